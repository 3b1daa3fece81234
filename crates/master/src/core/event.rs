use core::fmt;
use std::collections::VecDeque;
use std::time::Duration;

use can::Instant;
use canopen::emcy::Emcy;
use canopen::{AbortCode, Mux, NmtState, NodeId};

use super::supervision::CycleLoss;
use super::twins::Twins;
use crate::host_loss::HostLoss;

/// Something that happened on the bus and that a person may want to know. Pulled with [`super::Core::poll_event`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A node sent its boot-up message.
    BootUp(NodeId),
    /// A node's heartbeat shows another state than before.
    NmtState(NodeId, NmtState),
    /// A watched heartbeat, or the answer to node guarding, has not come for this long.
    HeartbeatLost(NodeId, Silence),
    /// It has come back.
    HeartbeatBack(NodeId),
    /// A node sent an emergency message.
    Emcy(NodeId, Emcy),
    /// A node did not answer an SDO request in this time.
    NoAnswer(NodeId, Mux, Duration),
    /// Two devices have this node-ID.
    TwoDevices(NodeId, Twins),
    /// A node aborted an SDO request.
    Aborted(NodeId, Mux, AbortCode),
    /// A node has answered SDO block transfer with 0504 0001h: long values are transferred segment by segment until it boots again.
    NoBlockTransfer(NodeId),
    /// So many periods directly before this one had no SYNC.
    CyclesMissed(u32),
    /// The SYNC of another producer stays away, for this long now.
    SyncLost(Duration),
    /// The SYNC of another producer has come back.
    SyncBack,
    /// A drive that was moved cycle by cycle has been stopped by this master.
    CyclicStopped(NodeId, CycleLoss),
    /// A drive is about to be moved cycle by cycle, and nothing stops it when this program dies.
    Unguarded(NodeId, HostLoss),
}

/// What has not come from a node that is watched, and for how long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Silence {
    /// Time since it was last heard.
    pub time: Duration,
    /// It was asked for, by node guarding; else it is a heartbeat.
    pub asked: bool,
}

/// `no heartbeat for 300 ms`, `no answer to node guarding for 300 ms`.
impl fmt::Display for Silence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = if self.asked { "answer to node guarding" } else { "heartbeat" };
        write!(f, "no {what} for {} ms", self.time.as_millis())
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BootUp(node) => write!(f, "node {node} booted"),
            Self::NmtState(node, state) => write!(f, "node {node} is {state}"),
            Self::HeartbeatLost(node, silence) => write!(f, "node {node}: {silence}"),
            Self::HeartbeatBack(node) => write!(f, "node {node}: it is heard again"),
            Self::Emcy(node, emcy) => write!(f, "node {node}: emergency {}", emcy.code),
            Self::NoAnswer(node, mux, time) => {
                write!(f, "node {node} did not answer about {mux} within {} ms", time.as_millis())
            }
            Self::TwoDevices(node, twins) => f.write_str(&two_devices(*node, *twins)),
            Self::NoBlockTransfer(node) => {
                write!(f, "node {node} has no SDO block transfer (0504 0001h): long objects take twice as many frames")
            }
            Self::CyclesMissed(1) => f.write_str("one cycle had no SYNC"),
            Self::CyclesMissed(cycles) => write!(f, "{cycles} cycles had no SYNC"),
            Self::SyncLost(time) => write!(f, "no SYNC for {} ms", time.as_secs_f64() * 1e3),
            Self::SyncBack => f.write_str("SYNC is back"),
            Self::CyclicStopped(node, loss) => write!(f, "node {node} was stopped: {loss}"),
            Self::Unguarded(node, loss) => write!(f, "node {node}: if this program dies, {loss}"),
            Self::Aborted(node, mux, code) => write!(f, "node {node} refused {mux}: {code}"),
        }
    }
}

/// That two devices have this node-ID, what speaks for it, and what to do.
pub fn two_devices(node: NodeId, twins: Twins) -> String {
    format!(
        "node {node}: {twins}: two devices have this node-ID, and both act on requests to either. Switch one off, and give the \
         other a node-ID of its own"
    )
}

/// How many events are kept until they are pulled; older ones are dropped first.
const EVENTS_KEPT: usize = 256;

/// Events not yet pulled, with the time of each.
#[derive(Clone, Debug, Default)]
pub(super) struct Events {
    queue: VecDeque<(Instant, Event)>,
}

impl Events {
    pub(super) fn push(&mut self, event: Event, now: Instant) {
        if self.queue.len() == EVENTS_KEPT {
            self.queue.pop_front();
        }
        self.queue.push_back((now, event));
    }

    pub(super) fn pop(&mut self) -> Option<(Instant, Event)> {
        self.queue.pop_front()
    }
}
