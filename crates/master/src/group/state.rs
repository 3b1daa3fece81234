//! What a group is doing, and why it stopped.

use core::fmt;

use canopen::NodeId;

use super::limits::degrees;
use crate::cyclic::Refusal;

/// What a group is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// No power.
    Off,
    /// Its drives are being enabled.
    Enabling,
    /// All axes have power and rest at their last set-points.
    Holding,
    /// On the way to a position.
    Moving,
    /// On a path that is given point by point.
    Streaming,
    /// Coming to rest, within the limits.
    Stopping,
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Off => "off",
            Self::Enabling => "being enabled",
            Self::Holding => "holding",
            Self::Moving => "moving",
            Self::Streaming => "streaming",
            Self::Stopping => "stopping",
        })
    }
}

/// Why the group was stopped. It stays until the group is switched off or goes on by command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StopCause {
    /// A drive did not follow its command: a fault, a loss, a refused set-point.
    Axis {
        /// Which axis, from 1.
        axis: usize,
        /// Its node.
        node: NodeId,
        /// What its drive says.
        refusal: Refusal,
    },
    /// A shaft is too far from its set-point.
    FollowingError {
        /// Which axis, from 1.
        axis: usize,
        /// Its node.
        node: NodeId,
        /// How far, in turns.
        error_turns: f64,
        /// How far is allowed.
        limit_turns: f64,
    },
    /// The producer of a stream gave no point.
    Underrun {
        /// For how many cycles it was waited for.
        cycles: u32,
    },
    /// The producer of a stream was late, and its path could not be joined again within the limits.
    OutOfReach {
        /// Cycles without a point.
        cycles: u32,
    },
    /// No path to rest was found from where the axes were: each drive was stopped by its own quick stop.
    NoPathToRest,
    /// It was asked for.
    Asked,
}

impl fmt::Display for StopCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Axis { axis, node, refusal } => {
                write!(f, "the group was stopped by axis {axis}, node {node}: {refusal}")
            }
            Self::FollowingError { axis, node, error_turns, limit_turns } => write!(
                f,
                "the group was stopped: axis {axis}, node {node}, is {} deg from its set-point, and {} are allowed: \
                 look whether it is blocked or overloaded, or allow more",
                degrees(*error_turns),
                degrees(*limit_turns)
            ),
            Self::Underrun { cycles } => write!(
                f,
                "the group was stopped: no point of its path came for {cycles} cycles. Give points earlier, or more \
                 of them before the start (prefill)"
            ),
            Self::OutOfReach { cycles } => write!(
                f,
                "the group was stopped: the points of its path came {cycles} cycles late, and joining it again would exceed the \
                 limits of speed or acceleration. Give points earlier, or more of them before the start (prefill)"
            ),
            Self::NoPathToRest => f.write_str(
                "the group was stopped by the quick stop (605Ah) of each of its drives, not along a path, since none to rest was \
                 found within its limits. Switch it off, check where its axes are, and enable it again",
            ),
            Self::Asked => f.write_str("the group was stopped by command"),
        }
    }
}

/// What a group shows after a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupState {
    /// What it is doing.
    pub phase: Phase,
    /// Why it was stopped, if it was.
    pub cause: Option<StopCause>,
    /// Cycles since it was opened that the program did not see, or that had no SYNC. The path waits for them.
    pub missed_cycles: u64,
}
