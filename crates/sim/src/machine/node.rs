//! A described device that is no drive: its objects on the bus, a supply switch and a memory, and nothing that turns.

use can::{Bitrate, Frame, Instant, Station};
use devices::Description;
use drives::node::{DescribedNode, Memory, conditions};

use super::kept;
use super::order::{self, Order, OrderError};
use crate::{Component, Refused, Report, SwitchRange, TemperatureSensor, VirtualDrive};

/// Supply that such devices have. Assumed: the 24 V of control cabinets.
const SUPPLY_V: f64 = 24.0;

/// A described node, as a station of a world.
#[derive(Clone)]
pub struct NodeMachine {
    firmware: DescribedNode,
    memory: Memory,
}

/// A node of this description as ordered, without power.
pub(super) fn ordered(model: &'static Description, order: &Order) -> Result<Box<dyn VirtualDrive>, OrderError> {
    let memory = order::memory(model, order)?;
    let profile = kept::profile(model, conditions(model.dictionary));
    Ok(Box::new(NodeMachine { firmware: DescribedNode::new(model, profile, order.node, order.bitrate), memory }))
}

impl NodeMachine {
    /// The firmware, to look at.
    pub const fn firmware(&self) -> &DescribedNode {
        &self.firmware
    }

    const fn absent(&self, what: &'static str) -> Refused {
        Refused::Absent { model: self.firmware.description().name, what }
    }
}

impl Station for NodeMachine {
    fn ignores(&self, frame: &Frame) -> bool {
        self.firmware.ignores(frame)
    }

    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        self.firmware.handle_frame(frame, now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.firmware.handle_timeout(now);
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.firmware.poll_transmit()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.firmware.poll_timeout()
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.firmware.handle_transmitted(frame, now);
    }
}

impl VirtualDrive for NodeMachine {
    fn model(&self) -> &'static str {
        self.firmware.description().name
    }

    fn set_power(&mut self, on: bool, now: Instant) {
        if self.firmware.is_running() {
            self.memory = *self.firmware.memory().0;
            self.firmware.power_off();
        }
        if on {
            self.firmware.power_on(self.memory, now);
        }
    }

    fn bitrate(&self) -> Option<Bitrate> {
        self.firmware.is_running().then(|| self.firmware.bitrate())
    }

    fn advance(&mut self, _now: Instant) {}

    fn report(&self) -> Report {
        let powered = self.firmware.is_running();
        let supply_v = if powered { SUPPLY_V } else { 0.0 };
        Report { node: self.firmware.node_id().raw(), powered, supply_v, ..Report::default() }
    }

    fn inputs(&self) -> &'static [&'static str] {
        &[]
    }

    fn set_input(&mut self, _input: usize, _level: bool, _now: Instant) -> Result<(), Refused> {
        Err(self.absent("such input"))
    }

    fn set_switch(&mut self, _input: usize, _range: SwitchRange, _now: Instant) -> Result<(), Refused> {
        Err(self.absent("such input"))
    }

    fn set_load_torque(&mut self, _torque_nm: f64, _now: Instant) -> Result<(), Refused> {
        Err(self.absent("motor"))
    }

    fn set_load_inertia(&mut self, _inertia_kg_m2: f64, _now: Instant) -> Result<(), Refused> {
        Err(self.absent("motor"))
    }

    fn set_rotor_locked(&mut self, _locked: bool, _now: Instant) -> Result<(), Refused> {
        Err(self.absent("motor"))
    }

    fn set_supply(&mut self, _supply_v: f64, _now: Instant) -> Result<(), Refused> {
        Err(self.absent("supply but on and off"))
    }

    fn hold_temperature(
        &mut self,
        _sensor: TemperatureSensor,
        _celsius: Option<f64>,
        _now: Instant,
    ) -> Result<(), Refused> {
        Err(self.absent("such sensor"))
    }

    fn set_fault(&mut self, _component: Component, _broken: bool, _now: Instant) -> Result<(), Refused> {
        Err(self.absent("such component"))
    }

    fn nvm_generation(&self) -> u64 {
        u64::from(self.firmware.memory().1)
    }

    fn nvm_image(&self) -> Vec<u8> {
        let memory = if self.firmware.is_running() { self.firmware.memory().0 } else { &self.memory };
        memory.bytes().to_vec()
    }

    fn load_nvm(&mut self, image: &[u8]) -> Result<(), Refused> {
        if image.len() != self.memory.bytes().len() {
            let model = self.firmware.description().name;
            return Err(Refused::BadImage { model, reason: "it has another length" });
        }
        self.memory = Memory::from_bytes(image);
        Ok(())
    }
}
