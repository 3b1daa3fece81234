//! The contract of a virtual drive: what a world, a test or a person at the machine can do to one, whatever its model.
//!
//! Units are SI, positions are the drive's own counts, speeds are those of the motor shaft in r/min.

use can::{Bitrate, Instant, Station};
use drives::RegisterError;

use crate::machine::Realism;

/// A drive joined to its physics: firmware, motor, load, supply and sensors as one station.
///
/// Every method that changes something takes `now`: the drive first does everything that was due
/// before `now` with the old values, then takes the new one. What a model does not have it refuses.
///
/// The bus interface (mailboxes, error counters, cable) belongs to the [`World`](crate::World), not
/// to the drive.
pub trait VirtualDrive: Station + VirtualDriveClone + Send {
    /// The model's name as users type it: `zlac8030l`.
    fn model(&self) -> &'static str;

    /// Switches the supply. Switching on boots the firmware. Switched off it lives on the charge of its bus, sees the
    /// voltage fall, and loses all that is not stored when it dies. Switched on before that, the supply waits: each time
    /// off ends in a restart.
    fn set_power(&mut self, on: bool, now: Instant);

    /// Takes the supply away and the charge of the bus with it: the firmware is dead at once, in the middle of whatever
    /// it did.
    fn cut_power(&mut self, now: Instant) {
        self.set_power(false, now);
    }

    /// Whether it is as it is calculated, or has the noise and the flaws of one on a bench; `seed` decides all of that.
    fn set_realism(&mut self, realism: Realism, seed: u64, now: Instant) {
        let _ = (realism, seed, now);
    }

    /// The bit rate of its CAN controller at present; `None` while it takes no part in the bus (no power).
    fn bitrate(&self) -> Option<Bitrate>;

    /// Brings control loops and physics up to `now`. Never changes what happens, only when it is computed.
    fn advance(&mut self, now: Instant);

    /// What a person standing beside the machine could measure, as of the last [`advance`](Self::advance).
    fn report(&self) -> Report;

    /// Names of the digital inputs, e.g. `X0`, `X1`; an input is addressed by its place in this list.
    fn inputs(&self) -> &'static [&'static str];

    /// Sets the level at digital input number `input`; removes a switch tied to it.
    fn set_input(&mut self, input: usize, level: bool, now: Instant) -> Result<(), Refused>;

    /// Ties digital input number `input` to a switch that is active while the shaft is in `range`.
    ///
    /// The range is given in counts of the present actual position and is fixed in the machine from
    /// then on: zeroing the drive's position later does not move the switch.
    fn set_switch(&mut self, input: usize, range: SwitchRange, now: Instant) -> Result<(), Refused>;

    /// Torque at the output shaft in N·m; positive opposes positive motion, also at standstill.
    fn set_load_torque(&mut self, torque_nm: f64, now: Instant) -> Result<(), Refused>;

    /// Inertia added at the output shaft in kg·m².
    fn set_load_inertia(&mut self, inertia_kg_m2: f64, now: Instant) -> Result<(), Refused>;

    /// Blocks the rotor mechanically, or frees it.
    fn set_rotor_locked(&mut self, locked: bool, now: Instant) -> Result<(), Refused>;

    /// Supply voltage in V.
    fn set_supply(&mut self, supply_v: f64, now: Instant) -> Result<(), Refused>;

    /// Supply voltage and what is behind it: all of it or nothing.
    fn set_source(&mut self, source: Source, now: Instant) -> Result<(), Refused> {
        match source {
            Source { voltage_v: Some(supply_v), limit_a: None, resistance_ohm: None } => self.set_supply(supply_v, now),
            _ => Err(Refused::Absent { model: self.model(), what: "limit or resistance of its supply" }),
        }
    }

    /// Holds a temperature in °C, or gives it back to the thermal model (`None`).
    fn hold_temperature(
        &mut self,
        sensor: TemperatureSensor,
        celsius: Option<f64>,
        now: Instant,
    ) -> Result<(), Refused>;

    /// Breaks or mends a component.
    fn set_fault(&mut self, component: Component, broken: bool, now: Instant) -> Result<(), Refused>;

    /// Disconnects or connects the multi-turn battery.
    fn set_battery(&mut self, connected: bool, now: Instant) -> Result<(), Refused> {
        let _ = (connected, now);
        Err(Refused::Absent { model: self.model(), what: "battery" })
    }

    /// Sends pulses to the pulse inputs; what was being sent ends.
    fn set_pulses(&mut self, train: PulseTrain, now: Instant) -> Result<(), Refused> {
        let _ = (train, now);
        Err(Refused::Absent { model: self.model(), what: "pulse input" })
    }

    /// The unit identifier that it answers to over Modbus; `None` without such an interface, or without power.
    fn modbus_unit(&self) -> Option<u8> {
        None
    }

    /// Reads Modbus registers from `address` on.
    fn read_registers(&mut self, address: u16, words: &mut [u16], now: Instant) -> Result<(), RegisterError> {
        let _ = (address, words, now);
        Err(RegisterError::NoSuchAddress)
    }

    /// Writes Modbus registers from `address` on, all of them or none.
    fn write_registers(&mut self, address: u16, words: &[u16], now: Instant) -> Result<(), RegisterError> {
        let _ = (address, words, now);
        Err(RegisterError::NoSuchAddress)
    }

    /// Counts stores into the non-volatile memory: a new value means a new image.
    fn nvm_generation(&self) -> u64;

    /// A value that was written is not in the non-volatile memory yet and soon will be, which is when
    /// [`nvm_generation`](Self::nvm_generation) grows by one.
    fn is_storing(&self) -> bool {
        false
    }

    /// The contents of the non-volatile memory, as [`load_nvm`](Self::load_nvm) takes them back.
    fn nvm_image(&self) -> Vec<u8>;

    /// Puts `image` into the non-volatile memory; it takes effect at the next power-on.
    fn load_nvm(&mut self, image: &[u8]) -> Result<(), Refused>;
}

