//! The ZLIM42-C: an integrated open-loop stepper, motor and drive in one, in two lengths (70 and 82 mm).
//!
//! Source: "ZLIM42-C user manual V1.03" (2022-03-03, Chinese; names are translated). Where it contradicts itself or is
//! silent, the choice is a named constant in [`assumptions`], or stands beside the row of [`objects`], with its reason.
//! Nothing measures the rotor: positions and velocities are the commanded ones.

pub mod assumptions;
mod drive;
pub mod faults;
pub mod hardware;
mod homing;
pub mod led;
pub mod objects;
mod parameters;
mod protection;
mod restart;
pub mod statusword;
pub mod storage;
pub mod tables;
mod terminals;
pub mod variations;

pub use drive::{NODE_PROFILE, Zlim42c};
pub use hardware::{Actuation, Hardware, PowerStage, Sensors};

/// The values of the drive's objects.
pub type Values = canopen::od::Dictionary<objects::TableStorage>;
