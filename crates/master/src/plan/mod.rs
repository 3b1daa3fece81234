//! Whether everything that a machine sends fits its bus, and how late each frame may come, before anything is wired.
//!
//! [`response_times`] is the analysis of a set of frames; [`traffic`] makes that set of how nodes are set up, and
//! [`most_nodes`] asks how many of them there may be.

mod response_time;
mod traffic;

pub use response_time::{Bound, ErrorRate, Queued, Trigger, load, response_times};
pub use traffic::{HostQueue, NodeTraffic, Plan, PlannedFrame, Purpose, Remark, Settings, most_nodes, plan};
