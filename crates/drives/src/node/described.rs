//! What every device is that comes from a description: node, services of CiA 301, and what it hears of its connection.
//!
//! [`Described`] is the one station of all of them; a firmware says what a lost connection means to it.

use can::{Frame, Instant, Station};
use canopen::node::{NodeProfile, Via};
use canopen::od::{Entry, Slot, Storage};
use canopen::{NmtCommand, NmtState, NodeId};
use devices::variant::Variant;

use super::lss::{Lss, Wanted};
use super::memory::is_makers_mark;
use super::program::{self, Changed};
use super::services::{Services, Written};
use super::{Memory, error_behaviour};
use crate::engine::device::{Application, Device, Reset};
use crate::engine::storage::StoredImage;

/// How often a device looks whether what its TPDOs carry has changed: without an inhibit time a TPDO comes no more often.
/// Assumed: drives and couplers of makers do it once in 1 to 10 ms.
const COMMUNICATION_PERIOD_NS: u64 = 1_000_000;

/// Device and services over one dictionary.
#[derive(Clone)]
pub struct DescribedDevice<S: Storage> {
    pub(crate) device: Device<S>,
    pub(crate) services: Services<S>,
    /// Layer setting services, of a device that has them and is started.
    lss: Option<Lss>,
    has_lss: bool,
    /// As delivered: LSS may have given it another one, or taken it away.
    pub(crate) node_id: NodeId,
    pub(crate) bitrate: can::Bitrate,
    stopped: bool,
    bus_off: bool,
}

/// How the connection to the host can be lost (CiA 402-2, object 6007h, names all but the last).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// A heartbeat that is watched (1016h) has stayed away, or the guarding of this device (100Ch, 100Dh).
    Silence,
    /// The controller is bus-off.
    BusOff,
    /// NMT stopped.
    Stopped,
    /// NMT reset communication: over as soon as it is reported.
    Reset,
    /// An RPDO has missed the deadline of its event timer (CiA 301, 7.5.2.35).
    RpdoDeadline,
}

impl<S: Storage> DescribedDevice<S> {
    /// A device without supply.
    pub(crate) fn new(
        profile: &'static NodeProfile,
        node_id: NodeId,
        bitrate: can::Bitrate,
        memory: Memory<S>,
        variant: Variant,
        has_lss: bool,
    ) -> Self {
        Self {
            device: Device::new(profile, bitrate, StoredImage::BLANK, COMMUNICATION_PERIOD_NS, variant),
            services: Services::new(memory),
            lss: None,
            has_lss,
            node_id,
            bitrate,
            stopped: false,
            bus_off: false,
        }
    }

    /// Supply voltage arrives, and this is found in the memory. [`restart`](Self::restart) and [`Device::boot`] follow.
    pub(crate) fn power_on(&mut self, memory: Memory<S>) {
        self.device.power_on(StoredImage::BLANK);
        self.services.power_on(memory);
        self.bus_off = false;
    }

    /// Starts over with the stored values. [`boot`](Self::boot) follows.
    pub(crate) fn restart(&mut self, now: Instant) {
        self.restart_as(self.node_id, self.bitrate, now);
        if self.has_lss {
            let lss = Lss::start(self.device.values(), self.services.memory().0, self.node_id);
            let bitrate = lss.bitrate().unwrap_or(self.bitrate);
            self.restart_as(lss.node_id().unwrap_or(self.node_id), bitrate, now);
            self.lss = Some(lss);
        }
        self.services.start(&mut self.device, |_| true);
        self.start_programs();
        self.stopped = false;
    }

    fn start_programs(&mut self) {
        let memory = self.services.memory().0;
        program::start(self.device.values_mut(), |object| memory.program(object));
    }

    /// A peer wrote to an object of a program; false if it is not one.
    fn take_program(&mut self, slot: Slot, raw: u32) -> bool {
        let Some(changed) = program::written(self.device.values_mut(), slot, raw) else { return false };
        let values = self.device.values();
        let number = values.table().row(slot).sub_index;
        let data = program::data_rows(values.table()).find(|(_, row)| row.sub_index == number);
        if let (Changed::Data, Some((data, row))) = (changed, data) {
            self.services.store_program(row.mux(), values.view().long_bytes(data));
        }
        true
    }

