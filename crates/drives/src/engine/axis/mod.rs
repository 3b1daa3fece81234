//! Motion of one shaft: where it is to be, in counts and seconds. Who may move it is decided elsewhere.

mod demand;
mod homing;
mod speed;
mod torque;
mod trajectory;

pub use demand::{Demand, Feedback};
pub use homing::{Homing, HomingParameters, HomingStep, Switches};
pub use speed::{Speed, VelocityRamps};
pub use torque::Torque;
pub use trajectory::{MoveLimits, StraightRamps, Trajectory, TrajectoryPoint};
