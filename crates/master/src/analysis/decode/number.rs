//! The numbers that frames carry: what a plot is drawn of.

use canopen::Mux;

use super::value::DecodedValue;
use super::{Decoded, SdoStep};

/// The value of an object of a node, as a number in the unit of its row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Number {
    /// Which object.
    pub mux: Mux,
    /// As the model's table has it.
    pub name: Option<&'static str>,
    /// As the device counts.
    pub value: i64,
    /// What one of it is, such as `0.1 r/min`; empty if nothing is known.
    pub unit: &'static str,
}

impl Decoded {
    /// The numbers in a PDO, or the one that an SDO transfer has read or written, with the frame that ends it.
    pub fn numbers(&self) -> Vec<Number> {
        match self {
            Self::Pdo(pdo) => {
                let fields = pdo.fields.iter().filter_map(|(record, raw)| {
                    let bytes = raw.to_le_bytes();
                    let length = usize::from(record.bits).div_ceil(8).min(bytes.len());
                    Number::of(&DecodedValue::new(record.mux, &bytes[..length], pdo.model.map(|model| model.0)))
                });
                fields.collect()
            }
            Self::Sdo(sdo) => match &sdo.step {
                SdoStep::ReadDone(mux, bytes) | SdoStep::WriteDone(mux, bytes) => {
                    let value = DecodedValue::new(*mux, bytes, sdo.model.map(|model| model.0));
                    Number::of(&value).into_iter().collect()
                }
                _ => Vec::new(),
            },
            _ => Vec::new(),
        }
    }
}

impl Number {
    fn of(value: &DecodedValue<'_>) -> Option<Self> {
        Some(Self { mux: value.mux, name: value.name(), value: value.number()?, unit: value.unit() })
    }
}
