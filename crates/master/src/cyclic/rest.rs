//! What is said of drives that were to come to rest.

use core::time::Duration;

use canopen::NodeId;

use super::drive::CyclicDrive;
use crate::core::NodeSet;
use crate::drive::Stopped;
use crate::error::Error;
use crate::units::Shown;

/// How long after its last set-point a shaft may take to show that it stands.
const REST_LIMIT: Duration = Duration::from_secs(2);

/// Why a drive that was to come to rest was not seen to stand.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NotAtRest {
    /// It turns.
    #[error(
        "node {node} still turns at {} r/min, {limit:?} after it was to stand: its load drives it, as one that pulls does without power, or \
         it does not follow. Without power a brake alone holds it, or `enable {node}`; with power the emergency stop takes it", Shown(*rpm)
    )]
    StillTurns {
        /// The node.
        node: NodeId,
        /// Its speed, in r/min of the output.
        rpm: f64,
        /// How long it was waited for.
        limit: Duration,
    },
    /// Its drive is not heard, or shows neither speed nor position.
    #[error(
        "node {node} was not seen to stand: it may still be moving. It stops by its own watch over its host, if it has one; take its power \
         by the emergency stop if it must not move"
    )]
    NotSeen {
        /// The node.
        node: NodeId,
    },
    /// Its power stage is on.
    #[error(
        "node {node} still has power, {limit:?} after it was to lose it: it holds its shaft, or another master commands it. `estop` stops it \
         whatever commands it"
    )]
    StillPowered {
        /// The node.
        node: NodeId,
        /// How long it was waited for.
        limit: Duration,
    },
}

impl NotAtRest {
    /// Which node it is about.
    pub const fn node(&self) -> NodeId {
        match self {
            Self::StillTurns { node, .. } | Self::NotSeen { node } | Self::StillPowered { node, .. } => *node,
        }
    }
}

impl CyclicDrive {
    /// Whether its shaft was seen to stand for 50 ms, and for as long anew without power where it had power until then. `None`
    /// before that, while it was waited for less than two seconds.
    pub fn at_rest(&self, waited: Duration) -> Option<Result<(), NotAtRest>> {
        at_rest([self], waited)
    }
}

/// What became of drives that were to stand so long ago: `None` while it is not known, `Ok` once all were seen to stand.
pub(crate) fn at_rest<'a>(
    drives: impl IntoIterator<Item = &'a CyclicDrive>,
    waited: Duration,
) -> Option<Result<(), NotAtRest>> {
    let Some(drive) = drives.into_iter().find(|drive| !drive.progress.standstill.stands()) else { return Some(Ok(())) };
    let node = drive.node();
    let why = match drive.progress.standstill.turned_rpm {
        Some(rpm) => NotAtRest::StillTurns { node, rpm, limit: REST_LIMIT },
        None => NotAtRest::NotSeen { node },
    };
    (waited >= REST_LIMIT).then_some(Err(why))
}

/// Whether all were seen to stand when they were asked by SDO at the end of their cycles. A drive that is `unheard` there sends no TPDO,
/// as one that another master has taken to pre-operational: it may well be among those that are `answering`.
pub(crate) fn seen_to_stand<E>(stopped: Vec<Stopped>, unheard: NodeSet, answering: NodeSet) -> Result<(), E>
where
    E: From<Error> + From<NotAtRest>,
{
    if let Some(node) = unheard.iter().find(|node| !answering.contains(*node)) {
        return Err(NotAtRest::NotSeen { node }.into());
    }
    stopped.into_iter().try_for_each(|stopped| stopped.outcome.map(drop))?;
    Ok(())
}
