//! The master as a passive state machine (CiA 301): one SDO channel, NMT and heartbeat watch per node, SYNC, PDOs, and the
//! heartbeat by which drives notice that it lives.
//!
//! In: frames, time, and [`Command`]s that carry the time. Out: frames, deadlines, [`Finished`] requests and
//! [`Event`]s, all pulled. Up to 127 nodes are asked at once, one request per node on the wire, the others queued.
//! Nothing here waits: the async face is [`crate::Network`]. Drives are unknown here: see [`crate::drive`].

mod answers;
mod channel;
mod cycle;
mod event;
mod facts;
mod field;
mod frame_log;
mod image;
mod nmt;
mod node_set;
mod payload;
mod pdo_map;
mod presence;
mod process;
mod receive;
mod request;
mod supervision;
mod timers;
mod twins;

use std::collections::VecDeque;
use std::time::Duration;

use can::{CanId, Frame, Instant, Station};
use canopen::connection_set::Service;
use canopen::{Mux, NodeId};
use cia402::object::STATUSWORD;

pub use cycle::Cycle;
pub use event::{Event, Silence, two_devices};
pub use facts::{HeartbeatWatch, NodeFacts, OtherWrite};
pub(crate) use field::bits_of;
pub use field::{Field, NumberForm, Sample, SetPoint, Signal};
pub use frame_log::{FrameLogs, LoggedFrame};
pub use image::{ProcessImage, Received, RpdoTrigger};
pub use node_set::NodeSet;
pub use payload::Payload;
pub use pdo_map::PdoMap;
pub use request::{Command, Failure, Finished, Outcome, Request, SdoServer, Ticket, Transfer};
pub use supervision::CycleLoss;
pub(crate) use supervision::{Cadence, CycleRules, WatchId};
pub use twins::Twins;

use answers::Answers;
use channel::SdoQueue;
use cycle::SyncClock;
use event::Events;
use presence::Presence;
use supervision::Supervision;
use timers::Timers;

/// Frames that wait for [`Core::poll_transmit`] besides SDO, SYNC and PDO; a further one replaces the oldest.
const OUTBOX: usize = 128;

/// Names those questions; no caller waits for their answers. Other tickets count from 1.
const FEED: Ticket = Ticket(0);

/// Shortest wait for their answers: drives take some milliseconds, a loaded bus some tens more.
const SHORTEST_FEED_TIMEOUT: Duration = Duration::from_millis(50);

/// The sans-IO master. See the [module](self).
///
/// A core that is given no time cannot time out: call it as [`Station`] says.
#[derive(Clone, Debug)]
pub struct Core {
    now: Instant,
    members: Vec<Member>,
    /// The node that the last SDO frame went to.
    served: NodeId,
    /// Replies of servers that are not the default ones of their nodes.
    further_servers: Vec<(u16, NodeId)>,
    /// Nodes with a transfer on the wire.
    busy: NodeSet,
    /// Nodes whose SDO channel may have a frame to send.
    sending: NodeSet,
    /// Nodes whose facts changed since the last [`Core::take_changed`].
    changed: NodeSet,
    /// A cycle has begun or SYNC was lost since the last [`Core::take_cycle_change`].
    cycle_changed: bool,
    watched: NodeSet,
    /// No watched heartbeat is lost before this; it may be too early, never too late.
    heartbeat_check: Instant,
    /// The earliest of all deadlines; heartbeats may make it too early, never too late.
    due: Instant,
    image: ProcessImage,
    frame_logs: FrameLogs,
    /// Of the last frame: how long after it came it was handed over.
    lateness: Duration,
    sync: SyncClock,
    supervision: Supervision,
    /// Drives to stop, for the length of a call.
    lost: Vec<(CycleRules, CycleLoss)>,
    presence: Presence,
    timers: Timers,
    outbox: VecDeque<Frame>,
    finished: VecDeque<Finished>,
    events: Events,
    next_ticket: u64,
    /// This master has left the bus.
    silent: bool,
}

/// One node as the master sees it.
#[derive(Clone, Debug)]
struct Member {
    facts: NodeFacts,
    channel: SdoQueue,
    answers: Answers,
}

impl Default for Core {
    fn default() -> Self {
        Self::new()
    }
}

