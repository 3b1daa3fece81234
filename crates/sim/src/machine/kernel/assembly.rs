//! What a machine asks of one model's hardware, and what all models answer alike: supply, load and temperatures.

use std::slice::from_mut;

use devices::{AxisId, Description};
use drives::engine::axis::Demand;
use drives::engine::device::ResetTimes;
use drives::{Fidelity, Firmware, RegisterError, Resting};
use plant::attachment::Attachment;
use plant::gear::GearModel;
use plant::mechanics::RotorData;
use plant::physics::Physics;
use plant::rest::{Rested, rest};
use plant::rig::RigModel;
use plant::shaft::Motion;
use plant::{Angle, FreeRun, Motor, Rig};

use super::quantity::QuantityRange;
use super::realism::{Noise, Realism};
use crate::{Component, PulseTrain, Refused, Report, Source, TemperatureSensor};

/// Temperature of the surroundings.
pub(crate) const AMBIENT_C: f64 = 25.0;

/// From a source that is open (0 A), over what a bench supply can be turned down to, to what a traction battery gives into a short circuit.
const SUPPLY_LIMIT: QuantityRange =
    QuantityRange { what: "limit of the supply", expected: "0 to 1000 A", least: 0.0, greatest: 1000.0 };

/// From a few centimetres of thick wire to what hardly lets a drive start.
const SUPPLY_RESISTANCE: QuantityRange =
    QuantityRange { what: "resistance of the supply", expected: "0.001 to 100 ohm", least: 0.001, greatest: 100.0 };

const TEMPERATURE: QuantityRange =
    QuantityRange { what: "temperature", expected: "-55 to 200 °C", least: -55.0, greatest: 200.0 };

/// What is asked of one shaft to place things at it.
#[derive(Clone, Copy, Debug)]
pub struct ShaftFacts {
    /// Counts of [`Assembly::shaft_counts`] in a turn of the motor.
    pub counts_per_turn: u32,
    /// Motor turns per turn of the output shaft, where a reducer is built in.
    pub reducer: Option<f64>,
    /// Inertia of the motor's rotor in kg·m².
    pub rotor_inertia_kg_m2: f64,
    /// Where what is joined to the shaft stands now.
    pub load_angle: Angle,
}

