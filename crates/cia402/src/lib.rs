//! The drive profile CiA 402-2 as tables and pure functions.
//!
//! Controlword and statusword by bit, the power drive state machine and the homing methods as const tables, modes, option
//! and error codes as open newtypes, the factor group as exact fractions, windows and touch probes as small machines; where the objects stand is [`object`]. Nothing here moves a motor or
//! knows a dictionary: the drives' firmware and the master both read these tables. Manufacturer meanings of bits are deliberately absent: they are the drives'.
//!
//! ```
//! use cia402::{PowerEvent, PowerState, Statusword, next_command, transition};
//!
//! // What a drive with this statusword has to be sent, one controlword after another, until it moves its motor.
//! let mut state = Statusword(0x1250).state().ok_or("no state has these bits")?;
//! assert_eq!(state, PowerState::SwitchOnDisabled);
//! let mut controlwords = Vec::new();
//! while let Some(command) = next_command(state) {
//!     controlwords.push(command.controlword().0);
//!     state = transition(state, PowerEvent::Command(command)).ok_or("no way on")?.to;
//! }
//! assert_eq!(controlwords, [0x06, 0x07, 0x0F]);
//! assert_eq!(state, PowerState::OperationEnabled);
//! # Ok::<(), &str>(())
//! ```
#![no_std]

mod controlword;
mod error_code;
mod homing_method;
mod interpolation;
mod mode;
pub mod object;
mod option_code;
mod power;
mod statusword;
mod terminals;
mod touch_probe;
mod units;
mod window;

pub use controlword::{Controlword, PowerCommand};
pub use error_code::ErrorCode;
pub use homing_method::{
    Direction, HOMING_METHODS, HomingMethod, HomingRow, HomingSequence, HomingSwitch, INDEX_METHODS, IndexRow,
    SwitchEdge,
};
pub use interpolation::{BufferOrganisation, InterpolationPeriod, InterpolationSubMode};
pub use mode::{ModeOfOperation, SupportedModes};
pub use option_code::{
    AbortConnectionOption, DisableOperationOption, FaultReactionOption, HaltOption, QuickStopOption, ShutdownOption,
    StopRamp,
};
pub use power::{PowerEvent, PowerState, TRANSITIONS, Transition, next_command, transition};
pub use statusword::Statusword;
pub use terminals::{DigitalInputs, DigitalOutputs};
pub use touch_probe::{Latched, TouchProbe, TouchProbeFunction, TouchProbeSource};
pub use units::{FactorGroup, Factors, NoFactor, Polarity, RAD_S_PER_RPM, RPM_PER_RAD_S, Ratio, SiUnit};
pub use window::{Dwell, Window};
