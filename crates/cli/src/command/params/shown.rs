//! Objects and values of a model as they are printed.

use canopen::Mux;
use devices::Description;
use serde::Serialize;

use crate::decode::decode;
use crate::paint::Paint;

/// A value as it is printed: the bytes of the wire, and what they mean.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Shown {
    /// In the order of the wire.
    bytes: String,
    /// In words and units.
    pub(super) text: String,
}

impl Shown {
    pub(super) fn new(model: Option<&'static Description>, object: Mux, bytes: &[u8]) -> Self {
        let row = model.and_then(|model| model.row(object));
        let decoded = decode(model, row, bytes);
        Self { bytes: decoded.bytes.clone(), text: decoded.text(Paint::OFF) }
    }
}

/// The name of an object, of its model or of the standard.
pub(super) fn name(model: Option<&'static Description>, object: Mux) -> Option<&'static str> {
    match model {
        Some(model) => model.row(object).map(|row| row.name),
        None => master::decode::common_name(object),
    }
}
