//! A described device that is not a drive: its objects on the bus, a supply switch and a memory, terminals
//! by CiA 401, the eye of an encoder by CiA 406, and nothing that turns.

use can::{Bitrate, Frame, Instant, Station};
use canopen::Mux;
use canopen::od::{DataType, Entry, Kind, Value};
use devices::{AxisId, Description};
use drives::node::{DescribedNode, Memory, conditions, profile_conditions};

use super::boxed::Boxed;
use super::kept;
use super::order::{self, Order, OrderError};
use crate::machine::kernel::NMT;
use crate::machine::kernel::timing::{OwnTime, TimingMode};
use crate::stimulus::{ObjectValue, Power, Stimulus};
use crate::{Levels, PowerPhase, Refused, Report, Source, VirtualDrive};

/// Supply that such devices have. Assumed: the 24 V of control cabinets.
const SUPPLY_V: f64 = 24.0;

/// Digital inputs of CiA 401, the first line first.
#[rustfmt::skip]
const INPUTS: [&str; 64] = [
    "DI1", "DI2", "DI3", "DI4", "DI5", "DI6", "DI7", "DI8",
    "DI9", "DI10", "DI11", "DI12", "DI13", "DI14", "DI15", "DI16",
    "DI17", "DI18", "DI19", "DI20", "DI21", "DI22", "DI23", "DI24",
    "DI25", "DI26", "DI27", "DI28", "DI29", "DI30", "DI31", "DI32",
    "DI33", "DI34", "DI35", "DI36", "DI37", "DI38", "DI39", "DI40",
    "DI41", "DI42", "DI43", "DI44", "DI45", "DI46", "DI47", "DI48",
    "DI49", "DI50", "DI51", "DI52", "DI53", "DI54", "DI55", "DI56",
    "DI57", "DI58", "DI59", "DI60", "DI61", "DI62", "DI63", "DI64",
];

/// Digital outputs.
#[rustfmt::skip]
const OUTPUTS: [&str; 64] = [
    "DO1", "DO2", "DO3", "DO4", "DO5", "DO6", "DO7", "DO8",
    "DO9", "DO10", "DO11", "DO12", "DO13", "DO14", "DO15", "DO16",
    "DO17", "DO18", "DO19", "DO20", "DO21", "DO22", "DO23", "DO24",
    "DO25", "DO26", "DO27", "DO28", "DO29", "DO30", "DO31", "DO32",
    "DO33", "DO34", "DO35", "DO36", "DO37", "DO38", "DO39", "DO40",
    "DO41", "DO42", "DO43", "DO44", "DO45", "DO46", "DO47", "DO48",
    "DO49", "DO50", "DO51", "DO52", "DO53", "DO54", "DO55", "DO56",
    "DO57", "DO58", "DO59", "DO60", "DO61", "DO62", "DO63", "DO64",
];

/// A described node, as a station of a world.
#[derive(Clone)]
pub struct NodeMachine {
    firmware: DescribedNode<Boxed>,
    memory: Memory<Boxed>,
    supply: Supply,
    /// What it takes between bus and firmware; none if it takes no time.
    own_time: Option<Box<OwnTime>>,
}

/// The switch in front of it. There is no capacitor that would let it live on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Supply {
    Off,
    /// The firmware starts then.
    Booting(Instant),
    On,
}

/// A node of this description as ordered, without power.
pub(super) fn ordered(model: &'static Description, order: &Order) -> Result<Box<dyn VirtualDrive>, OrderError> {
    let memory = order::memory(model, order)?;
    let profile = kept::profile(model, conditions(model.dictionary).chain(profile_conditions(model)));
    let firmware = DescribedNode::new(model, profile, order.node, order.bitrate);
    Ok(Box::new(NodeMachine { firmware, memory, supply: Supply::Off, own_time: None }))
}

impl NodeMachine {
    /// The firmware, to look at.
    pub const fn firmware(&self) -> &DescribedNode<Boxed> {
        &self.firmware
    }

    fn switch(&mut self, on: bool, now: Instant) {
        if self.supply == Supply::On {
            let (memory, generation) = self.firmware.memory();
            self.memory = memory.clone();
            if let Some(own_time) = &mut self.own_time {
                own_time.power_off();
                own_time.chip.advance(now);
                own_time.chip.power_off(None, u64::from(generation));
                self.memory = Memory::from_bytes(self.firmware.description().dictionary, own_time.chip.contents());
            }
            self.firmware.power_off();
        }
        self.supply = Supply::Off;
        if on {
            let boot_ns = self.own_time.as_mut().map_or(0, |own_time| own_time.boot_ns());
            self.supply = Supply::Booting(now.plus_nanos(boot_ns));
            self.boot_if_due(now);
        }
    }

