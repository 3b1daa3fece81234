//! What every drive is on the bus: its CANopen node, its parameter store, and the task that looks after both.
//!
//! A drive owns a [`Device`] and hands frames and time to it. What a peer wrote comes back as [`NodeEvent`]s, which
//! `Application` turns into the drive's own reactions. Nothing here knows what an object means but for the error register
//! (1001h).

mod errors;

use can::{Bitrate, Frame, Instant, Station};
use canopen::node::{Node, NodeEvent, NodeProfile, Ticket, Via};
use canopen::object::ERROR_REGISTER;
use canopen::od::{Dictionary, Entry, Slot, Storage};
use canopen::pdo::PdoNumber;
use canopen::{AbortCode, Mux, NmtCommand, NmtState, NodeId};

use super::communication_errors::CommunicationErrors;
use super::storage::{Store, StoredImage};
use devices::variant::Variant;

/// Node, store and communication task of a drive whose table has `N` rows.
#[derive(Clone)]
pub struct Device<S: Storage> {
    profile: &'static NodeProfile,
    node: Node<S>,
    store: Store,
    /// Bits of the error register that the drive's faults set.
    fault_bits: u8,
    communication_errors: CommunicationErrors,
    eeprom_ok: bool,
    running: bool,
    bitrate: Bitrate,
    task_period_ns: u64,
    next_task: Instant,
    reset_times: ResetTimes,
    /// A reset by NMT that takes its time.
    reset: Option<(Reset, Instant)>,
    variant: Variant,
}

/// How long resets by NMT take, ns; 0 for none. The device is silent and deaf meanwhile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ResetTimes {
    /// NMT reset node. The firmware does not run meanwhile: the power stage is off.
    pub node_ns: u64,
    /// NMT reset communication. The motor goes on.
    pub communication_ns: u64,
}

/// What is started over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reset {
    /// The firmware.
    Node,
    /// The objects 1000h to 1FFFh.
    Communication,
}

impl<S: Storage> Device<S> {
    /// A device without supply, with its bit rate and EEPROM as delivered, the time between two runs of its communication
    /// task, and how it differs from others of its model.
    pub fn new(
        profile: &'static NodeProfile,
        bitrate: Bitrate,
        image: StoredImage,
        task_period_ns: u64,
        variant: Variant,
    ) -> Self {
        Self {
            profile,
            node: Node::new(profile, NodeId::MIN),
            store: Store::new(image),
            fault_bits: 0,
            communication_errors: CommunicationErrors::NONE,
            eeprom_ok: true,
            running: false,
            bitrate,
            task_period_ns,
            next_task: Instant::ZERO,
            reset_times: ResetTimes::default(),
            reset: None,
            variant,
        }
    }

    /// The node, to look at.
    pub const fn node(&self) -> &Node<S> {
        &self.node
    }

    /// The values of the objects.
    #[inline]
    pub const fn values(&self) -> &Dictionary<S> {
        self.node.dictionary()
    }

    /// The values, to write as the drive itself.
    #[inline]
    pub const fn values_mut(&mut self) -> &mut Dictionary<S> {
        self.node.dictionary_mut()
    }

    /// The application's word on a download that it was asked about: [`Node::answer`].
    pub fn answer(&mut self, ticket: Ticket, verdict: Result<(), AbortCode>, now: Instant) -> bool {
        self.node.answer(ticket, verdict, now)
    }

    /// Supplied and started.
    #[inline]
    pub const fn is_running(&self) -> bool {
        self.running
    }

    /// Bit rate in use.
    pub const fn bitrate(&self) -> Bitrate {
        self.bitrate
    }

    /// How this drive differs from others of its model.
    pub const fn variant(&self) -> &Variant {
        &self.variant
    }

    /// The values as delivered, of a device with this node-ID.
    fn factory_values(&self, node_id: NodeId) -> Dictionary<S> {
        self.variant.delivered(self.profile.table, node_id).with_conditions(self.profile.conditions)
    }

