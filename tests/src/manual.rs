//! What the tables of every drive share: the rows that hold an object, a datagram and a power state, and their readers.
//!
//! The files lie in `tests/data`, one folder a drive; `tests/data/README.md` describes their columns.

use std::ops::RangeInclusive;

use crate::csv::{CsvTable, Row};

/// A row of an object dictionary.
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
    /// Whether the drive's save command stores it.
    pub stored: bool,
    /// Whether it can be mapped into a PDO.
    pub pdo_mappable: bool,
    /// The value of a drive as delivered; `None` where the manual prints none.
    pub default: Option<i64>,
    /// The least and the greatest value, where given. For a read-only object: the range of what it reads.
    pub limits: Option<(i64, i64)>,
    /// A measurement or a state: what it reads after power-on is not its default.
    pub live: bool,
    /// The section that has it, `5.4`; a standard, where the manual does not print it.
    pub section: String,
}

/// A datagram that the manual prints.
#[derive(Debug, Clone)]
pub struct Datagram {
    /// The section that prints it, `4.1`.
    pub section: String,
    /// What the host sends: identifier and data. `None` for a message that the drive sends on its own.
    pub request: Option<(u16, Vec<u8>)>,
    /// What the drive sends, as the manual prints it.
    pub response: Option<(u16, Vec<u8>)>,
    /// What the drive answers: by CiA 301 to an SDO request, by the manual to a PDO; `None` for a byte that depends
    /// on the drive's state.
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

impl ObjectRow {
    /// Index and sub-index.
    #[must_use]
    pub fn key(&self) -> (u16, u8) {
        (self.index, self.sub)
    }

    /// The values that its type can carry.
    #[must_use]
    pub fn type_range(&self) -> RangeInclusive<i64> {
        let bits = self.size * 8;
        if self.signed { -(1 << (bits - 1))..=(1 << (bits - 1)) - 1 } else { 0..=(1 << bits) - 1 }
    }

    /// Another value than the default, at an end of the limits where there are any.
    #[must_use]
    pub fn other_value(&self) -> Option<i64> {
        let default = self.default?;
        Some(match self.limits {
            Some((low, high)) if default == high => low,
            Some((_, high)) => high,
            None => default + 1,
        })
    }

    /// Checks that the default lies within the limits, and the limits within the type.
    ///
    /// # Panics
    ///
    /// When they do not.
    pub fn check(&self) {
        let (least, most) = self.type_range().into_inner();
        let (low, high) = self.limits.unwrap_or((least, most));
        assert!(least <= low && low <= high && high <= most, "{self:?}");
        assert!(self.default.is_none_or(|default| (low..=high).contains(&default)), "{self:?}");
    }
}

impl Datagram {
    /// The node whose SDO server it asks, if it is an SDO request.
    #[must_use]
    pub fn sdo_server(&self) -> Option<u16> {
        self.request.as_ref().map(|(cob, _)| *cob).filter(|cob| (0x601..=0x67F).contains(cob)).map(|cob| cob - 0x600)
    }

    /// Checks an SDO datagram: the request names one of `objects` and carries its size; the answer, where one is printed,
    /// comes from the same node, repeats the multiplexor and is the one that CiA 301 demands.
    ///
    /// # Panics
    ///
    /// When that is not so.
    pub fn check_sdo(&self, objects: &[ObjectRow], node: u16) {
        let request = &self.request.as_ref().expect("an SDO request").1;
        let [command, low, high, sub, ..] = request[..] else { panic!("short request {request:02X?}") };
        let key = (u16::from_le_bytes([low, high]), sub);
        let object = objects.iter().find(|row| row.key() == key).expect("a row of the table");
        let (carried, size_left) = (4 - usize::from(command >> 2 & 3), (4 - object.size) as u8);
        assert!(command == 0x40 || carried == object.size, "{self:?}");
        let Some((from, printed)) = &self.response else { return };
        let answered = if command == 0x40 { 0x43 | size_left << 2 } else { 0x60 };
        let head = [answered, low, high, sub];
        assert_eq!((*from, printed.len(), &printed[..4]), (0x580 + node, 8, &head[..]), "{self:?}");
        let agrees = |(byte, known): (&u8, &Option<u8>)| known.is_none_or(|known| known == *byte);
        assert!(self.answer.len() == 8 && printed.iter().zip(&self.answer).all(agrees), "{self:?}");
    }
}

/// Reads each row of a file.
pub(crate) fn rows<T>(text: &str, read: fn(Row<'_>) -> T) -> Vec<T> {
    let table = CsvTable::parse(text).unwrap_or_else(|line| panic!("line {line} has another number of fields"));
    table.rows().map(read).collect()
}

/// A row of `objects.csv`.
pub(crate) fn object(row: Row<'_>) -> ObjectRow {
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
        section: row.get("source").to_owned(),
    }
}

/// A row of `datagrams.csv`.
pub(crate) fn datagram(row: Row<'_>) -> Datagram {
    let message = |cob: &str, data: &str| (hex(cob.trim_start_matches("0x")), bytes(data));
    // SYNC is a request without data; an answer without data is one that the manual does not print.
    let (request_cob, response) = (row.get("request_cob"), row.get("response"));
    let known = |byte: &str| (byte != "..").then(|| u8::from_str_radix(byte, 16).expect("two hex digits"));
    Datagram {
        section: row.get("section").to_owned(),
        request: (!request_cob.is_empty()).then(|| message(request_cob, row.get("request"))),
        response: (!response.is_empty()).then(|| message(row.get("response_cob"), response)),
        answer: row.get("answer").split_whitespace().map(known).collect(),
        meaning: row.get("meaning").to_owned(),
    }
}

/// A row of `power_state.csv`.
pub(crate) fn power_cell(row: Row<'_>) -> PowerCell {
    PowerCell {
        state: row.get("state").to_owned(),
        event: row.get("event").to_owned(),
        controlword: Some(row.get("controlword")).filter(|word| !word.is_empty()).map(hex),
        state_after: row.get("state_after").to_owned(),
        low_byte_after: u8::try_from(hex(row.get("low_byte_after"))).expect("a byte has two digits"),
    }
}

/// One of two words, as a truth value.
pub(crate) fn flag(text: &str, yes: &str, no: &str) -> bool {
    assert!(text == yes || text == no, "{text:?} is neither {yes} nor {no}");
    text == yes
}

/// Four hexadecimal digits, without a prefix.
pub(crate) fn hex(text: &str) -> u16 {
    u16::from_str_radix(text, 16).unwrap_or_else(|_| panic!("{text:?} is not hexadecimal"))
}

/// A decimal number, or a hexadecimal one with `0x`; `None` for an empty field.
pub(crate) fn integer(text: &str) -> Option<i64> {
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
