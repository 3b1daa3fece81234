//! Why a group cannot be made, or did not do what it should.

use core::time::Duration;

use canopen::{Mux, NodeId};
use cia402::ModeOfOperation;

use super::limits::PathError;
use super::state::{Phase, StopCause};
use crate::cyclic::{Bound, CyclicError, NotAtRest};
use crate::error::Error;
use crate::network::NoCycle;
use crate::units::Shown;

/// Periods that are taken: below, no bus carries a drive's frames; above, drives that interpolate do not wait so long.
pub(super) const PERIODS: core::ops::RangeInclusive<Duration> = Duration::from_micros(500)..=Duration::from_millis(100);

/// Why a group cannot be made, or did not do what it should.
#[derive(Clone, Debug, thiserror::Error)]
pub enum GroupError {
    /// An axis was not seen to come to rest.
    #[error(transparent)]
    NotAtRest(#[from] NotAtRest),
    /// A group without axes.
    #[error("a group needs at least one axis")]
    NoAxis,
    /// The drives are on several networks, which no SYNC joins.
    #[error("the axes of a group have to be on one network: node {node} is on another than the first axis")]
    OtherNetwork {
        /// The node.
        node: NodeId,
    },
    /// Another group or base has the axis.
    #[error(
        "node {node} ({controlword}) already belongs to a group: an axis follows one at a time. Close the other one first"
    )]
    Taken {
        /// The node.
        node: NodeId,
        /// Its controlword: which axis it is.
        controlword: Mux,
    },
    /// The drive takes no set-point in each cycle.
    #[error("node {node} has no mode in which it could be an axis of a group: csp, ip, csv or pv")]
    NoMode {
        /// The node.
        node: NodeId,
    },
    /// A period that cannot be held.
    #[error("a period of {} ms is out of range: expected {} to {} ms", ms(*given), ms(*PERIODS.start()), ms(*PERIODS.end()))]
    Period {
        /// What was given.
        given: Duration,
    },
    /// The limit is more than the drive does.
    #[error(
        "axis {axis}, node {node}: a velocity of {} r/min was stated as its limit, and the drive does {} r/min at most, by \
         {bound}. Lower the limit", Shown(*stated_rpm), Shown(*most_rpm)
    )]
    BeyondDrive {
        /// Which axis, from 1.
        axis: usize,
        /// Its node.
        node: NodeId,
        /// What was stated.
        stated_rpm: f64,
        /// What the drive does.
        most_rpm: f64,
        /// Where that stands.
        bound: Bound,
    },
    /// The mode has no position or speed as its set-point, or the drive does not show where it is.
    #[error(
        "axis {axis}, node {node}, cannot follow a path in mode {mode}: that takes a mode for positions or speeds, and a TPDO \
         with the position actual value that comes each cycle"
    )]
    NoPosition {
        /// Which axis, from 1.
        axis: usize,
        /// Its node.
        node: NodeId,
        /// The mode.
        mode: ModeOfOperation,
    },
    /// A path or a limit is wrong.
    #[error("{}{error}", node.map(|node| format!("node {node}: ")).unwrap_or_default())]
    Path {
        /// The node of the axis that it is about, where it is about one.
        node: Option<NodeId>,
        /// What is wrong.
        error: PathError,
    },
    /// The group was stopped.
    #[error("{0}")]
    Stopped(StopCause),
    /// It has to be in another phase.
    #[error("the group is {phase}: {remedy}")]
    Phase {
        /// What it is doing.
        phase: Phase,
        /// What to do.
        remedy: &'static str,
    },
    /// An option of a stream that bounds nothing, or that cannot be met.
    #[error(
        "a stream's {option} of {given} is out of range, expected {least} to {most}: nothing is moved. Cycles without a point are bounded by \
         100 ms, and points that are waited for by the capacity"
    )]
    StreamOption {
        /// The name of the option.
        option: &'static str,
        /// What was given.
        given: usize,
        /// The smallest that is taken.
        least: usize,
        /// The largest that is taken.
        most: usize,
    },
    /// The stream has no room.
    #[error("the stream has no room for a further point: wait for the next cycle, or give it a larger capacity")]
    StreamFull,
    /// The drives were not enabled in time.
    #[error("axis {axis}, node {node}, was not enabled within {} s: {shows}", limit.as_secs())]
    NotEnabled {
        /// Which axis, from 1.
        axis: usize,
        /// Its node.
        node: NodeId,
        /// How long it was waited for.
        limit: Duration,
        /// What it shows.
        shows: String,
    },
    /// A shaft is not where its path has ended.
    #[error(
        "axis {axis}, node {node}, is {} deg from its set-point, {} s after its last set-point: it is held back, or its drive lost \
         set-points", Shown(*error_turns * 360.0), waited.as_secs_f64()
    )]
    NotReached {
        /// Which axis, from 1.
        axis: usize,
        /// Its node.
        node: NodeId,
        /// How far, in turns.
        error_turns: f64,
        /// How long it was waited for.
        waited: Duration,
    },
    /// An axis did not find its reference. Those that searched beside it were stopped.
    #[error("axis {axis} did not find its reference: {source}")]
    Homing {
        /// Which axis, from 1.
        axis: usize,
        /// Its node.
        node: NodeId,
        /// What its drive says.
        source: Error,
    },
    /// A drive cannot be moved cycle by cycle.
    #[error(transparent)]
    Cyclic(#[from] CyclicError),
    /// A request failed.
    #[error(transparent)]
    Drive(#[from] Error),
    /// There is no next cycle.
    #[error(transparent)]
    NoCycle(#[from] NoCycle),
}

impl GroupError {
    /// What is wrong with a path or a limit of a group whose axes are at these nodes, in its order.
    pub fn of_path(error: PathError, nodes: impl IntoIterator<Item = NodeId>) -> Self {
        let axis = error.axis().and_then(|axis| axis.checked_sub(1));
        Self::Path { node: axis.and_then(|axis| nodes.into_iter().nth(axis)), error }
    }

    /// What a drive said, where that is why.
    pub const fn of_drive(&self) -> Option<&Error> {
        match self {
            Self::Drive(error) | Self::Homing { source: error, .. } => Some(error),
            Self::Cyclic(error) => error.of_drive(),
            _ => None,
        }
    }
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}
