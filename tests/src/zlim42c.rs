//! The figures of the "ZLIM42-C integrated open-loop stepper motor user manual" (V1.03, in Chinese) as data.
//!
//! Every value is the manual's, with its contradictions settled as `docs/drives/zlim42c.md` says; the `note` of a row
//! tells what the manual prints instead. The node is 1, as in the manual's examples.

use crate::csv::Row;
use crate::homing::{HomingRow, homing};
use crate::manual::{Datagram, ObjectRow, PowerCell, datagram, flag, hex, object, power_cell, rows};

/// A cell of the power state table, with the statusword bit that reports whether the motor is energised.
#[derive(Debug, Clone)]
pub struct EnergisedCell {
    /// The cell.
    pub cell: PowerCell,
    /// Bit 13 in the state after: the motor is energised.
    pub bit_13_after: bool,
}

/// A homing run, and the statusword bits and the position that it ends with.
#[derive(Debug, Clone)]
pub struct HomingResult {
    /// The run.
    pub row: HomingRow,
    /// Bit 8: homing attained.
    pub bit_8: bool,
    /// Bit 10: target reached.
    pub bit_10: bool,
    /// Bit 14: the motor runs.
    pub bit_14: bool,
}

/// A figure of the technical data, of a table of settings, or of the address switches.
#[derive(Debug, Clone)]
pub struct MotorFigures {
    /// The table it belongs to: `model`, `current`, `microstep`.
    pub table: String,
    /// The row within that: a model, a setting.
    pub row: String,
    /// What is reported.
    pub quantity: String,
    /// Its unit; `1` for a plain number.
    pub unit: String,
    /// The value as text; empty where the manual has none.
    pub value: String,
}

/// All rows of the object dictionary, in order.
#[must_use]
pub fn objects() -> Vec<ObjectRow> {
    rows(include_str!("../data/zlim42c/objects.csv"), object)
}

/// All printed datagrams, in the manual's order.
#[must_use]
pub fn datagrams() -> Vec<Datagram> {
    rows(include_str!("../data/zlim42c/datagrams.csv"), datagram)
}

/// Every pair of a power state and an event.
#[must_use]
pub fn power_states() -> Vec<EnergisedCell> {
    rows(include_str!("../data/zlim42c/power_state.csv"), |row| EnergisedCell {
        cell: power_cell(row),
        bit_13_after: bit(row, "bit_13_after"),
    })
}

/// Homing from each start, in the directions of the labels.
#[must_use]
pub fn homing_runs() -> Vec<HomingResult> {
    homing_results(include_str!("../data/zlim42c/homing.csv"))
}

/// Homing from each start, in the directions of the paragraphs.
#[must_use]
pub fn homing_runs_by_prose() -> Vec<HomingResult> {
    homing_results(include_str!("../data/zlim42c/homing_by_prose.csv"))
}

fn homing_results(file: &str) -> Vec<HomingResult> {
    rows(file, |row| HomingResult {
        row: homing(row),
        bit_8: bit(row, "bit_8"),
        bit_10: bit(row, "bit_10"),
        bit_14: bit(row, "bit_14"),
    })
}

/// The technical data of both lengths and the tables of settings.
#[must_use]
pub fn figures() -> Vec<MotorFigures> {
    rows(include_str!("../data/zlim42c/models.csv"), |row| MotorFigures {
        table: row.get("table").to_owned(),
        row: row.get("row").to_owned(),
        quantity: row.get("quantity").to_owned(),
        unit: row.get("unit").to_owned(),
        value: row.get("value").to_owned(),
    })
}

/// The figure of one row of one table, as a number.
///
/// # Panics
///
/// If there is no such figure: the test is wrong.
#[must_use]
pub fn figure(table: &str, row: &str, quantity: &str) -> f64 {
    let all = figures();
    let found = all.iter().find(|it| it.table == table && it.row == row && it.quantity == quantity);
    let found = found.unwrap_or_else(|| panic!("no {quantity} of {row} in {table}"));
    found.value.parse().unwrap_or_else(|_| panic!("{found:?} is not a number"))
}

/// The code of a fault (603Fh) in the figures.
#[must_use]
pub fn fault_code(row: &MotorFigures) -> u16 {
    hex(&row.row)
}

fn bit(row: Row<'_>, name: &str) -> bool {
    flag(row.get(name), "1", "0")
}
