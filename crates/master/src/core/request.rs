use std::time::Duration;

use can::{CanId, Frame};
use canopen::nmt::NmtTarget;
use canopen::sdo::client;
use canopen::{AbortCode, Mux, NmtCommand, NodeId, connection_set};

use super::payload::Payload;

/// Names a request or a timer until it has finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ticket(pub u64);

/// What an SDO request does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Transfer {
    /// Read an object.
    Upload,
    /// Write an object with these bytes.
    Download(Payload),
}

/// One SDO request to one node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    /// The node asked.
    pub node: NodeId,
    /// The object asked for.
    pub mux: Mux,
    /// What to do with it.
    pub transfer: Transfer,
    /// Longest wait for each frame of the answer.
    pub timeout: Duration,
}

/// What the core can be asked to do. A command is plain data; the time comes with [`super::Core::execute`].
#[derive(Clone, Debug)]
pub enum Command {
    /// Queue an SDO request; it finishes under the ticket.
    Request(Ticket, Request),
    /// Fire the ticket after this long.
    Timer(Ticket, Duration),
    /// Forget a request (an SDO abort goes out if it was on the wire) or a timer.
    Cancel(Ticket),
    /// Send an NMT command.
    Nmt(NmtTarget, NmtCommand),
    /// Produce SYNC with this period, or stop.
    Sync(Option<Duration>),
    /// Let each SYNC that is produced carry a counter from 1 to this, as 1019h; 0 for none.
    SyncCounter(u8),
    /// Count the SYNCs that another node produces with this period, or stop.
    FollowSync(Option<Duration>),
    /// Expect a heartbeat of the node at least this often, or stop watching.
    WatchHeartbeat(NodeId, Option<Duration>),
    /// Ask the node for its state each guard time by a remote frame, and expect an answer at least once in as many of them as the
    /// life time factor says (0 is as 1), in place of a heartbeat. [`WatchHeartbeat`](Self::WatchHeartbeat) ends it. Source: CiA 301, 7.2.8.2.1.
    WatchByGuarding(NodeId, Duration, u8),
    /// Produce this master's heartbeat under a node-ID with this period in whole ms, or stop. One that would come later than the
    /// last time allows, if there is one, is not sent, nor any after it. Source: CiA 301, 7.2.8.3.2.1.
    Heartbeat(NodeId, Option<Duration>, Option<Duration>),
    /// Ask the node for its statusword (6041h) whenever nothing else was sent to it for this long, or stop; not after it was left
    /// without a frame for the last time, if there is one.
    KeepFed(NodeId, Option<Duration>, Option<Duration>),
    /// From the next request on, ask this SDO server of the node.
    UseSdoServer(NodeId, SdoServer),
    /// Send a frame as it is.
    Transmit(Frame),
}

/// Identifiers of one of a node's SDO servers: the default one (1200h), or a further one (1201h to 127Fh). Source: CiA 301, 7.5.2.33.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SdoServer {
    /// From the client to the server.
    pub request: CanId,
    /// And back.
    pub reply: CanId,
}

impl SdoServer {
    /// That of the predefined connection set.
    pub const fn default_of(node: NodeId) -> Self {
        Self { request: connection_set::sdo_request(node), reply: connection_set::sdo_reply(node) }
    }
}

impl Command {
    /// The ticket of a request or timer to be started.
    pub const fn ticket(&self) -> Option<Ticket> {
        match self {
            Self::Request(ticket, _) | Self::Timer(ticket, _) => Some(*ticket),
            _ => None,
        }
    }
}

/// How a request or timer ended. A timer ends with no bytes.
pub type Outcome = Result<Payload, Failure>;

/// Why a request failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The node did not answer in time.
    NoAnswer {
        /// How long the last wait was.
        waited: Duration,
        /// True if the request never left the master.
        unsent: bool,
    },
    /// The node aborted the transfer.
    Aborted(AbortCode),
    /// The node's answer broke the protocol, and the master aborted.
    BadAnswer(client::Failure),
    /// The node's request queue was full.
    QueueFull,
}

/// A request or timer that has ended.
#[derive(Clone, Debug)]
pub struct Finished {
    /// Its ticket, as it was handed out when it began.
    pub ticket: Ticket,
    /// Its answer, its error or its end.
    pub outcome: Outcome,
}
