//! The last frames of the bus, raw, decoded on request.
//!
//! In: every frame of the bus. Out: parts of the kept frames, decoded then ([`Query`]), or as a log ([`Origin`]). The memory is
//! bounded, and no reader makes the host wait: the lock is held for a push, or for the copy of some pointers.

mod identifiers;
pub(crate) mod learning;
mod line;
mod log;
mod origin;
mod query;
mod ring;
mod series;

pub use identifiers::{ByIdentifier, Identifier};
pub use origin::Origin;
pub use query::{Asked, Query};
pub use ring::{Held, Trace};
pub use series::{AskedSeries, LogSeries};
