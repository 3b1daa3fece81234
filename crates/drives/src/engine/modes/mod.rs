//! The modes of operation (CiA 402-2): one file each, a small state that turns targets into a trajectory or a torque.
//!
//! What all drives share is here; which bits of the statusword tell of it is the drive's.

mod homing;
mod profile_position;
mod profile_torque;
mod profile_velocity;

pub use homing::{Homing, HomingParameters, HomingStep, Switches};
pub use profile_position::{ProfilePosition, SetPoint};
pub use profile_torque::ProfileTorque;
pub use profile_velocity::{ProfileVelocity, VelocityRamps};