    /// With the table's values, and the numbers that its maker has given it.
    fn restart_as(&mut self, node_id: NodeId, bitrate: can::Bitrate, now: Instant) {
        self.device.restart(node_id, bitrate, now);
        let values = self.device.values_mut();
        for (object, number) in self.services.memory().0.marks() {
            let slot = values.table().find(object).ok();
            if let Some(slot) = slot.filter(|slot| is_makers_mark(values.table().row(*slot))) {
                values.set_raw(slot, number);
            }
        }
    }

    /// Communication begins, unless it has no node-ID: such a device waits for LSS, and is not seen on the bus.
    pub(crate) fn boot(&mut self, now: Instant) {
        if self.is_node() {
            self.device.boot(now);
        }
    }

    /// It has a node-ID.
    fn is_node(&self) -> bool {
        self.lss.as_ref().is_none_or(|lss| lss.node_id().is_some())
    }

    /// NMT reset communication.
    pub(crate) fn restart_communication(&mut self, now: Instant) {
        match self.lss.as_mut().map(Lss::take_node_id) {
            Some(None) => return self.device.leave_bus(),
            Some(Some(node_id)) => self.device.set_node_id(node_id),
            None => {}
        }
        let programs = program::states(self.device.values());
        self.device.restart_communication(now);
        self.services.start(&mut self.device, Entry::is_communication);
        self.start_programs();
        program::restore_states(self.device.values_mut(), programs);
        self.stopped = false;
        self.device.boot(now);
    }

    /// A request of an LSS master; true if the device is to start its communication over.
    fn handle_lss(&mut self, frame: &Frame, now: Instant) -> bool {
        let running = self.device.is_running();
        let Some(lss) = self.lss.as_mut().filter(|lss| running && !lss.is_silent()) else { return false };
        match lss.handle_frame(frame, now) {
            Wanted::Nothing => false,
            Wanted::ResetCommunication => true,
            Wanted::Store(stored) => {
                self.services.store_lss(stored);
                false
            }
        }
    }

    /// It changes its bit rate, and is silent and deaf before and after.
    fn is_silent(&self) -> bool {
        self.lss.as_ref().is_some_and(Lss::is_silent)
    }

    /// When it hears, sends or changes something without a frame, but for the communication task.
    pub(crate) fn next_watch(&self) -> Option<Instant> {
        let lss = self.lss.as_ref().and_then(Lss::poll_timeout);
        self.services.poll_timeout().into_iter().chain(lss).min().filter(|_| self.device.is_running())
    }

    /// What a device that loses its connection does to its own NMT state: 1029h:01, and without the object it enters pre-operational
    /// (CiA 301, 7.5.2.32).
    fn follow_error_behaviour(&mut self, now: Instant) {
        let state = self.device.node().state();
        match error_behaviour(self.device.values()).unwrap_or(0) {
            0 if state == NmtState::Operational => self.device.command_itself(NmtCommand::EnterPreOperational, now),
            2 => self.device.command_itself(NmtCommand::Stop, now),
            _ => {}
        }
    }

    /// The error that CiA 301 has a code for begins or ends.
    pub(crate) fn report(&mut self, loss: Loss, lost: bool, now: Instant) {
        match (loss, lost) {
            (Loss::Silence, _) => self.device.report_heartbeat(!lost, now),
            (Loss::RpdoDeadline, _) => self.device.report_rpdo_deadline(!lost, now),
            (Loss::BusOff, false) => self.device.report_bus_off_recovery(now),
            (Loss::BusOff, true) | (Loss::Stopped | Loss::Reset, _) => {}
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        if self.is_silent() {
            return None;
        }
        if let Some(answer) = self.lss.as_mut().and_then(Lss::take_answer) {
            return Some(answer);
        }
        let frame = self.services.take_answer().or_else(|| self.device.poll_transmit())?;
        self.services.sent(self.device.values_mut(), &frame);
        Some(frame)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.device.poll_timeout().into_iter().chain(self.next_watch()).min()
    }
}

/// A firmware over a described device.
pub(crate) trait Described<S: Storage>: Application<S> {
    /// Node and services.
    fn base(&self) -> &DescribedDevice<S>;

    /// Node and services, to act on.
    fn base_mut(&mut self) -> &mut DescribedDevice<S>;

    /// The connection to the host is lost in one way, or that way is over. Reports it ([`DescribedDevice::report`]).
    fn connection(&mut self, loss: Loss, lost: bool, now: Instant) {
        self.base_mut().report(loss, lost, now);
    }

