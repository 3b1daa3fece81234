//! The device: node, services and what its profile says of its objects, joined over the dictionary, with a supply switch. What it
//! measures comes from outside.

use can::{Bitrate, Instant};
use canopen::node::{NodeProfile, Via};
use canopen::object::ERROR_REGISTER;
use canopen::od::{Dictionary, Slot, Storage};
use canopen::{AbortCode, Mux, NmtState, NodeId};
use devices::Description;
use devices::variant::Variant;

use super::described::{Described, DescribedDevice, Loss, described_station};
use super::encoder;
use super::profile::Profile;
use super::{Memory, Overheard};
use crate::engine::device::{Application, Device, ResetTimes};

/// The firmware of a described device that is not a drive.
#[derive(Clone)]
pub struct DescribedNode<S: Storage> {
    description: &'static Description,
    base: DescribedDevice<S>,
    profile: Profile,
    /// NMT operational.
    operational: bool,
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
        Self { description, base, profile: Profile::of(description), operational: false }
    }

    /// Lines of digital inputs and of digital outputs (CiA 401).
    pub fn lines(&self) -> [u8; 2] {
        self.profile.lines(self.values())
    }

    /// Levels at the digital inputs and at the digital outputs, the first line in bit 0. Outputs are off without power.
    pub fn levels(&self) -> [u64; 2] {
        let [inputs, outputs] = self.profile.levels(self.values());
        [inputs, if self.is_running() { outputs } else { 0 }]
    }

    /// The level at a digital input changes; lines count from 0, as many as there are [`lines`](Self::lines).
    pub fn set_input(&mut self, line: u8, level: bool, now: Instant) {
        if line < self.lines()[0] {
            self.profile.set_input(self.base.device.values_mut(), line, level);
            self.notice(now);
        }
    }

    /// Values of the analogue channels by their objects (CiA 401): inputs, then outputs. None without power.
    pub fn analogue(&self) -> impl Iterator<Item = (Mux, i64)> {
        self.is_running().then(|| self.profile.analogue(self.values())).into_iter().flatten()
    }

    /// The position that an encoder shows, 6004h; `None` without power, and of what is not an encoder.
    pub fn encoder_position(&self) -> Option<i64> {
        (self.is_encoder() && self.is_running()).then(|| self.values().view().value(encoder::POSITION).ok()).flatten()
    }

    /// It is an encoder (CiA 406), which [sees](Self::see_shaft) a shaft.
    pub const fn is_encoder(&self) -> bool {
        self.profile.is_encoder()
    }

    /// The shaft that an encoder sits on (CiA 406) is at so many turns, and turns so fast, in turns a second.
    pub fn see_shaft(&mut self, turns: f64, turns_s: f64) {
        self.profile.see_shaft(self.base.device.values_mut(), turns, turns_s);
    }

    fn notice(&mut self, now: Instant) {
        if self.profile.take_event() {
            self.base.device.notice_changes(now);
        }
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

    /// What it has heard of others: TIME and their EMCY messages.
    pub const fn overheard(&self) -> &Overheard {
        self.base.services.overheard()
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
        let mux = device.values().table().row(slot).mux();
        self.profile.measured(self.base.device.values(), mux);
        self.notice(now);
        Ok(())
    }

    /// Its application writes a value to an object of another node, or of all, by a TPDO in destination address mode (FFh in
    /// sub-index 00h of its mapping; CiA 301, 7.2.3). False if there is none that has nothing to send, or the node is not
    /// operational.
    pub fn send_to_destination(&mut self, to: Option<NodeId>, object: Mux, data: [u8; 4], now: Instant) -> bool {
        self.base.device.send_to_destination(to, object, data, now)
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

    fn written(&mut self, slot: Slot, raw: u32, via: Via, now: Instant) -> bool {
        if !self.service_written(slot, raw, via, now) {
            let mux = self.base.device.values().table().row(slot).mux();
            if let Some((slot, raw)) = self.profile.written(self.base.device.values_mut(), mux) {
                self.base.device.write_own(slot, raw);
            }
        }
        false
    }

    fn show_status(&mut self) {}

    fn nmt_changed(&mut self, state: NmtState, now: Instant) {
        self.follow_nmt(state, now);
        let operational = state == NmtState::Operational;
        if core::mem::replace(&mut self.operational, operational) && !operational {
            self.profile.fail(self.base.device.values_mut());
        }
    }

    fn restart(&mut self, now: Instant) {
        self.base.restart(now);
        self.operational = false;
        self.profile.restart(self.base.device.values_mut());
        self.base.boot(now);
    }

    fn restart_communication(&mut self, now: Instant) {
        if core::mem::replace(&mut self.operational, false) {
            self.profile.fail(self.base.device.values_mut());
        }
        self.base.restart_communication(now);
    }

    fn communication_task(&mut self, now: Instant) {
        self.notice(now);
    }
}

impl<S: Storage> Described<S> for DescribedNode<S> {
    fn base(&self) -> &DescribedDevice<S> {
        &self.base
    }

    fn base_mut(&mut self) -> &mut DescribedDevice<S> {
        &mut self.base
    }

    fn connection(&mut self, loss: Loss, lost: bool, now: Instant) {
        if lost && matches!(loss, Loss::Silence | Loss::BusOff) {
            self.profile.fail(self.base.device.values_mut());
        }
        self.base.report(loss, lost, now);
    }
}

described_station!(DescribedNode);