impl Core {
    /// A master that knows nothing of any node.
    pub fn new() -> Self {
        let member =
            |node| Member { facts: NodeFacts::default(), channel: SdoQueue::new(node), answers: Answers::default() };
        Self {
            now: Instant::ZERO,
            members: NodeId::all().map(member).collect(),
            served: NodeId::MAX,
            further_servers: Vec::new(),
            busy: NodeSet::EMPTY,
            sending: NodeSet::EMPTY,
            changed: NodeSet::EMPTY,
            cycle_changed: false,
            watched: NodeSet::EMPTY,
            heartbeat_check: Instant::FAR_FUTURE,
            due: Instant::FAR_FUTURE,
            image: ProcessImage::default(),
            frame_logs: FrameLogs::default(),
            lateness: Duration::ZERO,
            sync: SyncClock::default(),
            supervision: Supervision::default(),
            lost: Vec::new(),
            presence: Presence::default(),
            timers: Timers::default(),
            outbox: VecDeque::with_capacity(OUTBOX),
            finished: VecDeque::new(),
            events: Events::default(),
            next_ticket: 0,
            silent: false,
        }
    }

    /// Reads an object of a node by SDO. The ticket comes back from [`poll_finished`](Self::poll_finished).
    pub fn upload(&mut self, node: NodeId, mux: Mux, timeout: Duration, now: Instant) -> Ticket {
        self.request(Request { node, mux, transfer: Transfer::Upload, timeout }, now)
    }

    /// Writes an object of a node by SDO. The ticket comes back from [`poll_finished`](Self::poll_finished).
    pub fn download(&mut self, node: NodeId, mux: Mux, data: &[u8], timeout: Duration, now: Instant) -> Ticket {
        self.request(Request { node, mux, transfer: Transfer::Download(Payload::new(data)), timeout }, now)
    }

    /// Queues an SDO request.
    pub fn request(&mut self, request: Request, now: Instant) -> Ticket {
        let ticket = self.ticket();
        self.execute(Command::Request(ticket, request), now);
        ticket
    }

    /// A ticket that no other request or timer of this core has.
    pub const fn ticket(&mut self) -> Ticket {
        self.next_ticket += 1;
        Ticket(self.next_ticket)
    }

    /// Carries out one command at `now`.
    pub fn execute(&mut self, command: Command, now: Instant) {
        self.advance(now);
        match command {
            // Requests and timers end all the same, for the callers that wait for them.
            Command::Request(..) | Command::Timer(..) | Command::Cancel(_) => {}
            _ if self.silent => return,
            _ => {}
        }
        match command {
            Command::Request(ticket, request) => self.start_request(ticket, request),
            Command::Timer(ticket, after) => self.timers.arm(self.now + after, ticket),
            Command::Cancel(ticket) => self.cancel(ticket),
            Command::Nmt(target, command) => self.send_nmt(target, command),
            Command::Sync(period) => self.produce_sync(period),
            Command::SyncCounter(overflow) => self.sync.set_overflow(overflow),
            Command::FollowSync(period) => self.follow_sync(period),
            Command::WatchHeartbeat(node, time) => self.watch_heartbeat(node, time),
            Command::WatchByGuarding(node, period, factor) => self.watch_by_guarding(node, period, factor),
            Command::Heartbeat(node, period, allowed) => {
                self.presence.set_heartbeat(node, period, allowed, self.now);
                self.show_presence();
            }
            Command::KeepFed(node, period, allowed) => self.presence.set_feed(node, period, allowed, self.now),
            Command::UseSdoServer(node, server) => self.use_sdo_server(node, server),
            Command::Transmit(frame) => {
                // A request or an NMT command that is sent as a frame is followed by what follows any other.
                match Service::of(frame.id()) {
                    Some(Service::SdoRequest(node)) if !frame.is_remote() => {
                        self.member_mut(node).answers.asked(&frame, now);
                    }
                    Some(Service::Nmt) => self.handle_nmt(&frame),
                    _ => {}
                }
                self.push_frame(frame);
            }
        }
        self.find_due();
    }

    /// The next request or timer that has ended.
    pub fn poll_finished(&mut self) -> Option<Finished> {
        self.finished.pop_front()
    }

    /// The next event for people, with its time.
    pub fn poll_event(&mut self) -> Option<(Instant, Event)> {
        self.events.pop()
    }

    /// What has been seen of a node.
    pub fn facts(&self, node: NodeId) -> &NodeFacts {
        &self.member(node).facts
    }

    /// How many bytes of the SDO transfer on the wire to a node are done; `None` where there is none, or one of a single frame.
    pub fn bytes_done(&self, node: NodeId) -> Option<usize> {
        self.member(node).channel.bytes_done()
    }

    /// The nodes whose facts or PDOs have changed since the last call.
    pub const fn take_changed(&mut self) -> NodeSet {
        core::mem::replace(&mut self.changed, NodeSet::EMPTY)
    }

    /// Last values of mapped objects.
    pub const fn image(&self) -> &ProcessImage {
        &self.image
    }

