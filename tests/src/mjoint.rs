//! The figures of the "M Robot Joint Motor CanOpen Manual" as data.
//!
//! Every value is the manual's, with its contradictions settled as `docs/drives/mjoint.md` says; the `note` of a row
//! has what the manual prints instead, and `assumed` where it prints nothing. The node is 1, the manual's default.

use crate::csv::Row;
use crate::homing::{HomingRow, homing};
use crate::manual::{Datagram, ObjectRow, datagram, flag, hex, integer, object, rows};

/// A row of the object dictionary, with its place among the Modbus registers.
#[derive(Debug, Clone)]
pub struct JointObject {
    /// The row.
    pub row: ObjectRow,
    /// The first register and the number of registers; `None` where the manual prints no Modbus address.
    pub registers: Option<(u16, u16)>,
}

/// A situation, and the statusword that it shows.
#[derive(Debug, Clone)]
pub struct Situation {
    /// What just happened.
    pub event: String,
    /// 6040h as last written.
    pub controlword: u16,
    /// 6060h.
    pub mode: u8,
    /// 2601h.
    pub output_enabled: bool,
    /// 260Eh.
    pub alarm: u16,
    /// The power stage drives the motor.
    pub live: bool,
    /// `none`, `running`, `attained` or `failed`.
    pub homing: String,
    /// Nothing is left to be done: no move, or the target is reached.
    pub reached: bool,
    /// 6041h.
    pub statusword: u16,
    /// The manual prints this statusword in this situation.
    pub printed: bool,
}

/// A homing run, and the statuswords while it runs and after it, with the controlword 0.
#[derive(Debug, Clone)]
pub struct HomingStatus {
    /// The run.
    pub row: HomingRow,
    /// 6041h on the way.
    pub running: u16,
    /// 6041h at the end.
    pub after: u16,
}

/// A figure of the technical data, for the four models.
#[derive(Debug, Clone)]
pub struct MotorFigures {
    /// The group of the table: `motor`, `reducer`.
    pub group: String,
    /// What is reported.
    pub parameter: String,
    /// Its unit; `1` for a plain number.
    pub unit: String,
    /// The values, in the order of [`MODELS`].
    pub values: [f64; 4],
}

/// The models, as the command line names them.
pub const MODELS: [&str; 4] = ["m4230e17b50", "m4230e17b80", "m8025e25b50", "m8025e25b80"];

/// All rows of the object dictionary, in order.
#[must_use]
pub fn objects() -> Vec<JointObject> {
    rows(include_str!("../data/mjoint/objects.csv"), |row| JointObject { row: object(row), registers: registers(row) })
}

/// All printed datagrams, in the manual's order.
#[must_use]
pub fn datagrams() -> Vec<Datagram> {
    rows(include_str!("../data/mjoint/datagrams.csv"), datagram)
}

/// The statusword of each situation.
#[must_use]
pub fn situations() -> Vec<Situation> {
    rows(include_str!("../data/mjoint/statusword.csv"), |row| Situation {
        event: row.get("event").to_owned(),
        controlword: hex(row.get("controlword")),
        mode: row.get("mode").parse().expect("a mode is a number"),
        output_enabled: flag(row.get("output_enabled"), "1", "0"),
        alarm: hex(row.get("alarm")),
        live: flag(row.get("live"), "1", "0"),
        homing: row.get("homing").to_owned(),
        reached: flag(row.get("reached"), "1", "0"),
        statusword: hex(row.get("statusword")),
        printed: flag(row.get("printed"), "yes", "no"),
    })
}

/// Homing from each start.
#[must_use]
pub fn homing_runs() -> Vec<HomingStatus> {
    rows(include_str!("../data/mjoint/homing.csv"), |row| HomingStatus {
        row: homing(row),
        running: hex(row.get("statusword_running")),
        after: hex(row.get("statusword_after")),
    })
}

/// The technical data.
#[must_use]
pub fn figures() -> Vec<MotorFigures> {
    rows(include_str!("../data/mjoint/models.csv"), |row| MotorFigures {
        group: row.get("group").to_owned(),
        parameter: row.get("parameter").to_owned(),
        unit: row.get("unit").to_owned(),
        values: MODELS.map(|model| row.get(model).parse().unwrap_or_else(|_| panic!("{row:?} of {model}"))),
    })
}

fn registers(row: Row<'_>) -> Option<(u16, u16)> {
    let word = |name| integer(row.get(name)).map(|value| u16::try_from(value).expect("a register fits"));
    word("modbus").zip(word("words"))
}
