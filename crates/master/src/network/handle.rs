use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use can::{Frame, Instant, Station};
use canopen::nmt::NmtTarget;
use canopen::pdo::PdoId;
use canopen::{Mux, NmtCommand, NodeId, sync};
use devices::AxisId;

use super::moved::{Moved, MovedAxis};
use crate::core::{Command, Core, Event, NodeFacts, NodeSet, Outcome, Payload, Received, SdoServer, Ticket};
use crate::host_loss::ArmedGuard;
use crate::models::Models;
use crate::pdo::FormerPdo;

/// A CANopen network as its master sees it: a cheap handle that all tasks and the runner share.
///
/// Futures that it hands out wait for facts in the core; dropping one cancels what it asked for.
#[derive(Clone, Debug, Default)]
pub struct Network {
    shared: Arc<Mutex<NetworkState>>,
}

/// What a node had of what was changed for a motion alone.
#[derive(Debug, Default)]
pub(crate) struct Former {
    pub objects: BTreeMap<Mux, Payload>,
    pub pdos: BTreeMap<PdoId, FormerPdo>,
}

#[derive(Debug, Default)]
pub(super) struct NetworkState {
    pub(super) core: Core,
    /// Commands that wait for the runner's next time.
    inbox: VecDeque<Command>,
    pub(super) slots: BTreeMap<Ticket, Slot>,
    pub(super) watchers: Vec<Watcher>,
    /// Woken by the next cycle, or when there will be none.
    pub(super) cycle_waiters: Vec<CycleWaiter>,
    /// Room for the wakers of one call, kept so that a cycle allocates nothing.
    woken: Vec<Waker>,
    /// Something was asked for since the runner last came.
    fresh: bool,
    /// Woken whenever a command comes into the inbox.
    on_activity: Option<Waker>,
    /// Woken once by the next command that comes into the inbox.
    activity: Option<Waker>,
    /// What this program has set in motion.
    pub(super) moved: Moved,
    /// The models that a node may be.
    models: Models,
    /// What watches this program, by node.
    guards: BTreeMap<NodeId, ArmedGuard>,
    /// What objects had that are changed for a motion alone.
    former: BTreeMap<NodeId, Former>,
    /// SDO servers that nodes are to be asked by, whose records are still to be read.
    chosen_servers: BTreeMap<NodeId, u16>,
    /// How often another server was chosen for a node: what was read for an earlier choice overrules no later one.
    server_choices: BTreeMap<NodeId, u32>,
    /// Axes that belong to a group or a base, by the place of their controlword.
    pub(super) claims: BTreeSet<(NodeId, Mux)>,
}

/// Commands that wait for a runner. Requests and timers are bounded by the futures that wait for them; the rest by
/// this.
const INBOX: usize = 4096;

/// What a future waits for.
#[derive(Debug)]
pub(super) enum Slot {
    Waiting(Waker),
    Done(Outcome),
}

/// A future that wants to look again when a node's facts change.
#[derive(Debug)]
pub(super) struct Watcher {
    pub(super) node: NodeId,
    pub(super) ticket: Ticket,
    pub(super) waker: Waker,
}

/// A future that waits for a cycle after the one with this number.
#[derive(Debug)]
pub(super) struct CycleWaiter {
    pub(super) ticket: Ticket,
    pub(super) waker: Waker,
}

impl Network {
    /// A network of which nothing is known yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Produces SYNC with this period, or stops.
    pub fn sync(&self, period: Option<Duration>) {
        self.submit(Command::Sync(period));
    }

    /// Each SYNC that this network produces carries a counter from 1 to `overflow`, 2 to 240: 1019h of the devices has to be the same.
    /// Devices begin a synchronous TPDO with a start value (1800h:06 and on) at the SYNC with that counter, so that several of them share
    /// the bus by turns; without a counter they begin at the first SYNC. `None` for none. Other values are taken as the nearest. Source:
    /// CiA 301, 7.2.5.1, 7.5.2.22 and 7.5.2.37.
    pub fn sync_counter(&self, overflow: Option<u8>) {
        self.submit(Command::SyncCounter(overflow.map_or(0, |overflow| overflow.clamp(2, sync::MAX_COUNTER))));
    }

