//! A CANopen device's communication: NMT slave, heartbeat producer, SYNC consumer and producer, EMCY producer, SDO server,
//! RPDOs and TPDOs over one object dictionary (CiA 301).
//! As many PDOs as the dictionary has records for, up to 512 each way, and as many SDO servers, up to 128.
//!
//! [`Node`] is what a firmware owns. Frames and time go in as [`can::Station`] says. Out come frames, a deadline, and
//! [`NodeEvent`]s: which entries a peer wrote, NMT changes, reset requests. The node never acts on the application;
//! its owner polls events, reads and writes the dictionary, and carries out resets by calling [`Node::boot`] again.
//! What differs between devices is data: [`NodeProfile`]. Beside it an owner has an [`SdoClient`] for each other node that it reads or
//! writes.
//!
//! ```
//! use can::{Instant, Station};
//! use canopen::od::{Access, DataType, Entry, Fixed, Index, Object, Table};
//! use canopen::{Node, NodeEvent, NodeId, NodeProfile};
//!
//! static ROWS: [Entry; 2] = [
//!     Entry::new(0x1000, 0, DataType::Unsigned32, Access::Const, "device_type", "Device type").default(0x0002_0192),
//!     Entry::new(0x6040, 0, DataType::Unsigned16, Access::ReadWrite, "controlword", "Controlword"),
//! ];
//! static INDEX: Index<2> = Index::of(&ROWS);
//! static TABLE: Table = Table::new(&ROWS, &INDEX);
//! static PROFILE: NodeProfile = NodeProfile::cia_301(&TABLE);
//! const CONTROLWORD: Object<u16> = TABLE.object(0x6040, 0);
//!
//! let now = Instant::ZERO;
//! let mut node: Node<Fixed<2>> = Node::new(&PROFILE, NodeId::new(4).unwrap());
//! node.boot(now);
//! assert_eq!(node.poll_transmit().unwrap().to_string(), "704#00");
//!
//! node.handle_frame(&"604#2B40600006000000".parse().unwrap(), now);
//! assert_eq!(node.poll_transmit().unwrap().to_string(), "584#6040600000000000");
//! assert_eq!(node.dictionary().get(CONTROLWORD), 6);
//! assert!(matches!(node.poll_event(), Some(NodeEvent::Nmt(_))));
//! assert!(matches!(node.poll_event(), Some(NodeEvent::Written { raw: 6, .. })));
//! ```

mod channel;
mod channels;
mod client;
mod cycle;
mod event;
mod identifiers;
mod multiplex;
mod objects;
mod pdo_set;
mod pdos;
mod pending;
mod profile;
mod receive;
mod sync;
mod transmit;

use can::{CanId, Frame, Instant, Station};

use channel::SdoChannel;
pub use client::SdoClient;
use event::EventQueue;
pub use event::{NodeEvent, Ticket, Via};
pub use profile::NodeProfile;

use crate::emcy::{self, Emcy, EmcyErrorCode};
use crate::heartbeat;
use crate::nmt::Transition;
use crate::object::ERROR_REGISTER;
use crate::od::{Dictionary, Storage, Table};
use crate::pdo::{PdoNumber, Rpdo, Tpdo};
use crate::sdo::Server;
use crate::{NmtCommand, NmtState, NodeId};
use identifiers::Identifiers;
use pdos::Pdos;
use pending::{Pending, Source};
use sync::NodeSync;

