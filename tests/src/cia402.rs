//! The figures of CiA 301 and CiA 402 for the standard's own servo, as data.
//!
//! `objects.csv` has the profile, `communication.csv` the objects of CiA 301 with the mappings of CiA 402-3. A default is
//! given where the standard has one. The node is 6.

use crate::csv::Row;
use crate::manual::{ObjectRow, PowerCell, flag, hex, integer, power_cell, rows};

/// All objects that hold one to four bytes and can be read.
#[must_use]
pub fn objects() -> Vec<ObjectRow> {
    let mut all = rows(include_str!("../data/cia402/communication.csv"), |row| object(row, ""));
    all.extend(rows(include_str!("../data/cia402/objects.csv"), |row| object(row, row.get("note"))));
    all.into_iter().flatten().collect()
}

/// Every pair of a power state and an event.
#[must_use]
pub fn power_states() -> Vec<PowerCell> {
    rows(include_str!("../data/cia402/power_state.csv"), power_cell)
}

/// `None` for one that cannot be read. What the note says is otherwise here, and why.
fn object(row: Row<'_>, note: &str) -> Option<ObjectRow> {
    let access = note.get(..2).unwrap_or(row.get("access"));
    if access == "wo" {
        return None;
    }
    let kind = row.get("type");
    Some(ObjectRow {
        index: hex(row.get("index")),
        sub: u8::try_from(hex(row.get("sub"))).expect("a sub-index has two digits"),
        name: String::new(),
        size: kind[1..].parse::<usize>().expect("a type ends with its bits") / 8,
        signed: kind.starts_with('I'),
        writable: flag(access, "rw", "ro"),
        stored: false,
        pdo_mappable: flag(row.get("pdo_mappable"), "yes", "no"),
        default: integer(row.get("default")),
        limits: integer(row.get("min")).zip(integer(row.get("max"))),
        live: flag(row.get("live"), "yes", "no"),
        // The list has none.
        section: String::new(),
    })
}