    /// Supply voltage arrives, and this is found in the EEPROM. [`restart`](Self::restart) and [`boot`](Self::boot) follow.
    pub fn power_on(&mut self, image: StoredImage) {
        self.store.reopen(image);
        self.eeprom_ok = true;
    }

    /// Another node-ID from the next [`restart_communication`](Self::restart_communication) on.
    pub const fn set_node_id(&mut self, node_id: NodeId) {
        self.node.set_node_id(node_id);
    }

    /// Another bit rate from now on.
    pub const fn set_bitrate(&mut self, bitrate: Bitrate) {
        self.bitrate = bitrate;
    }

    /// Silent and deaf until the next [`boot`](Self::boot), though the firmware runs: it has no node-ID any more.
    pub fn leave_bus(&mut self) {
        self.node.power_off();
    }

    /// Supply voltage is gone.
    pub fn power_off(&mut self) {
        self.running = false;
        self.reset = None;
        self.node.power_off();
    }

    /// The values that a restart finds. An unreadable store leaves factory values.
    pub fn stored_values(&self) -> Dictionary<S> {
        let mut values = self.factory_values(NodeId::MIN);
        let _ = self.store.load(&mut values, |_| true);
        values
    }

    /// Starts over with the stored values. [`boot`](Self::boot) follows, when the drive has put its own on top.
    pub fn restart(&mut self, node_id: NodeId, bitrate: Bitrate, now: Instant) {
        self.node = Node::new(self.profile, node_id);
        *self.node.dictionary_mut() = self.factory_values(node_id);
        self.fault_bits = 0;
        self.communication_errors = CommunicationErrors::NONE;
        let _ = self.store.load(self.node.dictionary_mut(), |_| true);
        self.running = true;
        self.bitrate = bitrate;
        self.next_task = now.plus_nanos(self.task_period_ns);
    }

    /// How long the next resets take.
    pub const fn set_reset_times(&mut self, times: ResetTimes) {
        self.reset_times = times;
    }

    /// A reset was asked for: true if it is to be carried out at once, else it becomes due.
    fn begin_reset(&mut self, reset: Reset, now: Instant) -> bool {
        let takes_ns = match reset {
            Reset::Node => self.reset_times.node_ns,
            Reset::Communication => self.reset_times.communication_ns,
        };
        if takes_ns != 0 {
            self.running &= reset != Reset::Node;
            self.reset = Some((reset, now.plus_nanos(takes_ns)));
        }
        takes_ns == 0
    }

    /// The reset whose time is over.
    #[inline]
    fn take_due_reset(&mut self, now: Instant) -> Option<Reset> {
        let (reset, at) = self.reset?;
        if now < at {
            return None;
        }
        self.reset = None;
        Some(reset)
    }

    /// Writes a communication object as the device itself; it takes effect at once.
    pub fn write_own(&mut self, slot: Slot, raw: u32) {
        self.node.write_own(slot, raw);
    }

    /// Communication begins with the values that are there.
    pub fn boot(&mut self, now: Instant) {
        self.node.boot(now);
    }

    /// NMT reset communication: 1000h to 1FFFh as at power-on, but for what the drive's faults show in the error register;
    /// all else and the node-ID go on.
    pub fn restart_communication(&mut self, now: Instant) {
        let error_register = self.error_register().map(|slot| {
            let shown = self.values().raw(slot);
            (slot, if self.communication_errors.is_empty() { shown } else { u32::from(self.fault_bits) })
        });
        self.communication_errors = CommunicationErrors::NONE;
        self.node.restore_communication_defaults();
        self.variant.apply_factory_values(self.node.dictionary_mut(), Entry::is_communication);
        let _ = self.store.load(self.node.dictionary_mut(), Entry::is_communication);
        if let Some((slot, register)) = error_register {
            self.node.dictionary_mut().set_raw(slot, register);
        }
        self.node.boot(now);
    }

    /// See [`Node::send_by_source`].
    pub fn send_by_source(&mut self, slot: Slot, now: Instant) -> bool {
        self.node.send_by_source(slot, now)
    }