/// One device on the bus, with as much room as its [`Storage`] has.
///
/// After [`new`](Self::new) it is silent and deaf until [`boot`](Self::boot). Call order: `handle_*`, then drain
/// [`poll_event`](Self::poll_event), let the application act, then drain `poll_transmit`.
#[derive(Clone)]
pub struct Node<S: Storage> {
    profile: &'static NodeProfile,
    node_id: NodeId,
    dictionary: Dictionary<S>,
    state: NmtState,
    /// Latest time seen.
    now: Instant,
    /// Nothing is due before this.
    deadline: Instant,
    /// What it listens to.
    received: Identifiers<S>,
    pending: Pending<S>,
    events: EventQueue<S>,
    last_addressed: Option<Instant>,
    heartbeat: heartbeat::Producer,
    heartbeat_state: Option<u8>,
    emcy: emcy::Producer,
    emcy_id: Option<CanId>,
    sdo: Server,
    /// The latest question to the owner for the client of this server.
    asked: Ticket,
    channels: S::Channels<SdoChannel>,
    sync: NodeSync,
    /// The latest question to the owner for any client.
    ticket: Ticket,
    pdos: Pdos<S>,
}

impl<S: Storage> Node<S> {
    /// A device with factory values, not booted yet.
    ///
    /// # Panics
    /// If the storage has not enough room for the profile's table: rows, longer values, PDOs, SDO servers, and the events that one
    /// frame can make.
    pub fn new(profile: &'static NodeProfile, node_id: NodeId) -> Self {
        let pdos = Pdos::of(profile.table);
        let sdo = Server::new(profile.sdo_frame_length, profile.sdo_timeout_ns, profile.sdo_block_size);
        Self {
            profile,
            node_id,
            dictionary: profile.factory_values(node_id),
            state: NmtState::Initialising,
            now: Instant::ZERO,
            deadline: Instant::FAR_FUTURE,
            received: pdos.identifiers(),
            pending: Pending::none(pdos.tpdos.as_ref().len()),
            events: EventQueue::empty(event::most_of_a_frame(profile.table)),
            last_addressed: None,
            heartbeat: heartbeat::Producer::OFF,
            heartbeat_state: None,
            emcy: emcy::Producer::new(),
            emcy_id: None,
            channels: channel::of::<S>(profile.table, &sdo),
            sdo,
            asked: Ticket(0),
            sync: NodeSync::NONE,
            ticket: Ticket(0),
            pdos,
        }
    }

    /// Starts communication over with the values that are in the dictionary: takes up the communication objects,
    /// sends boot-up and enters the profile's start state. For power-on, and after a reset request once the owner
    /// has put the dictionary to its power-on values.
    pub fn boot(&mut self, now: Instant) {
        self.now = now;
        self.sdo.reset();
        self.emcy = emcy::Producer::new();
        self.reset_channels();
        self.pending.clear();
        self.events.clear();
        self.last_addressed = None;
        self.pdos.short.clear();
        self.pdos.rpdos.as_mut().fill(Rpdo::INVALID);
        self.configure_objects();
        self.pending.insert(Source::BootUp);
        self.heartbeat = heartbeat::Producer::from_boot_up(self.heartbeat_period_ms(), now);
        self.enter(self.profile.start_state);
        self.reschedule();
    }

    /// Factory values for the communication objects (1000h to 1FFFh), then [`boot`](Self::boot): reset communication
    /// for a device that stores none of them.
    ///
    /// A device with a parameter store calls [`restore_communication_defaults`](Self::restore_communication_defaults),
    /// puts its stored values on top and boots.
    pub fn reset_communication(&mut self, now: Instant) {
        self.restore_communication_defaults();
        self.boot(now);
    }

    /// Puts the objects 1000h to 1FFFh to factory values. They take effect with [`boot`](Self::boot).
    pub fn restore_communication_defaults(&mut self) {
        let rows = self.profile.table.iter();
        for (slot, _) in rows.filter(|(_, row)| row.is_communication()) {
            self.dictionary.restore_default(slot, self.node_id);
        }
    }

    /// Another node-ID, by LSS or a switch. It takes effect with [`boot`](Self::boot), and for the defaults of objects with
    /// [`restore_communication_defaults`](Self::restore_communication_defaults).
    pub const fn set_node_id(&mut self, node_id: NodeId) {
        self.node_id = node_id;
    }

