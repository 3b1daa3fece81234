//! A ZLIM42-C on its hardware: stepper, load, supply and EEPROM as the assembly of a machine.
//!
//! In go the bridges and outputs of the firmware, out come its sensors and the report for people. The drive does not
//! know where its rotor is; the report has both, the commanded position and the rotor's in the same pulses. Figures of
//! the motors are those of `plant`; what is assumed of the surroundings is a constant below.

use std::sync::Arc;

use canopen::Mux;
use devices::AxisId;
use devices::Description;
use devices::zltech::{ZLIM42C, ZLIM42C_82};
use drives::engine::actuator::stepper::{FieldDemand, StepperGains, VOLTAGE_DELAY_PERIODS};
use drives::engine::axis::Demand;
use drives::engine::device::ResetTimes;
use drives::engine::storage::StoredImage;
use drives::zlim42c::assumptions::{CONTROL_PERIOD_S, REFERENCE_V, TEETH};
use drives::zlim42c::hardware::{Actuation, Hardware, PowerStage, Sensors};
use drives::zlim42c::variations::VARIANT;
use drives::zlim42c::{Zlim42c, objects, storage};
use plant::FreeRun;
use plant::angle::Angle;
use plant::field_loop::{FieldLoop, GiveWay};
use plant::rest::{Rested, is_at_rest, rest};
use plant::stepper::{Bridges, Phase};
use plant::stepper_motor::{StepperMotor, StepperMotorModel};
use plant::supply::SupplyData;

use super::order::{Order, OrderError, baud_rate};
use crate::machine::kernel::Machine;
use crate::machine::kernel::assembly::{AMBIENT_C, Assembly};
use crate::machine::kernel::quantity::QuantityRange;
use crate::machine::kernel::realism::{Noise, Realism, SMALL_CURRENT_STEP_A, VOLTAGE_STEP_V, with_dead_time};
use crate::{Component, Levels, Refused, Report, TemperatureSensor, VirtualDrive};

const OUTPUTS: &[&str] = &["Y0", "Y1", "RED", "GREEN"];
const SUPPLY_V: f64 = 24.0;

/// What has been destroyed, and what to do about it.
const SEIZED: &str = "bearings seized by over-speed: 'rotor free' puts in new ones";
const BURNT: &str = "a transistor of the bridges has burnt: 'fault bridge off' fits a new board";

/// Length of the longer motor's body, mm.
const LONG: u16 = 82;

/// Counts of a turn in which switches are placed: each setting of 2006h divides it.
const SHAFT_COUNTS: u32 = 3_200_000;

/// A ZLIM42-C of 70 mm as a station of a world.
pub type Zlim42cMachine = Machine<Stepper<70>>;

/// A ZLIM42-C of 82 mm as a station of a world.
pub type Zlim42c82Machine = Machine<Stepper<LONG>>;

/// A ZLIM42-C of 70 mm as delivered but for its address, on 24 V, without power.
///
/// `node` 1 to 15 is set at the DIP switches, 32 to 127 is stored in the EEPROM (2008h); the drive cannot be given any
/// other, and answers as node 1. `baud_rate` is the value of 2009h in the EEPROM.
pub fn zlim42c(node: u8, baud_rate: u16) -> Zlim42cMachine {
    Machine::new(Zlim42c::new(), Stepper::addressed(node, baud_rate))
}

/// The same with the longer motor, 82 mm.
pub fn zlim42c_82(node: u8, baud_rate: u16) -> Zlim42c82Machine {
    Machine::new(Zlim42c::new(), Stepper::addressed(node, baud_rate))
}

/// Bit rates by number.
const BAUD_RATE: Mux = Mux::new(0x2009, 0);

/// The same as it was ordered, of 70 mm.
pub(super) fn ordered(model: &Description, order: &Order) -> Result<Box<dyn VirtualDrive>, OrderError> {
    Ok(Box::new(of_length::<70>(model, order)?))
}

/// The same as it was ordered, of 82 mm.
pub(super) fn ordered_82(model: &Description, order: &Order) -> Result<Box<dyn VirtualDrive>, OrderError> {
    Ok(Box::new(of_length::<LONG>(model, order)?))
}