    /// Produces this master's heartbeat under a node-ID, the first one at once, or stops. Periods are whole milliseconds.
    ///
    /// Any drive that consumes that heartbeat (1016h) and hears it watches this program from then on, not only those that
    /// it moves. [`crate::Drive::guard`] does what a drive needs; this is for masters that do the rest themselves.
    pub fn heartbeat(&self, own: NodeId, period: Option<Duration>) {
        self.heartbeat_within(own, period, None);
    }

    /// The same for drives that stop when it stays away for `allowed`: one that would come later is not sent, nor any after it.
    pub(crate) fn heartbeat_within(&self, own: NodeId, period: Option<Duration>, allowed: Option<Duration>) {
        self.submit(Command::Heartbeat(own, period, allowed));
    }

    /// Sends an NMT command to every node.
    pub fn nmt_all(&self, command: NmtCommand) {
        self.submit(Command::Nmt(NmtTarget::All, command));
    }

    /// Sends a frame as it is.
    pub fn transmit(&self, frame: Frame) {
        self.submit(Command::Transmit(frame));
    }

    /// The next event for people, with its time.
    pub fn poll_event(&self) -> Option<(Instant, Event)> {
        self.lock().core.poll_event()
    }

    /// The models among which nodes are looked for: those of crate `devices`, unless others were given.
    pub fn models(&self) -> Models {
        self.lock().models.clone()
    }

    /// Looks for nodes among these models from now on.
    pub fn set_models(&self, models: Models) {
        self.lock().models = models;
    }

    /// Asks these nodes by other SDO servers than the default one, given by their records (1201h to 127Fh), in place of what was chosen
    /// before. Each record is read when its node is first asked for something; a request fails as
    /// [`Node::use_sdo_server`](super::Node::use_sdo_server) does where there is none. What stops an axis before that goes to the default
    /// server and waits for nothing.
    pub fn choose_sdo_servers(&self, servers: impl IntoIterator<Item = (NodeId, u16)>) {
        let mut shared = self.lock();
        shared.chosen_servers = servers.into_iter().collect();
        NodeId::all().for_each(|node| *shared.server_choices.entry(node).or_default() += 1);
    }

    /// The record of a server that is to be used and was not read yet, with the number of that choice.
    pub(super) fn chosen_server(&self, node: NodeId) -> Option<(u16, u32)> {
        let shared = self.lock();
        let record = shared.chosen_servers.get(&node).copied()?;
        Some((record, shared.server_choices.get(&node).copied().unwrap_or_default()))
    }

    /// Another server is chosen for a node; the number of that choice.
    pub(super) fn begin_server_choice(&self, node: NodeId) -> u32 {
        let mut shared = self.lock();
        // It would be read meanwhile as if it were the newer one.
        shared.chosen_servers.remove(&node);
        let choices = shared.server_choices.entry(node).or_default();
        *choices += 1;
        *choices
    }

    /// Has a node be asked by this server from now on, unless another was chosen since.
    pub(super) fn use_chosen_server(&self, node: NodeId, server: SdoServer, choice: u32) {
        {
            let mut shared = self.lock();
            if shared.server_choices.get(&node).copied().unwrap_or_default() != choice {
                return;
            }
            shared.chosen_servers.remove(&node);
        }
        self.submit(Command::UseSdoServer(node, server));
    }

    /// Has a node be asked by its default server, whatever was chosen.
    pub(crate) fn use_default_server(&self, node: NodeId) {
        let choice = self.begin_server_choice(node);
        self.use_chosen_server(node, SdoServer::default_of(node), choice);
    }

    /// What has been seen of a node.
    pub fn facts(&self, node: NodeId) -> NodeFacts {
        self.lock().core.facts(node).clone()
    }

    /// The nodes of which any frame has been seen.
    pub fn seen(&self) -> NodeSet {
        let shared = self.lock();
        NodeId::all().filter(|node| shared.core.facts(*node).seen_at.is_some()).collect()
    }

    /// The newest value of an object that a node sends by PDO.
    pub fn received(&self, node: NodeId, mux: Mux) -> Option<Received> {
        self.lock().core.image().value(node, mux)
    }

