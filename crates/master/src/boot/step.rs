//! What one step of a boot-up expected, and what it found: data that prints as a sentence.

use core::fmt;
use std::time::Duration;

use canopen::{AbortCode, Mux, NmtState};

use super::error_status::ErrorStatus;
use crate::error::Hints;

/// One step of the boot-up of a node.
#[derive(Clone, Debug)]
pub struct Step {
    /// What the step does.
    pub kind: StepKind,
    /// The object that it was about, if it was about one.
    pub object: Option<Mux>,
    /// What should be.
    pub expected: Expected,
    /// What is.
    pub found: Found,
    /// What follows.
    pub verdict: Verdict,
}

/// The steps of the process "boot NMT slave" (CiA 302-2), in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum StepKind {
    /// The node is in the list of slaves.
    Assignment,
    /// NMT reset communication, until it has booted.
    Reset,
    /// 1000h.
    DeviceType,
    /// 1018h.
    Identity,
    /// Whether it is operational already.
    State,
    /// Its factory settings.
    Restore,
    /// Its software version.
    Software,
    /// Its configuration.
    Configuration,
    /// Its heartbeat.
    Heartbeat,
    /// Its answer to node guarding, where it sends no heartbeat.
    Guarding,
    /// What it does when this program dies.
    HostWatch,
    /// NMT start.
    Start,
}

/// What a step of the boot (CiA 302-2, boot-up of a slave) expects of the node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Expected {
    /// This number.
    Value(u32),
    /// Any answer.
    Answer,
    /// That these bytes are taken.
    Write(Vec<u8>),
    /// A boot-up message.
    BootUp,
    /// A heartbeat.
    Heartbeat,
    /// An answer to node guarding.
    GuardAnswer,
    /// A state.
    State(NmtState),
    /// Any other state.
    OtherState(NmtState),
    /// That the drive stops when this program dies.
    Stops,
    /// To be in the list of slaves.
    Listed,
}

/// What a step of the boot has found where something was [`Expected`].
#[derive(Clone, Debug)]
pub enum Found {
    /// This number.
    Value(u32),
    /// It was taken.
    Done,
    /// It was so already, and nothing was written.
    AsItWas,
    /// It came.
    Came,
    /// This state.
    State(NmtState),
    /// The node refused.
    Refused(AbortCode),
    /// No answer.
    Silent {
        /// How long each was waited for.
        waited: Duration,
        /// How often it was asked.
        tries: u32,
        /// What was last heard of it.
        last: Option<Heard>,
        /// What may explain it.
        hints: Hints,
    },
    /// Nothing of the kind that was waited for.
    Nothing {
        /// For how long.
        waited: Duration,
        /// What was last heard of it.
        last: Option<Heard>,
        /// What may explain it.
        hints: Hints,
    },
    /// Something else, in words.
    Text(String),
}

/// The last thing that was heard of a node, and how long before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// Its boot-up message.
    BootUp(Duration),
    /// Its heartbeat.
    Heartbeat(Duration),
    /// Another frame.
    Frame(Duration),
}

/// What follows from a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// As expected.
    Passed,
    /// Not as expected, and the boot-up goes on.
    Noted,
    /// It was operational already: what would disturb it is left out.
    LeftOperational,
    /// The boot-up of the node ends here.
    Failed(ErrorStatus),
}

impl StepKind {
    /// Its name in lower case, for messages: `device type`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Assignment => "assignment",
            Self::Reset => "reset",
            Self::DeviceType => "device type",
            Self::Identity => "identity",
            Self::State => "state",
            Self::Restore => "restore",
            Self::Software => "software",
            Self::Configuration => "configuration",
            Self::Heartbeat => "heartbeat",
            Self::Guarding => "guarding",
            Self::HostWatch => "host watch",
            Self::Start => "start",
        }
    }
}

impl Step {
    /// What to do, where something has to be done.
    pub fn advice(&self) -> Option<&'static str> {
        match (&self.found, self.verdict) {
            (_, Verdict::Passed) => None,
            (Found::Silent { hints, .. } | Found::Nothing { hints, .. }, _) => Some(hints.check()),
            (_, Verdict::Failed(status)) => Some(status.advice()),
            (_, Verdict::LeftOperational) => Some(ErrorStatus::InitiallyOperational.advice()),
            (_, Verdict::Noted) => None,
        }
    }
}

/// `1018h:01 expected 100h, got no answer within 200 ms after 3 tries; last heard: boot-up 12.0 s ago; check ...`.
impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.object {
            Some(object) => write!(f, "{object}")?,
            None => f.write_str(self.kind.name())?,
        }
        write!(f, " expected {}, got {}", self.expected, self.found)?;
        self.advice().map_or(Ok(()), |advice| write!(f, "; {advice}"))
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value(value) => write!(f, "{value:X}h"),
            Self::Answer => f.write_str("an answer"),
            // SDO carries numbers with their lowest byte first; people write it last.
            Self::Write(bytes) if bytes.len() <= 8 => {
                f.write_str("to take ")?;
                let number = bytes.iter().rev().fold(0_u64, |number, byte| number << 8 | u64::from(*byte));
                write!(f, "{number:X}h")
            }
            Self::Write(bytes) => write!(f, "to take {} bytes", bytes.len()),
            Self::BootUp => f.write_str("a boot-up message"),
            Self::Heartbeat => f.write_str("a heartbeat"),
            Self::GuardAnswer => f.write_str("an answer to node guarding"),
            Self::State(state) => write!(f, "{state}"),
            Self::OtherState(state) => write!(f, "another state than {state}"),
            Self::Stops => f.write_str("to stop without this program"),
            Self::Listed => f.write_str("to be a slave (1F81h)"),
        }
    }
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let heard = |f: &mut fmt::Formatter<'_>, last: &Option<Heard>| match last {
            Some(heard) => write!(f, "; last heard: {heard}"),
            None => f.write_str("; it has never been heard"),
        };
        match self {
            Self::Value(value) => write!(f, "{value:X}h"),
            Self::Done => f.write_str("that"),
            Self::AsItWas => f.write_str("that already"),
            Self::Came => f.write_str("received"),
            Self::State(state) => write!(f, "{state}"),
            Self::Refused(code) => write!(f, "refused: {code}"),
            Self::Silent { waited, tries, last, .. } => {
                let times = if *tries == 1 { "try" } else { "tries" };
                write!(f, "no answer within {} ms after {tries} {times}", waited.as_millis())?;
                heard(f, last)
            }
            Self::Nothing { waited, last, .. } => {
                write!(f, "none within {} ms", waited.as_millis())?;
                heard(f, last)
            }
            Self::Text(words) => f.write_str(words),
        }
    }
}

impl fmt::Display for Heard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, age) = match self {
            Self::BootUp(age) => ("boot-up", age),
            Self::Heartbeat(age) => ("heartbeat", age),
            Self::Frame(age) => ("a frame", age),
        };
        write!(f, "{what} {:.1} s ago", age.as_secs_f64())
    }
}