    /// Falls silent and deaf until the next [`boot`](Self::boot): the supply is gone.
    pub fn power_off(&mut self) {
        self.state = NmtState::Initialising;
        self.received.deafen();
        self.pending.clear();
        self.deadline = Instant::FAR_FUTURE;
        self.sdo.reset();
        self.reset_channels();
        self.stop_pdos();
        self.follow_nmt_with_sync();
        self.events.clear();
    }

    /// What happened since, in the order of arrival. Poll after every `handle_*`.
    #[inline]
    pub fn poll_event(&mut self) -> Option<NodeEvent> {
        self.events.pop()
    }

    /// When the last frame arrived that brings this node data (SDO request, RPDO): for a watch over the host. NMT commands,
    /// SYNC and heartbeats go on when the motor is not commanded any more. `None` since boot.
    pub const fn last_addressed(&self) -> Option<Instant> {
        self.last_addressed
    }

    /// Whether it has nothing to send and nothing to report, and its state and its values are those that it had as `earlier`:
    /// until a frame comes, or its deadline, or another value, it does nothing.
    pub fn rests_since(&self, earlier: &Self) -> bool {
        let silent = self.pending.is_empty() && self.events.is_empty();
        silent && self.state == earlier.state && self.dictionary.has_same_values(&earlier.dictionary)
    }

    /// Queues an EMCY message and sets the error register (1001h).
    pub fn raise_emcy(&mut self, code: EmcyErrorCode, error_register: u8, manufacturer: [u8; 5], now: Instant) {
        self.now = now;
        if let Ok(slot) = self.dictionary.table().find(ERROR_REGISTER) {
            self.dictionary.set_raw(slot, u32::from(error_register));
        }
        if self.emcy_id.is_some() && self.state != NmtState::Initialising {
            self.emcy.raise(Emcy { code, error_register, manufacturer });
            self.offer_emcy();
        }
    }

    /// The application has written to the dictionary: event-driven TPDOs whose mapped values changed become due.
    #[inline]
    pub fn notice_changes(&mut self, now: Instant) {
        self.now = now;
        if !self.state.allows_pdo() {
            return;
        }
        let mut from = 0;
        while let Some(position) = self.pdos.watching.next(from) {
            if self.pdos.tpdos.as_mut()[position].notice_change(&self.dictionary) {
                self.offer_tpdo(position);
            }
            from = position + 1;
        }
    }

    /// A change that [`notice_changes`](Self::notice_changes) would find is to be sent.
    pub fn watches_changes(&self) -> bool {
        self.state.allows_pdo() && self.pdos.watching.next(0).is_some()
    }

    /// Sends `state` in heartbeats instead of the NMT state; `None` for the NMT state again.
    pub const fn set_heartbeat_state(&mut self, state: Option<u8>) {
        self.heartbeat_state = state;
    }

    /// The values of its object dictionary, to read; writes go through the node.
    #[inline]
    pub const fn dictionary(&self) -> &Dictionary<S> {
        &self.dictionary
    }

    /// The values, to write as the device itself. Communication objects take effect with [`boot`](Self::boot); for
    /// mapped values see [`notice_changes`](Self::notice_changes).
    #[inline]
    pub const fn dictionary_mut(&mut self) -> &mut Dictionary<S> {
        &mut self.dictionary
    }

