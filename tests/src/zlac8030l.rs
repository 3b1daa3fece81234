//! The figures of the "ZLAC8030L V2.0 servo driver CANopen communication quick start guide" (V1.00) as data.
//!
//! Every value is the manual's, with its contradictions settled as `docs/drives/zlac8030l.md` says; the `note` of a
//! row tells what the manual prints instead. The node is 4, the manual's default.

use crate::csv::{Row, Table};

/// A row of the object dictionary (chapter 9).
#[derive(Debug, Clone)]
pub struct ObjectRow {
    /// The index, `0x6040`.
    pub index: u16,
    /// The sub-index.
    pub sub: u8,
    /// The manual's name for it.
    pub name: String,
    /// The size in bytes: 1, 2 or 4.
    pub size: usize,
    /// Whether the value is a signed integer.
    pub signed: bool,
    /// Whether it can be written.
    pub writable: bool,
    /// Whether 2009h = 2 stores it.
    pub stored: bool,
    /// Whether it can be mapped into a PDO.
    pub pdo_mappable: bool,
    /// The value of a drive as delivered; `None` where the manual prints none.
    pub default: Option<i64>,
    /// The least and the greatest value, where given. For a read-only object: the range of what it reads.
    pub limits: Option<(i64, i64)>,
    /// A measurement or a state: what it reads after power-on is not its default.
    pub live: bool,
}

/// A datagram that the manual prints (chapters 3 to 6).
#[derive(Debug, Clone)]
pub struct Datagram {
    /// The section that prints it, `4.1`.
    pub section: String,
    /// What the host sends: identifier and data. `None` for a message that the drive sends on its own.
    pub request: Option<(u16, Vec<u8>)>,
    /// What the drive sends, as the manual prints it.
    pub response: Option<(u16, Vec<u8>)>,
    /// What CiA 301 has the drive answer to an SDO request; `None` for a byte that depends on the drive's state.
    pub answer: Vec<Option<u8>>,
    /// What it is for.
    pub meaning: String,
}

/// A cell of the CiA 402 power state table: states down, events across.
#[derive(Debug, Clone)]
pub struct PowerCell {
    /// The state before, in snake case.
    pub state: String,
    /// The event, in snake case.
    pub event: String,
    /// The controlword that is the event; `None` for an event inside the drive.
    pub controlword: Option<u16>,
    /// The state after.
    pub state_after: String,
    /// The low byte of the statusword in the state after, with the bus voltage present.
    pub low_byte_after: u8,
}

/// All rows of the object dictionary, in order.
#[must_use]
pub fn objects() -> Vec<ObjectRow> {
    rows(include_str!("../data/zlac8030l/objects.csv"), object)
}

/// All printed datagrams, in the manual's order.
#[must_use]
pub fn datagrams() -> Vec<Datagram> {
    rows(include_str!("../data/zlac8030l/datagrams.csv"), datagram)
}

/// Every pair of a power state and an event.
#[must_use]
pub fn power_states() -> Vec<PowerCell> {
    rows(include_str!("../data/zlac8030l/power_state.csv"), power_cell)
}

fn rows<T>(text: &str, read: fn(Row<'_>) -> T) -> Vec<T> {
    let table = Table::parse(text).unwrap_or_else(|line| panic!("line {line} has another number of fields"));
    table.rows().map(read).collect()
}

fn object(row: Row<'_>) -> ObjectRow {
    let kind = row.get("type");
    ObjectRow {
        index: hex(row.get("index")),
        sub: u8::try_from(hex(row.get("sub"))).expect("a sub-index has two digits"),
        name: row.get("name").to_owned(),
        size: kind[1..].parse::<usize>().expect("a type ends with its bits") / 8,
        signed: kind.starts_with('I'),
        writable: flag(row.get("access"), "rw", "ro"),
        stored: flag(row.get("stored"), "yes", "no"),
        pdo_mappable: flag(row.get("pdo_mappable"), "yes", "no"),
        default: integer(row.get("default")),
        limits: integer(row.get("min")).zip(integer(row.get("max"))),
        live: flag(row.get("live"), "yes", "no"),
    }
}

fn datagram(row: Row<'_>) -> Datagram {
    let message = |cob: &str, data: &str| (!data.is_empty()).then(|| (hex(cob.trim_start_matches("0x")), bytes(data)));
    let known = |byte: &str| (byte != "..").then(|| u8::from_str_radix(byte, 16).expect("two hex digits"));
    Datagram {
        section: row.get("section").to_owned(),
        request: message(row.get("request_cob"), row.get("request")),
        response: message(row.get("response_cob"), row.get("response")),
        answer: row.get("answer").split_whitespace().map(known).collect(),
        meaning: row.get("meaning").to_owned(),
    }
}

fn power_cell(row: Row<'_>) -> PowerCell {
    PowerCell {
        state: row.get("state").to_owned(),
        event: row.get("event").to_owned(),
        controlword: Some(row.get("controlword")).filter(|word| !word.is_empty()).map(hex),
        state_after: row.get("state_after").to_owned(),
        low_byte_after: u8::try_from(hex(row.get("low_byte_after"))).expect("a byte has two digits"),
    }
}

fn flag(text: &str, yes: &str, no: &str) -> bool {
    assert!(text == yes || text == no, "{text:?} is neither {yes} nor {no}");
    text == yes
}

fn hex(text: &str) -> u16 {
    u16::from_str_radix(text, 16).unwrap_or_else(|_| panic!("{text:?} is not hexadecimal"))
}

fn integer(text: &str) -> Option<i64> {
    let value = match text.strip_prefix("0x") {
        Some(digits) => i64::from_str_radix(digits, 16),
        None if text.is_empty() => return None,
        None => text.parse(),
    };
    Some(value.unwrap_or_else(|_| panic!("{text:?} is not a number")))
}

fn bytes(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("two hex digits")).collect()
}