/// Cloning behind a `Box<dyn VirtualDrive>`; comes by itself with `Clone`.
pub trait VirtualDriveClone {
    /// A copy that goes its own way from here.
    fn clone_box(&self) -> Box<dyn VirtualDrive>;
}

impl<T: VirtualDrive + Clone + 'static> VirtualDriveClone for T {
    fn clone_box(&self) -> Box<dyn VirtualDrive> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn VirtualDrive> {
    fn clone(&self) -> Self {
        (**self).clone_box()
    }
}

/// Why a drive did not take what it was told to.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refused {
    /// The model has no such part.
    #[error("a {model} has no {what}")]
    Absent {
        /// The drive's model.
        model: &'static str,
        /// What it does not have.
        what: &'static str,
    },
    /// The value makes no sense for this machine.
    #[error("{what} must be {expected}, not {value}")]
    OutOfRange {
        /// The quantity.
        what: &'static str,
        /// What would have been taken.
        expected: &'static str,
        /// What was given.
        value: f64,
    },
    /// The image does not come from this model's memory.
    #[error("not a memory image of a {model}: {reason}")]
    BadImage {
        /// The drive's model.
        model: &'static str,
        /// What is wrong with it.
        reason: &'static str,
    },
}

/// A supply; `None` leaves that as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Source {
    /// Open-circuit voltage in V.
    pub voltage_v: Option<f64>,
    /// The most that it gives, in A. Asked for more its voltage falls.
    pub limit_a: Option<f64>,
    /// Resistance of source and wires, in ohm.
    pub resistance_ohm: Option<f64>,
}

/// A stretch of the actual position in the drive's counts, ends included; `None` reaches for ever.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SwitchRange {
    /// Lower end.
    pub low: Option<i64>,
    /// Upper end.
    pub high: Option<i64>,
}

impl SwitchRange {
    /// True while the switch is active.
    pub fn contains(&self, position: i64) -> bool {
        self.low.is_none_or(|low| low <= position) && self.high.is_none_or(|high| position <= high)
    }
}

/// Where a temperature is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TemperatureSensor {
    /// Winding or housing of the motor.
    Motor,
    /// Power stage.
    Driver,
}