    /// Last values of mapped objects, to change mappings and values to send.
    pub const fn image_mut(&mut self) -> &mut ProcessImage {
        &mut self.image
    }

    /// Frames that are kept one by one.
    pub const fn frame_logs_mut(&mut self) -> &mut FrameLogs {
        &mut self.frame_logs
    }

    /// The time of the bus up to which frames have been handed over: [`now`](Self::now), less how late the last one came.
    pub fn heard_until(&self) -> Instant {
        Instant::ZERO + (self.now - Instant::ZERO).saturating_sub(self.lateness)
    }

    /// The latest time that was passed to this core.
    pub const fn now(&self) -> Instant {
        self.now
    }

    fn start_request(&mut self, ticket: Ticket, request: Request) {
        let node = request.node;
        let now = self.now;
        if self.silent {
            let failure = Failure::NoAnswer { waited: Duration::ZERO, unsent: true };
            return self.finished.push_back(Finished { ticket, outcome: Err(failure) });
        }
        let blocks = self.may_use_blocks(node);
        match self.member_mut(node).channel.push(ticket, request, blocks, now) {
            Ok(()) => self.settle(node),
            Err(failure) => self.finished.push_back(Finished { ticket, outcome: Err(failure) }),
        }
    }

    fn cancel(&mut self, ticket: Ticket) {
        if self.timers.cancel(ticket) {
            return;
        }
        let now = self.now;
        let owner = self.busy.iter().find(|node| {
            let blocks = self.may_use_blocks(*node);
            self.member_mut(*node).channel.cancel(ticket, blocks, now)
        });
        if let Some(node) = owner {
            self.settle(node);
        }
    }

    /// What a frame is to this master, which may use other SDO servers than the default ones.
    fn service_of(&self, id: u16) -> Option<Service> {
        let further = self.further_servers.iter().find(|(reply, _)| *reply == id);
        further.map_or_else(|| Service::of(CanId::standard(id)), |(_, node)| Some(Service::SdoReply(*node)))
    }

    fn use_sdo_server(&mut self, node: NodeId, server: SdoServer) {
        self.member_mut(node).channel.use_server(server);
        self.forget_servers(node);
        if let Some(reply) = server.reply.as_standard().filter(|_| server != SdoServer::default_of(node)) {
            self.further_servers.retain(|(known, _)| *known != reply);
            self.further_servers.push((reply, node));
        }
    }

    /// Those that nothing is asked of any more: not before the request that is on the wire has ended.
    fn forget_servers(&mut self, node: NodeId) {
        let channel = &self.members[usize::from(node.raw()) - 1].channel;
        self.further_servers.retain(|(reply, of)| *of != node || channel.listens_to(CanId::standard(*reply)));
    }

    /// Not while SYNC is produced: the segments of a block wait for no answer, and a hundred of them would stand before SYNC and RPDOs
    /// in the queue of an adapter. Nor with a node that has refused them.
    fn may_use_blocks(&self, node: NodeId) -> bool {
        self.sync.period().is_none() && !self.member(node).facts.refuses_blocks
    }

    /// Collects what a node's channel has to say after it was called.
    fn settle(&mut self, node: NodeId) {
        let now = self.now;
        if self.member_mut(node).channel.take_refusal() {
            self.member_mut(node).facts.refuses_blocks = true;
            self.events.push(Event::NoBlockTransfer(node), now);
        }
        while let Some(ended) = self.member_mut(node).channel.poll_finished() {
            self.note_outcome(node, ended.mux, &ended.outcome);
            if ended.downloads {
                self.member_mut(node).facts.written_at = Some(now);
                if !matches!(ended.outcome, Err(Failure::Aborted(_))) {
                    self.image_mut().note_written(node, ended.mux.index);
                }
            }
            if ended.ticket != FEED {
                self.finished.push_back(Finished { ticket: ended.ticket, outcome: ended.outcome });
            }
            let blocks = self.may_use_blocks(node);
            self.member_mut(node).channel.start_next(blocks, now);
            self.forget_servers(node);
        }
        if self.member(node).channel.is_idle() {
            self.busy.remove(node)
        } else {
            self.busy.insert(node)
        }
        self.sending.insert(node);
    }

    /// Sends heartbeats that are due, and asks for the statusword of drives that would lose patience. A node that is being
    /// asked something already needs no question.
    fn show_presence(&mut self) {
        for (node, period) in self.presence.handle_timeout(self.now) {
            if !self.busy.contains(node) {
                let timeout = period.max(SHORTEST_FEED_TIMEOUT);
                self.start_request(FEED, Request { node, mux: STATUSWORD, transfer: Transfer::Upload, timeout });
            }
        }
    }

