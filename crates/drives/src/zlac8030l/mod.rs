//! The ZLAC8030L V2.0: a 30 A servo drive for hub motors with Hall sensors and incremental encoder.
//!
//! Source: "ZLAC8030L quick start guide V1.00" (2023-09-11). Where it contradicts itself or is silent, the choice is
//! a named constant in [`assumptions`] or [`gains`], or stands beside the row of [`objects`], with its reason.

pub mod assumptions;
mod drive;
pub mod faults;
pub mod gains;
pub mod hardware;
pub mod objects;
mod parameters;
mod protection;
mod restart;
pub mod statusword;
pub mod storage;
mod terminals;
pub mod variations;

pub use drive::{NODE_PROFILE, Zlac8030l};
pub use hardware::{Actuation, Hardware, PowerStage, Sensors};

/// The values of the drive's objects.
pub type Values = canopen::od::Dictionary<objects::TableStorage>;