    /// The latest time that the runner has passed.
    pub fn now(&self) -> Instant {
        self.lock().core.now()
    }

    /// See [`Core::heard_until`].
    pub fn heard_until(&self) -> Instant {
        self.lock().core.heard_until()
    }

    /// Looks into the core, or changes mappings and values to send. The runner is woken to fetch frames.
    pub fn with_core<T>(&self, look: impl FnOnce(&mut Core) -> T) -> T {
        self.with_shared(|shared| look(&mut shared.core))
    }

    /// As [`with_core`](Self::with_core), with what else the handles share.
    pub(super) fn with_shared<T>(&self, look: impl FnOnce(&mut NetworkState) -> T) -> T {
        let mut shared = self.lock();
        let result = look(&mut shared);
        let wakers = shared.activity_wakers();
        drop(shared);
        wakers.wake();
        result
    }

    /// Looks into the core without waking the runner.
    pub(crate) fn look<T>(&self, look: impl FnOnce(&Core) -> T) -> T {
        look(&self.lock().core)
    }

    /// Wakes `waker` each time that a command is queued, until another one is given. For a runner that sleeps.
    pub fn on_activity(&self, waker: Waker) {
        self.lock().on_activity = Some(waker);
    }

    /// Ready, once, when something was asked for since the runner last called
    /// [`handle_timeout`](Station::handle_timeout). For a runner that waits in async code.
    pub fn poll_activity(&self, context: &mut Context<'_>) -> Poll<()> {
        let mut shared = self.lock();
        if !shared.fresh {
            shared.activity = Some(context.waker().clone());
            return Poll::Pending;
        }
        shared.fresh = false;
        Poll::Ready(())
    }

    /// Notes that this program has set the axis with this controlword in motion.
    pub fn note_moved(&self, node: NodeId, controlword: Mux) {
        self.note_axis_moved(MovedAxis { node, controlword, axis: AxisId::FIRST, description: None });
    }

    pub(crate) fn note_axis_moved(&self, axis: MovedAxis) {
        self.lock().moved.insert(&axis);
    }

    /// Notes that it was seen to stand.
    pub(crate) fn note_stopped(&self, node: NodeId, controlword: Mux) {
        self.lock().moved.remove(node, controlword);
    }

    /// The nodes that this program has set in motion and not seen to stand since.
    pub fn moved(&self) -> NodeSet {
        self.lock().moved.nodes()
    }

    /// The axes that this program has set in motion and not seen to stand since.
    pub(crate) fn moved_axes(&self) -> Vec<MovedAxis> {
        self.lock().moved.axes()
    }

