//! Who may move, by CiA 402-2: the power drive state machine with its option codes, what stops a motor, and the modes.

mod power;
mod power_drive;
mod set_points;
mod stop;

pub use power::{DisableOptions, PowerMachine};
pub use power_drive::{Parameters, PowerDrive, Status, Targets, Tolerances};
pub use set_points::{SetPoint, SetPoints};
pub use stop::{ExternalStop, StopCause, StopRamp};
