//! Why a base was stopped.

use core::fmt;
use core::time::Duration;

use canopen::NodeId;

use crate::cyclic::Refusal;

/// Why a base was stopped. A wheel's cause stays until the base is enabled anew; a watchdog's until the next twist.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StopCause {
    /// A drive did not follow its command: a fault, a loss.
    Wheel {
        /// Its node.
        node: NodeId,
        /// What its drive says.
        refusal: Refusal,
    },
    /// A wheel lags behind its commanded way.
    Lag {
        /// Its node.
        node: NodeId,
        /// How far, over the ground, in m; below 0 it is ahead.
        lag_m: f64,
        /// How far it may.
        limit_m: f64,
    },
    /// No new twist came.
    Watchdog {
        /// For how long the last one counted.
        after: Duration,
    },
}

impl StopCause {
    /// The node whose wheel is the cause: such a cause stays until the base is enabled anew.
    pub const fn wheel(&self) -> Option<NodeId> {
        match self {
            Self::Wheel { node, .. } | Self::Lag { node, .. } => Some(*node),
            Self::Watchdog { .. } => None,
        }
    }
}

impl fmt::Display for StopCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Wheel { node, refusal } => write!(f, "the base was stopped by its wheel, node {node}: {refusal}"),
            Self::Lag { node, lag_m, limit_m } => write!(
                f,
                "the base was stopped: its wheel, node {node}, lags {lag_m:.2} m behind its command; at most {limit_m:.2} m is allowed \
                 (lag_m). It may be blocked, or its load too heavy"
            ),
            Self::Watchdog { after } => {
                write!(f, "the base was stopped: no new twist came for {} ms", after.as_millis())
            }
        }
    }
}
