//! The last frames of the bus, raw, and their words for whoever asks.
//!
//! In: every frame that passes. Out: parts of what is kept, decoded then ([`Query`]), or as a log ([`Origin`]). The memory is
//! bounded, and nobody who reads keeps the host waiting: the lock is held for a push, or for the copy of some pointers.

mod bus_frame;
mod line;
mod log;
mod query;
mod ring;
mod series;

pub use bus_frame::BusFrame;

pub(crate) use bus_frame::Origin;
pub(crate) use query::{Asked, Query};
pub(crate) use ring::{Held, Trace};
pub(crate) use series::AskedSeries;
