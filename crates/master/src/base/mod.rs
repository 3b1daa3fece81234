//! A base on two driven wheels: a twist in, the speeds of the wheels and the pose out, once in each cycle of SYNC.
//!
//! In: m/s along the heading and rad/s about the middle of the axle, again and again: without a new twist within the watchdog's
//! time the base stops. Out: speeds in the drives' RPDOs, within the limits of the base and of its wheels, and the pose by the
//! positions of the wheels, exact for arcs of circles. A wheel at fault, or lost, stops both. What the ground does to the wheels
//! (slip, tyres under load) is not known here.

mod drive;
mod kinematics;
mod limits;
mod state;

pub use drive::{Base, BaseState, WheelSetup};
pub use kinematics::{Geometry, Pose, Twist, Wheels};
pub use limits::{BaseError, BaseLimits};
pub use state::StopCause;