    fn boot_if_due(&mut self, now: Instant) {
        if let Supply::Booting(due) = self.supply
            && due <= now
        {
            self.supply = Supply::On;
            self.firmware.power_on(self.memory.clone(), now);
        }
    }

    fn hand_over(&mut self, frame: &Frame, now: Instant) {
        if let Some(own_time) = self.own_time.as_mut().filter(|_| frame.standard_data_id() == Some(NMT)) {
            self.firmware.set_reset_times(own_time.reset_times());
        }
        self.firmware.handle_frame(frame, now);
    }

    fn note_store(&mut self, now: Instant) {
        if let Some(own_time) = &mut self.own_time {
            own_time.chip.advance(now);
            let (memory, generation) = self.firmware.memory();
            own_time.store(memory.bytes(), u64::from(generation), now);
        }
    }

    fn phase(&self) -> PowerPhase {
        match self.supply {
            Supply::Off => PowerPhase::Off,
            Supply::On if self.firmware.is_running() => PowerPhase::On,
            Supply::On | Supply::Booting(_) => PowerPhase::Booting,
        }
    }

    /// As the device's application would: what a sensor measured, whatever the object's access is.
    fn set_object(&mut self, object: Mux, value: &ObjectValue, now: Instant) -> Result<(), Refused> {
        let bad = |reason: String| Refused::BadObject { object, reason };
        let slot = self.firmware.find(object).ok_or_else(|| bad("the device has no such object".to_owned()))?;
        if !self.firmware.is_running() {
            return Err(bad("the device has no power, or has not booted".to_owned()));
        }
        let row = self.firmware.values().table().row(slot);
        let bytes = bytes(row, value).map_err(bad)?;
        self.firmware.set(slot, &bytes, now).map_err(|_| bad(room(row)))
    }

    const fn absent(&self, what: &'static str) -> Refused {
        Refused::Absent { model: self.firmware.description().name, what }
    }
}

/// A value as an SDO carries it, or what the object would take.
fn bytes(row: &Entry, value: &ObjectValue) -> Result<Vec<u8>, String> {
    let (data_type, name) = (row.data_type, row.data_type.name());
    let number =
        |value: Value<'_>| value.to_bits(data_type).map(|bits| bits.to_le_bytes()[..data_type.size()].to_vec());
    let of_type = || format!("it is of type {name}");
    match (data_type.kind(), value) {
        (Kind::Real, ObjectValue::Real(real)) => number(as_real(data_type, *real)).ok_or_else(of_type),
        (Kind::Real, ObjectValue::Integer(integer)) => number(as_real(data_type, *integer as f64)).ok_or_else(of_type),
        (Kind::Signed | Kind::Unsigned, ObjectValue::Integer(integer)) => {
            let value = i64::try_from(*integer).map(Value::Integer).ok();
            let value = value.or(u64::try_from(*integer).ok().map(Value::Unsigned));
            let high =
                if data_type == DataType::Unsigned64 { u64::MAX.into() } else { i128::from(data_type.range().1) };
            value.and_then(number).ok_or_else(|| format!("{name} takes {} to {high}", data_type.range().0))
        }
        (Kind::Bytes, ObjectValue::Text(text)) if data_type == DataType::UnicodeString => {
            Ok(text.encode_utf16().flat_map(u16::to_le_bytes).collect())
        }
        (Kind::Bytes, ObjectValue::Text(text)) => {
            // One byte a letter, as in a file: ISO 8859-1.
            let letters: Option<Vec<u8>> = text.chars().map(|letter| u8::try_from(letter).ok()).collect();
            letters.ok_or_else(|| format!("{name} takes letters of ISO 8859-1, one byte each"))
        }
        (Kind::Bytes, _) => Err(format!("{}: a text in quotation marks is meant", of_type())),
        _ => Err(of_type()),
    }
}

fn as_real(data_type: DataType, real: f64) -> Value<'static> {
    if data_type.size() == 4 { Value::Real32(real as f32) } else { Value::Real64(real) }
}

/// Why a value of the right type does not fit.
fn room(row: &Entry) -> String {
    match row.stored_bytes() {
        0 => format!("it is a {} that never changes", row.data_type.name()),
        most => format!("it holds {most} bytes"),
    }
}