    /// The rows of its object dictionary: types, access, limits, defaults.
    pub const fn table(&self) -> &'static Table {
        self.profile.table
    }

    /// The node-ID that its identifiers are made of; one set by LSS acts from the next reset of communication on (CiA 305).
    pub const fn node_id(&self) -> NodeId {
        self.node_id
    }

    /// The NMT state; `Initialising` before boot and after a reset request.
    pub const fn state(&self) -> NmtState {
        self.state
    }

    /// The identifier of TPDO `number`, if it is valid and maps something.
    pub fn tpdo_id(&self, number: PdoNumber) -> Option<CanId> {
        self.pdos
            .tpdos
            .as_ref()
            .get(number.position())
            .filter(|tpdo| tpdo.is_active() || tpdo.address_mode().is_some())
            .map(Tpdo::can_id)
    }

    /// The identifier of RPDO `number`, if it is valid.
    pub fn rpdo_id(&self, number: PdoNumber) -> Option<CanId> {
        self.pdos.rpdos.as_ref().get(number.position())?.standard_id().map(CanId::standard)
    }

    /// The device takes an NMT command of its own, as its error behaviour (1029h) may ask for.
    pub fn command_itself(&mut self, command: NmtCommand, now: Instant) {
        self.now = now;
        self.handle_nmt(command);
    }

    fn handle_nmt(&mut self, command: NmtCommand) {
        match self.state.handle(command) {
            Transition::None => {}
            Transition::Enter(state) => self.enter(state),
            Transition::ResetNode => self.begin_reset(NodeEvent::ResetNode),
            Transition::ResetCommunication => self.begin_reset(NodeEvent::ResetCommunication),
        }
    }

    fn enter(&mut self, state: NmtState) {
        self.state = state;
        self.push(NodeEvent::Nmt(state));
        if state.allows_pdo() {
            for position in 0..self.pdos.tpdos.as_ref().len() {
                self.pdos.tpdos.as_mut()[position].start(self.now);
                self.offer_tpdo(position);
            }
        } else {
            self.stop_pdos();
        }
        self.follow_nmt_with_sync();
        if state.allows_sdo() {
            self.offer_emcy();
        } else {
            self.sdo.reset();
            self.reset_channels();
            self.pending.remove(Source::SdoReply);
            self.pending.remove(Source::Emcy);
        }
    }

    /// Waits for the owner to boot again; what it was about to report is void.
    fn begin_reset(&mut self, request: NodeEvent) {
        self.power_off();
        self.push(request);
    }

    fn stop_pdos(&mut self) {
        self.pdos.latched.clear();
        for rpdo in self.pdos.rpdos.as_mut() {
            rpdo.stop();
        }
        for position in 0..self.pdos.tpdos.as_ref().len() {
            self.pdos.tpdos.as_mut()[position].stop();
            self.pending.remove(Source::Tpdo(position));
        }
    }

    #[inline]
    fn push(&mut self, event: NodeEvent) {
        self.events.push(event);
    }
}

impl<S: Storage> Station for Node<S> {
    #[inline]
    fn ignores(&self, frame: &Frame) -> bool {
        match frame.standard_data_id() {
            Some(id) => !self.received.contain(id),
            None => !self.hears_remote(frame),
        }
    }

    #[inline]
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        match frame.standard_data_id() {
            Some(id) if self.received.contain(id) => {
                self.now = now;
                self.receive(frame, id);
            }
            // As one that it [ignores](Station::ignores).
            Some(_) => {}
            None => {
                self.now = now;
                self.receive_remote(frame);
            }
        }
    }

    #[inline]
    fn handle_timeout(&mut self, now: Instant) {
        self.now = now;
        if now >= self.deadline {
            self.serve_deadlines();
        }
    }

    /// The most urgent frame: boot-up before all, then by identifier.
    #[inline]
    fn poll_transmit(&mut self) -> Option<Frame> {
        if self.pending.is_empty() { None } else { self.take_most_urgent() }
    }

    #[inline]
    fn poll_timeout(&self) -> Option<Instant> {
        (self.deadline != Instant::FAR_FUTURE).then_some(self.deadline)
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.now = now;
        if Some(frame.id()) == self.emcy_id {
            self.emcy.handle_transmitted(now);
            self.offer_emcy();
            return;
        }
        for position in 0..self.pdos.tpdo_ids.as_ref().len() {
            if self.pdos.tpdo_ids.as_ref()[position] == frame.id().raw()
                && self.pdos.tpdos.as_mut()[position].handle_transmitted(now)
            {
                self.offer_tpdo(position);
            }
        }
    }
}