    /// As [`Node::send_to_destination`] with the first of these TPDOs that has nothing to send.
    pub fn send_to_destination(&mut self, to: Option<NodeId>, object: Mux, data: [u8; 4], now: Instant) -> bool {
        let mut numbers = (0..).map_while(PdoNumber::at);
        numbers.any(|number| self.node.send_to_destination(number, to, object, data, now))
    }

    /// What happened since, in the order of arrival.
    #[inline]
    pub fn poll_event(&mut self) -> Option<NodeEvent> {
        self.node.poll_event()
    }

    /// See [`Node::last_addressed`].
    pub const fn last_addressed(&self) -> Option<Instant> {
        self.node.last_addressed()
    }

    /// True once each task period. The task keeps its grid unless it was not called for long.
    #[inline]
    pub fn is_task_due(&mut self, now: Instant) -> bool {
        if !self.running || now < self.next_task {
            return false;
        }
        let next = self.next_task.plus_nanos(self.task_period_ns);
        self.next_task = if next > now { next } else { now.plus_nanos(self.task_period_ns) };
        true
    }

    /// See [`Resting::task_from`](crate::Resting::task_from).
    pub fn task_from(&self, at: Instant) -> Option<Instant> {
        let runs = at.nanos_since(self.next_task).div_ceil(self.task_period_ns);
        self.running.then(|| self.next_task.plus_nanos(runs * self.task_period_ns))
    }

    /// See [`Resting::task_is_idle`](crate::Resting::task_is_idle).
    pub fn is_task_idle(&self) -> bool {
        self.running && self.reset.is_none() && !self.store.has_pending() && !self.node.watches_changes()
    }

    /// See [`Resting::leave_out_tasks`](crate::Resting::leave_out_tasks).
    pub fn leave_out_tasks(&mut self, now: Instant) {
        if let Some(next) = self.task_from(now) {
            self.next_task = next;
        }
    }

    /// Whether nothing about it differs from `earlier` and nothing waits to be stored, so that until a frame comes or
    /// [something is due](Self::next_event) a run of the communication task changes nothing.
    pub fn rests_since(&self, earlier: &Self) -> bool {
        self.running
            && self.reset.is_none()
            && !self.store.has_pending()
            && self.eeprom_ok == earlier.eeprom_ok
            && self.fault_bits == earlier.fault_bits
            && self.communication_errors == earlier.communication_errors
            && self.node.rests_since(&earlier.node)
    }

    /// [`Station::poll_timeout`] but for the communication task.
    pub fn next_event(&self) -> Option<Instant> {
        let node = self.running.then(|| self.node.poll_timeout()).flatten();
        node.into_iter().chain(self.reset.map(|(_, at)| at)).min()
    }

    /// See [`Node::set_heartbeat_state`].
    pub const fn set_heartbeat_state(&mut self, state: Option<u8>) {
        self.node.set_heartbeat_state(state);
    }

    /// The values have changed: event-driven TPDOs become due.
    #[inline]
    pub fn notice_changes(&mut self, now: Instant) {
        self.node.notice_changes(now);
    }

    /// Contents of the EEPROM, and a number that changes with them.
    pub fn eeprom(&self) -> (&[u8], u32) {
        let (image, generation) = self.store.image();
        (&image.0, generation)
    }

    /// Whether the EEPROM answers, as measured. Nothing is written while it does not.
    #[inline]
    pub const fn set_eeprom_ok(&mut self, ok: bool) {
        self.eeprom_ok = ok;
    }

    /// The EEPROM answers, and what it holds can be read.
    #[inline]
    pub fn is_eeprom_sound(&self) -> bool {
        self.eeprom_ok && self.store.is_readable()
    }

    /// Has a row's value stored with the next [`commit`](Self::commit), if it is a row to be stored at all.
    #[inline]
    pub fn mark(&mut self, slot: Slot) {
        self.store.mark(self.profile.table, slot);
    }

    /// Has all kept rows that `wanted` names stored with the next [`commit`](Self::commit).
    pub fn mark_all(&mut self, wanted: fn(&Entry) -> bool) {
        self.store.mark_all(self.profile.table, wanted);
    }

