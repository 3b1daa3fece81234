//! Who may move, by CiA 402-2: the power drive state machine with its option codes, what stops a motor, and the modes.
//!
//! [`PowerDrive`] joins them over one [`Axis`](super::axis::Axis).

mod modes;
mod parameters;
mod power;
mod power_drive;
mod set_points;
mod status;
mod stop;
mod stopping;

pub use parameters::{ModeChange, Parameters, Status, Targets, Tolerances};
pub use power::{DisableOptions, PowerMachine};
pub use power_drive::PowerDrive;
pub use set_points::{SetPoint, SetPoints};
pub use stop::{ExternalStop, StopCause};

#[cfg(test)]
mod tests;