fn of_length<const MM: u16>(model: &Description, order: &Order) -> Result<Machine<Stepper<MM>>, OrderError> {
    let (node, variant) = (order.node.raw(), order.variant);
    if (16..=31).contains(&node) {
        let reason = "its switches have 1 to 15, and 2008h takes 32 to 127";
        return Err(OrderError::Node { model: model.name, node: order.node, reason });
    }
    let baud_rate = baud_rate(model, BAUD_RATE, order.bitrate)?;
    let image = order.image(storage::addressed(&variant, node, baud_rate))?;
    Ok(Machine::new(Zlim42c::of(variant), Stepper::new(dip_address(node), image)))
}

/// What the DIP switches of a drive for this node-ID are set to.
const fn dip_address(node: u8) -> u8 {
    if node <= 15 { node } else { 0 }
}

/// What the firmware asks for of a power stage that follows by itself, as the plant takes it.
#[inline]
fn field_loop(path: &FieldDemand, gains: &StepperGains) -> FieldLoop {
    let at_limit = &gains.at_limit;
    FieldLoop {
        from_turns: path.from_turns,
        way_turns: path.way_turns,
        pulse_turns: path.pulse_turns,
        amplitude_a: f64::from(path.amplitude_a),
        detent_a: f64::from(path.detent_a),
        detent_lead_turns: f64::from(path.detent_lead_turns),
        proportional: f64::from(gains.current.proportional),
        integral_per_s: f64::from(gains.current.integral_per_s),
        modulation_limit: f64::from(gains.modulation_limit),
        voltage_lag_s: f64::from(VOLTAGE_DELAY_PERIODS) * f64::from(CONTROL_PERIOD_S),
        give_way: GiveWay {
            turns_per_a: f64::from(at_limit.turns_per_a),
            across_share: f64::from(at_limit.across_share),
            passed: at_limit.passed.map(f64::from),
            integral_share: f64::from(at_limit.integral_share),
        },
    }
}

/// Motor, load, supply and memory of a ZLIM42-C whose body is this many mm long.
#[derive(Clone, Debug)]
pub struct Stepper<const LENGTH_MM: u16> {
    motor: StepperMotor,
    dip_address: u8,
    /// Shared by all copies of a world until one of them loses power.
    image: Arc<StoredImage>,
    eeprom_broken: bool,
    reference_broken: bool,
    dead_time: bool,
    last: Actuation,
    /// The electrical turn that the rotor stood in at power-on: there the drive's vector points to its zero.
    zero: Option<f64>,
}

impl<const LENGTH_MM: u16> Stepper<LENGTH_MM> {
    /// At rest at ambient temperature, the supply not yet connected.
    pub fn new(dip_address: u8, image: StoredImage) -> Self {
        let model = if LENGTH_MM == LONG { StepperMotorModel::ZLIM42_C_82 } else { StepperMotorModel::ZLIM42_C_70 };
        let mut motor = StepperMotor::new(model, Angle::default(), SUPPLY_V, AMBIENT_C);
        motor.rig.supply = SupplyData::switched_off(SUPPLY_V);
        Self {
            motor,
            dip_address,
            image: Arc::new(image),
            eeprom_broken: false,
            reference_broken: false,
            dead_time: false,
            last: Actuation::default(),
            zero: None,
        }
    }

    /// The motor and all that is joined to it.
    pub fn motor(&self) -> &StepperMotor {
        &self.motor
    }

    /// The motor and all that is joined to it, to change.
    pub fn motor_mut(&mut self) -> &mut StepperMotor {
        &mut self.motor
    }

    /// What the drive does now.
    pub fn actuation(&self) -> &Actuation {
        &self.last
    }

    fn addressed(node: u8, baud_rate: u16) -> Self {
        Self::new(dip_address(node), StoredImage::of(&storage::addressed(&VARIANT, node, baud_rate)))
    }

    #[inline(always)]
    fn note(&mut self, actuation: &Actuation) {
        self.last = *actuation;
        // The green light: the firmware runs.
        if self.zero.is_none() && actuation.led.green {
            self.zero = Some(self.rotor_turns().round());
        }
    }

    fn damage(&self) -> Option<&'static str> {
        let seized = self.motor.is_seized().then_some(SEIZED);
        self.motor.is_overheated().then_some(BURNT).or(seized)
    }

    /// Electrical turns of the rotor.
    fn rotor_turns(&self) -> f64 {
        self.motor.rotor.angle.as_rad() / core::f64::consts::TAU * f64::from(TEETH)
    }

    /// The rotor's true position in the drive's pulses: the commanded one and how far the rotor is from the vector.
    fn rotor_position(&self, firmware: &Zlim42c, position: i64) -> i64 {
        let rotor = self.rotor_turns();
        let ahead = rotor - self.zero.unwrap_or(rotor.round()) - firmware.vector_turns();
        position + (ahead * f64::from(firmware.pulses_per_turn()) / f64::from(TEETH)).round() as i64
    }
}

