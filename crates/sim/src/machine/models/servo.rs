//! A described servo on its hardware: a motor with encoder, index pulse, brake, switches, supply and memory for each axis.
//!
//! The motor is chosen by the order (`motor=sgmah-04a-brake`). What a description has and the firmware does not act on:
//! [`without_effect`].

use canopen::Mux;
use devices::servo::variations::VARIATIONS;
use devices::variant::Pick;
use devices::{AxisId, Description};
use drives::Fidelity;
use drives::engine::device::ResetTimes;
use drives::node::{Memory, device_acts_on};
use drives::servo::{
    Actuation, AxisActuation, AxisSensors, Hardware, MAX_AXES, Motor, PowerStage, Sensors, ServoDrive, acts_on,
    conditions,
};
use plant::FreeRun;
use plant::angle::Angle;
use plant::encoder::EncoderFault;
use plant::hall::HallFault;
use plant::hub_motor::{self, HubMotor, HubMotorModel, Inverter};
use plant::pmsm::Phase;
use plant::rest::{Rested, is_at_rest, rest};
use plant::supply::SupplyData;

use super::boxed::Boxed;
use super::following::{current_loop, followed};
use super::order::{Order, OrderError};
use super::{kept, order};
use crate::machine::kernel::Machine;
use crate::machine::kernel::assembly::{AMBIENT_C, Assembly, with_demand};
use crate::machine::kernel::quantity::QuantityRange;
use crate::machine::kernel::realism::{
    HUB_COGGING, LARGE_CURRENT_STEP_A, Noise, Realism, TEMPERATURE_STEP_C, VOLTAGE_STEP_V, with_dead_time,
};
use crate::{Brake, Component, Levels, Refused, Report, VirtualDrive};

const WITH_BRAKE: Pick = Pick::of(VARIATIONS, "motor", "sgmah-04a-brake");
const WHEEL: Pick = Pick::of(VARIATIONS, "motor", "zllg65asm250-l");

/// Where the rotor stands when it is put together: not at its index pulse.
const FIRST_TURNS: f64 = 0.3;

const OUTPUTS: &[&str] = &["brake released"];

/// What has been destroyed, and what to do about it.
const SEIZED: &str = "bearings seized by over-speed: 'rotor free' puts in new ones";
const BURNT: &str = "power stage burnt: 'fault bridge off' fits a new one, 'power cycle' starts it";
const BLEEDER_BURNT: &str = "bleeder resistor burnt, it takes no power: 'fault bleeder off' fits a new one";

/// A described servo, as a station of a world.
pub type ServoMachine = Machine<ServoBench>;

/// A servo of this description as ordered, without power.
///
/// # Errors
/// [`OrderError`] if a value cannot be in its parameter store.
pub fn servo(model: &'static Description, order: &Order) -> Result<ServoMachine, OrderError> {
    let memory = order::memory(model, order)?;
    let hardware = hardware(order, memory);
    let profile = kept::profile(model, conditions(model));
    let firmware = ServoDrive::new(model, profile, &hardware);
    Ok(Machine::new(firmware, ServoBench::new(model, &kit(order), hardware)))
}

pub(super) fn ordered(model: &'static Description, order: &Order) -> Result<Box<dyn VirtualDrive>, OrderError> {
    Ok(Box::new(servo(model, order)?))
}

/// The objects that a description has and the firmware does not act on: they are answered, and have no effect.
pub fn without_effect(model: &Description) -> impl Iterator<Item = Mux> {
    let rows = model.dictionary.rows().iter().map(canopen::od::Entry::mux);
    let acts = if model.axes.is_empty() { device_acts_on } else { acts_on };
    rows.filter(move |mux| !acts(model, *mux))
}

/// A motor with the figures that its data sheet has beyond the model's.
struct Kit {
    model: HubMotorModel,
    rated_torque_nm: f64,
    rated_current_a_rms: f64,
    max_current_a_rms: f64,
    max_rpm: f64,
    bus_v: f64,
}

