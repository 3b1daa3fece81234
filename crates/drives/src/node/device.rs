//! The device: node and services joined over the dictionary, with a supply switch. What it measures comes from outside.

use can::{Bitrate, Frame, Instant, Station};
use canopen::node::{NodeProfile, Via};
use canopen::od::{Dictionary, Entry, Slot, Storage};
use canopen::{Mux, NmtState, NodeId};
use devices::Description;
use devices::variant::Variant;

use super::{Memory, Services};
use crate::engine::device::{Application, Device};
use crate::engine::storage::StoredImage;

const COMMUNICATION_PERIOD_NS: u64 = 1_000_000;

/// The firmware of a described device that is no drive.
#[derive(Clone)]
pub struct DescribedNode<S: Storage> {
    description: &'static Description,
    device: Device<S>,
    services: Services,
    node_id: NodeId,
    bitrate: Bitrate,
}

impl<S: Storage> DescribedNode<S> {
    /// A device without supply: [`power_on`](Self::power_on) starts it. `profile` is how `description` communicates
    /// ([`communication`](crate::communication::communication)).
    ///
    /// # Panics
    /// If the description has more rows than a firmware holds.
    pub fn new(
        description: &'static Description,
        profile: &'static NodeProfile,
        node_id: NodeId,
        bitrate: Bitrate,
    ) -> Self {
        let variant = Variant::first_of(description.variations);
        Self {
            description,
            device: Device::new(profile, bitrate, StoredImage::BLANK, COMMUNICATION_PERIOD_NS, variant),
            services: Services::new(Memory::empty()),
            node_id,
            bitrate,
        }
    }

    /// What it is built from.
    pub const fn description(&self) -> &'static Description {
        self.description
    }

    /// The values of the objects, to look at.
    pub const fn values(&self) -> &Dictionary<S> {
        self.device.values()
    }

    /// Its node-ID.
    pub const fn node_id(&self) -> NodeId {
        self.node_id
    }

    /// Bit rate in use.
    pub const fn bitrate(&self) -> Bitrate {
        self.device.bitrate()
    }

    /// NMT state.
    pub const fn nmt_state(&self) -> NmtState {
        self.device.node().state()
    }

    /// Supplied and started.
    pub const fn is_running(&self) -> bool {
        self.device.is_running()
    }

    /// Supply voltage arrives: starts with what the memory holds, and sends the boot-up message.
    pub fn power_on(&mut self, memory: Memory, now: Instant) {
        self.device.power_on(StoredImage::BLANK);
        self.services.power_on(memory);
        self.restart(now);
    }

    /// Supply voltage is gone.
    pub fn power_off(&mut self) {
        self.device.power_off();
    }

    /// Contents of the memory chip, and a number that changes with them.
    pub const fn memory(&self) -> (&Memory, u32) {
        self.services.memory()
    }

    /// The application has a new value for an object: what a sensor measured, whatever its access is. Event-driven TPDOs
    /// become due.
    pub fn set(&mut self, slot: Slot, raw: u32, now: Instant) {
        self.device.values_mut().set_raw(slot, raw);
        self.device.notice_changes(now);
    }

    /// Where an object is, if the device has it.
    pub fn find(&self, mux: Mux) -> Option<Slot> {
        self.description.dictionary.find(mux).ok()
    }
}

impl<S: Storage> Application<S> for DescribedNode<S> {
    fn device(&mut self) -> &mut Device<S> {
        &mut self.device
    }

    fn written(&mut self, slot: Slot, raw: u32, _via: Via, _now: Instant) -> bool {
        let _ = self.services.written(&mut self.device, slot, raw);
        false
    }

    fn show_status(&mut self) {}

    fn restart(&mut self, now: Instant) {
        self.device.restart(self.node_id, self.bitrate, now);
        self.services.start(&mut self.device, |_| true);
        self.device.boot(now);
    }

    fn restart_communication(&mut self, now: Instant) {
        self.device.restart_communication(now);
        self.services.start(&mut self.device, Entry::is_communication);
        self.device.boot(now);
    }

    fn communication_task(&mut self, now: Instant) {
        self.device.notice_changes(now);
    }
}

impl<S: Storage> Station for DescribedNode<S> {
    fn ignores(&self, frame: &Frame) -> bool {
        self.device.ignores(frame) && !self.services.wants(frame)
    }

    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        if self.device.is_running() && self.services.wants(frame) && self.services.handle_frame(frame, now) {
            self.device.report_heartbeat(true, now);
        }
        self.device.handle_frame(frame, now);
        self.handle_events(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.device.handle_timeout(now);
        self.handle_events(now);
        if self.device.is_running() && self.services.handle_timeout(now) {
            self.device.report_heartbeat(false, now);
        }
        if self.device.is_task_due(now) {
            self.communication_task(now);
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        let frame = self.device.poll_transmit()?;
        self.services.sent(self.device.values_mut(), &frame);
        Some(frame)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let own = self.device.poll_timeout();
        let watch = self.services.poll_timeout().filter(|_| self.device.is_running());
        match (own, watch) {
            (Some(own), Some(watch)) => Some(own.min(watch)),
            (own, watch) => own.or(watch),
        }
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.device.handle_transmitted(frame, now);
    }
}
