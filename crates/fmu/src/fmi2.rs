//! Values as FMI 2.0 has them: four types, to which those of FMI 3.0 are brought.

use crate::call::{Called, refused};
use crate::variable::Value;

/// A type of FMI 2.0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VariableKind {
    /// A 64-bit floating-point number; also whole numbers that need more than 32 bits.
    Real,
    /// A signed integer of 32 bits.
    Integer,
    /// True or false.
    Boolean,
    /// A text.
    String,
}

impl VariableKind {
    /// The type of such a value.
    pub const fn of(value: &Value) -> Self {
        match value {
            Value::Float64(_) | Value::Int64(_) => Self::Real,
            Value::UInt8(_) | Value::UInt16(_) | Value::UInt32(_) | Value::UInt64(_) => Self::Integer,
            Value::Boolean(_) => Self::Boolean,
            // No variable of these FMUs is a binary.
            Value::String(_) | Value::Binary(_) => Self::String,
        }
    }

    /// Its element in the description of the model.
    pub const fn element(self) -> &'static str {
        match self {
            Self::Real => "Real",
            Self::Integer => "Integer",
            Self::Boolean => "Boolean",
            Self::String => "String",
        }
    }
}

/// As a Real: counts are exact up to 2^53.
pub fn real(value: &Value) -> Option<f64> {
    match value {
        Value::Float64(value) => Some(*value),
        Value::Int64(value) => Some(*value as f64),
        _ => None,
    }
}

/// As an Integer: of an unsigned number its 32 bits.
pub fn integer(value: &Value) -> Option<i32> {
    match value {
        Value::UInt8(value) => Some(i32::from(*value)),
        Value::UInt16(value) => Some(i32::from(*value)),
        Value::UInt32(value) => Some(*value as i32),
        // The seed, which came as one.
        Value::UInt64(value) => Some(*value as i32),
        _ => None,
    }
}

/// What an importer sets as an Integer: a seed, which is not negative.
///
/// # Errors
/// It is.
pub fn from_integer(value: i32) -> Called<Value> {
    match u64::try_from(value) {
        Ok(value) => Ok(Value::UInt64(value)),
        Err(_) => refused(format!("an Integer is 0 to {} here, not {value}", i32::MAX)),
    }
}

/// The folder that `fmuResourceLocation` names (FMI 2.0.5, 2.1.5): `file:///path`, with its characters escaped as in a URI. A plain
/// path is taken as it is, as some importers give one.
///
/// # Errors
/// It is a URI of another kind, or torn.
pub fn folder(uri: &str) -> Called<String> {
    let Some(rest) = uri.strip_prefix("file:") else {
        let is_uri = uri.split_once("://").is_some_and(|(scheme, _)| scheme.len() > 1);
        return if is_uri {
            refused(format!("resources are expected at file:///path, not at {uri}"))
        } else {
            Ok(uri.to_owned())
        };
    };
    let path = match rest.strip_prefix("//") {
        Some(behind) => behind.strip_prefix("localhost").unwrap_or(behind),
        None => rest,
    };
    let torn = || refused(format!("the location of the resources is not a URI: {uri}"));
    let mut bytes = Vec::with_capacity(path.len());
    let mut rest = path.bytes();
    while let Some(byte) = rest.next() {
        if byte != b'%' {
            bytes.push(byte);
            continue;
        }
        let mut digit = || rest.next().and_then(|byte| char::from(byte).to_digit(16));
        let (Some(high), Some(low)) = (digit(), digit()) else { return torn() };
        bytes.push((high << 4 | low) as u8);
    }
    let Ok(path) = String::from_utf8(bytes) else { return torn() };
    // `/C:/folder` on Windows.
    let is_drive = |path: &str| matches!(path.as_bytes(), [b'/', letter, b':', ..] if letter.is_ascii_alphabetic());
    Ok(if cfg!(windows) && is_drive(&path) { path[1..].to_owned() } else { path })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_location_of_resources_is_a_uri() {
        let expected = [
            ("file:///tmp/a%20b/%C3%A9", Some("/tmp/a b/é")),
            ("file:/tmp/x", Some("/tmp/x")),
            ("file://localhost/tmp/x", Some("/tmp/x")),
            ("/tmp/100%", Some("/tmp/100%")),
            ("file:///tmp/%2", None),
            ("file:///tmp/%zz", None),
            ("file:///tmp/%ff", None),
            ("http://host/x", None),
        ];
        for (uri, path) in expected {
            assert_eq!(folder(uri).ok().as_deref(), path, "{uri}");
        }
    }

    #[test]
    fn whole_numbers_keep_their_bits_or_become_reals() {
        assert_eq!(integer(&Value::UInt32(0x8130_0000)), Some(0x8130_0000_u32 as i32));
        assert_eq!(real(&Value::Int64(-(1 << 40))), Some(-1_099_511_627_776.0));
        assert_eq!((real(&Value::UInt8(1)), integer(&Value::Float64(1.0))), (None, None));
        assert!(from_integer(-1).is_err());
    }
}
