//! The contract of a virtual drive: what a world, a test or a person at the machine can do to one, whatever its model.
//!
//! Units are SI, positions are the drive's own counts, speeds are those of the motor shaft in r/min.

use can::{Bitrate, Instant, Station};
use canopen::{Mux, NmtState};
use cia402::{ModeOfOperation, PowerState};
use devices::{AxisId, Description};
use drives::{Fidelity, RegisterError};
use plant::FreeRun;
use plant::gear::GearModel;
use plant::mechanics::RotorModel;
use plant::physics::Physics;
use plant::pmsm::PmsmModel;
use plant::stepper::Stepping;

use crate::machine::{Realism, TimingMode};
use crate::mechanics::Mechanics;
use crate::refused::Refused;
use crate::stimulus::{Component, Power, Source, Stimulus, SwitchRange, TemperatureSensor};

/// What a virtual drive's motor is made of: what a data sheet says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorData {
    /// Rotor and bearings.
    pub rotor: RotorModel,
    /// Windings and magnets.
    pub windings: PmsmModel,
    /// The reducer, where one is built in.
    pub gear: Option<GearModel>,
}

/// The same of a stepper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepperData {
    /// Rotor and bearings.
    pub rotor: RotorModel,
    /// Windings, magnets and switches.
    pub stepping: Stepping,
}

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

    /// What is known of its model: axes, faults, objects.
    fn description(&self) -> Option<&'static Description> {
        devices::model(self.model())
    }

    /// How many axes it has: motors that its one node moves.
    fn axes(&self) -> u8 {
        1
    }

    /// Whether it has this axis.
    fn check_axis(&self, axis: AxisId) -> Result<(), Refused> {
        let (model, axes) = (self.model(), self.axes());
        if axis.0 < axes { Ok(()) } else { Err(Refused::NoSuchAxis { model, axis: u16::from(axis.0) + 1, axes }) }
    }

    /// What the outer world does to it, all of it or nothing. What does not belong to an axis is the whole drive's, whatever the axis.
    fn apply(&mut self, axis: AxisId, stimulus: &Stimulus, now: Instant) -> Result<(), Refused>;

    /// Whether it takes the time that such a device takes, to boot, to answer and to store, or none; `seed` decides its
    /// jitter. Before it has power.
    fn set_timing(&mut self, mode: TimingMode, seed: u64, now: Instant) {
        let _ = (mode, seed, now);
    }

    /// Whether it is as it is calculated, or has the noise and the flaws of one on a bench; `seed` decides all of that.
    fn set_realism(&mut self, realism: Realism, seed: u64, now: Instant) {
        let _ = (realism, seed, now);
    }

    /// How much of it is computed. Before it has power.
    ///
    /// # Errors
    /// [`Refused::Fidelity`] for [`Fidelity::Mechanical`] of a model that has no such form.
    fn set_fidelity(&mut self, fidelity: Fidelity, now: Instant) -> Result<(), Refused> {
        let _ = now;
        match fidelity {
            Fidelity::Full => Ok(()),
            Fidelity::Mechanical => {
                Err(Refused::Fidelity { model: self.model(), reason: "it has no such form; expected full" })
            }
        }
    }

    /// The bit rate of its CAN controller at present; `None` while it takes no part in the bus (no power).
    fn bitrate(&self) -> Option<Bitrate>;

    /// Brings control loops and physics up to `now`. Never changes what happens, only when it is computed.
    fn advance(&mut self, now: Instant);

    /// From now on it computes what changes nothing too, control period by control period. It makes no difference but of work:
    /// this is what tests compare with.
    fn keep_awake(&mut self) {}

    /// What a person standing beside the machine could measure, as of the last [`advance`](Self::advance); of a machine with
    /// several axes, at the first.
    fn report(&self) -> Report;

    /// The same at an axis that it has.
    fn report_of(&self, axis: AxisId) -> Report {
        let _ = axis;
        self.report()
    }

    /// What the shaft of an axis will do in the end if its load stays as it is; `None` while the drive drives it, or where it
    /// is not known. Velocities are the motor's.
    fn free_run(&self, axis: AxisId) -> Option<FreeRun> {
        let _ = axis;
        None
    }

    /// What the motor of an axis is made of, of one with magnets.
    fn motor(&self, axis: AxisId) -> Option<MotorData> {
        let _ = axis;
        None
    }

    /// What the stepper of an axis is made of.
    fn stepper(&self, axis: AxisId) -> Option<StepperData> {
        let _ = axis;
        None
    }

    /// What a coupled machine needs of it, of a drive that moves a shaft.
    fn mechanics(&mut self) -> Option<&mut dyn Mechanics> {
        None
    }

    /// It is an encoder, which sits on the shaft of another node ([`World::mount`](crate::World::mount)).
    fn reads_a_shaft(&self) -> bool {
        false
    }

    /// The shaft that it sits on is at so many turns, and turns so fast, in turns a second.
    fn see_shaft(&mut self, turns: f64, turns_s: f64) {
        let _ = (turns, turns_s);
    }

    /// Whether the shaft of an axis can be handed over to a coupled machine.
    fn check_couple(&self, axis: AxisId) -> Result<(), Refused> {
        let _ = axis;
        Ok(())
    }

    /// Names of the digital inputs, e.g. `X0`, `X1`; an input is addressed by its place in this list.
    fn inputs(&self) -> &'static [&'static str];

    /// Values of analogue channels by the objects that show them, inputs before outputs (CiA 401: 6401h and 6411h), as converters have them.
    fn analogue(&self) -> Vec<(Mux, i64)> {
        Vec::new()
    }

    /// The levels at the digital inputs now.
    fn input_levels(&self) -> Levels {
        Levels::default()
    }

    /// [`Power::On`] or [`Power::Off`]: no drive refuses them.
    fn set_power(&mut self, on: bool, now: Instant) {
        let _ = self.apply(AxisId::FIRST, &Stimulus::Power(if on { Power::On } else { Power::Off }), now);
    }

    /// [`Power::Cut`]: no drive refuses it.
    fn cut_power(&mut self, now: Instant) {
        let _ = self.apply(AxisId::FIRST, &Stimulus::Power(Power::Cut), now);
    }

    /// [`Stimulus::Input`] of input number `input`.
    fn set_input(&mut self, input: usize, level: bool, now: Instant) -> Result<(), Refused> {
        let name = self.input_name(input)?;
        self.apply(AxisId::FIRST, &Stimulus::Input { name, level }, now)
    }

    /// [`Stimulus::Switch`] at input number `input`.
    fn set_switch(&mut self, input: usize, range: SwitchRange, now: Instant) -> Result<(), Refused> {
        let name = self.input_name(input)?;
        self.apply(AxisId::FIRST, &Stimulus::Switch { name, range }, now)
    }

    /// [`Stimulus::LoadTorque`], N·m.
    fn set_load_torque(&mut self, torque_nm: f64, now: Instant) -> Result<(), Refused> {
        self.apply(AxisId::FIRST, &Stimulus::LoadTorque(torque_nm), now)
    }

    /// [`Stimulus::LoadInertia`], kg·m².
    fn set_load_inertia(&mut self, inertia_kg_m2: f64, now: Instant) -> Result<(), Refused> {
        self.apply(AxisId::FIRST, &Stimulus::LoadInertia(inertia_kg_m2), now)
    }

    /// [`Stimulus::RotorLock`].
    fn set_rotor_locked(&mut self, locked: bool, now: Instant) -> Result<(), Refused> {
        self.apply(AxisId::FIRST, &Stimulus::RotorLock(locked), now)
    }

    /// [`Stimulus::Supply`] of a voltage alone, V.
    fn set_supply(&mut self, supply_v: f64, now: Instant) -> Result<(), Refused> {
        self.set_source(Source { voltage_v: Some(supply_v), ..Source::default() }, now)
    }

    /// [`Stimulus::Supply`].
    fn set_source(&mut self, source: Source, now: Instant) -> Result<(), Refused> {
        self.apply(AxisId::FIRST, &Stimulus::Supply(source), now)
    }

    /// [`Stimulus::Temperature`], °C.
    fn hold_temperature(
        &mut self,
        sensor: TemperatureSensor,
        celsius: Option<f64>,
        now: Instant,
    ) -> Result<(), Refused> {
        self.apply(AxisId::FIRST, &Stimulus::Temperature(sensor, celsius), now)
    }

    /// [`Stimulus::Fault`].
    fn set_fault(&mut self, component: Component, broken: bool, now: Instant) -> Result<(), Refused> {
        self.apply(AxisId::FIRST, &Stimulus::Fault(component, broken), now)
    }

    /// The name of input number `input`, as stimuli have it.
    fn input_name(&self, input: usize) -> Result<String, Refused> {
        let absent = Refused::Absent { model: self.model(), what: "such input" };
        self.inputs().get(input).map(|name| (*name).to_owned()).ok_or(absent)
    }

    /// The number of the input of this name, in any case of letters.
    fn input_number(&self, name: &str) -> Result<usize, Refused> {
        let inputs = self.inputs();
        inputs.iter().position(|input| input.eq_ignore_ascii_case(name)).ok_or_else(|| {
            let present = if inputs.is_empty() { "none".to_owned() } else { inputs.join(", ") };
            Refused::NoSuchInput { model: self.model(), name: name.to_owned(), present }
        })
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

/// What a drive makes of its supply.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PowerPhase {
    /// Dead, and nothing brings it back by itself.
    #[default]
    Off,
    /// There is voltage, and the firmware starts: silent and deaf, in the state NOT READY TO SWITCH ON. Also after NMT reset node.
    Booting,
    /// The firmware runs.
    On,
    /// Switched off; it lives on the charge of its bus.
    Draining,
    /// Off for now: the supply comes back when the bus has drained.
    Cycling,
}

