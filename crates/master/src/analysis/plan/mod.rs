//! Whether everything that a machine sends fits its bus, and how late each frame may come, before anything is wired.
//!
//! [`response_times`] is the analysis of a set of frames; [`plan`] makes that set of how nodes are set up and what their host sends,
//! and [`most_nodes`] asks how many of them there may be.
//!
//! ```
//! use std::time::Duration;
//!
//! use can::{Bitrate, CanId};
//! use master::plan::{Queued, response_times};
//!
//! // The example of Davis et al.: three frames of 125 bits at 125 kbit/s, every 2.5, 3.5 and 3.5 ms. The last one is late with
//! // its second instance.
//! let frame = |id, us| Queued {
//!     id: CanId::standard(id),
//!     length: 7,
//!     period: Duration::from_micros(us),
//!     jitter: Duration::ZERO,
//!     ahead: vec![],
//!     with: None,
//!     trigger: None,
//! };
//! let frames = [frame(1, 2_500), frame(2, 3_500), frame(3, 3_500)];
//! let worst = response_times(&frames, Bitrate::K125, None).into_iter().map(|bound| bound.worst);
//! assert_eq!(worst.collect::<Vec<_>>(), [2_000, 3_000, 3_500].map(|us| Some(Duration::from_micros(us))));
//! ```

mod in_step;
mod queued;
mod response_time;
mod traffic;

pub use queued::{Queued, Trigger};
pub use response_time::{Bound, ErrorRate, load, response_times};
pub use traffic::{
    HostQueue, NodeTraffic, Plan, PlannedFrame, Purpose, Remark, Settings, most_nodes, plan, shortest_cycle,
};
