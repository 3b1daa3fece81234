//! The figures of the "ZLAC8030L V2.0 servo driver CANopen communication quick start guide" (V1.00) as data.
//!
//! Every value is the manual's, with its contradictions settled as `docs/drives/zlac8030l.md` says; the `note` of a
//! row has what the manual prints instead. The node is 4, the manual's default.

use crate::manual::{datagram, object, power_cell, rows};

pub use crate::manual::{Datagram, ObjectRow, PowerCell};

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