    /// A value waits for the next [`commit`](Self::commit), which will write it: the EEPROM answers and can be read.
    #[inline]
    pub fn is_storing(&self) -> bool {
        self.takes_stores() && self.store.has_pending()
    }

    /// It has power, and the EEPROM answers.
    #[inline]
    pub fn takes_stores(&self) -> bool {
        self.running && self.eeprom_ok
    }

    /// Stores what is marked. While the EEPROM does not answer it waits.
    #[inline]
    pub fn commit(&mut self) {
        if self.eeprom_ok {
            self.store.commit(self.node.dictionary());
        }
    }

    /// Stores all rows that are to be stored, with their values in `contents`, whatever the EEPROM held. False if it does
    /// not answer; nothing is stored then.
    pub fn save(&mut self, contents: &Dictionary<S>) -> bool {
        if self.eeprom_ok {
            self.store.format(contents);
        }
        self.eeprom_ok
    }

    /// Everything in the EEPROM becomes as delivered. Parameters do at once, communication objects with the next restart:
    /// until then they show what the device does. Of the parameters those that `wanted` names are. False if the EEPROM does
    /// not answer; nothing is changed then.
    pub fn restore_factory_settings(&mut self, wanted: fn(&Entry) -> bool) -> bool {
        let factory = self.factory_values(self.node.node_id());
        if !self.save(&factory) {
            return false;
        }
        let parameters = |row: &Entry| row.is_kept() && wanted(row) && !row.is_communication();
        for (slot, _) in factory.table().iter().filter(|(_, row)| parameters(row)) {
            self.node.dictionary_mut().set_raw(slot, factory.raw(slot));
        }
        true
    }

    /// The device takes an NMT command of its own: [`Node::command_itself`]. What comes of it is reported as events.
    pub fn command_itself(&mut self, command: NmtCommand, now: Instant) {
        if self.running {
            self.node.command_itself(command, now);
        }
    }

    fn error_register(&self) -> Option<Slot> {
        self.profile.table.find(ERROR_REGISTER).ok()
    }
}

impl<S: Storage> Station for Device<S> {
    #[inline]
    fn ignores(&self, frame: &Frame) -> bool {
        !self.running || self.node.ignores(frame)
    }

    #[inline]
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        if self.running {
            self.node.handle_frame(frame, now);
        }
    }

    #[inline]
    fn handle_timeout(&mut self, now: Instant) {
        if self.running {
            self.node.handle_timeout(now);
        }
    }

    #[inline]
    fn poll_transmit(&mut self) -> Option<Frame> {
        self.node.poll_transmit()
    }

    #[inline]
    fn poll_timeout(&self) -> Option<Instant> {
        let reset = self.reset.map(|(_, at)| at);
        let Some(task) = self.running.then_some(self.next_task) else { return reset };
        let due = self.node.poll_timeout().map_or(task, |deadline| deadline.min(task));
        Some(reset.map_or(due, |reset| reset.min(due)))
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.node.handle_transmitted(frame, now);
    }
}

/// What a drive does with what its device hears.
pub(crate) trait Application<S: Storage> {
    /// The device.
    fn device(&mut self) -> &mut Device<S>;

    /// A peer wrote `raw` to `slot`. True if it was a command: the status is shown anew once the whole frame has been taken.
    fn written(&mut self, slot: Slot, raw: u32, via: Via, now: Instant) -> bool;

    /// A client wants to write `raw` to a row whose condition is [`Condition::Ask`](canopen::od::Condition::Ask). Answered with
    /// [`Device::answer`], now or later; taken at once by default.
    fn asked(&mut self, slot: Slot, raw: u32, ticket: Ticket, now: Instant) {
        let _ = (slot, raw);
        self.device().answer(ticket, Ok(()), now);
    }

    /// SYNC came.
    #[inline]
    fn synchronised(&mut self, now: Instant) {
        let _ = now;
    }

    /// Puts the status into the dictionary.
    fn show_status(&mut self);

    /// NMT reset node: starts the firmware over with the stored values.
    fn restart(&mut self, now: Instant);