fn kit(order: &Order) -> Kit {
    if order.variant.is(WHEEL) {
        // "Rated 6 N m at 6 A, peak 18 A"; 521 r/min at 48 V.
        return Kit {
            model: HubMotorModel::ZLLG65ASM250_L,
            rated_torque_nm: 6.0,
            rated_current_a_rms: 6.0,
            max_current_a_rms: 18.0,
            max_rpm: 500.0,
            bus_v: 48.0,
        };
    }
    let with_brake = order.variant.is(WITH_BRAKE);
    Kit {
        model: if with_brake { HubMotorModel::SGMAH_04A_BRAKE } else { HubMotorModel::SGMAH_04A },
        rated_torque_nm: 1.27,
        rated_current_a_rms: 2.8,
        max_current_a_rms: 8.5,
        max_rpm: 5000.0,
        bus_v: 283.0,
    }
}

fn hardware(order: &Order, memory: Memory<Boxed>) -> Hardware<Boxed> {
    let Kit { model, rated_torque_nm, rated_current_a_rms, max_current_a_rms, max_rpm, bus_v } = kit(order);
    let amplitude = |rms: f64| (rms * core::f64::consts::SQRT_2) as f32;
    let bleeder = model.rig.supply.bleeder;
    let motor = Motor {
        pole_pairs: model.pmsm.pole_pairs,
        increments_per_turn: model.encoder.counts_per_turn(),
        resistance_ohm: model.pmsm.resistance_ohm as f32,
        inductance_h: model.pmsm.inductance_q_h as f32,
        flux_linkage_wb: model.pmsm.flux_linkage_wb as f32,
        inertia_kg_m2: model.rotor.inertia_kg_m2 as f32,
        rated_torque_nm: rated_torque_nm as f32,
        rated_current_a: amplitude(rated_current_a_rms),
        max_current_a: amplitude(max_current_a_rms),
        max_velocity_rad_s: (max_rpm * cia402::RAD_S_PER_RPM) as f32,
        braking_ohm: bleeder.resistance_ohm as f32,
        braking_w: bleeder.rated_power_w as f32,
        bus_v: bus_v as f32,
        speed_worth: order.speed_worth,
    };
    Hardware { node_id: order.node, bitrate: order.bitrate, motors: [motor; MAX_AXES], memory }
}

/// Motors, loads, supply and memory of a described servo.
#[derive(Clone, Debug)]
pub struct ServoBench {
    model: &'static Description,
    motors: Vec<HubMotor>,
    /// The counter of each motor where its index pulse came in the last period.
    indexes: Vec<Option<u16>>,
    hardware: Hardware<Boxed>,
    store_broken: bool,
    dead_time: bool,
    last: Actuation,
}

impl ServoBench {
    /// At rest at ambient temperature, the supply not yet connected.
    fn new(model: &'static Description, kit: &Kit, hardware: Hardware<Boxed>) -> Self {
        let mut motor = HubMotor::new(kit.model, Angle::from_turns(FIRST_TURNS), kit.bus_v, AMBIENT_C);
        motor.rig.supply = SupplyData::switched_off(kit.bus_v);
        let count = model.axes.len().clamp(1, MAX_AXES);
        Self {
            model,
            motors: vec![motor; count],
            indexes: vec![None; count],
            hardware,
            store_broken: false,
            dead_time: false,
            last: Actuation::default(),
        }
    }

    /// The motor of an axis and all that is joined to it.
    pub fn motor(&self, axis: usize) -> Option<&HubMotor> {
        self.motors.get(axis)
    }

    /// The motor of an axis and all that is joined to it, to change.
    pub fn motor_mut(&mut self, axis: usize) -> Option<&mut HubMotor> {
        self.motors.get_mut(axis)
    }

    fn first(&self) -> &HubMotor {
        &self.motors[0]
    }