    /// Finds the earliest deadline, after anything that may have moved one.
    fn find_due(&mut self) {
        let mut due = self.heartbeat_check;
        for node in self.busy.iter() {
            due = due.min(self.member(node).channel.poll_timeout().unwrap_or(Instant::FAR_FUTURE));
        }
        let others = [self.timers.next(), self.sync.next(), self.presence.next()];
        self.due = others.into_iter().flatten().fold(due, Instant::min);
    }

    /// This master sends nothing from now on, whatever it is asked.
    pub(crate) fn fall_silent(&mut self) {
        self.silent = true;
        self.sync.produce(None, self.now);
        self.cycle_changed = true;
        self.presence = Presence::default();
        self.image.fall_silent();
        self.outbox.clear();
        self.find_due();
    }

    /// How long this master was held up (its program was frozen, its machine asleep) beyond what the watch of this node allows
    /// its host: the drive has stopped for want of it, and is sent no sign of life that would have it go on.
    pub(crate) fn lapse(&self, node: NodeId) -> Option<Duration> {
        self.presence.lapse(node)
    }

    fn push_frame(&mut self, frame: Frame) {
        if self.outbox.len() == OUTBOX {
            self.outbox.pop_front();
        }
        self.outbox.push_back(frame);
    }

    /// Nodes take turns, frame by frame: a block of up to 127 segments to one keeps the others waiting for one of them.
    fn poll_sdo(&mut self) -> Option<Frame> {
        while let Some(node) = self.sending.next_after(self.served) {
            match self.member_mut(node).channel.poll_transmit() {
                Some(frame) => {
                    self.served = node;
                    self.presence.note_sent(node, self.now);
                    let now = self.now;
                    let member = self.member_mut(node);
                    member.facts.talked_to_at = Some(now);
                    if member.channel.is_default() {
                        member.answers.asked(&frame, now);
                    }
                    return Some(frame);
                }
                None => self.sending.remove(node),
            }
        }
        None
    }

    fn advance(&mut self, now: Instant) {
        self.now = self.now.max(now);
    }

    fn member(&self, node: NodeId) -> &Member {
        &self.members[usize::from(node.raw()) - 1]
    }

    fn member_mut(&mut self, node: NodeId) -> &mut Member {
        &mut self.members[usize::from(node.raw()) - 1]
    }
}

impl Station for Core {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        self.handle_stamped(frame, now, now);
    }

    fn handle_stamped(&mut self, frame: &Frame, at: Instant, now: Instant) {
        self.advance(now);
        self.lateness = now - at;
        let Some(id) = frame.standard_data_id() else { return };
        self.frame_logs.note(id, frame, at);
        if let Some(node) = self.image.handle_frame(id, frame, now) {
            self.member_mut(node).facts.seen_at = Some(now);
            self.changed.insert(node);
            return;
        }
        let node = match self.service_of(id) {
            Some(Service::SdoReply(node)) => {
                self.handle_sdo_reply(node, frame);
                node
            }
            Some(Service::Heartbeat(node)) => {
                self.handle_heartbeat(node, frame);
                node
            }
            Some(Service::Emcy(node)) => {
                self.handle_emcy(node, frame);
                node
            }
            // Another client's: the answer to it is not ours.
            Some(Service::SdoRequest(node)) => return self.handle_other_request(node, frame),
            Some(Service::Sync) => return self.handle_sync(),
            Some(Service::Nmt) => return self.handle_nmt(frame),
            _ => return,
        };
        self.member_mut(node).facts.seen_at = Some(now);
        self.changed.insert(node);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.advance(now);
        let now = self.now;
        if now < self.due {
            return;
        }
        for node in self.busy.iter() {
            let channel = &mut self.member_mut(node).channel;
            if channel.poll_timeout().is_some_and(|due| due <= now) {
                channel.handle_timeout(now);
                self.settle(node);
                self.changed.insert(node);
            }
        }
        while let Some(ticket) = self.timers.pop_due(now) {
            self.finished.push_back(Finished { ticket, outcome: Ok(Payload::EMPTY) });
        }
        self.count_cycle();
        self.show_presence();
        self.check_heartbeats();
        self.find_due();
    }

    /// NMT and other single frames, then SYNC, heartbeats, RPDOs, SDO.
    fn poll_transmit(&mut self) -> Option<Frame> {
        if self.silent {
            return None;
        }
        self.outbox
            .pop_front()
            .or_else(|| self.sync.poll_transmit())
            .or_else(|| self.presence.poll_transmit())
            .or_else(|| self.poll_rpdo())
            .or_else(|| self.poll_sdo())
    }

    fn poll_timeout(&self) -> Option<Instant> {
        (self.due < Instant::FAR_FUTURE).then_some(self.due)
    }
}
