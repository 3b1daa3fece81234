//! A described device that is no drive: its objects on the bus, a supply switch and a memory, and nothing that turns.

use can::{Bitrate, Frame, Instant, Station};
use canopen::Mux;
use canopen::od::{DataType, Entry};
use devices::{AxisId, Description};
use drives::node::{DescribedNode, Memory, conditions};

use super::boxed::Boxed;
use super::kept;
use super::order::{self, Order, OrderError};
use crate::stimulus::{ObjectValue, Power, Stimulus};
use crate::{Refused, Report, Source, VirtualDrive};

/// Supply that such devices have. Assumed: the 24 V of control cabinets.
const SUPPLY_V: f64 = 24.0;

/// A described node, as a station of a world.
#[derive(Clone)]
pub struct NodeMachine {
    firmware: DescribedNode<Boxed>,
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
    pub const fn firmware(&self) -> &DescribedNode<Boxed> {
        &self.firmware
    }

    fn switch(&mut self, on: bool, now: Instant) {
        if self.firmware.is_running() {
            self.memory = *self.firmware.memory().0;
            self.firmware.power_off();
        }
        if on {
            self.firmware.power_on(self.memory, now);
        }
    }

    /// As the device's application would: what a sensor measured, whatever the object's access is.
    fn set_object(&mut self, object: Mux, value: &ObjectValue, now: Instant) -> Result<(), Refused> {
        let bad = |reason: String| Refused::BadObject { object, reason };
        let slot = self.firmware.find(object).ok_or_else(|| bad("the device has no such object".to_owned()))?;
        if !self.firmware.is_running() {
            return Err(bad("the device has no power".to_owned()));
        }
        let raw = raw(self.firmware.values().table().row(slot), value).map_err(bad)?;
        self.firmware.set(slot, raw, now);
        Ok(())
    }

    const fn absent(&self, what: &'static str) -> Refused {
        Refused::Absent { model: self.firmware.description().name, what }
    }
}

/// The cell of an object for a value, or what the object would take.
fn raw(row: &Entry, value: &ObjectValue) -> Result<u32, String> {
    let (data_type, name) = (row.data_type, row.data_type.name());
    match (data_type, value) {
        (DataType::Real32, ObjectValue::Real(real)) => Ok((*real as f32).to_bits()),
        (DataType::Real32, ObjectValue::Integer(integer)) => Ok((*integer as f32).to_bits()),
        (DataType::Boolean, ObjectValue::Integer(integer @ 0..=1)) => Ok(u32::from(*integer == 1)),
        (_, ObjectValue::Integer(integer)) if data_type.fits_cell() && data_type.is_integer() => {
            let (low, high) = data_type.range();
            let fits = i64::try_from(*integer).ok().filter(|integer| (low..=high).contains(integer));
            fits.map(|integer| data_type.raw(integer)).ok_or_else(|| format!("{name} takes {low} to {high}"))
        }
        _ if !data_type.fits_cell() => Err(format!("it is of type {name}, which cannot be set from outside")),
        _ => Err(format!("it is of type {name}")),
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

    fn description(&self) -> Option<&'static Description> {
        Some(self.firmware.description())
    }

    fn apply(&mut self, axis: AxisId, stimulus: &Stimulus, now: Instant) -> Result<(), Refused> {
        self.check_axis(axis)?;
        match stimulus {
            Stimulus::Power(Power::Cycle) => {
                self.switch(false, now);
                self.switch(true, now);
            }
            Stimulus::Power(power) => self.switch(*power == Power::On, now),
            Stimulus::Object { mux, value } => return self.set_object(*mux, value, now),
            Stimulus::Input { name, .. } | Stimulus::Switch { name, .. } => {
                self.input_number(name)?;
            }
            Stimulus::LoadTorque(_) | Stimulus::LoadInertia(_) | Stimulus::Load(_) | Stimulus::RotorLock(_) => {
                return Err(self.absent("motor"));
            }
            Stimulus::Supply(source) if *source == Source::default() => {}
            Stimulus::Supply(_) => return Err(self.absent("supply but on and off")),
            Stimulus::Temperature(..) => return Err(self.absent("such sensor")),
            Stimulus::Fault(..) => return Err(self.absent("such component")),
            Stimulus::Battery(_) => return Err(self.absent("battery")),
            Stimulus::Pulses(_) => return Err(self.absent("pulse input")),
            Stimulus::CableCut(_) | Stimulus::Bus(_) => return Err(self.absent("cable but the world's")),
        }
        Ok(())
    }

    fn bitrate(&self) -> Option<Bitrate> {
        self.firmware.is_running().then(|| self.firmware.bitrate())
    }

    fn advance(&mut self, _now: Instant) {}

    fn report(&self) -> Report {
        let powered = self.firmware.is_running();
        let supply_v = if powered { SUPPLY_V } else { 0.0 };
        let nmt = powered.then(|| self.firmware.nmt_state());
        Report { node: self.firmware.node_id().raw(), powered, nmt, supply_v, ..Report::default() }
    }

    fn inputs(&self) -> &'static [&'static str] {
        &[]
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
