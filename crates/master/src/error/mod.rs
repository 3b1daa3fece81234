//! Errors that say which node, which object, what was expected, what came, and what to do next.

mod hints;

use core::fmt;
use std::time::Duration;

use canopen::emcy::Emcy;
use canopen::sdo::client;
use canopen::{AbortCode, Mux, NmtState, NodeId};
use cia402::{ModeOfOperation, PowerState, Statusword};
use devices::AxisId;
use devices::faults::FaultRow;

use crate::identify::knowledge::{Guess, Identity};
use crate::limits::{AskedNumber, Limits, Setting};
use crate::units::{Shown, Volts};
use hints::advice;

pub use hints::{Access, HeardNodes, Hints};

/// Why the master could not do what it was asked.
#[derive(Clone, Debug, thiserror::Error)]
pub enum Error {
    /// An SDO request was not answered in time.
    #[error("node {node} did not answer within {} ms when asked to {access} {mux}. {hints}", waited.as_millis())]
    NoAnswer {
        /// The node asked.
        node: NodeId,
        /// The object asked for.
        mux: Mux,
        /// Read or write.
        access: Access,
        /// How long the last frame of the answer was waited for.
        waited: Duration,
        /// What may explain it.
        hints: Hints,
    },
    /// The node refused with an SDO abort.
    #[error("node {node} refused to {access} {mux}: {code}. {}", advice(*code, *access))]
    Aborted {
        /// The node asked.
        node: NodeId,
        /// The object asked for.
        mux: Mux,
        /// Read or write.
        access: Access,
        /// The node's reason.
        code: AbortCode,
    },
    /// The node's answer broke the SDO protocol; the master aborted the transfer.
    #[error(
        "node {node} answered the request to {access} {mux} in a way that breaks the SDO protocol. {why}. \
             Try again; if it persists, two devices may share the node-ID, or another master talks to it"
    )]
    BadAnswer {
        /// The node asked.
        node: NodeId,
        /// The object asked for.
        mux: Mux,
        /// Read or write.
        access: Access,
        /// What was wrong with it.
        why: client::Failure,
    },
    /// An object is not as long as it should be.
    #[error(
        "{mux} of node {node} has {received} bytes where {expected} were expected: \
             the device may be another model than assumed"
    )]
    WrongLength {
        /// The node asked.
        node: NodeId,
        /// The object.
        mux: Mux,
        /// Bytes expected.
        expected: usize,
        /// Bytes received.
        received: usize,
    },
    /// Too many requests wait for one node.
    #[error("too many requests already wait for node {node}: wait for some of them first")]
    QueueFull {
        /// The node asked.
        node: NodeId,
    },
    /// A further SDO server of the node does not exist.
    #[error(
        "node {node} has no SDO server by {record:04X}h: bit 31 of one of its COB-IDs is set, or they have 29 bits. Write both COB-IDs \
             (sub-indices 1 and 2) first"
    )]
    NoSdoServer {
        /// The node.
        node: NodeId,
        /// The record, 1201h to 127Fh.
        record: u16,
    },
    /// A node did not send its boot-up message.
    #[error("node {node} did not boot within {} ms. {hints}", waited.as_millis())]
    NoBootUp {
        /// The node waited for.
        node: NodeId,
        /// For how long it was waited for.
        waited: Duration,
        /// What may explain it.
        hints: Hints,
    },
    /// The drive did not get where it was meant to be.
    #[error("{0}")]
    NotReached(Box<Explanation>),
    /// Something was asked of a drive whose model is not known.
    #[error(
        "node {node}: its model is not known, and that is needed to {intent}. Name the model; a wrong one could \
             write to objects that mean something else"
    )]
    UnknownModel {
        /// The node.
        node: NodeId,
        /// What was to be done.
        intent: &'static str,
    },
    /// Something that not every model of the node's identity takes alike was asked of a drive whose model is a guess.
    #[error(
        "node {node}: its model is not known for sure, and that is needed to {intent}: {guess}. Nothing was sent{}",
        if guess.evidence().is_some() { ": what stores parameters on one may set something else on the other" } else { "" }
    )]
    GuessedModel {
        /// The node.
        node: NodeId,
        /// What was to be done.
        intent: String,
        /// What is known.
        guess: Guess,
    },
    /// The node says that it is something else than the model it was taken for.
    #[error("node {node} is not a {model}: {}. Name the right model", differences(found, wanted))]
    WrongModel {
        /// The node.
        node: NodeId,
        /// The model it was taken for.
        model: &'static str,
        /// What it says.
        found: Identity,
        /// What the model says.
        wanted: devices::Identity,
    },
    /// The node lacks an object that the model has, though both say the same identity.
    #[error(
        "node {node} is not a {model}, though it has the same identity: it has no {object}. Name the right model; \
         what stores parameters on one may set something else on the other"
    )]
    OtherModel {
        /// The node.
        node: NodeId,
        /// The model it was taken for.
        model: &'static str,
        /// The object that the model has.
        object: Mux,
    },
    /// The drive has no axis of this number, or the device is not a drive.
    #[error("node {node}: the {model} {}", no_such_axis(*axis, *axes))]
    NoSuchAxis {
        /// The node.
        node: NodeId,
        /// Its model.
        model: &'static str,
        /// The axis asked for.
        axis: AxisId,
        /// How many it has.
        axes: usize,
    },
    /// The axis has no object for something that is needed.
    #[error("node {node}: the {model} has no object for {what}: what needs it cannot be done with this model")]
    NoSuchQuantity {
        /// The node.
        node: NodeId,
        /// Its model.
        model: &'static str,
        /// What it is, as in "no object for the actual velocity".
        what: &'static str,
    },
    /// A way was asked for, of a drive that is not known to move something along.
    #[error(
        "node {node}: its travel per turn is not known: state it in the machine file, units = \
         {{ feed_constant = \"10mm\" }}, or give an angle"
    )]
    NoFeed {
        /// The node.
        node: NodeId,
    },
    /// A group or a base of this program moves the axis in each cycle.
    #[error(
        "node {node}: could not {intent}: a group or a base of this program moves it, and nothing was sent. {IN_CYCLES_ADVICE}"
    )]
    InCycles {
        /// The node.
        node: NodeId,
        /// What was to be done.
        intent: &'static str,
    },
    /// The model has no parameter store.
    #[error("node {node}: the {model} stores no parameters: write them after each start")]
    NoParameterStore {
        /// The node.
        node: NodeId,
        /// The model's name.
        model: &'static str,
    },
    /// The drive took the command to store its parameters, and never said that it had done so.
    #[error("node {node}: {mux} was set to store the parameters, and still reads {found} after {waited:?}, not {done}")]
    NotStored {
        /// The node.
        node: NodeId,
        /// The object that starts the store and says its end.
        mux: Mux,
        /// What it reads.
        found: i64,
        /// What it reads after a store.
        done: i64,
        /// How long was waited.
        waited: Duration,
    },
    /// An object that was changed for a motion alone was written back, and has another value.
    #[error("{mux} of node {node} was put back to {had:X}h after the motion and reads {found:X}h: write it again")]
    NotPutBack {
        /// The node.
        node: NodeId,
        /// The object.
        mux: Mux,
        /// What it had before, and was written.
        had: u32,
        /// What it reads.
        found: u32,
    },
    /// The model has no command that restores factory settings.
    #[error("node {node}: the {model} cannot restore its factory settings: write each object instead")]
    NoFactorySettings {
        /// The node.
        node: NodeId,
        /// The model's name.
        model: &'static str,
    },
    /// The model does not have this mode.
    #[error("node {node}: the {model} has no mode {mode}: its 6060h takes {}", list(modes))]
    NoSuchMode {
        /// The node.
        node: NodeId,
        /// Its model.
        model: &'static str,
        /// The mode.
        mode: ModeOfOperation,
        /// Those that it has.
        modes: &'static [ModeOfOperation],
    },
    /// A value is outside what the drive takes, or would be held back by another object: it was not sent.
    #[error("node {node}: {} is out of range for {} {}, which takes {limits}. It was not sent",
        AskedNumber(*asked), limits.object, limits.name)]
    OutOfLimits {
        /// The node.
        node: NodeId,
        /// What was asked for, in counts.
        asked: i64,
        /// What the object takes, and why.
        limits: Box<Limits>,
    },
    /// A value is less than half of what one count of its object is worth, and not zero: it was not sent.
    #[error(
        "node {node}: {asked} {unit} is too little for {object} {name}: one count of it is {step} {unit}{}. It was not sent",
        finer.map(|setting| format!(", by {setting}")).unwrap_or_default()
    )]
    TooFine {
        /// The node.
        node: NodeId,
        /// The object.
        object: Mux,
        /// Its name.
        name: &'static str,
        /// What was asked for.
        asked: Shown,
        /// What one count is worth.
        step: Shown,
        /// The unit of both.
        unit: &'static str,
        /// An object that makes the counts finer.
        finer: Option<Setting>,
    },
}