/// One model's hardware: motor, load, supply, sensors, and the memory chip that outlives power.
///
/// Changes take effect from the next control period on.
pub trait Assembly: Clone + Send + 'static {
    /// The firmware that runs on it.
    type Firmware: Resting + Firmware<Actuation: Default + Send, Sensors: Send> + Send + 'static;

    /// The motor of each axis.
    type Motor: Motor<Pins: Copy>;

    /// The model's name as users type it.
    const MODEL: &'static str;
    /// Names of the digital inputs, of the largest device of the model.
    const INPUTS: &'static [&'static str];
    /// Length of a control period.
    const PERIOD_S: f64 = <Self::Firmware as Firmware>::CONTROL_PERIOD_NS as f64 * 1e-9;
    /// Bus voltage at which the drive's own converter starts. Assumed: far below the ZLAC8030L's under-voltage fault, which
    /// needs the firmware to run, and the 24 V that the M joint's manual wants.
    const STARTS_AT_V: f64 = 12.0;
    /// Bus voltage below which it stops; assumed likewise.
    const STOPS_BELOW_V: f64 = 9.0;
    /// What the supply can be set to.
    const SUPPLY_VOLTAGE: QuantityRange =
        QuantityRange { what: "supply", expected: "0 to 100 V", least: 0.0, greatest: 100.0 };
    /// What can be asked of the load at the output shaft.
    const LOAD_TORQUE: QuantityRange =
        QuantityRange { what: "load torque", expected: "-1000 to 1000 N·m", least: -1000.0, greatest: 1000.0 };
    /// What can be added at the output shaft.
    const LOAD_INERTIA: QuantityRange =
        QuantityRange { what: "load inertia", expected: "0 to 1000 kg·m²", least: 0.0, greatest: 1000.0 };

    /// The model's name as users type it, where one assembly serves several.
    fn model(&self) -> &'static str {
        Self::MODEL
    }

    /// What is known of the model.
    fn description(firmware: &Self::Firmware, assembly: &Self) -> Option<&'static Description> {
        let _ = firmware;
        devices::model(assembly.model())
    }

    /// Names of the digital inputs of this one: an input is addressed by its place in this list.
    fn inputs(&self) -> &'static [&'static str] {
        Self::INPUTS
    }

    /// What the firmware finds when it wakes.
    fn hardware(&self) -> <Self::Firmware as Firmware>::Hardware;

    /// How long the next resets by NMT take on this hardware: drawn from the description's [`Timing`](devices::Timing).
    fn set_reset_times(firmware: &mut Self::Firmware, times: ResetTimes);

    /// What the sensors read now; bit `n` of `inputs` is the level of input `n`.
    fn sense(&self, inputs: u64) -> <Self::Firmware as Firmware>::Sensors;

    /// Ideal switches and no cogging, or not.
    fn set_realism(&mut self, realism: Realism);

    /// Puts noise on what the sensors read.
    fn disturb(&self, sensors: &mut <Self::Firmware as Firmware>::Sensors, noise: &mut Noise);

    /// One control period of physics under `actuation`.
    fn step(&mut self, actuation: &<Self::Firmware as Firmware>::Actuation);

    /// From now on the power stage follows by itself, or not: of a firmware that has such a form.
    fn set_fidelity(&mut self, fidelity: Fidelity) {
        let _ = fidelity;
    }

    /// Puts what a power stage says that follows by itself to what the sensors read.
    fn add_followed(&self, sensors: &mut <Self::Firmware as Firmware>::Sensors) {
        let _ = sensors;
    }

    /// As long a step as the ticks of such a firmware.
    fn step_long(&mut self, firmware: &Self::Firmware, actuation: &<Self::Firmware as Firmware>::Actuation, dt_s: f64) {
        let _ = (firmware, dt_s);
        self.step(actuation);
    }

    /// Whether, under this actuation, such periods change nothing but heat.
    fn can_rest(&self, actuation: &<Self::Firmware as Firmware>::Actuation, dt_s: f64) -> bool;

    /// So many such periods, or fewer if the sensors read otherwise before.
    fn rest(&mut self, actuation: &<Self::Firmware as Firmware>::Actuation, dt_s: f64, periods: u64) -> Rested {
        let pins = self.pins(AxisId::FIRST, actuation);
        rest(from_mut(self.motor_at_mut(AxisId::FIRST)), dt_s, |_| pins, periods)
    }

    /// The motor of an axis, and all that is joined to it; of an axis that there is not, the first.
    fn motor_at(&self, axis: AxisId) -> &Self::Motor;

    /// The same, to change.
    fn motor_at_mut(&mut self, axis: AxisId) -> &mut Self::Motor;

    /// What the power stage of an axis, and its brake, make of the firmware's outputs.
    fn pins(&self, axis: AxisId, actuation: &<Self::Firmware as Firmware>::Actuation) -> <Self::Motor as Motor>::Pins;

    /// How many axes it has.
    fn axes(&self) -> u8 {
        1
    }

    /// The shaft of an axis, and load, supply, temperatures and energies around it.
    fn shaft_and_rig(&self, axis: AxisId) -> (&RotorData, &Rig) {
        let motor = self.motor_at(axis);
        (motor.rotor(), motor.rig())
    }

    /// What the motor of an axis does, and what it does it with.
    fn physics(&self, axis: AxisId) -> Physics {
        self.motor_at(axis).physics()
    }

    /// Load, supply, temperatures and energies, to change.
    fn rig_mut(&mut self, axis: AxisId) -> &mut Rig {
        self.motor_at_mut(axis).rig_and_model().0
    }

    /// What can be measured from outside: `common`, what is measured alike at every model, with the model's own.
    fn report(&self, firmware: &Self::Firmware, axis: AxisId, common: Report) -> Report;

    /// The drive's own converter has started, or stopped: what lives on it follows.
    fn set_supplied(&mut self, supplied: bool) {
        let _ = supplied;
    }

    /// What never changes about the rig, and the rig.
    fn rig_and_model_mut(&mut self) -> (&mut Rig, &mut RigModel) {
        self.motor_at_mut(AxisId::FIRST).rig_and_model()
    }

    /// Whether the voltage is enough for the firmware to run on (`running`), or to start.
    #[inline]
    fn supplies_firmware(&self, running: bool) -> bool {
        self.shaft_and_rig(AxisId::FIRST).1.supply.bus_v
            >= if running { Self::STOPS_BELOW_V } else { Self::STARTS_AT_V }
    }

    /// Where the motor shaft truly is, in counts of a fixed size, from an arbitrary zero.
    #[inline]
    fn shaft_counts(&self, axis: AxisId) -> i64 {
        self.motor_at(axis).rotor().angle.count(self.counts_per_turn(axis))
    }

    /// How many of those are a turn of the motor's shaft.
    fn counts_per_turn(&self, axis: AxisId) -> u32;

    /// The reducer, where one is built in.
    fn gear(&self) -> Option<&GearModel> {
        None
    }

    /// How many of those are one count of the drive as it is set now.
    fn shaft_counts_per_count(&self, firmware: &Self::Firmware, axis: AxisId) -> i64 {
        let _ = (firmware, axis);
        1
    }

    /// The drive counts against the shaft's own direction.
    fn counts_reversed(&self, firmware: &Self::Firmware, axis: AxisId) -> bool {
        let _ = (firmware, axis);
        false
    }

    /// What things are placed by that are joined to the shaft of an axis.
    fn shaft_facts(&self, axis: AxisId) -> ShaftFacts {
        let motor = self.motor_at(axis);
        ShaftFacts {
            counts_per_turn: self.counts_per_turn(axis),
            reducer: self.gear().map(|gear| gear.ratio),
            rotor_inertia_kg_m2: motor.rotor_model().inertia_kg_m2,
            load_angle: motor.load_angle(),
        }
    }

    /// Joins these things to the output shaft, in place of those before.
    fn attach(&mut self, axis: AxisId, what: Attachment) {
        self.motor_at_mut(axis).attach(what);
    }

    /// From now on the shaft of an axis moves by [`follow`](Self::follow), at the end of each control period.
    fn couple(&mut self, axis: AxisId) {
        self.motor_at_mut(axis).couple();
    }

    /// Ends the control period of a coupled axis.
    fn follow(&mut self, axis: AxisId, motion: &Motion) {
        self.motor_at_mut(axis).follow(motion);
    }

    /// What the shaft will do if its load stays as it is; `None` while the drive drives it, or where it is not known.
    fn free_run(&self, axis: AxisId) -> Option<FreeRun>;

    /// Contents of the memory chip as of the last power-off.
    fn image(&self) -> &[u8];

    /// Puts `image` into the memory chip.
    fn keep_image(&mut self, image: &[u8]);

    /// Torque at the output shaft, positive against positive motion.
    fn set_load_torque(&mut self, axis: AxisId, torque_nm: f64) -> Result<(), Refused> {
        self.rig_mut(axis).load.torque_nm = Self::LOAD_TORQUE.check(torque_nm)?;
        Ok(())
    }

    /// Inertia added at the output shaft.
    fn set_load_inertia(&mut self, axis: AxisId, inertia_kg_m2: f64) -> Result<(), Refused> {
        self.rig_mut(axis).load.inertia_kg_m2 = Self::LOAD_INERTIA.check(inertia_kg_m2)?;
        Ok(())
    }

    /// Blocks the rotor, or frees it.
    fn set_rotor_locked(&mut self, axis: AxisId, locked: bool) {
        self.rig_mut(axis).load.locked = locked;
    }

    /// Voltage of the supply and what is behind it: all of it or nothing.
    fn set_source(&mut self, source: Source) -> Result<(), Refused> {
        let voltage_v = source.voltage_v.map(|voltage_v| Self::SUPPLY_VOLTAGE.check(voltage_v)).transpose()?;
        let limit_a = source.limit_a.map(|limit_a| SUPPLY_LIMIT.check(limit_a)).transpose()?;
        let ohm = source.resistance_ohm.map(|ohm| SUPPLY_RESISTANCE.check(ohm)).transpose()?;
        let (rig, model) = self.rig_and_model_mut();
        model.supply.source_limit_a = limit_a.unwrap_or(model.supply.source_limit_a);
        model.supply.source_resistance_ohm = ohm.unwrap_or(model.supply.source_resistance_ohm);
        if let Some(voltage_v) = voltage_v {
            rig.set_source_v(model, voltage_v);
        }
        Ok(())
    }

    /// Holds a temperature, or gives it back to the model.
    fn hold_temperature(
        &mut self,
        axis: AxisId,
        sensor: TemperatureSensor,
        celsius: Option<f64>,
    ) -> Result<(), Refused> {
        let hold_c = celsius.map(|celsius| TEMPERATURE.check(celsius)).transpose()?;
        let rig = self.rig_mut(axis);
        let body = match sensor {
            TemperatureSensor::Motor => &mut rig.winding,
            TemperatureSensor::Driver => &mut rig.heat_sink,
        };
        body.hold_c = hold_c;
        Ok(())
    }

    /// Breaks or mends a component.
    fn set_fault(&mut self, axis: AxisId, component: Component, broken: bool) -> Result<(), Refused>;

    /// Connects or disconnects the multi-turn battery, where there is one.
    fn set_battery(&mut self, connected: bool) -> Result<(), Refused> {
        let _ = connected;
        Err(Refused::Absent { model: self.model(), what: "battery" })
    }

    /// Sends pulses to the inputs, where the drive counts them.
    fn set_pulses(&mut self, train: PulseTrain) -> Result<(), Refused> {
        let _ = train;
        Err(Refused::Absent { model: self.model(), what: "pulse input" })
    }

    /// The unit identifier of the firmware's Modbus registers, where it has any.
    fn modbus_unit(firmware: &Self::Firmware) -> Option<u8> {
        let _ = firmware;
        None
    }

    /// Reads the firmware's Modbus registers from `address` on.
    fn read_registers(firmware: &Self::Firmware, address: u16, words: &mut [u16]) -> Result<(), RegisterError> {
        let _ = (firmware, address, words);
        Err(RegisterError::NoSuchAddress)
    }

    /// Writes the firmware's Modbus registers from `address` on, all of them or none.
    fn write_registers(firmware: &mut Self::Firmware, address: u16, words: &[u16]) -> Result<(), RegisterError> {
        let _ = (firmware, address, words);
        Err(RegisterError::NoSuchAddress)
    }
}

/// `report` with the set-points of the control loops; `rpm` turns the velocity of a set-point into r/min.
pub(crate) fn with_demand(demand: &Demand, rpm: impl Fn(f64) -> f64, report: Report) -> Report {
    match *demand {
        Demand::Off => report,
        Demand::Position(point) => Report {
            position_demand: Some(i64::from(point.position)),
            velocity_demand_rpm: Some(rpm(point.velocity)),
            ..report
        },
        Demand::Velocity(point) => Report { velocity_demand_rpm: Some(rpm(point.velocity)), ..report },
        Demand::Torque(current_a) => Report { current_demand_a: Some(f64::from(current_a)), ..report },
    }
}
