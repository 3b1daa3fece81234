//! The object table of a file, kept for the life of the program.

use std::collections::HashSet;

use canopen::Mux;
use canopen::od::{Access, DataType, DefaultValue, Entry, Kind, PdoMapping, ValueRange};
use devices::names::standard;
use devices::row::is_parameter;

use super::names;
use crate::{AccessType, Eds, Number, Object, Value, Variable};

/// Bytes that a string or DOMAIN that can be written holds, unless the default has more.
const STRING_CAPACITY: usize = 64;
const DOMAIN_CAPACITY: usize = 1_024;
/// The same of a program (1F50h). A guess: the flash of small microcontrollers.
const PROGRAM_CAPACITY: usize = 131_072;

/// A row whose texts are not kept yet: of a file that makes no table nothing is.
pub(super) struct DraftRow {
    /// With empty texts; limits, sizes and numbers are those of the row.
    pub(super) entry: Entry,
    name: String,
    title: String,
    bytes: Option<Vec<u8>>,
}

impl DraftRow {
    /// The row with its texts, kept for the life of the program.
    pub(super) fn keep(self) -> Entry {
        let Self { mut entry, name, title, bytes } = self;
        (entry.name, entry.title) = (leak(name), leak(title));
        match bytes.map(String::from_utf8) {
            None => {}
            Some(Ok(text)) if entry.data_type == DataType::VisibleString && text.is_ascii() => {
                entry.default = DefaultValue::Text(leak(text));
            }
            Some(Ok(text)) => entry.default = DefaultValue::Bytes(leak(text).as_bytes()),
            Some(Err(error)) => entry.default = DefaultValue::Bytes(error.into_bytes().leak()),
        }
        entry
    }
}

/// All rows, ascending. Of a DCF, the values stand in place of the defaults: it is the device as configured.
pub(super) fn rows(eds: &Eds) -> Vec<DraftRow> {
    let storing = Storing {
        on_command: eds.variable(0x1010, 1).is_some(),
        is_drive: eds.variable(0x6040, 0).is_some() && eds.variable(0x6041, 0).is_some(),
    };
    let mut taken = HashSet::new();
    let mut rows = Vec::new();
    for object in &eds.objects {
        for variable in &object.variables {
            let name = unique(name(object, variable), Mux::new(object.index, variable.sub_index), &mut taken);
            rows.push(row(object, variable, name, storing));
        }
    }
    rows
}

/// What decides which rows a device stores: a file does not say it of each.
#[derive(Clone, Copy)]
struct Storing {
    /// The device has 1010h.
    on_command: bool,
    is_drive: bool,
}

impl Storing {
    /// Parameters are stored. What can be mapped and is not a drive's is process data: a drive's speeds and limits can
    /// be mapped too, and are parameters all the same.
    const fn stores(self, row: &Entry) -> bool {
        let is_program = matches!(row.index, 0x1F50..=0x1F57);
        self.on_command && !is_program && is_parameter(row) && (self.is_drive || !row.pdo.is_allowed())
    }
}

fn row(object: &Object, variable: &Variable, name: String, storing: Storing) -> DraftRow {
    let data_type = DataType::from_code(variable.data_type.0).unwrap_or(DataType::Unsigned32);
    let title = if variable.name.is_empty() { &object.name } else { &variable.name };
    let access = match variable.access {
        AccessType::ReadOnly => Access::ReadOnly,
        AccessType::WriteOnly => Access::WriteOnly,
        AccessType::Const => Access::Const,
        AccessType::ReadWrite | AccessType::ReadWriteInput | AccessType::ReadWriteOutput => Access::ReadWrite,
    };
    let mut row = Entry::new(object.index, variable.sub_index, data_type, access, "", "");
    let value = variable.value_or_default();
    let bytes = match value {
        Some(Value::Text(text)) => Some(bytes(data_type, text)),
        Some(value) => {
            row.default = number(value);
            None
        }
        None => None,
    };
    row.limits = limits(data_type, variable);
    row.pdo = match (variable.pdo_mapping, variable.access) {
        (false, _) => PdoMapping::No,
        (true, AccessType::ReadWriteInput) => PdoMapping::Transmit,
        (true, AccessType::ReadWriteOutput) => PdoMapping::Receive,
        (true, _) => PdoMapping::Yes,
    };
    if data_type.kind() == Kind::Bytes && access.is_writable() {
        row.capacity = capacity(object.index, data_type, bytes.as_ref().map_or(0, Vec::len));
    }
    row.saved = storing.stores(&row);
    DraftRow { entry: row, name, title: title.clone(), bytes }
}

fn capacity(index: u16, data_type: DataType, length: usize) -> u32 {
    let least = match (data_type, index) {
        (DataType::Domain, 0x1F50) => PROGRAM_CAPACITY,
        (DataType::Domain, _) => DOMAIN_CAPACITY,
        _ => STRING_CAPACITY,
    };
    u32::try_from(length.max(least)).unwrap_or(u32::MAX)
}

