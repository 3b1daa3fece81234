//! Commands about the session itself and the bus as a whole, as JSON.

use canopen::NodeId;
use serde::Deserialize;

use super::fields;

/// What concerns the session, or the bus as a whole.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum SessionCommand {
    /// Shows that the session is there; required at least every [`crate::PRESENCE_SPAN`] from one that moves something.
    Alive {},
    /// Takes control if no session has it.
    TakeControl {},
    /// Asks for control.
    AskControl {},
    /// Hands control to a session.
    HandOver {
        /// Its number.
        to: u64,
    },
    /// Releases control.
    ReleaseControl {},
    /// Limits the speed of the motions of this session, in r/min; `null` removes the limit. Motions under way are stopped by a
    /// limit that is lower than before.
    LimitSpeed {
        /// Above 0.
        rpm: Option<f64>,
    },
    /// Quick-stops every drive. Open to all.
    StopAll {},
    /// Scans the bus for nodes.
    Scan {},
    /// Sends a frame as it is, `604#4041600000000000`. One that may set a drive in motion is refused, unless the program was started
    /// with leave for it.
    SendFrame {
        /// In the form of candump: identifier, `#`, data.
        frame: String,
    },
    /// Carries out a line of the command line, `move 4 90deg`: with what it says, and the status that it ends with.
    Console {
        /// The words of a command, without the program's name.
        line: String,
    },
    /// Explains a term that the state has.
    Help {
        /// The node that has it, for terms of its model.
        #[serde(default, deserialize_with = "fields::node_or_null")]
        node: Option<NodeId>,
        /// The kind of term.
        topic: Topic,
        /// The term.
        name: String,
    },
}

impl SessionCommand {
    pub(super) const WORDS: &[&str] = &[
        "alive",
        "take_control",
        "ask_control",
        "hand_over",
        "release_control",
        "limit_speed",
        "stop_all",
        "scan",
        "send_frame",
        "console",
        "help",
    ];

    /// Whether it needs control.
    pub(super) const fn needs_control(&self) -> bool {
        matches!(self, Self::SendFrame { .. })
    }
}

/// What concerns the world around virtual drives.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum WorldCommand {
    /// Lists the commands to the world around virtual drives.
    WorldForms {},
    /// Reads the true state of the world around virtual drives, and its changes.
    LookAround {
        /// The changes after the one with this number.
        after: Option<u64>,
    },
    /// Changes the world around virtual drives.
    ChangeWorld {
        /// A command of `ferrodrive sim`.
        line: String,
    },
}

impl WorldCommand {
    pub(super) const WORDS: &[&str] = &["world_forms", "look_around", "change_world"];

    /// Whether it changes the world.
    pub(super) const fn needs_control(&self) -> bool {
        matches!(self, Self::ChangeWorld { .. })
    }
}

/// The kind of a term to be explained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Topic {
    /// An object, `6040h:00`.
    Object,
    /// A state of the power state machine.
    State,
    /// A bit of the statusword.
    StatusBit,
    /// A bit of the controlword.
    ControlBit,
    /// A mode of operation.
    Mode,
    /// An NMT state.
    Nmt,
    /// A service of CANopen, or a kind of timeline entry.
    Service,
    /// A fault or an alarm, by its name.
    Fault,
}
