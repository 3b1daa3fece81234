use std::collections::VecDeque;
use std::time::Duration;

use can::Instant;
use canopen::NmtState;
use canopen::emcy::Emcy;

/// How many emergency messages are kept for each node.
const EMCY_KEPT: usize = 8;

/// What has been seen of one node on the bus, without asking it.
#[derive(Clone, Debug, Default)]
pub struct NodeFacts {
    /// State of its last boot-up or heartbeat message.
    pub nmt_state: Option<NmtState>,
    /// When its last boot-up message came, and how many have come.
    pub boot_up: Option<(Instant, u32)>,
    /// When its last heartbeat or boot-up message came.
    pub heartbeat_at: Option<Instant>,
    /// When any frame of its predefined connection set came (CiA 301, 7.3.3).
    pub seen_at: Option<Instant>,
    /// The heartbeat that is expected of it, if it is being watched.
    pub heartbeat_watch: Option<HeartbeatWatch>,
    /// SDO requests in a row that it has not answered.
    pub unanswered: u32,
    emcys: VecDeque<(Instant, Emcy)>,
}

/// Watch over a node's heartbeat. Source: CiA 301, 7.2.8.2.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeartbeatWatch {
    /// Longest time without a heartbeat.
    pub time: Duration,
    /// When the heartbeat counts as lost; `None` until the first one has come, and once it is lost.
    pub deadline: Option<Instant>,
    /// The heartbeat has been lost and has not come back.
    pub lost: bool,
}

impl NodeFacts {
    /// The emergency messages kept, oldest first, with the time each came.
    pub fn emcys(&self) -> impl DoubleEndedIterator<Item = &(Instant, Emcy)> {
        self.emcys.iter()
    }

    /// The newest emergency message.
    pub fn last_emcy(&self) -> Option<&(Instant, Emcy)> {
        self.emcys.back()
    }

    /// Time since the last heartbeat or boot-up message.
    pub fn heartbeat_age(&self, now: Instant) -> Option<Duration> {
        self.heartbeat_at.map(|at| now - at)
    }

    pub(super) fn push_emcy(&mut self, emcy: Emcy, now: Instant) {
        if self.emcys.len() == EMCY_KEPT {
            self.emcys.pop_front();
        }
        self.emcys.push_back((now, emcy));
    }

    /// Notes a heartbeat; true if a lost one has come back.
    pub(super) fn note_heartbeat(&mut self, now: Instant) -> bool {
        self.heartbeat_at = Some(now);
        let Some(watch) = &mut self.heartbeat_watch else { return false };
        watch.deadline = Some(now + watch.time);
        core::mem::take(&mut watch.lost)
    }

    /// True once when the watched heartbeat has not come in time.
    pub(super) fn check_heartbeat(&mut self, now: Instant) -> bool {
        let Some(watch) = &mut self.heartbeat_watch else { return false };
        if watch.deadline.is_none_or(|deadline| deadline > now) {
            return false;
        }
        watch.deadline = None;
        watch.lost = true;
        true
    }
}
