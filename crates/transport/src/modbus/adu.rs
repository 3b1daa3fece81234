//! A request as the media carry it.

/// A request as it came, without what the medium adds for itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Adu {
    pub(super) transaction: u16,
    pub(super) unit: u8,
    pub(super) pdu: Vec<u8>,
}