/// What is there in place of an axis.
fn no_such_axis(axis: AxisId, axes: usize) -> String {
    match axes {
        0 => "is not a drive: it has nothing that moves".to_owned(),
        axes => format!("has {axes} axes, and no axis {}", axis.0),
    }
}

impl Error {
    /// What kind it is, in a word that programs may rely on.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::NoAnswer { .. } => "no_answer",
            Self::Aborted { .. } => "aborted",
            Self::BadAnswer { .. } => "bad_answer",
            Self::WrongLength { .. } => "wrong_length",
            Self::QueueFull { .. } => "queue_full",
            Self::NoSdoServer { .. } => "no_sdo_server",
            Self::NoBootUp { .. } => "no_boot_up",
            Self::NotReached(_) => "not_reached",
            Self::UnknownModel { .. } => "unknown_model",
            Self::GuessedModel { .. } => "guessed_model",
            Self::WrongModel { .. } => "wrong_model",
            Self::OtherModel { .. } => "other_model",
            Self::NoSuchAxis { .. } => "no_such_axis",
            Self::NoSuchQuantity { .. } => "no_such_quantity",
            Self::NoFeed { .. } => "no_feed",
            Self::InCycles { .. } => "in_cycles",
            Self::NoParameterStore { .. } => "no_parameter_store",
            Self::NotStored { .. } => "not_stored",
            Self::NoFactorySettings { .. } => "no_factory_settings",
            Self::NoSuchMode { .. } => "no_such_mode",
            Self::OutOfLimits { .. } => "out_of_limits",
            Self::TooFine { .. } => "too_fine",
            Self::NotPutBack { .. } => "not_put_back",
        }
    }

    /// The node that it is about.
    pub const fn node(&self) -> NodeId {
        match self {
            Self::NoAnswer { node, .. }
            | Self::Aborted { node, .. }
            | Self::BadAnswer { node, .. }
            | Self::WrongLength { node, .. }
            | Self::QueueFull { node }
            | Self::NoSdoServer { node, .. }
            | Self::NoBootUp { node, .. }
            | Self::UnknownModel { node, .. }
            | Self::GuessedModel { node, .. }
            | Self::WrongModel { node, .. }
            | Self::OtherModel { node, .. }
            | Self::NoSuchAxis { node, .. }
            | Self::NoSuchQuantity { node, .. }
            | Self::NoFeed { node }
            | Self::InCycles { node, .. }
            | Self::NoParameterStore { node, .. }
            | Self::NotStored { node, .. }
            | Self::NoFactorySettings { node, .. }
            | Self::NoSuchMode { node, .. }
            | Self::OutOfLimits { node, .. }
            | Self::TooFine { node, .. }
            | Self::NotPutBack { node, .. } => *node,
            Self::NotReached(explanation) => explanation.node,
        }
    }

    /// The object that it is about, if it is about one.
    pub fn object(&self) -> Option<Mux> {
        match self {
            Self::NoAnswer { mux, .. }
            | Self::NotStored { mux, .. }
            | Self::Aborted { mux, .. }
            | Self::BadAnswer { mux, .. }
            | Self::WrongLength { mux, .. }
            | Self::TooFine { object: mux, .. } => Some(*mux),
            Self::OutOfLimits { limits, .. } => Some(limits.object),
            Self::OtherModel { object, .. } => Some(*object),
            _ => None,
        }
    }

    /// The abort code that the node gave.
    pub const fn abort(&self) -> Option<AbortCode> {
        if let Self::Aborted { code, .. } = self { Some(*code) } else { None }
    }

    /// What to do about it, where that is known; the text of the error has it too, as its end.
    pub fn advice(&self) -> Option<String> {
        match self {
            Self::NoAnswer { hints, .. } | Self::NoBootUp { hints, .. } => Some(hints.to_string()),
            Self::Aborted { code, access, .. } => Some(advice(*code, *access).to_owned()),
            Self::NotReached(explanation) => Some(explanation.advice.clone()),
            Self::InCycles { .. } => Some(IN_CYCLES_ADVICE.to_owned()),
            _ => None,
        }
    }
}

