//! The device: node and services joined over the dictionary, with a supply switch. What it measures comes from outside.

use can::{Bitrate, Instant};
use canopen::node::{NodeProfile, Via};
use canopen::object::ERROR_REGISTER;
use canopen::od::{Dictionary, Slot, Storage};
use canopen::{AbortCode, Mux, NmtState, NodeId};
use devices::Description;
use devices::variant::Variant;

use super::Memory;
use super::described::{Described, DescribedDevice, described_station};
use crate::engine::device::{Application, Device, ResetTimes};

/// The firmware of a described device that is not a drive.
#[derive(Clone)]
pub struct DescribedNode<S: Storage> {
    description: &'static Description,
    base: DescribedDevice<S>,
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
        let memory = Memory::empty(description.dictionary);
        let base = DescribedDevice::new(profile, node_id, bitrate, memory, variant, description.lss);
        Self { description, base }
    }

    /// What it is built from.
    pub const fn description(&self) -> &'static Description {
        self.description
    }

    /// The values of the objects, to look at.
    pub const fn values(&self) -> &Dictionary<S> {
        self.base.device.values()
    }

    /// Its node-ID: the latest one, where LSS has taken it away.
    pub const fn node_id(&self) -> NodeId {
        self.base.device.node().node_id()
    }

    /// Bit rate in use.
    pub const fn bitrate(&self) -> Bitrate {
        self.base.device.bitrate()
    }

    /// NMT state.
    pub const fn nmt_state(&self) -> NmtState {
        self.base.device.node().state()
    }

    /// Supplied and started.
    pub const fn is_running(&self) -> bool {
        self.base.device.is_running()
    }

    /// Supply voltage arrives: starts with what the memory holds, and sends the boot-up message.
    pub fn power_on(&mut self, memory: Memory<S>, now: Instant) {
        self.base.power_on(memory);
        self.restart(now);
    }

    /// How long the next resets by NMT take.
    pub const fn set_reset_times(&mut self, times: ResetTimes) {
        self.base.device.set_reset_times(times);
    }

    /// Supply voltage is gone.
    pub fn power_off(&mut self) {
        self.base.device.power_off();
    }

    /// Contents of the memory chip, and a number that changes with them.
    pub const fn memory(&self) -> (&Memory<S>, u32) {
        self.base.services.memory()
    }

    /// The application has a new value for an object, as an SDO would carry it: what a sensor measured, whatever its access
    /// is. Event-driven TPDOs become due. A new error register (1001h) is reported: an EMCY message with the code
    /// 1000h for an error, 0000h when none is left.
    ///
    /// # Errors
    /// [`AbortCode::TOO_LONG`] and [`AbortCode::TOO_SHORT`] if the object is for another number of bytes,
    /// [`AbortCode::READ_ONLY`] for a string that never changes.
    pub fn set(&mut self, slot: Slot, bytes: &[u8], now: Instant) -> Result<(), AbortCode> {
        let device = &mut self.base.device;
        if device.values().table().row(slot).mux() == ERROR_REGISTER {
            device.values().view().check_length(slot, bytes.len())?;
            device.report_own_errors(bytes.first().copied().unwrap_or(0), now);
        } else {
            device.values_mut().set_bytes(slot, bytes)?;
        }
        device.notice_changes(now);
        Ok(())
    }

    /// Where an object is, if the device has it.
    pub fn find(&self, mux: Mux) -> Option<Slot> {
        self.description.dictionary.find(mux).ok()
    }
}

impl<S: Storage> Application<S> for DescribedNode<S> {
    fn device(&mut self) -> &mut Device<S> {
        &mut self.base.device
    }

    fn written(&mut self, slot: Slot, raw: u32, _via: Via, now: Instant) -> bool {
        self.service_written(slot, raw, now);
        false
    }

    fn show_status(&mut self) {}

    fn nmt_changed(&mut self, state: NmtState, now: Instant) {
        self.follow_nmt(state, now);
    }

    fn restart(&mut self, now: Instant) {
        self.base.restart(now);
        self.base.boot(now);
    }

    fn restart_communication(&mut self, now: Instant) {
        self.base.restart_communication(now);
    }

    fn communication_task(&mut self, now: Instant) {
        self.base.device.notice_changes(now);
    }
}

impl<S: Storage> Described<S> for DescribedNode<S> {
    fn base(&self) -> &DescribedDevice<S> {
        &self.base
    }

    fn base_mut(&mut self) -> &mut DescribedDevice<S> {
        &mut self.base
    }
}

described_station!(DescribedNode);