/// A component that can break.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// Hall sensors.
    Hall,
    /// Encoder.
    Encoder,
    /// Parameter memory.
    Eeprom,
    /// Reference voltage of the current measurement.
    Reference,
    /// A motor phase, open.
    Phase,
    /// A motor phase, its wires touching.
    Short,
    /// The power stage: a transistor that has broken down takes current from the bus.
    Bridge,
}

/// What a controller sends to a drive's pulse inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PulseTrain {
    /// Pulses with a direction.
    Pulses {
        /// How many; negative with the direction input conducting.
        count: i64,
        /// Pulses a second.
        hz: f64,
    },
    /// Two channels of an encoder.
    Quadrature {
        /// Counts, four a line; negative with the second channel ahead.
        count: i64,
        /// Counts a second.
        hz: f64,
    },
    /// A square wave of this duty cycle in per cent, for ever.
    Duty(f64),
    /// A level on the second input that changes so many times a second, for ever.
    Clock(f64),
}

/// State of the holding brake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Brake {
    /// The shaft turns freely.
    Released,
    /// The shaft is held.
    Engaged,
}

/// Named on/off levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Levels {
    /// One name for each level.
    pub names: &'static [&'static str],
    /// Bit `n` is the level of `names[n]`.
    pub bits: u32,
}

impl Levels {
    /// Levels and their names, in the same order.
    pub fn new(names: &'static [&'static str], levels: &[bool]) -> Self {
        let bits = levels.iter().enumerate().fold(0, |bits, (n, level)| bits | u32::from(*level) << n);
        Levels { names, bits }
    }

    /// Each name with its level.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, bool)> + use<> {
        let bits = self.bits;
        self.names.iter().enumerate().map(move |(n, name)| (*name, bits >> n & 1 != 0))
    }
}

/// The shaft behind a reducer, and what the reducer has borne. No drive measures it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutputShaft {
    /// Its angle in rad, many turns: the motor's over the ratio, but for the reducer's error, twist and slip.
    pub angle_rad: f64,
    /// Torque that the reducer gives it in N·m.
    pub torque_nm: f64,
    /// The most that there has been in N·m.
    pub most_nm: f64,
    /// How often it was more than the reducer may transmit.
    pub overloads: u32,
    /// How often the reducer's teeth have jumped.
    pub jumps: u32,
    /// What the output was left behind by in doing so, in rad.
    pub slip_rad: f64,
}

/// What can be measured at a drive from outside, and what its own actual values say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// The node-ID it uses at present.
    pub node: u8,
    /// Supply switched on.
    pub powered: bool,
    /// Statusword; `None` without power.
    pub statusword: Option<u16>,
    /// Code of the present fault in the drive's own numbering; 0 for none.
    pub error_code: u32,
    /// Actual position in the drive's counts.
    pub position: i64,
    /// Where the rotor truly is in the drive's counts, of a drive that does not measure it.
    pub rotor_position: Option<i64>,
    /// Position demand in the drive's counts, where a mode has one.
    pub position_demand: Option<i64>,
    /// True speed of the motor shaft in r/min.
    pub velocity_rpm: f64,
    /// Velocity demand at the motor shaft in r/min, where a mode has one.
    pub velocity_demand_rpm: Option<f64>,
    /// Signed motor current in A.
    pub current_a: f64,
    /// Current demand in A, where a mode has one.
    pub current_demand_a: Option<f64>,
    /// Voltage at the supply terminals in V.
    pub supply_v: f64,
    /// Temperature of the motor in °C, where it has a sensor.
    pub motor_c: Option<f64>,
    /// Temperature of the power stage in °C, where it has a sensor.
    pub driver_c: Option<f64>,
    /// Digital outputs.
    pub outputs: Levels,
    /// The holding brake, where there is one.
    pub brake: Option<Brake>,
    /// The shaft behind a reducer, where there is one.
    pub output: Option<OutputShaft>,
    /// What has been destroyed, and what to do about it.
    pub damage: Option<&'static str>,
    /// True angle of the motor shaft in rad, many turns, from where it stood at the start.
    pub shaft_angle_rad: f64,
}