impl Station for NodeMachine {
    fn ignores(&self, frame: &Frame) -> bool {
        self.firmware.ignores(frame)
    }

    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        let frame = match &mut self.own_time {
            _ if self.supply != Supply::On => None,
            None => Some(*frame),
            Some(own_time) => own_time.take_in(frame, now),
        };
        if let Some(frame) = frame {
            self.hand_over(&frame, now);
            self.note_store(now);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.boot_if_due(now);
        while let Some(frame) = self.own_time.as_mut().and_then(|own_time| own_time.take_out(now)) {
            self.hand_over(&frame, now);
        }
        self.firmware.handle_timeout(now);
        self.note_store(now);
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        let needed = u64::from(self.firmware.memory().1);
        match &mut self.own_time {
            None => self.firmware.poll_transmit(),
            Some(own_time) => own_time.next_frame(needed, || self.firmware.poll_transmit()),
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        if let Supply::Booting(due) = self.supply {
            return Some(due);
        }
        let own = self.own_time.as_ref().and_then(|own_time| own_time.next_due());
        self.firmware.poll_timeout().into_iter().chain(own).min()
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.firmware.handle_transmitted(frame, now);
    }

    fn handle_bus_off(&mut self, off: bool, now: Instant) {
        self.firmware.handle_bus_off(off, now);
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
            Stimulus::Mpdo { to, object, value } => {
                let data = (*value as u32).to_le_bytes();
                if !self.firmware.send_to_destination(*to, *object, data, now) {
                    return Err(Refused::NotSent { model: self.firmware.description().name });
                }
            }
            Stimulus::Input { name, level } => {
                let line = self.input_number(name)?;
                self.firmware.set_input(line as u8, *level, now);
            }
            Stimulus::Switch { name, .. } => {
                self.input_number(name)?;
                return Err(self.absent("position that an input could be tied to"));
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

    fn set_timing(&mut self, mode: TimingMode, seed: u64, _now: Instant) {
        let (image, generation) = (self.nvm_image(), self.nvm_generation());
        let timing = self.firmware.description().timing;
        self.own_time = (mode == TimingMode::Device).then(|| Box::new(OwnTime::new(timing, seed, &image, generation)));
        self.firmware
            .set_reset_times(self.own_time.as_mut().map(|own_time| own_time.reset_times()).unwrap_or_default());
    }

    fn bitrate(&self) -> Option<Bitrate> {
        self.firmware.is_running().then(|| self.firmware.bitrate())
    }

    fn advance(&mut self, _now: Instant) {}

    fn report(&self) -> Report {
        let powered = self.supply != Supply::Off;
        let supply_v = if powered { SUPPLY_V } else { 0.0 };
        let nmt = self.firmware.is_running().then(|| self.firmware.nmt_state());
        let node = self.firmware.node_id().raw();
        let outputs =
            Levels { names: &OUTPUTS[..usize::from(self.firmware.lines()[1])], bits: self.firmware.levels()[1] };
        let position = self.firmware.encoder_position().unwrap_or(0);
        Report { node, powered, power: self.phase(), nmt, position, supply_v, outputs, ..Report::default() }
    }

    fn inputs(&self) -> &'static [&'static str] {
        &INPUTS[..usize::from(self.firmware.lines()[0])]
    }

    fn input_levels(&self) -> Levels {
        Levels { names: self.inputs(), bits: self.firmware.levels()[0] }
    }

    fn analogue(&self) -> Vec<(Mux, i64)> {
        self.firmware.analogue().collect()
    }

    fn reads_a_shaft(&self) -> bool {
        self.firmware.is_encoder()
    }

    fn see_shaft(&mut self, turns: f64, turns_s: f64) {
        self.firmware.see_shaft(turns, turns_s);
    }

    fn nvm_generation(&self) -> u64 {
        let own = u64::from(self.firmware.memory().1);
        self.own_time.as_ref().map_or(own, |own_time| own_time.chip.generation())
    }

    fn is_storing(&self) -> bool {
        self.own_time.as_ref().is_some_and(|own_time| own_time.chip.is_writing())
    }

    fn nvm_image(&self) -> Vec<u8> {
        match &self.own_time {
            Some(own_time) => own_time.chip.contents().to_vec(),
            None if self.supply == Supply::On => self.firmware.memory().0.bytes().to_vec(),
            None => self.memory.bytes().to_vec(),
        }
    }

    fn load_nvm(&mut self, image: &[u8]) -> Result<(), Refused> {
        if image.len() != self.memory.bytes().len() {
            let model = self.firmware.description().name;
            return Err(Refused::BadImage { model, reason: "it has another length" });
        }
        self.memory = Memory::from_bytes(self.firmware.description().dictionary, image);
        if let Some(own_time) = &mut self.own_time {
            own_time.chip.replace(image);
        }
        Ok(())
    }
}
