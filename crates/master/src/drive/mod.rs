//! A CiA 402 drive by its intents, in physical units.
//!
//! In: what a person wants ("turn 90 degrees at 30 r/min"). Out: SDO requests to the node in the order that CiA 402-2
//! and the model's manual ask for, and either success or an [`Explanation`]. What a model's raw values are worth, and
//! where it departs from the standard, comes from its [`Description`](devices::Description); no model is known here by its name, and 6502h is
//! never asked for. Without a description only what the standard fixes is offered.
//! While a motion is supervised, the polling keeps the drive's watch over its host content.

mod command;
mod conclude;
mod everything;
mod explain;
mod goal;
mod guard;
mod handle;
mod homing;
mod limits;
mod mode;
mod motion;
mod observe;
mod position;
mod power;
mod safety;
mod scale;
mod state;
mod store;

pub use crate::error::{Explanation, Fact};
pub use crate::host_loss::HostLoss;
pub use crate::limits::{HeldBy, Limits, Setting};
pub use command::{Command, Manner, Motion, ParseCommandError, Report};
pub(crate) use conclude::Trigger;
pub use everything::{StopWay, StoppedAxis};
pub(crate) use explain::LATELY;
pub use explain::faults_in;
pub(crate) use goal::REACHED_TURNS;
pub use guard::SwitchedOff;
pub use handle::Drive;
pub use homing::HomingOptions;
pub use motion::{MotionOptions, MotionReport, Note};
pub(crate) use power::STANDSTILL_RPM;
pub(crate) use safety::{ANSWER, STOP};
pub use safety::{StopGuard, Stopped};
pub use scale::Commanded;
pub use state::DriveState;