impl PowerPhase {
    /// The word for it in answers: `booting`.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Booting => "booting",
            Self::On => "on",
            Self::Draining => "draining",
            Self::Cycling => "cycling",
        }
    }

    pub(crate) const fn sentence(self) -> &'static str {
        match self {
            Self::Off => "the bus has drained, the firmware is dead",
            Self::Booting => "power is there, the firmware starts",
            Self::On => "the firmware runs",
            Self::Draining => "switched off, the drive lives on the charge of its bus",
            Self::Cycling => "switched off until the bus has drained",
        }
    }
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
    pub bits: u64,
}

impl Levels {
    /// Levels and their names, in the same order.
    pub fn new(names: &'static [&'static str], levels: &[bool]) -> Self {
        let bits = levels.iter().enumerate().fold(0, |bits, (n, level)| bits | u64::from(*level) << n);
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
    /// There is enough voltage for the drive's converter.
    pub powered: bool,
    /// What it makes of its supply.
    pub power: PowerPhase,
    /// Statusword; `None` without power, 0 (NOT READY TO SWITCH ON) while it boots.
    pub statusword: Option<u16>,
    /// NMT state; `None` without power.
    pub nmt: Option<NmtState>,
    /// State of the power drive system, or what comes closest to it; `None` without power.
    pub state: Option<PowerState>,
    /// Mode in effect; `None` without power.
    pub mode: Option<ModeOfOperation>,
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
    /// True angle of the motor shaft in rad, many turns, from the zero of its disc. That is where most stand at the start; a
    /// described servo is put together at some other place.
    pub shaft_angle_rad: f64,
    /// What no drive measures: torques, energies, true temperatures; of a drive with a motor. The motor's torque has the sign of
    /// [`velocity_rpm`](Self::velocity_rpm), the load's that of [`Stimulus::LoadTorque`].
    pub physics: Option<Physics>,
}
