//! What clients of a hub do, and how they are distinguished.

use std::fmt;
use std::net::SocketAddr;

use can::Frame;

use crate::Protocol;

/// A client of a hub; never used twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ClientId(pub(super) u64);

impl ClientId {
    /// A client by its number, for a world that is moved without a hub.
    pub const fn of(number: u64) -> Self {
        Self(number)
    }
}

impl fmt::Display for ClientId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "client {}", self.0)
    }
}

/// Something that a client did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HubEvent {
    /// A client connected.
    Joined {
        /// The client.
        client: ClientId,
        /// The protocol that it came by, and where from; `None` for a bus that was joined ([`Hub::join`](super::Hub::join)).
        peer: Option<(Protocol, SocketAddr)>,
    },
    /// A client sends a frame. Answer it with [`Hub::broadcast`](super::Hub::broadcast) or [`Hub::discard`](super::Hub::discard), now or later.
    Frame {
        /// The client that sends it.
        client: ClientId,
        /// The frame.
        frame: Frame,
    },
    /// A client is gone. Its frames that came before still count.
    Left {
        /// The client.
        client: ClientId,
        /// Why its connection ended.
        reason: LeaveReason,
    },
}

/// Why a client is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeaveReason {
    /// It closed the connection, or asked for a bus that is not here.
    Closed,
    /// The connection broke.
    Broken,
    /// It did not read for so long that too many frames waited for it.
    TooSlow,
    /// It made room for another: it did not listen, or was silent for the longest, and there were too many.
    Displaced,
}