    fn damage(&self) -> Option<&'static str> {
        let seized = self.motors.iter().any(HubMotor::is_seized).then_some(SEIZED);
        let bleeder = self.motors.iter().any(|motor| motor.rig.supply.bleeder_burnt).then_some(BLEEDER_BURNT);
        self.motors.iter().any(HubMotor::is_power_stage_burnt).then_some(BURNT).or(seized).or(bleeder)
    }

    fn sense_axis(&self, axis: usize, motor: &HubMotor, inputs: u64) -> AxisSensors {
        let sensed = motor.sense();
        let level = |input: usize| inputs >> (axis * SWITCHES + input) & 1 != 0;
        AxisSensors {
            encoder_count: sensed.encoder_count,
            index_count: self.indexes[axis],
            encoder_wired: motor.encoder.fault != EncoderFault::Disconnected,
            tracks: sensed.hall,
            phase_current_a: [sensed.phase_current_a[0] as f32, sensed.phase_current_a[1] as f32],
            motor_c: sensed.winding_c as f32,
            negative_limit: level(0),
            positive_limit: level(1),
            home: level(2),
            probes: [level(3), level(4)],
            followed: None,
        }
    }

    /// The source and its switch are those of the first axis; each power stage has its own bus behind it.
    fn share_source(&mut self) {
        let Some((first, others)) = self.motors.split_first_mut() else { return };
        let supply = first.rig.supply;
        for motor in others {
            motor.rig.supply.source_v = supply.source_v;
            if motor.rig.supply.connected != supply.connected {
                motor.rig.switch_source(&motor.model.rig, supply.connected);
            }
        }
    }

    fn step_axis(
        &mut self,
        axis: usize,
        actuation: &Actuation,
        step: impl FnOnce(&mut HubMotor, &hub_motor::Actuation),
    ) {
        let pins = self.pins(AxisId(axis as u8), actuation);
        let motor = &mut self.motors[axis];
        let before = motor.rotor.angle.turns();
        step(motor, &pins);
        self.indexes[axis] = index_count(motor, before);
    }
}

/// The counter where the index pulse came, if the shaft has passed a whole turn since it stood in turn `before`.
fn index_count(motor: &HubMotor, before: i64) -> Option<u16> {
    let angle = motor.rotor.angle;
    let turns = angle.turns();
    if turns == before {
        return None;
    }
    let per_turn = motor.model.encoder.counts_per_turn();
    let beyond = angle.count(per_turn) - turns.max(before) * i64::from(per_turn);
    Some(motor.encoder.count.wrapping_sub(beyond as u16))
}

/// Inputs of one axis: limit switches, home switch, touch probes.
const SWITCHES: usize = 5;

/// Those of all axes, one axis after the other; the number of each axis but the first stands behind.
#[rustfmt::skip]
const INPUTS: [&str; SWITCHES * MAX_AXES] = [
    "NEG", "POS", "HOME", "P1", "P2",
    "NEG2", "POS2", "HOME2", "P1_2", "P2_2",
    "NEG3", "POS3", "HOME3", "P1_3", "P2_3",
    "NEG4", "POS4", "HOME4", "P1_4", "P2_4",
    "NEG5", "POS5", "HOME5", "P1_5", "P2_5",
    "NEG6", "POS6", "HOME6", "P1_6", "P2_6",
    "NEG7", "POS7", "HOME7", "P1_7", "P2_7",
    "NEG8", "POS8", "HOME8", "P1_8", "P2_8",
];

impl Assembly for ServoBench {
    type Firmware = ServoDrive<Boxed>;
    type Motor = HubMotor;

