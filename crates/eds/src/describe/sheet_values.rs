//! Values of a row as a file has them.

use canopen::od::{DataType, DefaultValue, Entry, Kind, ValueRange};
use devices::variant::Preset;

use crate::{AccessType, Number, Value};
use canopen::od::{Access, PdoMapping};

/// The value that a device is delivered with; `None` where the row says none.
pub(super) fn default(row: &Entry, presets: &[Preset]) -> Option<Value> {
    if let Some(preset) = presets.iter().rev().find(|preset| preset.object == row.mux()) {
        return Some(plain(preset.value.into()));
    }
    match row.default {
        DefaultValue::Value(value) if row.data_type.is_integer() => Some(plain(value.into())),
        DefaultValue::Value(value) if row.data_type.kind() == Kind::Real => Some(Value::Real(value as f64)),
        DefaultValue::Value(_) => None,
        DefaultValue::Unsigned(value) => Some(plain(value.into())),
        DefaultValue::Real(value) => Some(Value::Real(value)),
        DefaultValue::NodeIdPlus(base) => Some(Value::Number(Number { base: base.into(), plus_node_id: true })),
        DefaultValue::Text("") | DefaultValue::Bytes([]) => None,
        DefaultValue::Text(text) => Some(Value::Text(text.to_owned())),
        DefaultValue::Bytes(bytes) => of_bytes(row.data_type, bytes),
    }
}

/// Bytes as an SDO carries them.
pub(crate) fn of_bytes(data_type: DataType, bytes: &[u8]) -> Option<Value> {
    let mut little_endian = [0; 8];
    let number = bytes.len() <= 8 && !bytes.is_empty();
    if number {
        little_endian[..bytes.len()].copy_from_slice(bytes);
    }
    let raw = u64::from_le_bytes(little_endian);
    let bits = bytes.len() as u32 * 8;
    match data_type.kind() {
        Kind::Unsigned if number => Some(plain(raw.into())),
        Kind::Signed if number => Some(plain((((raw << (64 - bits)) as i64) >> (64 - bits)).into())),
        Kind::Real if bytes.len() == 4 => Some(Value::Real(f64::from(f32::from_bits(raw as u32)))),
        Kind::Real if bytes.len() == 8 => Some(Value::Real(f64::from_bits(raw))),
        // Days and milliseconds, as other tools have them.
        Kind::Time if bytes.len() == 6 => Some(Value::Text(format!("{} {}", raw >> 32 & 0xFFFF, raw & 0x0FFF_FFFF))),
        Kind::Bytes if data_type == DataType::VisibleString => {
            Some(Value::Text(bytes.iter().map(|byte| char::from(*byte)).collect()))
        }
        Kind::Bytes if data_type == DataType::UnicodeString => {
            let units: Vec<u16> = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
            Some(Value::Text(String::from_utf16_lossy(&units)))
        }
        Kind::Bytes => Some(Value::Text(bytes.iter().map(|byte| format!("{byte:02X}")).collect())),
        _ => None,
    }
}

/// Limits that hold for every device of the model as long as it is configured in any way: none of a row whose limits
/// another object multiplies, and none that would exclude the default.
pub(super) fn limits(row: &Entry, default: Option<&Value>) -> (Option<Value>, Option<Value>) {
    if row.resolution.is_some() {
        return (None, None);
    }
    let (low, high) = match row.limits {
        None => return (None, None),
        Some(ValueRange::Integer(low, high)) => (plain(low.into()), plain(high.into())),
        Some(ValueRange::Unsigned(low, high)) => (plain(low.into()), plain(high.into())),
        Some(ValueRange::Real(low, high)) => (Value::Real(low), Value::Real(high)),
    };
    let outside = |limit: &Value, below: bool| match (limit, default) {
        (Value::Number(limit), Some(Value::Number(default))) => {
            (default.base < limit.base) == below && default.base != limit.base
        }
        (Value::Real(limit), Some(Value::Real(default))) => (default < limit) == below && default != limit,
        _ => false,
    };
    (Some(low).filter(|low| !outside(low, true)), Some(high).filter(|high| !outside(high, false)))
}

/// How a row may be used, with the direction of its mapping.
pub(super) const fn access(row: &Entry) -> AccessType {
    match (row.access, row.pdo) {
        (Access::ReadOnly, _) => AccessType::ReadOnly,
        (Access::WriteOnly, _) => AccessType::WriteOnly,
        (Access::Const, _) => AccessType::Const,
        (Access::ReadWrite, PdoMapping::Receive) => AccessType::ReadWriteOutput,
        (Access::ReadWrite, PdoMapping::Transmit) => AccessType::ReadWriteInput,
        (Access::ReadWrite, _) => AccessType::ReadWrite,
    }
}

pub(super) const fn plain(value: i128) -> Value {
    Value::Number(Number::plain(value))
}