    /// True if both are handles of one network.
    pub(crate) fn is_same_as(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.shared, &other.shared)
    }

    /// The guards of this program, to look at or to change.
    pub(crate) fn with_guards<T>(&self, look: impl FnOnce(&mut BTreeMap<NodeId, ArmedGuard>) -> T) -> T {
        look(&mut self.lock().guards)
    }

    /// An object of a node is going to be changed for a motion alone; what it has now is put back when the node's guard is given back. Of
    /// an object that has been noted the first value counts.
    pub(crate) fn note_former(&self, node: NodeId, object: Mux, value: Payload) {
        self.lock().former.entry(node).or_default().objects.entry(object).or_insert(value);
    }

    /// The same of a PDO, which is set up in an order of its own.
    pub(crate) fn note_former_pdo(&self, node: NodeId, pdo: FormerPdo) {
        self.lock().former.entry(node).or_default().pdos.entry(pdo.config.pdo).or_insert(pdo);
    }

    /// Whether a PDO was noted, and not put back since.
    pub(crate) fn has_former_pdo(&self, node: NodeId, pdo: PdoId) -> bool {
        self.lock().former.get(&node).is_some_and(|former| former.pdos.contains_key(&pdo))
    }

    /// Takes what was noted of a node's objects and PDOs.
    pub(crate) fn take_former(&self, node: NodeId) -> Former {
        self.lock().former.remove(&node).unwrap_or_default()
    }

    pub(crate) fn submit(&self, command: Command) {
        let mut shared = self.lock();
        let plain = |command: &Command| {
            use Command::{FollowSync, Heartbeat, KeepFed, Nmt, Sync, Transmit};
            matches!(command, Nmt(..) | Transmit(_) | Sync(_) | FollowSync(_) | Heartbeat(..) | KeepFed(..))
        };
        // The bus was not run for thousands of commands: the newest replaces the oldest.
        if shared.inbox.len() >= INBOX
            && plain(&command)
            && let Some(oldest) = shared.inbox.iter().position(plain)
        {
            shared.inbox.remove(oldest);
        }
        shared.inbox.push_back(command);
        let wakers = shared.activity_wakers();
        drop(shared);
        wakers.wake();
    }

    /// Takes back a request or timer: before it reached the core without a trace, else by a cancel.
    pub(super) fn withdraw(&self, ticket: Ticket) {
        let mut shared = self.lock();
        let Some(Slot::Waiting(_)) = shared.slots.remove(&ticket) else { return };
        let before = shared.inbox.len();
        shared.inbox.retain(|command| command.ticket() != Some(ticket));
        let known_to_core = shared.inbox.len() == before;
        drop(shared);
        if known_to_core {
            self.submit(Command::Cancel(ticket));
        }
    }

    /// Calls the core at `now`, waiting commands first, and wakes the futures that waited for the results.
    fn run(&self, now: Instant, call: impl FnOnce(&mut Core)) {
        let mut shared = self.lock();
        shared.fresh = false;
        while let Some(command) = shared.inbox.pop_front() {
            shared.core.execute(command, now);
        }
        call(&mut shared.core);
        shared.collect();
        if shared.woken.is_empty() {
            return;
        }
        // Woken after the lock; the room goes back for the next call.
        let mut woken = core::mem::take(&mut shared.woken);
        drop(shared);
        woken.drain(..).for_each(Waker::wake);
        self.lock().woken = woken;
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, NetworkState> {
        // A panic elsewhere leaves the core whole: every call finishes its own step.
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl NetworkState {
    /// Hands outcomes to their slots, and collects the wakers of those that waited.
    fn collect(&mut self) {
        while let Some(finished) = self.core.poll_finished() {
            // No slot: the future has been dropped.
            let Some(slot) = self.slots.get_mut(&finished.ticket) else { continue };
            if let Slot::Waiting(waker) = core::mem::replace(slot, Slot::Done(finished.outcome)) {
                self.woken.push(waker);
            }
        }
        let changed = self.core.take_changed();
        if !changed.is_empty() {
            let due = self.watchers.extract_if(.., |watcher| changed.contains(watcher.node));
            self.woken.extend(due.map(|watcher| watcher.waker));
        }
        if self.core.take_cycle_change() {
            self.woken.extend(self.cycle_waiters.drain(..).map(|waiter| waiter.waker));
        }
    }

    /// True if SYNC has been asked for and the runner has not come since.
    pub(super) fn expects_sync(&self) -> bool {
        let newest = self.inbox.iter().rev().find_map(|command| match command {
            Command::Sync(period) | Command::FollowSync(period) => Some(period.is_some()),
            _ => None,
        });
        newest.unwrap_or(false)
    }

    fn activity_wakers(&mut self) -> ActivityWakers {
        self.fresh = true;
        ActivityWakers { lasting: self.on_activity.clone(), once: self.activity.take() }
    }
}

/// Whom a new command wakes; kept apart so that it happens after the lock.
struct ActivityWakers {
    lasting: Option<Waker>,
    once: Option<Waker>,
}

impl ActivityWakers {
    fn wake(self) {
        [self.lasting, self.once].into_iter().flatten().for_each(Waker::wake);
    }
}

impl Station for Network {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        self.handle_stamped(frame, now, now);
    }

    fn handle_stamped(&mut self, frame: &Frame, at: Instant, now: Instant) {
        self.run(now, |core| core.handle_stamped(frame, at, now));
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.run(now, |core| core.handle_timeout(now));
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.lock().core.poll_transmit()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let shared = self.lock();
        if shared.inbox.is_empty() { shared.core.poll_timeout() } else { Some(shared.core.now()) }
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.run(now, |core| core.handle_transmitted(frame, now));
    }
}
