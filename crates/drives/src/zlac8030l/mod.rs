//! The ZLAC8030L V2.0: a 30 A servo drive for hub motors with Hall sensors and incremental encoder.
//!
//! Source: "ZLAC8030L quick start guide V1.00" (2023-09-11). Where it contradicts itself or is silent, the choice is
//! a named constant in [`readings`], or stands beside the row of [`objects`], with its reason.

pub mod faults;
pub mod hardware;
pub mod objects;
mod profile;
pub mod readings;
mod storage;

pub use hardware::{Actuation, Hardware, PowerStage, Sensors};
pub use profile::PROFILE;
pub use storage::Image;