    const MODEL: &'static str = "cia402";
    const INPUTS: &'static [&'static str] = &INPUTS;
    const STARTS_AT_V: f64 = 24.0;
    const STOPS_BELOW_V: f64 = 18.0;
    const SUPPLY_VOLTAGE: QuantityRange =
        QuantityRange { what: "supply", expected: "0 to 450 V", least: 0.0, greatest: 450.0 };

    fn model(&self) -> &'static str {
        self.model.name
    }

    fn description(firmware: &Self::Firmware, _: &Self) -> Option<&'static Description> {
        Some(firmware.description())
    }

    fn inputs(&self) -> &'static [&'static str] {
        &INPUTS[..self.motors.len() * SWITCHES]
    }

    fn hardware(&self) -> Hardware<Boxed> {
        self.hardware.clone()
    }

    fn set_reset_times(firmware: &mut Self::Firmware, times: ResetTimes) {
        firmware.set_reset_times(times);
    }

    fn sense(&self, inputs: u64) -> Sensors {
        let first = self.first();
        // Most servos have one axis; what eight would sense is a tenth of their world's time.
        let mut axes = [AxisSensors::default(); MAX_AXES];
        for (axis, motor) in self.motors.iter().enumerate() {
            axes[axis] = self.sense_axis(axis, motor, inputs);
        }
        Sensors {
            axes,
            bus_v: first.rig.supply.bus_v as f32,
            drive_c: first.rig.heat_sink.temperature_c as f32,
            store_ok: !self.store_broken,
        }
    }

    fn set_realism(&mut self, realism: Realism) {
        self.dead_time = realism == Realism::Full;
        let cogging = self.dead_time.then_some(HUB_COGGING);
        self.motors.iter_mut().for_each(|motor| motor.cogging = cogging);
    }

    fn disturb(&self, sensors: &mut Sensors, noise: &mut Noise) {
        for (axis, motor) in sensors.axes.iter_mut().zip(&self.motors) {
            let off = noise.misplaced_edge(motor.rotor.angle, motor.model.encoder.counts_per_turn());
            axis.encoder_count = axis.encoder_count.wrapping_add_signed(off);
            axis.phase_current_a = axis.phase_current_a.map(|a| noise.flicker(a, LARGE_CURRENT_STEP_A));
            axis.motor_c = noise.flicker(axis.motor_c, TEMPERATURE_STEP_C);
        }
        sensors.bus_v = noise.flicker(sensors.bus_v, VOLTAGE_STEP_V);
        sensors.drive_c = noise.flicker(sensors.drive_c, TEMPERATURE_STEP_C);
    }

    fn step(&mut self, actuation: &Actuation) {
        self.last = *actuation;
        self.share_source();
        for axis in 0..self.motors.len() {
            self.step_axis(axis, actuation, |motor, pins| motor.step(Self::PERIOD_S, pins));
        }
    }

    fn set_fidelity(&mut self, fidelity: Fidelity) {
        let long = fidelity == Fidelity::Mechanical;
        self.motors.iter_mut().for_each(|motor| motor.rig.set_long_steps(long));
    }

    fn add_followed(&self, sensors: &mut Sensors) {
        for (axis, motor) in sensors.axes.iter_mut().zip(&self.motors) {
            axis.followed = Some(followed(&motor.rotor, &motor.pmsm));
        }
    }

    fn step_long(&mut self, firmware: &ServoDrive<Boxed>, actuation: &Actuation, dt_s: f64) {
        self.last = *actuation;
        self.share_source();
        for (axis, (motor, asked)) in self.motors.iter_mut().zip(&actuation.axes).enumerate() {
            if let (PowerStage::Follow(demand), Some(gains)) = (&asked.power_stage, firmware.current_gains(axis)) {
                motor.pmsm.current_loop.settings = current_loop(demand, &gains, &motor.model.pmsm, &motor.rotor);
            }
        }
        for axis in 0..self.motors.len() {
            self.step_axis(axis, actuation, |motor, pins| motor.step_long(dt_s, pins));
        }
    }

    fn can_rest(&self, actuation: &Actuation, dt_s: f64) -> bool {
        let stand = self.motors.iter().all(|motor| motor.rotor.velocity_rad_s == 0.0);
        let rests = |(axis, motor)| is_at_rest(motor, dt_s, &self.pins(AxisId(axis as u8), actuation));
        stand && self.indexes.iter().all(Option::is_none) && self.motors.iter().enumerate().all(rests)
    }

    fn rest(&mut self, actuation: &Actuation, dt_s: f64, periods: u64) -> Rested {
        let pins: [_; MAX_AXES] = std::array::from_fn(|axis| {
            if axis < self.motors.len() {
                self.pins(AxisId(axis as u8), actuation)
            } else {
                hub_motor::Actuation::default()
            }
        });
        rest(&mut self.motors, dt_s, |axis| pins[axis], periods)
    }

    /// Behind a burnt power stage there is no voltage.
    fn supplies_firmware(&self, running: bool) -> bool {
        let least_v = if running { Self::STOPS_BELOW_V } else { Self::STARTS_AT_V };
        !self.first().is_power_stage_burnt() && self.first().rig.supply.bus_v >= least_v
    }

    fn axes(&self) -> u8 {
        self.motors.len() as u8
    }

    fn motor_at(&self, axis: AxisId) -> &HubMotor {
        self.motors.get(usize::from(axis.0)).unwrap_or(self.first())
    }

    fn motor_at_mut(&mut self, axis: AxisId) -> &mut HubMotor {
        let number = Some(usize::from(axis.0)).filter(|number| *number < self.motors.len());
        &mut self.motors[number.unwrap_or(0)]
    }

    fn pins(&self, axis: AxisId, actuation: &Actuation) -> hub_motor::Actuation {
        let axis = usize::from(axis.0);
        let AxisActuation { power_stage, brake_released, .. } = &actuation.axes[axis];
        let inverter = match power_stage {
            PowerStage::Off => Inverter::Open,
            PowerStage::Modulate { duty } if self.dead_time => {
                Inverter::Driven(with_dead_time(duty.map(f64::from), self.motors[axis].phase_current_a()))
            }
            PowerStage::Modulate { duty } => Inverter::Driven(duty.map(f64::from)),
            PowerStage::Follow(_) => Inverter::Regulated,
        };
        hub_motor::Actuation { inverter, bleeder_on: actuation.bleeder_on, brake_released: *brake_released }
    }

    fn report(&self, firmware: &ServoDrive<Boxed>, axis: AxisId, common: Report) -> Report {
        let counts_per_turn = f64::from(self.motor_at(axis).model.encoder.counts_per_turn());
        let number = usize::from(axis.0);
        let has_brake = self.motor_at(axis).model.brake.holding_nm > 0.0;
        let released = self.last.axes.get(number).is_some_and(|axis| axis.brake_released);
        let report = Report {
            statusword: common.powered.then(|| firmware.statusword(number)).flatten(),
            outputs: Levels::new(OUTPUTS, &[released]),
            damage: self.damage(),
            brake: has_brake.then_some(if released { Brake::Released } else { Brake::Engaged }),
            ..common
        };
        match firmware.demand(number) {
            Some(demand) => with_demand(demand, |counts_s| counts_s * 60.0 / counts_per_turn, report),
            None => report,
        }
    }

    #[inline]
    fn counts_per_turn(&self, axis: AxisId) -> u32 {
        self.motor_at(axis).model.encoder.counts_per_turn()
    }

    fn free_run(&self, axis: AxisId) -> Option<FreeRun> {
        let actuation = self.last.axes.get(usize::from(axis.0))?;
        if actuation.power_stage != PowerStage::Off {
            None
        } else {
            self.motor_at(axis).free_run(actuation.brake_released)
        }
    }

    fn image(&self) -> &[u8] {
        self.hardware.memory.bytes()
    }

    fn keep_image(&mut self, image: &[u8]) {
        self.hardware.memory = Memory::from_bytes(self.model.dictionary, image);
    }

    fn set_rotor_locked(&mut self, axis: AxisId, locked: bool) {
        self.motor_at_mut(axis).lock_rotor(locked);
    }

    fn set_fault(&mut self, axis: AxisId, component: Component, broken: bool) -> Result<(), Refused> {
        let motor = self.motor_at_mut(axis);
        match component {
            Component::Hall => motor.hall_fault = if broken { HallFault::Disconnected } else { HallFault::None },
            Component::Encoder => {
                motor.encoder.fault = if broken { EncoderFault::Disconnected } else { EncoderFault::None };
            }
            Component::Eeprom => self.store_broken = broken,
            Component::Phase => motor.lost_phase = broken.then_some(Phase::U),
            Component::Bridge if broken => motor.burn_power_stage(),
            Component::Bridge => motor.mend_power_stage(),
            Component::Bleeder => motor.rig.supply.set_bleeder_burnt(broken),
            Component::Short | Component::Reference => {
                return Err(Refused::Absent { model: self.model.name, what: "such component" });
            }
        }
        Ok(())
    }
}
