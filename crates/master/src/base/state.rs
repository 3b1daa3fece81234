//! Why a base was stopped.

use core::fmt;
use core::time::Duration;

use canopen::NodeId;

use crate::cyclic::Refusal;

/// Why a base was stopped. A drive's cause stays until the base is enabled anew; a watchdog's until the next twist.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StopCause {
    /// A drive did not do what it was told: a fault, a loss.
    Wheel {
        /// Its node.
        node: NodeId,
        /// What its drive says.
        refusal: Refusal,
    },
    /// No new twist came.
    Watchdog {
        /// For how long the last one counted.
        after: Duration,
    },
}

impl fmt::Display for StopCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Wheel { node, refusal } => write!(f, "the base was stopped by its wheel, node {node}: {refusal}"),
            Self::Watchdog { after } => {
                write!(f, "the base was stopped: no new twist came for {} ms", after.as_millis())
            }
        }
    }
}
