//! What a drive does when the program that moves it dies, as data. Who arms a drive: [`crate::Drive::guard`].

use core::fmt;
use std::time::Duration;

use canopen::{Mux, NodeId};

/// What a drive does when the program that moves it dies in the middle of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostLoss {
    /// It stops when no frame for it has come for this long.
    StopsInSilence {
        /// The object that sets it.
        object: Mux,
        /// The time.
        time: Duration,
    },
    /// It stops when this program's heartbeat has stayed away for this long.
    StopsWithoutHeartbeat {
        /// The object that sets it.
        object: Mux,
        /// The node-ID whose heartbeat it is.
        host: NodeId,
        /// The time.
        time: Duration,
    },
    /// It goes on: its watch for a heartbeat is armed by the first one, and this program sends none.
    NotArmed {
        /// The object that sets the watch.
        object: Mux,
    },
    /// It goes on: its watch is set to 0.
    SwitchedOff {
        /// The object that sets the watch.
        object: Mux,
    },
    /// It goes on: it watches for the heartbeat of a node-ID that another device on the bus has.
    WatchesAnother {
        /// The object that sets the watch.
        object: Mux,
        /// That node-ID.
        host: NodeId,
    },
    /// It goes on: its model has no watch over its host.
    GoesOn,
}

impl HostLoss {
    /// After how long the drive stops by itself, if it does.
    pub const fn stops_after(self) -> Option<Duration> {
        match self {
            Self::StopsInSilence { time, .. } | Self::StopsWithoutHeartbeat { time, .. } => Some(time),
            _ => None,
        }
    }

    /// The object that sets the drive's watch over its host, if it has one.
    pub const fn object(self) -> Option<Mux> {
        match self {
            Self::StopsInSilence { object, .. }
            | Self::StopsWithoutHeartbeat { object, .. }
            | Self::NotArmed { object }
            | Self::SwitchedOff { object }
            | Self::WatchesAnother { object, .. } => Some(object),
            Self::GoesOn => None,
        }
    }
}

impl fmt::Display for HostLoss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StopsInSilence { object, time } => {
                write!(f, "it stops by itself {} ms after the last frame for it ({object})", time.as_millis())
            }
            Self::StopsWithoutHeartbeat { object, host, time } => {
                let ms = time.as_millis();
                write!(
                    f,
                    "it stops by itself {ms} ms after the last heartbeat of node {host}, which is this program ({object})"
                )
            }
            Self::NotArmed { object } => {
                write!(
                    f,
                    "nothing stops it: its watch over a host ({object}) is armed by heartbeats, and none are sent"
                )
            }
            Self::SwitchedOff { object } => write!(f, "nothing stops it: its watch over a host ({object}) is set to 0"),
            Self::WatchesAnother { object, host } => write!(
                f,
                "nothing of this program stops it: {object} has it watch node {host}, which is another device on this bus"
            ),
            Self::GoesOn => {
                f.write_str("nothing stops it: this model has no watch over its host and goes on as it was commanded")
            }
        }
    }
}

/// A drive that watches this program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ArmedGuard {
    pub(crate) loss: HostLoss,
    /// How often it needs a sign of life.
    pub(crate) period: Duration,
    /// What the watch's object had before.
    pub(crate) before: i64,
    /// What it has now.
    pub(crate) armed: i64,
}