/// A value of a file that is not text, as a row has it.
fn number(value: &Value) -> DefaultValue {
    match value {
        Value::Number(Number { base, plus_node_id: true }) => {
            u32::try_from(*base).map_or(DefaultValue::Value(0), DefaultValue::NodeIdPlus)
        }
        Value::Number(Number { base, .. }) => i64::try_from(*base)
            .map(DefaultValue::Value)
            .unwrap_or_else(|_| DefaultValue::Unsigned(u64::try_from(*base).unwrap_or(0))),
        Value::Real(real) => DefaultValue::Real(*real),
        Value::Text(_) => DefaultValue::Value(0),
    }
}

/// The bytes of a text as an SDO carries them.
pub(crate) fn bytes(data_type: DataType, text: &str) -> Vec<u8> {
    match data_type {
        DataType::UnicodeString => text.encode_utf16().flat_map(u16::to_le_bytes).collect(),
        DataType::TimeOfDay | DataType::TimeDifference => {
            let mut parts = text.split_whitespace().map(|part| part.parse::<u32>().unwrap_or(0));
            let (days, milliseconds) = (parts.next().unwrap_or(0), parts.next().unwrap_or(0));
            let (days, milliseconds) = ((days as u16).to_le_bytes(), (milliseconds & 0x0FFF_FFFF).to_le_bytes());
            [&milliseconds[..], &days[..]].concat()
        }
        DataType::VisibleString => letters(text),
        _ => hexadecimal(text).unwrap_or_else(|| letters(text)),
    }
}

/// One byte a letter, as a file in ISO 8859-1 has them and as they are shown; letters that it does not have as UTF-8.
fn letters(text: &str) -> Vec<u8> {
    let latin: Option<Vec<u8>> = text.chars().map(|letter| u8::try_from(letter).ok()).collect();
    latin.unwrap_or_else(|| text.as_bytes().to_vec())
}

/// `0123AB` or `01 23 AB`.
fn hexadecimal(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u8> = text.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let pair = |pair: &[u8]| match pair {
        [high, low] => Some((char::from(*high).to_digit(16)? << 4 | char::from(*low).to_digit(16)?) as u8),
        _ => None,
    };
    digits.chunks(2).map(pair).collect()
}

/// The limits of a row, unless they are those of the type.
fn limits(data_type: DataType, variable: &Variable) -> Option<ValueRange> {
    let number = |value: &Option<Value>| match value {
        Some(Value::Number(number)) if !number.plus_node_id => Some(number.base),
        _ => None,
    };
    let real = |value: &Option<Value>| match value {
        Some(Value::Real(real)) => Some(*real),
        _ => None,
    };
    if data_type.kind() == Kind::Real {
        let (low, high) = (real(&variable.low), real(&variable.high));
        let any = low.is_some() || high.is_some();
        return any.then(|| ValueRange::Real(low.unwrap_or(f64::MIN), high.unwrap_or(f64::MAX)));
    }
    let (lowest, highest) = variable.data_type.range()?;
    let (low, high) = (number(&variable.low).unwrap_or(lowest), number(&variable.high).unwrap_or(highest));
    if (low, high) == (lowest, highest) {
        return None;
    }
    match (i64::try_from(low), i64::try_from(high)) {
        (Ok(low), Ok(high)) => Some(ValueRange::Integer(low, high)),
        _ => Some(ValueRange::Unsigned(u64::try_from(low).unwrap_or(0), u64::try_from(high).unwrap_or(u64::MAX))),
    }
}

/// A name to type: the standard's where the object is the standard's, else from the file's words.
fn name(object: &Object, variable: &Variable) -> String {
    let place = Mux::new(object.index, variable.sub_index);
    if let Some(standard) = standard_name(place) {
        return standard;
    }
    let of_object = names::name(&object.name);
    let own = names::name(&variable.name);
    let is_record = object.object_type.has_sub_objects();
    match (is_record, variable.sub_index) {
        (true, 0) | (false, _) => of_object,
        _ if own.starts_with(&of_object) => own,
        _ => format!("{of_object}_{own}"),
    }
}

/// The name of the standards; of the further axes (CiA 402-1) with their number behind.
fn standard_name(place: Mux) -> Option<String> {
    let find = |place| standard(place).map(|name| name.name);
    match place.index {
        0x1000..=0x1FFF | 0x6000..=0x67FF => find(place).map(str::to_owned),
        0x6800..=0x9FFF => {
            let axis = (place.index - 0x6000) / 0x800 + 1;
            let first = Mux::new(0x6000 + place.index % 0x800, place.sub_index);
            find(first).map(|name| format!("{name}_{axis}"))
        }
        _ => None,
    }
}

fn unique(name: String, place: Mux, taken: &mut HashSet<String>) -> String {
    let name = if name.is_empty() { "object".to_owned() } else { name };
    let free = if taken.contains(&name) || name == "object" {
        format!("{name}_{:04x}_{:02x}", place.index, place.sub_index)
    } else {
        name
    };
    taken.insert(free.clone());
    free
}

pub(super) fn leak(text: String) -> &'static str {
    Box::leak(text.into_boxed_str())
}
