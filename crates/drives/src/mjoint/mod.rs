//! The M-series robot joint motors M4230E17B50, M4230E17B80, M8025E25B50 and M8025E25B80: a servo motor with its drive,
//! a multi-turn absolute encoder on a battery, and a reducer.
//!
//! Source: "M Robot Joint Motor CanOpen Manual" (Zhengzhou Defy Mechanical & Electrical Equipment). The four models are
//! one firmware; [`Model`] holds what differs. It does not have the CiA 402 state machine: the [statusword] mirrors the
//! controlword. Where the manual contradicts itself or is silent, the choice is a named constant in [`assumptions`] or
//! [`gains`], or stands beside the row of [`objects`], with its reason.

pub mod alarms;
pub mod assumptions;
mod drive;
mod encoder;
pub mod gains;
pub mod hardware;
pub mod homing;
mod host_heartbeat;
pub mod leds;
mod model;
pub mod objects;
mod orders;
mod origin;
mod output;
mod parameters;
pub mod power_on;
mod protection;
pub mod pulses;
mod rhythm;
pub mod statusword;
pub mod storage;
mod terminals;
mod turns;
pub mod variations;

pub use drive::{MJoint, NODE_PROFILE};
pub use hardware::{Actuation, Battery, Brake, Hardware, PowerStage, Sensors};
pub use model::Model;

/// The values of the drive's objects.
pub type Values = canopen::od::Dictionary<objects::TableStorage>;