    /// A new NMT state was entered. Nothing by default: the motor goes on, and is stopped by the drive's own watch.
    fn nmt_changed(&mut self, state: NmtState, now: Instant) {
        let _ = (state, now);
    }

    /// An RPDO has missed the deadline of its event timer, or has come again.
    fn rpdo_deadline(&mut self, number: PdoNumber, met: bool, now: Instant) {
        let _ = number;
        self.device().report_rpdo_deadline(met, now);
    }

    /// NMT reset communication. By default the motor goes on.
    fn restart_communication(&mut self, now: Instant) {
        self.device().restart_communication(now);
    }

    /// Every task period.
    fn communication_task(&mut self, now: Instant);

    /// A peer asks for a reset: at once, or when its time is over.
    fn reset(&mut self, reset: Reset, now: Instant) {
        if self.device().begin_reset(reset, now) {
            self.carry_out(reset, now);
        }
    }

    /// Carries out the reset whose time is over.
    #[inline]
    fn finish_reset(&mut self, now: Instant) {
        if let Some(reset) = self.device().take_due_reset(now) {
            self.carry_out(reset, now);
        }
    }

    /// Starts over.
    fn carry_out(&mut self, reset: Reset, now: Instant) {
        match reset {
            Reset::Node => self.restart(now),
            Reset::Communication => self.restart_communication(now),
        }
    }

    /// Acts on all that the device has heard.
    #[inline]
    fn handle_events(&mut self, now: Instant) {
        let mut commanded = false;
        while let Some(event) = self.device().poll_event() {
            match event {
                NodeEvent::Written { slot, raw, via } => commanded |= self.written(slot, raw, via, now),
                NodeEvent::Sync => self.synchronised(now),
                rare => self.handle_rare_event(rare, now),
            }
        }
        if commanded {
            self.show_status();
        }
    }

    /// What comes neither with each frame nor with each SYNC. Apart, so that what it works on is not looked up for those.
    #[inline(never)]
    fn handle_rare_event(&mut self, event: NodeEvent, now: Instant) {
        match event {
            NodeEvent::Asked { slot, raw, ticket } => self.asked(slot, raw, ticket, now),
            NodeEvent::ResetNode => self.reset(Reset::Node, now),
            NodeEvent::ResetCommunication => self.reset(Reset::Communication, now),
            NodeEvent::RpdoTooShort(_) => self.device().report_rpdo_length(false, now),
            NodeEvent::RpdoFits(_) => self.device().report_rpdo_length(true, now),
            NodeEvent::DestinationMissing(_) => self.device().report_missing_destination(now),
            NodeEvent::EventsLost => self.device().report_lost_events(now),
            NodeEvent::RpdoTimedOut(number) => self.rpdo_deadline(number, false, now),
            NodeEvent::RpdoInTime(number) => self.rpdo_deadline(number, true, now),
            NodeEvent::Nmt(state) => self.nmt_changed(state, now),
            NodeEvent::Written { .. } | NodeEvent::Sync => {}
        }
    }
}

/// [`Station`] for a drive that is an [`Application`] over its field `device`.
macro_rules! station {
    ($drive:ty) => {
        impl can::Station for $drive {
            fn ignores(&self, frame: &can::Frame) -> bool {
                self.device.ignores(frame)
            }

            fn handle_frame(&mut self, frame: &can::Frame, now: can::Instant) {
                self.device.handle_frame(frame, now);
                self.handle_events(now);
            }

            fn handle_timeout(&mut self, now: can::Instant) {
                self.device.handle_timeout(now);
                self.finish_reset(now);
                self.handle_events(now);
                if self.device.is_task_due(now) {
                    self.communication_task(now);
                }
            }

            fn poll_transmit(&mut self) -> Option<can::Frame> {
                self.device.poll_transmit()
            }

            fn poll_timeout(&self) -> Option<can::Instant> {
                self.device.poll_timeout()
            }

            fn handle_transmitted(&mut self, frame: &can::Frame, now: can::Instant) {
                self.device.handle_transmitted(frame, now);
            }
        }
    };
}
pub(crate) use station;

#[cfg(test)]
mod tests;
