//! Errors that say which node, which object, what was expected, what came, and what to do next.

use core::fmt;
use std::time::Duration;

use canopen::sdo::client;
use canopen::{AbortCode, Mux, NmtState, NodeId};
use cia402::ModeOfOperation;

use crate::drive::{Explanation, Limits, Setting};
use crate::identify::{Guess, Identity};
use crate::units::Shown;

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
    /// A node did not send its boot-up message.
    #[error("node {node} did not boot within {} ms. {hints}", waited.as_millis())]
    NoBootUp {
        /// The node waited for.
        node: NodeId,
        /// How long.
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
    #[error("node {node} is not a {model}: it says {found}. Name the right model")]
    WrongModel {
        /// The node.
        node: NodeId,
        /// The model it was taken for.
        model: &'static str,
        /// What it says.
        found: Identity,
    },
    /// The node lacks an object that the model has, though both say the same identity.
    #[error(
        "node {node} is not a {model}, though it says the same of itself: it has no {hallmark}. Name the right model; \
         what stores parameters on one may set something else on the other"
    )]
    OtherModel {
        /// The node.
        node: NodeId,
        /// The model it was taken for.
        model: &'static str,
        /// The object that the model has.
        hallmark: Mux,
    },
    /// The model has no command that restores factory settings.
    #[error("node {node}: the {model} cannot be told to restore its factory settings: write each object instead")]
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
    #[error("node {node}: {asked} is out of range for {} {}, which takes {limits}. It was not sent",
        limits.object, limits.name)]
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

impl Error {
    /// What kind it is, in a word that programs may rely on.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::NoAnswer { .. } => "no_answer",
            Self::Aborted { .. } => "aborted",
            Self::BadAnswer { .. } => "bad_answer",
            Self::WrongLength { .. } => "wrong_length",
            Self::QueueFull { .. } => "queue_full",
            Self::NoBootUp { .. } => "no_boot_up",
            Self::NotReached(_) => "not_reached",
            Self::UnknownModel { .. } => "unknown_model",
            Self::GuessedModel { .. } => "guessed_model",
            Self::WrongModel { .. } => "wrong_model",
            Self::OtherModel { .. } => "other_model",
            Self::NoFactorySettings { .. } => "no_factory_settings",
            Self::NoSuchMode { .. } => "no_such_mode",
            Self::OutOfLimits { .. } => "out_of_limits",
            Self::TooFine { .. } => "too_fine",
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
            | Self::NoBootUp { node, .. }
            | Self::UnknownModel { node, .. }
            | Self::GuessedModel { node, .. }
            | Self::WrongModel { node, .. }
            | Self::OtherModel { node, .. }
            | Self::NoFactorySettings { node, .. }
            | Self::NoSuchMode { node, .. }
            | Self::OutOfLimits { node, .. }
            | Self::TooFine { node, .. } => *node,
            Self::NotReached(explanation) => explanation.node,
        }
    }

    /// The object that it is about, if it is about one.
    pub fn object(&self) -> Option<Mux> {
        match self {
            Self::NoAnswer { mux, .. }
            | Self::Aborted { mux, .. }
            | Self::BadAnswer { mux, .. }
            | Self::WrongLength { mux, .. }
            | Self::TooFine { object: mux, .. } => Some(*mux),
            Self::OutOfLimits { limits, .. } => Some(limits.object),
            Self::OtherModel { hallmark, .. } => Some(*hallmark),
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
            _ => None,
        }
    }
}

/// Direction of an SDO request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Upload.
    Read,
    /// Download.
    Write,
}

impl fmt::Display for Access {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Read => "read",
            Self::Write => "write",
        })
    }
}

/// What the master knows when a node is silent. Prints as the likeliest cause and what to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hints {
    /// The request never left the master.
    pub unsent: bool,
    /// The state that the node must be in by its last heartbeat or the NMT command sent since.
    pub nmt_state: Option<NmtState>,
    /// Time since any frame of the node.
    pub silent_for: Option<Duration>,
    /// Other nodes have been heard.
    pub others: bool,
}

impl fmt::Display for Hints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.unsent, self.nmt_state, self.silent_for) {
            (true, ..) => f.write_str(
                "The request never left this computer: check that the CAN interface is up and that another node \
                 acknowledges frames (cable, bit rate, termination)",
            ),
            (_, Some(NmtState::Stopped), _) => f.write_str(
                "By its last heartbeat, or the last NMT command to it, it is stopped, where SDO does not exist: send NMT \
                 pre-operational or start. Some drives' heartbeats say so in an alarm: then check supply and cable",
            ),
            (_, _, Some(age)) => write!(
                f,
                "It was last heard {} ms ago: check whether it has lost its supply or its cable, or is too busy to \
                 answer in time",
                age.as_millis()
            ),
            (_, _, None) if self.others => f.write_str(
                "Other nodes are on the bus but this one has never been heard: check its node-ID and its supply \
                 (a scan shows who is there); if it is in the NMT state stopped, it answers after NMT start",
            ),
            (_, _, None) => {
                f.write_str(
                "Nothing at all has been heard on the bus: check supply, cable, termination and bit rate; if the node is \
                 in the NMT state stopped, it answers after NMT start",
            )
            }
        }
    }
}

fn list(items: &[impl fmt::Display]) -> String {
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// What to do about an abort code.
fn advice(code: AbortCode, access: Access) -> &'static str {
    match code {
        AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX => {
            "This model has no such object: check index and \
             sub-index against its object dictionary"
        }
        AbortCode::READ_ONLY => "The object can only be read",
        AbortCode::WRITE_ONLY => "The object can only be written",
        AbortCode::INVALID_VALUE | AbortCode::VALUE_TOO_HIGH | AbortCode::VALUE_TOO_LOW => {
            "Give a value within the limits of its object dictionary"
        }
        AbortCode::LENGTH_MISMATCH | AbortCode::TOO_LONG | AbortCode::TOO_SHORT => {
            "The value was sent with another length than the object has: check its data type"
        }
        AbortCode::NOT_MAPPABLE | AbortCode::PDO_TOO_LONG => "Map other objects, or fewer of them, into this PDO",
        AbortCode::DEVICE_STATE | AbortCode::LOCAL_CONTROL | AbortCode::CANNOT_TRANSFER => {
            "The drive does not accept this in its present state: look at its statusword, and try it disabled"
        }
        AbortCode::UNSUPPORTED_ACCESS => match access {
            Access::Read => "The object cannot be read now",
            Access::Write => "The object cannot be changed now: a PDO mapping may have to be disabled first",
        },
        AbortCode::HARDWARE_ERROR => "The drive's parameter memory may be faulty",
        _ => "Look the code up in the drive's manual",
    }
}
