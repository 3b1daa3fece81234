//! Objects and values of a model as they are printed.

use canopen::Mux;
use canopen::pdo::{MappingRecord, PdoId};
use devices::Description;
use plot::Paint;
use serde::Serialize;

use words::decode::decode;

/// A value as it is printed: the bytes of the wire, and what they mean.
#[derive(Clone, Debug, Serialize)]
pub struct Shown {
    /// In the order of the wire.
    pub bytes: String,
    /// In words and units.
    pub text: String,
}

impl Shown {
    /// The bytes of an object of a model.
    pub fn new(model: Option<&'static Description>, object: Mux, bytes: &[u8]) -> Self {
        let row = model.and_then(|model| model.row(object));
        let decoded = decode(model, row, bytes);
        let text = mapped(model, object, bytes).unwrap_or_else(|| decoded.text(Paint::OFF));
        Self { bytes: decoded.bytes, text }
    }
}

/// What an entry of a mapping maps: `6041h:00 statusword (16)`.
fn mapped(model: Option<&'static Description>, object: Mux, bytes: &[u8]) -> Option<String> {
    let (_, is_mapping) = PdoId::of_object(object.index)?;
    let raw = u32::from_le_bytes(bytes.try_into().ok().filter(|_| is_mapping && object.sub_index > 0)?);
    if raw == 0 {
        return Some("nothing".to_owned());
    }
    let record = MappingRecord::from_raw(raw);
    Some(format!("{} {} ({})", record.mux, name(model, record.mux).unwrap_or_default(), record.bits))
}

/// The name of an object, of its model or of the standard.
pub fn name(model: Option<&'static Description>, object: Mux) -> Option<&'static str> {
    match model {
        Some(model) => model.row(object).map(|row| row.name),
        None => master::decode::common_name(object),
    }
}