    /// A loss, and what CiA 301 has the node do.
    fn lose(&mut self, loss: Loss, now: Instant) {
        self.connection(loss, true, now);
        if matches!(loss, Loss::Silence | Loss::BusOff) {
            self.base_mut().follow_error_behaviour(now);
            self.handle_events(now);
        }
    }

    /// A peer wrote to `slot`; true if it was an object of the services.
    fn service_written(&mut self, slot: Slot, raw: u32, via: Via, now: Instant) -> bool {
        let base = self.base_mut();
        if base.take_program(slot, raw) {
            return true;
        }
        match base.services.written(&mut base.device, slot, raw, via) {
            Written::Elsewhere => return false,
            Written::Service => {}
            Written::WatchEnded => self.connection(Loss::Silence, false, now),
        }
        true
    }

    /// [`Application::nmt_changed`].
    fn follow_nmt(&mut self, state: NmtState, now: Instant) {
        let stopped = state == NmtState::Stopped;
        if core::mem::replace(&mut self.base_mut().stopped, stopped) != stopped {
            self.connection(Loss::Stopped, stopped, now);
        }
    }

    /// [`Station::ignores`].
    fn base_ignores(&self, frame: &Frame) -> bool {
        let base = self.base();
        base.device.ignores(frame) && !base.services.wants(frame) && !(base.lss.is_some() && Lss::wants(frame))
    }

    /// [`Station::handle_frame`].
    fn take_frame(&mut self, frame: &Frame, now: Instant) {
        if Lss::wants(frame) {
            if self.base_mut().handle_lss(frame, now) {
                self.reset(Reset::Communication, now);
                self.handle_events(now);
            }
            return;
        }
        let base = self.base_mut();
        if !base.is_node() || base.is_silent() {
            return;
        }
        if base.device.is_running() && base.services.wants(frame) {
            let state = base.device.node().state();
            if base.services.handle_frame(frame, base.device.values(), state, now) {
                self.connection(Loss::Silence, false, now);
            }
        }
        self.base_mut().device.handle_frame(frame, now);
        self.handle_events(now);
    }

    /// [`Station::handle_timeout`].
    fn take_timeout(&mut self, now: Instant) {
        let base = self.base_mut();
        if let Some(bitrate) = base.lss.as_mut().and_then(|lss| lss.handle_timeout(now)) {
            base.device.set_bitrate(bitrate);
        }
        base.device.handle_timeout(now);
        self.finish_reset(now);
        self.handle_events(now);
        let base = self.base_mut();
        if base.device.is_running() && base.services.handle_timeout(now) {
            self.lose(Loss::Silence, now);
        }
        if self.base_mut().device.is_task_due(now) {
            self.communication_task(now);
            let base = self.base_mut();
            base.services.run_task(&mut base.device, now);
        }
    }

    /// [`Station::handle_bus_off`].
    fn take_bus_off(&mut self, off: bool, now: Instant) {
        let base = self.base_mut();
        if !base.device.is_running() || !base.is_node() || core::mem::replace(&mut base.bus_off, off) == off {
            return;
        }
        if off {
            self.lose(Loss::BusOff, now);
        } else {
            self.connection(Loss::BusOff, false, now);
        }
    }

    /// [`Station::poll_transmit`].
    fn next_frame(&mut self) -> Option<Frame> {
        self.base_mut().poll_transmit()
    }

    /// [`Station::poll_timeout`].
    fn next_timeout(&self) -> Option<Instant> {
        self.base().poll_timeout()
    }
}

/// [`Station`] for a firmware that is [`Described`].
macro_rules! described_station {
    ($firmware:ident) => {
        impl<S: canopen::od::Storage> can::Station for $firmware<S> {
            fn ignores(&self, frame: &can::Frame) -> bool {
                self.base_ignores(frame)
            }

            fn handle_frame(&mut self, frame: &can::Frame, now: can::Instant) {
                self.take_frame(frame, now);
            }

            fn handle_timeout(&mut self, now: can::Instant) {
                self.take_timeout(now);
            }

            fn poll_transmit(&mut self) -> Option<can::Frame> {
                self.next_frame()
            }

            fn poll_timeout(&self) -> Option<can::Instant> {
                self.next_timeout()
            }

            fn handle_transmitted(&mut self, frame: &can::Frame, now: can::Instant) {
                self.base.device.handle_transmitted(frame, now);
            }

            fn handle_bus_off(&mut self, off: bool, now: can::Instant) {
                self.take_bus_off(off, now);
            }
        }
    };
}
pub(crate) use described_station;
