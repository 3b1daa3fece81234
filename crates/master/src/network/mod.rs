//! The async face of the master: a shared handle that hands out futures.
//!
//! [`Network`] is a cheap clone over one [`Core`] and is itself a [`Station`]: the clone that a runner holds brings
//! frames and time, the others ask and wait. Futures wait for facts in the core, never for a runtime's timer;
//! sleeping is a deadline in the core. Nothing here knows the time: what is asked for is queued and carried out at
//! the runner's next call, for which [`poll_timeout`](Station::poll_timeout) asks at once.

mod claim;
mod cycle;
mod frame_log;
mod future;
mod handle;
mod join;
mod moved;
mod node;

pub(crate) use claim::Claim;
pub use cycle::{Exchange, NextSync, NoCycle};
pub use frame_log::FrameLog;
pub use future::{Elapsed, NodeView, Sleep, Wait};
pub(crate) use handle::Former;
pub use handle::Network;
pub use join::join_all;
pub(crate) use moved::MovedAxis;
pub use node::{DEFAULT_TIMEOUT, Node};
