//! Fast capture: a drive is made to send what is asked for, what comes is kept with its times, and everything is put back.
//!
//! [`plan`] finds the TPDOs and what makes them come; [`Wanted::begin`] sets them up, with the way back on the disk, and [`Running`]
//! collects until a capture is whole. [`Restorer`] leads back, whatever ends it. [`merit`] has the figures of a response.

pub(crate) mod commanded;
mod line;
mod measurand;
pub mod merit;
mod of_log;
mod plain;
mod plan;
mod quantity;
mod restorer;
mod rows;
mod run;
mod session;
mod wanted;
mod ways_back;

pub use crate::network::params::SeenBy;
pub use commanded::refusal;
pub use line::CaptureLine;
pub use measurand::{Measurand, TRUE, TrueValue, Way};
pub use of_log::record_of_log;
pub use plain::Captured;
pub use plan::{CapturePlan, Pace, Request, plan};
pub use quantity::{Form, Quantity, short_names};
pub use restorer::{Restorer, not_put_back, with_left};
pub use rows::Trigger;
pub(crate) use run::{CaptureOutcome, CaptureRun, NamedCapture};
pub use session::{Running, Taken};
pub use wanted::{Span, Wanted};
pub use ways_back::{WayBack, WaysBack};
