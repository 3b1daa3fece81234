//! What a case works with: frames out and in, SDO frame by frame, and the way back from all that it changed.

mod axis;
mod nmt;
mod pdo;
mod restore;
mod sdo;

use std::collections::VecDeque;
use std::time::Duration;

use can::{BusFrame, CanId, Frame, Instant};
use canopen::NodeId;
use canopen::connection_set::{self, Service};
use master::Network;

pub(crate) use axis::{CHANGE, MOTION};
pub(crate) use pdo::{Tpdo, another, entry, is_mappable};
pub use restore::Restorer;
pub(crate) use sdo::{SdoResult, hex, refused};

use crate::capture::Capture;
use crate::finding::Finding;
use crate::options::Options;
use crate::subject::Subject;

/// Frames that a result shows: the last ones that were about the node.
const EVIDENCE: usize = 16;
/// And those of single findings before.
const PINNED: usize = 24;

/// How long nothing must come where nothing may come: longer than devices take to answer.
pub(crate) const SILENCE: Duration = Duration::from_millis(150);

/// Milliseconds.
pub(crate) const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

/// The data frames of an identifier since a case began to count them.
#[derive(Debug)]
struct Counting {
    id: CanId,
    at: Vec<Instant>,
    last: Option<Frame>,
}

/// A node on a bench.
#[derive(Debug)]
pub(crate) struct Bench {
    pub(crate) network: Network,
    pub(crate) subject: Subject,
    /// What the memory of the device has may change for a time.
    pub(crate) allow_store: bool,
    /// Longest wait for the answer to a frame.
    pub(crate) timeout: Duration,
    pub(crate) restorer: Restorer,
    capture: Capture,
    evidence: VecDeque<Frame>,
    pinned: Vec<Frame>,
    watched: Vec<CanId>,
    counting: Option<Counting>,
    /// Identifiers of the SDO server that is asked: request and reply.
    server: (CanId, CanId),
}

impl Bench {
    pub(crate) fn new(network: Network, capture: Capture, subject: Subject, options: &Options) -> Self {
        let Options { timeout, allow_store, .. } = *options;
        let restorer = Restorer::new(network.node(subject.node).with_timeout(timeout), subject);
        let (evidence, pinned, watched) = (VecDeque::new(), Vec::new(), Vec::new());
        let server = default_server(subject.node);
        Self {
            network,
            subject,
            allow_store,
            timeout,
            restorer,
            capture,
            evidence,
            pinned,
            watched,
            counting: None,
            server,
        }
    }

    pub(crate) const fn node(&self) -> NodeId {
        self.subject.node
    }

    /// A case begins.
    pub(crate) fn begin(&mut self) {
        self.absorb();
        self.evidence.clear();
        self.pinned.clear();
        self.watched.clear();
        self.counting = None;
        self.server = default_server(self.node());
    }

    /// SDO requests go to this server from now on, until the case ends: identifiers of its requests and replies.
    pub(crate) fn ask_server(&mut self, server: (CanId, CanId)) {
        self.watch(server.1);
        self.server = server;
    }

    /// The frames that show what was seen, in candump form.
    pub(crate) fn evidence(&mut self) -> Vec<String> {
        self.absorb();
        let frames = self.pinned.drain(..).chain(self.evidence.drain(..));
        frames.map(|frame| frame.to_string()).collect()
    }

    /// What the last frames show is kept: a finding among others.
    pub(crate) fn pin(&mut self) {
        self.absorb();
        let last = self.evidence.len().saturating_sub(4);
        let room = PINNED.saturating_sub(self.pinned.len());
        self.pinned.extend(self.evidence.drain(last..).take(room));
        self.evidence.clear();
    }

    /// Frames with this identifier are evidence too.
    pub(crate) fn watch(&mut self, id: CanId) {
        self.watched.push(id);
    }

    /// Sends a frame as it is.
    pub(crate) fn send(&self, frame: Frame) {
        self.network.transmit(frame);
    }

    pub(crate) fn now(&self) -> Instant {
        self.network.now()
    }

    /// The next frame of others that `wanted` takes, within a time.
    pub(crate) async fn wait_for(
        &mut self,
        within: Duration,
        mut wanted: impl FnMut(&Frame) -> bool,
    ) -> Option<BusFrame> {
        let end = self.now() + within;
        while let Some(passed) = self.next(end).await {
            if !passed.own && wanted(&passed.frame) {
                return Some(passed);
            }
        }
        None
    }

    /// All frames of others that `wanted` takes, for a time.
    pub(crate) async fn collect(&mut self, during: Duration, mut wanted: impl FnMut(&Frame) -> bool) -> Vec<BusFrame> {
        let end = self.now() + during;
        let mut found = Vec::new();
        while let Some(passed) = self.next(end).await {
            if !passed.own && wanted(&passed.frame) {
                found.push(passed);
            }
        }
        found
    }

    /// Lets time pass.
    pub(crate) async fn pause(&mut self, during: Duration) {
        self.collect(during, |_| false).await;
    }

    /// Counts the data frames of an identifier from now on, whatever else the case waits for.
    pub(crate) fn count(&mut self, id: CanId) {
        self.absorb();
        self.counting = Some(Counting { id, at: Vec::new(), last: None });
    }

    /// How many came.
    pub(crate) fn counted(&mut self) -> usize {
        self.absorb();
        self.counting.as_ref().map_or(0, |counting| counting.at.len())
    }

    /// When they came: also those that came while an answer was waited for.
    pub(crate) fn counted_at(&mut self) -> Vec<Instant> {
        self.absorb();
        self.counting.as_ref().map(|counting| counting.at.clone()).unwrap_or_default()
    }

    /// The last of them.
    pub(crate) fn last_counted(&mut self) -> Option<Frame> {
        self.absorb();
        self.counting.as_ref().and_then(|counting| counting.last)
    }

    /// Takes what has come.
    pub(crate) fn absorb(&mut self) {
        while let Some(passed) = self.capture.take() {
            self.note(&passed);
        }
    }

    /// The identifier of the node's EMCY, as delivered.
    pub(crate) fn emcy_id(&self) -> CanId {
        connection_set::emcy(self.node())
    }

    async fn next(&mut self, end: Instant) -> Option<BusFrame> {
        let passed = self.capture.next(&self.network, end).await?;
        self.note(&passed);
        Some(passed)
    }

    fn note(&mut self, passed: &BusFrame) {
        let id = passed.frame.id();
        let of_node = match Service::of(id) {
            Some(Service::Heartbeat(node) | Service::SdoReply(node) | Service::Emcy(node)) => node == self.node(),
            _ => id.as_standard().is_some_and(|id| id > 0x180 && id & 0x7F == u16::from(self.node().raw())),
        };
        if let Some(counting) = &mut self.counting
            && counting.id == id
            && !passed.own
            && !passed.frame.is_remote()
        {
            counting.at.push(passed.at);
            counting.last = Some(passed.frame);
        }
        if !passed.own && !of_node && !self.watched.contains(&id) {
            return;
        }
        if self.evidence.len() == EVIDENCE {
            self.evidence.pop_front();
        }
        self.evidence.push_back(passed.frame);
    }
}

/// The server that every node has, 1200h.
pub(crate) fn default_server(node: NodeId) -> (CanId, CanId) {
    (connection_set::sdo_request(node), connection_set::sdo_reply(node))
}

/// Ends a case: the node was expected to send something.
pub(crate) fn silent<T>(what: &str, within: Duration) -> Result<T, Finding> {
    Err(Finding::Fail(format!("{what}: nothing came within {} ms", within.as_millis())))
}