/// What to do about [`Error::InCycles`].
const IN_CYCLES_ADVICE: &str = "Move it by that, or close that first";

/// What a node says otherwise than the model that it was taken for.
fn differences(found: &Identity, wanted: &devices::Identity) -> String {
    let all =
        found.differences(wanted).map(|(name, said, expected)| format!("its {name} is {said:X}h, not {expected:X}h"));
    all.collect::<Vec<_>>().join(", ")
}

fn list(items: &[impl fmt::Display]) -> String {
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// Why a drive is not where it was meant to be: what was seen, what follows from it, what to do.
#[derive(Clone, Debug)]
pub struct Explanation {
    /// The drive.
    pub node: NodeId,
    /// What was wanted, as in "could not enable it".
    pub intent: &'static str,
    /// What was seen, in the order it was asked for.
    pub facts: Vec<Fact>,
    /// What follows.
    pub conclusion: String,
    /// What to do.
    pub advice: String,
}

/// One thing that the drive showed when a motion failed; an explanation is drawn from them.
#[derive(Clone, Debug)]
pub enum Fact {
    /// 6041h, and the state that it shows.
    Statusword(Statusword, Option<PowerState>),
    /// The model's fault code, with what its bits mean.
    FaultCode(u16, Vec<&'static FaultRow>),
    /// 6060h and 6061h.
    Mode(ModeOfOperation, ModeOfOperation),
    /// Supply voltage at the drive.
    Supply(Volts),
    /// An acceleration or deceleration that is 0.
    RateOfZero(Mux),
    /// State by its last heartbeat or the NMT command sent since.
    Nmt(NmtState),
    /// Age of its last heartbeat; `None` if none ever came.
    Heartbeat(Option<Duration>),
    /// Its last emergency message, how long ago it came, and what it means on this model.
    Emcy(Duration, Emcy, Option<&'static FaultRow>),
    /// Another SDO client has asked it to write an object, so long ago; the value, where it came in the request.
    OtherWrite(Duration, Mux, Option<u32>),
    /// A request that failed while looking.
    Failed(Box<Error>),
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "node {}: could not {}. {}.", self.node, self.intent, self.conclusion)?;
        f.write_str("  Seen: ")?;
        for (position, fact) in self.facts.iter().enumerate() {
            write!(f, "{}{fact}", if position == 0 { "" } else { "; " })?;
        }
        write!(f, ".\n  Do: {}.", self.advice.trim_end_matches('.'))
    }
}

impl fmt::Display for Fact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Statusword(word, Some(state)) => write!(f, "statusword {:04X}h ({})", word.0, state.name()),
            Self::Statusword(word, None) => write!(f, "statusword {word}"),
            Self::FaultCode(0, _) => f.write_str("no fault code"),
            Self::FaultCode(code, rows) => {
                write!(f, "fault code {code:04X}h")?;
                rows.iter().try_for_each(|row| write!(f, ", {}", row.name))
            }
            Self::Mode(wanted, shown) if wanted == shown => write!(f, "mode {shown}"),
            Self::Mode(wanted, shown) => write!(f, "mode {shown}, asked for {wanted}"),
            Self::Supply(volts) => write!(f, "supply {volts}"),
            Self::RateOfZero(object) => write!(f, "{object} is 0"),
            Self::Nmt(state) => write!(f, "NMT state {state}"),
            Self::Heartbeat(None) => f.write_str("no heartbeat or boot-up seen"),
            Self::Heartbeat(Some(age)) => write!(f, "last heartbeat or boot-up {:.1} s ago", age.as_secs_f64()),
            Self::Emcy(age, emcy, Some(row)) => {
                write!(f, "EMCY {:04X}h ({}) {:.1} s ago", emcy.code.0, row.name, age.as_secs_f64())
            }
            Self::Emcy(age, emcy, None) => write!(f, "EMCY {} {:.1} s ago", emcy.code, age.as_secs_f64()),
            Self::OtherWrite(age, object, value) => {
                write!(f, "{object} written by another master {:.1} s ago", age.as_secs_f64())?;
                value.map_or(Ok(()), |value| write!(f, " ({value:X}h)"))
            }
            Self::Failed(error) => write!(f, "{error}"),
        }
    }
}