impl<const LENGTH_MM: u16> Assembly for Stepper<LENGTH_MM> {
    type Firmware = Zlim42c;
    type Motor = StepperMotor;

    const MODEL: &'static str = if LENGTH_MM == LONG { ZLIM42C_82.name } else { ZLIM42C.name };
    const INPUTS: &'static [&'static str] = &["X0", "X1", "X2", "X3"];
    // It is off below the 20 V of 2.1, and has no fault for a low supply. A guess: half a volt of hysteresis, and that its
    // 20 V are those of the supply, of which cable and bus take some tenths when the motor draws its most.
    const STARTS_AT_V: f64 = 19.8;
    const STOPS_BELOW_V: f64 = StepperMotorModel::ZLIM42_C_70.rig.supply.consumption_from_v;
    const LOAD_TORQUE: QuantityRange =
        QuantityRange { what: "load torque", expected: "-100 to 100 N·m", least: -100.0, greatest: 100.0 };
    const LOAD_INERTIA: QuantityRange =
        QuantityRange { what: "load inertia", expected: "0 to 100 kg·m²", least: 0.0, greatest: 100.0 };

    fn hardware(&self) -> Hardware {
        Hardware { dip_address: self.dip_address, eeprom: *self.image }
    }

    fn set_reset_times(firmware: &mut Self::Firmware, times: ResetTimes) {
        firmware.set_reset_times(times);
    }

    #[inline]
    fn sense(&self, inputs: u64) -> Sensors {
        let sensed = self.motor.sense();
        Sensors {
            phase_current_a: sensed.phase_current_a.map(|current_a| current_a as f32),
            bus_v: sensed.bus_v as f32,
            bus_current_a: sensed.bus_current_a as f32,
            reference_v: if self.reference_broken { 0.0 } else { REFERENCE_V },
            inputs: [0, 1, 2, 3].map(|n| inputs >> n & 1 != 0),
            eeprom_ok: !self.eeprom_broken,
            largest_a: None,
        }
    }

    /// Its detent is there anyway, and it has no encoder.
    fn set_realism(&mut self, realism: Realism) {
        self.dead_time = realism == Realism::Full;
    }

    fn disturb(&self, sensors: &mut Sensors, noise: &mut Noise) {
        sensors.phase_current_a = sensors.phase_current_a.map(|a| noise.flicker(a, SMALL_CURRENT_STEP_A));
        sensors.bus_v = noise.flicker(sensors.bus_v, VOLTAGE_STEP_V);
    }

    // Inlined by force: it has a second caller, in periods without firmware.
    #[inline(always)]
    fn step(&mut self, actuation: &Actuation) {
        self.note(actuation);
        self.motor.step(Self::PERIOD_S, &self.pins(AxisId::FIRST, actuation));
    }

    fn add_followed(&self, sensors: &mut Sensors) {
        sensors.largest_a = self.motor.largest_current_a().map(|largest_a| largest_a as f32);
    }

    fn step_long(&mut self, firmware: &Zlim42c, actuation: &Actuation, dt_s: f64) {
        self.note(actuation);
        if actuation.power_stage == PowerStage::Follow {
            self.motor.field.settings = field_loop(firmware.path(), firmware.current_gains());
            self.motor.follow_long(dt_s);
        } else {
            self.motor.coast_long(dt_s);
        }
    }

    fn can_rest(&self, actuation: &Actuation, _dt_s: f64) -> bool {
        let idle = actuation.power_stage != PowerStage::Follow;
        let quiet = self.motor.rotor.velocity_rad_s == 0.0 && (self.zero.is_some() || !actuation.led.green);
        idle && quiet && is_at_rest(&self.motor, Self::PERIOD_S, &self.pins(AxisId::FIRST, actuation))
    }

    /// Its idle steps are control periods at either fidelity.
    fn rest(&mut self, actuation: &Actuation, dt_s: f64, periods: u64) -> Rested {
        let pins = self.pins(AxisId::FIRST, actuation);
        let each = (dt_s / Self::PERIOD_S).round() as u64;
        let mut rest_for = |steps| rest(std::slice::from_mut(&mut self.motor), Self::PERIOD_S, |_| pins, steps);
        let mut rested = rest_for(periods * each);
        // To the end of the last of them.
        while !rested.steps.is_multiple_of(each) {
            rested.steps += rest_for(each - rested.steps % each).steps;
        }
        Rested { steps: rested.steps / each, ..rested }
    }

    #[inline]
    fn supplies_firmware(&self, running: bool) -> bool {
        let supply = &self.motor.rig.supply;
        // What a motor feeds back as it is switched off lasts for milliseconds, in which no controller starts.
        let may_start = supply.connected && supply.source_v >= Self::STARTS_AT_V;
        supply.bus_v >= if running { Self::STOPS_BELOW_V } else { Self::STARTS_AT_V } && (running || may_start)
    }

    fn motor_at(&self, _axis: AxisId) -> &StepperMotor {
        &self.motor
    }

    fn motor_at_mut(&mut self, _axis: AxisId) -> &mut StepperMotor {
        &mut self.motor
    }

    #[inline]
    fn pins(&self, _axis: AxisId, actuation: &Actuation) -> Bridges {
        match actuation.power_stage {
            PowerStage::Off => Bridges::Open,
            PowerStage::Modulate { duty } if self.dead_time => {
                Bridges::Driven(with_dead_time(duty.map(f64::from), self.motor.sense().phase_current_a))
            }
            PowerStage::Modulate { duty } => Bridges::Driven(duty.map(f64::from)),
            PowerStage::Follow => Bridges::Regulated(self.motor.stepper.current_a),
        }
    }

    fn report(&self, firmware: &Zlim42c, _axis: AxisId, common: Report) -> Report {
        let rpm = |pulses_s: f64| pulses_s * 60.0 / f64::from(firmware.pulses_per_turn());
        let demand = match *firmware.demand() {
            Demand::Position(point) | Demand::Velocity(point) => Some(point),
            Demand::Off | Demand::Torque(_) => None,
        };
        let [y0, y1] = self.last.outputs;
        let levels = [y0, y1, self.last.led.red, self.last.led.green];
        Report {
            rotor_position: Some(self.rotor_position(firmware, common.position)),
            position_demand: demand.map(|point| i64::from(point.position)),
            velocity_demand_rpm: demand.map(|point| rpm(point.velocity)),
            current_demand_a: demand.map(|_| f64::from(firmware.current_demand_a())),
            motor_c: None,
            driver_c: None,
            statusword: common.powered.then(|| firmware.values().get(objects::STATUSWORD)),
            damage: self.damage(),
            outputs: Levels::new(OUTPUTS, &levels.map(|level| common.powered && level)),
            ..common
        }
    }

    fn set_rotor_locked(&mut self, _axis: AxisId, locked: bool) {
        self.motor.lock_rotor(locked);
    }

    #[inline]
    fn counts_per_turn(&self, _axis: AxisId) -> u32 {
        SHAFT_COUNTS
    }

    fn free_run(&self, _axis: AxisId) -> Option<FreeRun> {
        let idle = self.last.power_stage == PowerStage::Off;
        idle.then(|| self.motor.free_run()).flatten()
    }

    fn shaft_counts_per_count(&self, firmware: &Zlim42c, _axis: AxisId) -> i64 {
        i64::from(SHAFT_COUNTS) / i64::from(firmware.pulses_per_turn())
    }

    fn image(&self) -> &[u8] {
        &self.image.0
    }

    fn keep_image(&mut self, image: &[u8]) {
        self.image = Arc::new(StoredImage::from_bytes(image));
        self.zero = None;
    }

    fn hold_temperature(
        &mut self,
        _axis: AxisId,
        _sensor: TemperatureSensor,
        _celsius: Option<f64>,
    ) -> Result<(), Refused> {
        Err(Refused::Absent { model: Self::MODEL, what: "temperature sensor" })
    }

    fn set_fault(&mut self, _axis: AxisId, component: Component, broken: bool) -> Result<(), Refused> {
        match component {
            Component::Hall => return Err(Refused::Absent { model: Self::MODEL, what: "Hall sensor" }),
            Component::Encoder => return Err(Refused::Absent { model: Self::MODEL, what: "encoder" }),
            Component::Eeprom => self.eeprom_broken = broken,
            Component::Reference => self.reference_broken = broken,
            Component::Phase => self.motor.lost_phase = broken.then_some(Phase::A),
            Component::Short => self.motor.shorted_phase = broken.then_some(Phase::A),
            Component::Bridge => self.motor.set_broken_down(broken),
            Component::Bleeder => return Err(Refused::Absent { model: Self::MODEL, what: "bleeder" }),
        }
        Ok(())
    }
}
