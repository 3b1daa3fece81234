//! Several axes that move as one: drives of any models, a set-point each in every cycle of SYNC.
//!
//! In: positions to come to rest at, or a path point by point, and for every axis its limits, without which nothing moves. Out:
//! set-points in the drives' RPDOs, all in one exchange, so that all drives take them with the same SYNC. Paths are limited in
//! jerk and end together ([`Trajectory`]). A fault, a loss, a shaft that lags, or a stream whose producer is late stops all
//! axes within their limits, and [`StopCause`] says why. What the whole program's death does is the drives' to notice
//! ([`crate::Drive::guard`]); a group that is dropped leaves its drives to the master, which stops them after some cycles.
//!
//! [`Group::step`] is one cycle and reads no clock; the async intents wait for SYNC and step.

mod axis;
mod error;
mod handle;
mod home;
mod limits;
mod open;
mod runner;
mod state;
mod stream;
mod trajectory;

pub use error::GroupError;
pub use handle::Group;
pub use home::{AxisHoming, HomingOrder, home};
pub use limits::{AxisLimits, PathError, PathPoint, Quantity};
pub use open::AxisSetup;
pub use state::{GroupState, Phase, StopCause};
pub use stream::{RefusedPoint, Stream, StreamOptions, check_path};
pub use trajectory::Trajectory;
