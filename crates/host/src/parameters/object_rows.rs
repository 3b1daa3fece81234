//! Rows of a description and values of objects, as sent to a page.

use canopen::od::{Entry, ValueRange};
use canopen::pdo::{Direction, PdoId, PdoNumber};
use canopen::{Mux, NodeId};
use devices::Description;
use devices::row::is_parameter;
use master::parameters::default_of;
use master::pdo::{PdoUnfit, record_of};
use serde_json::{Value, json};

/// The areas of an object dictionary (CiA 301, table 37), its PDOs apart (CiA 301, 7.5.2.35 to 7.5.2.38).
const AREAS: [(u16, u16, &str); 8] = [
    (0x1000, 0x13FF, "Device and communication"),
    (0x1400, 0x17FF, "Receive PDOs"),
    (0x1800, 0x1BFF, "Transmit PDOs"),
    (0x1C00, 0x1FFF, "Further communication"),
    (0x2000, 0x5FFF, "Manufacturer-specific"),
    (0x6000, 0x9FFF, "Drive profile"),
    (0xA000, 0xBFFF, "Interface profile"),
    (0, 0xFFFF, "Others"),
];

/// The parts of the drive profile (CiA 402-2, chapters 8 to 18), by the index on the first axis.
const DRIVE_PARTS: [(&str, &[(u16, u16)]); 9] = [
    ("Device control", &[(0x6007, 0x6007), (0x603F, 0x6041), (0x605A, 0x605E), (0x6060, 0x6061), (0x6502, 0x6502)]),
    ("Profile position", &[(0x607A, 0x607B), (0x607D, 0x607D), (0x607F, 0x6086)]),
    ("Homing", &[(0x607C, 0x607C), (0x6098, 0x609A)]),
    ("Position control", &[(0x6062, 0x6068), (0x60F4, 0x60F4), (0x60FA, 0x60FC)]),
    ("Velocity", &[(0x6069, 0x6070), (0x60F8, 0x60F9), (0x60FF, 0x60FF)]),
    ("Torque", &[(0x6071, 0x6079), (0x6087, 0x6088), (0x60F5, 0x60F7)]),
    ("Units", &[(0x607E, 0x607E), (0x6089, 0x6097)]),
    ("Cyclic and interpolated modes", &[(0x60B0, 0x60B2), (0x60C0, 0x60C6)]),
    ("Inputs and outputs", &[(0x60B8, 0x60BD), (0x60FD, 0x60FE)]),
];

/// The group in which a page shows an object.
fn group_of(index: u16) -> &'static str {
    // A block of 800h for each axis (CiA 402-1).
    let on_first_axis = 0x6000 | index & 0x7FF;
    let part =
        DRIVE_PARTS.iter().find(|(_, ranges)| ranges.iter().any(|(low, high)| (*low..=*high).contains(&on_first_axis)));
    match part.filter(|_| matches!(index, 0x6000..=0x9FFF)) {
        Some((part, _)) => part,
        None => AREAS.iter().find(|(low, high, _)| (*low..=*high).contains(&index)).map_or("Others", |(.., area)| area),
    }
}

/// The description of an object.
pub(crate) fn row_json(model: &Description, row: &Entry, node: NodeId) -> Value {
    let range = row.limits.map(|limits| match limits {
        ValueRange::Integer(low, high) => format!("{low} to {high}"),
        ValueRange::Unsigned(low, high) => format!("{low} to {high}"),
        ValueRange::Real(low, high) => format!("{low} to {high}"),
    });
    let meanings = row.values.iter().map(|(value, meaning)| json!([value, meaning]));
    json!({
        "object": row.mux().to_string(),
        "group": group_of(row.index),
        "name": row.name,
        "title": row.title,
        "type": row.data_type.name(),
        "access": row.access.name(),
        "readable": row.access.is_readable(),
        "parameter": is_parameter(row),
        "kept": row.is_kept(),
        "rpdo": in_pdo(model, row, Direction::Rpdo),
        "tpdo": in_pdo(model, row, Direction::Tpdo),
        "unit": row.unit,
        "range": range,
        "range_times": row.resolution.map(|object| object.to_string()),
        "default": default_of(row, node).filter(|bytes| !bytes.is_empty()).map(|bytes| plain_value(row, &bytes)),
        "meanings": meanings.collect::<Vec<_>>(),
    })
}

/// The bits that it takes in PDOs of a direction, or why it cannot be mapped.
fn in_pdo(model: &Description, row: &Entry, direction: Direction) -> Value {
    match record_of(model, PdoId { direction, number: PdoNumber::FIRST }, row.mux()) {
        Ok(record) => json!(record.bits),
        Err(PdoUnfit::NotMappable { why, .. }) => json!(why),
        Err(error) => json!(error.to_string()),
    }
}

/// A number as it is typed, a text, or bytes.
fn plain_value(row: &Entry, bytes: &[u8]) -> String {
    if row.data_type.is_integer() && row.data_type.fits_cell() {
        let raw = bytes.iter().rev().fold(0_u32, |raw, byte| raw << 8 | u32::from(*byte));
        return row.data_type.value(raw).to_string();
    }
    bytes_text(bytes)
}

/// A value in words, with its unit where it has one.
pub(crate) fn value_text(model: &'static Description, mux: Mux, bytes: &[u8]) -> String {
    let value = master::decode::DecodedValue::new(mux, bytes, Some(model));
    let decoded = value.to_string();
    // The object and its name come before.
    let text = decoded.split_once(" = ").map_or(decoded.as_str(), |(_, text)| text);
    // In a log the unit of one count is [0.1 A].
    let unit = value.unit();
    let times = if unit.starts_with(|first: char| first.is_ascii_digit()) { "× " } else { "" };
    text.replacen(&format!("[{unit}]"), &format!("{times}{unit}"), 1)
}

/// Bytes in the order of the wire.
pub(crate) fn bytes_text(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ZLAC8030L quick start guide V1.00, chapter 9: 606Ch counts 0.1 r/min, 6081h 1 r/min, 2000h ms.
    #[test]
    fn a_value_has_its_unit_behind_it() {
        let model = devices::model("zlac8030l").expect("a model");
        for (object, bytes, text) in [
            (Mux::new(0x606C, 0), &600_i32.to_le_bytes()[..], "600 × 0.1 r/min"),
            (Mux::new(0x6081, 0), &60_u32.to_le_bytes()[..], "60 r/min"),
            (Mux::new(0x2000, 0), &1000_u16.to_le_bytes()[..], "1000 ms"),
            (Mux::new(0x1A00, 0), &[2], "2"),
        ] {
            assert_eq!(value_text(model, object, bytes), text);
        }
    }

    #[test]
    fn objects_stand_where_the_profiles_describe_them() {
        for (index, group) in [
            (0x1017, "Device and communication"),
            (0x1400, "Receive PDOs"),
            (0x1A00, "Transmit PDOs"),
            (0x2000, "Manufacturer-specific"),
            (0x6040, "Device control"),
            (0x6840, "Device control"),
            (0x6081, "Profile position"),
            (0x6098, "Homing"),
            (0x60FF, "Velocity"),
            (0x60C2, "Cyclic and interpolated modes"),
            (0x6099, "Homing"),
        ] {
            assert_eq!(group_of(index), group, "{index:04X}h");
        }
    }
}
