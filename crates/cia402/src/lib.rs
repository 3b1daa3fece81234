//! The drive profile CiA 402-2 as tables and pure functions.
//!
//! Controlword and statusword by bit, the power drive state machine as one const table, modes and option
//! codes as open newtypes. Nothing here moves a motor or knows a dictionary: the drives' firmware and the
//! master both read these tables. Manufacturer meanings of bits are deliberately absent: they are the drives'.
#![no_std]

mod controlword;
mod homing_method;
mod mode;
mod option_code;
mod power;
mod statusword;

pub use controlword::{Controlword, PowerCommand};
pub use homing_method::{Direction, HOMING_METHODS, HomingMethod, HomingRow, HomingSwitch, SwitchEdge};
pub use mode::ModeOfOperation;
pub use option_code::{DisableOperationOption, HaltOption, QuickStopOption, ShutdownOption};
pub use power::{PowerEvent, PowerState, TRANSITIONS, Transition, next_command, transition};
pub use statusword::Statusword;
