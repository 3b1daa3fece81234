//! An M joint motor on its hardware: motor, reducer, load, absolute encoder with battery, brake, supply, EEPROM, and what
//! is wired to its pulse inputs.
//!
//! In go the firmware's power stage, brake and outputs, out come its sensors and the report for people. Figures of the
//! motors are those of `plant`; what is assumed of the surroundings is a constant below.

use std::sync::Arc;

use can::Bitrate;
use devices::AxisId;
use devices::Description;
use drives::engine::device::ResetTimes;
use drives::engine::storage::StoredImage;
use drives::mjoint::assumptions::{COUNTS_PER_TURN, COUNTS_S_PER_RPM};
use drives::mjoint::variations::VARIANT;
use drives::mjoint::{Actuation, Battery, Brake, Hardware, MJoint, Model, PowerStage, Sensors, objects, storage};
use drives::{Fidelity, RegisterError};
use plant::absolute_encoder::BatteryState;
use plant::gear::{GearData, GearModel};
use plant::pmsm::Phase;
use plant::rest::is_at_rest;
use plant::supply::SupplyData;
use plant::{Angle, FreeRun, Inverter, JointMotor, JointMotorModel, joint_motor};

use super::following::{current_loop, followed};
use super::order::{Order, OrderError};
use super::pulse_source::PulseSource;
use crate::machine::kernel::Machine;
use crate::machine::kernel::assembly::{AMBIENT_C, Assembly, with_demand};
use crate::machine::kernel::realism::{
    JOINT_COGGING, LARGE_CURRENT_STEP_A, Noise, Realism, TEMPERATURE_STEP_C, VOLTAGE_STEP_V, with_dead_time,
};
use crate::{Component, Levels, OutputShaft, PulseTrain, Refused, Report, VirtualDrive};

/// What has been destroyed, and what to do about it.
const SEIZED: &str = "bearing of the reducer seized by over-speed: 'rotor free' fits a new reducer";
const SLIPPED: &str = "teeth of the reducer jumped, its output stands elsewhere: 'rotor free' fits a new reducer";
const BURNT: &str = "power stage burnt: 'fault bridge off' fits a new one, 'power cycle' starts it";

const OUTPUTS: &[&str] = &["ZO", "WR", "RED", "GREEN"];
const SUPPLY_V: f64 = 36.0;

/// Assumed: at the output of a 36 V supply of some 200 W. A bare joint that stops from its full speed stays under 52 V
/// with it; a loaded one does not.
const SUPPLY_CAPACITANCE_F: f64 = 3_000e-6;

/// An M joint motor, as a station of a world.
pub type MJointMachine = Machine<Joint>;

/// A joint as delivered but for its address (2615h), on 36 V, its battery full, without power.
///
/// `bitrate` is the rate that its CAN controller is built for: 1 Mbit/s on a real one.
pub fn mjoint(model: &'static Model, node: u8, bitrate: Bitrate) -> MJointMachine {
    let image = StoredImage::of(&storage::addressed(&VARIANT, node));
    Machine::new(MJoint::new(model), Joint::new(model, image, bitrate))
}

/// The same as it was ordered.
pub(super) fn ordered(model: &Description, order: &Order) -> Result<Box<dyn VirtualDrive>, OrderError> {
    let joint = Model::named(model.name).ok_or(OrderError::NoSuchModel { model: model.name })?;
    let image = order.image(storage::addressed(&order.variant, order.node.raw()))?;
    Ok(Box::new(Machine::new(MJoint::of(joint, order.variant), Joint::new(joint, image, order.bitrate))))
}

/// Motor, gear, load, supply and memory of a joint.
#[derive(Clone, Debug)]
pub struct Joint {
    model: &'static Model,
    motor: JointMotor,
    /// Shared by all copies of a world until one of them loses power.
    image: Arc<StoredImage>,
    bitrate: Bitrate,
    pulses: PulseSource,
    last: Actuation,
    /// A brake that was fitted holds the shaft when the drive has no power.
    braked_without_power: bool,
    eeprom_broken: bool,
    dead_time: bool,
    /// The line to the encoder is broken: the drive goes on reading what came last.
    last_reading: Option<EncoderReading>,
}

/// What the encoder reads.
#[derive(Clone, Copy, Debug)]
struct EncoderReading {
    angle_count: u16,
    position_counts: i32,
}

impl Joint {
    /// At rest at ambient temperature, the supply not yet connected.
    pub fn new(model: &'static Model, image: StoredImage, bitrate: Bitrate) -> Self {
        let mut motor = JointMotor::new(motor_of(model), Angle::default(), SUPPLY_V, AMBIENT_C);
        motor.model.rig.supply.source_capacitance_f = SUPPLY_CAPACITANCE_F;
        motor.rig.supply = SupplyData::switched_off(SUPPLY_V);
        Self {
            model,
            motor,
            image: Arc::new(image),
            bitrate,
            pulses: PulseSource::default(),
            last: Actuation::default(),
            braked_without_power: false,
            eeprom_broken: false,
            dead_time: false,
            last_reading: None,
        }
    }

    /// The motor and all that is joined to it.
    pub fn motor(&self) -> &JointMotor {
        &self.motor
    }

    /// The motor and all that is joined to it, to change.
    pub fn motor_mut(&mut self) -> &mut JointMotor {
        &mut self.motor
    }

    fn output_shaft(&self) -> OutputShaft {
        let GearData { torque_nm, slip_rad, most_nm, overloads, jumps, .. } = self.motor.gear;
        OutputShaft { angle_rad: self.motor.output_angle().as_rad(), torque_nm, most_nm, overloads, jumps, slip_rad }
    }

    fn damage(&self) -> Option<&'static str> {
        let seized = self.motor.is_seized().then_some(SEIZED);
        let slipped = (self.motor.gear.jumps > 0).then_some(SLIPPED);
        self.motor.is_power_stage_burnt().then_some(BURNT).or(seized).or(slipped)
    }

    fn encoder_reading(&self, position_counts: i32) -> EncoderReading {
        let turn = i64::from(COUNTS_PER_TURN);
        let angle_count = self.motor.rotor.angle.count(COUNTS_PER_TURN).rem_euclid(turn) as u16;
        self.last_reading.unwrap_or(EncoderReading { angle_count, position_counts })
    }

    /// Fits a brake as soon as the drive is set for one (2619h = 7 or 8).
    #[inline]
    fn fit_brake(&mut self, actuation: &Actuation) {
        if !actuation.running {
            return;
        }
        self.braked_without_power = actuation.brake != Brake::Absent;
        if self.braked_without_power && self.motor.model.brake.holding_nm == 0.0 {
            self.motor.model = self.motor.model.with_brake();
        }
    }
}

/// The physics of a model.
fn motor_of(model: &Model) -> JointMotorModel {
    let motors = [
        JointMotorModel::M4230E17B50,
        JointMotorModel::M4230E17B80,
        JointMotorModel::M8025E25B50,
        JointMotorModel::M8025E25B80,
    ];
    motors.into_iter().find(|motor| motor.name.eq_ignore_ascii_case(model.name)).unwrap_or(JointMotorModel::M4230E17B50)
}

impl Assembly for Joint {
    type Firmware = MJoint;
    type Motor = JointMotor;

    const MODEL: &'static str = "M joint";
    const INPUTS: &'static [&'static str] = &["PU", "DIR"];

    fn model(&self) -> &'static str {
        self.model.name
    }

    /// A broken EEPROM reads as a blank one; what is in it comes back when it is mended.
    fn hardware(&self) -> Hardware {
        let eeprom = if self.eeprom_broken { StoredImage::from_bytes(&[]) } else { *self.image };
        Hardware { eeprom, bitrate: self.bitrate }
    }

    fn set_reset_times(firmware: &mut Self::Firmware, times: ResetTimes) {
        firmware.set_reset_times(times);
    }

    #[inline]
    fn sense(&self, inputs: u64) -> Sensors {
        let sensed = self.motor.sense();
        let EncoderReading { angle_count, position_counts } = self.encoder_reading(sensed.position_counts);
        Sensors {
            angle_count,
            position_counts,
            turns_lost: sensed.turns_lost,
            battery: match sensed.battery {
                BatteryState::Full => Battery::Full,
                BatteryState::Charging => Battery::Charging,
                BatteryState::Disconnected => Battery::Missing,
            },
            phase_current_a: [sensed.phase_current_a[0] as f32, sensed.phase_current_a[1] as f32],
            bus_v: sensed.bus_v as f32,
            driver_c: sensed.heat_sink_c as f32,
            pu: inputs & 1 != 0,
            dir: self.pulses.dir().unwrap_or(inputs & 2 != 0),
            pulses: self.pulses.read(),
            eeprom_fails: self.eeprom_broken,
            followed: None,
        }
    }

    fn set_realism(&mut self, realism: Realism) {
        self.dead_time = realism == Realism::Full;
        self.motor.cogging = self.dead_time.then_some(JOINT_COGGING);
    }

    fn disturb(&self, sensors: &mut Sensors, noise: &mut Noise) {
        let off = i32::from(noise.misplaced_edge(self.motor.rotor.angle, COUNTS_PER_TURN));
        let within_turn = i32::from(sensors.angle_count) + off;
        sensors.angle_count = within_turn.rem_euclid(COUNTS_PER_TURN as i32) as u16;
        sensors.position_counts = sensors.position_counts.saturating_add(off);
        sensors.phase_current_a = sensors.phase_current_a.map(|a| noise.flicker(a, LARGE_CURRENT_STEP_A));
        sensors.bus_v = noise.flicker(sensors.bus_v, VOLTAGE_STEP_V);
        sensors.driver_c = noise.flicker(sensors.driver_c, TEMPERATURE_STEP_C);
    }

    // Inlined by force: it has a second caller, in periods without firmware.
    #[inline(always)]
    fn step(&mut self, actuation: &Actuation) {
        self.last = *actuation;
        self.fit_brake(actuation);
        self.motor.step(Self::PERIOD_S, &self.pins(AxisId::FIRST, actuation));
        self.pulses.advance(Self::PERIOD_S);
    }

    fn set_fidelity(&mut self, fidelity: Fidelity) {
        self.motor.rig.set_long_steps(fidelity == Fidelity::Mechanical);
    }

    fn add_followed(&self, sensors: &mut Sensors) {
        sensors.followed = Some(followed(&self.motor.rotor, &self.motor.pmsm));
    }

    fn step_long(&mut self, firmware: &MJoint, actuation: &Actuation, dt_s: f64) {
        self.last = *actuation;
        if let PowerStage::Follow(demand) = &actuation.power_stage {
            let (gains, motor) = (firmware.current_gains(), &mut self.motor);
            motor.pmsm.current_loop.settings = current_loop(demand, &gains, &motor.model.pmsm, &motor.rotor);
        }
        self.fit_brake(actuation);
        self.motor.step_long(dt_s, &self.pins(AxisId::FIRST, actuation));
        self.pulses.advance(dt_s);
    }

    fn can_rest(&self, actuation: &Actuation, dt_s: f64) -> bool {
        let quiet = self.motor.rotor.velocity_rad_s == 0.0 && !actuation.set_origin && self.pulses.is_idle();
        quiet && is_at_rest(&self.motor, dt_s, &self.pins(AxisId::FIRST, actuation))
    }

    /// Behind a burnt power stage there is no voltage.
    #[inline]
    fn supplies_firmware(&self, running: bool) -> bool {
        let least_v = if running { Self::STOPS_BELOW_V } else { Self::STARTS_AT_V };
        !self.motor.is_power_stage_burnt() && self.motor.rig.supply.bus_v >= least_v
    }

    /// Blocks the output, or frees it with a new reducer in place of a broken one.
    fn set_rotor_locked(&mut self, _axis: AxisId, locked: bool) {
        self.motor.rig.load.locked = locked;
        if !locked && (self.motor.is_seized() || self.motor.gear.jumps > 0) {
            self.motor.replace_reducer();
        }
    }

    fn motor_at(&self, _axis: AxisId) -> &JointMotor {
        &self.motor
    }

    fn motor_at_mut(&mut self, _axis: AxisId) -> &mut JointMotor {
        &mut self.motor
    }

    #[inline]
    fn pins(&self, _axis: AxisId, actuation: &Actuation) -> joint_motor::Actuation {
        let braked = if actuation.running { actuation.brake == Brake::Engaged } else { self.braked_without_power };
        joint_motor::Actuation {
            inverter: match actuation.power_stage {
                PowerStage::Off => Inverter::Open,
                PowerStage::Modulate { duty } if self.dead_time => {
                    Inverter::Driven(with_dead_time(duty.map(f64::from), self.motor.phase_current_a()))
                }
                PowerStage::Modulate { duty } => Inverter::Driven(duty.map(f64::from)),
                PowerStage::Follow(_) => Inverter::Regulated,
            },
            brake_released: !braked,
            set_origin: actuation.set_origin,
        }
    }

    fn report(&self, firmware: &MJoint, _axis: AxisId, common: Report) -> Report {
        let running = common.powered;
        let engaged = if running {
            drives::Firmware::report(firmware, AxisId::FIRST).brake_engaged
        } else {
            self.braked_without_power
        };
        let levels = [self.last.zero_output, self.last.alarm_output, self.last.red_led, self.last.green_led];
        let report = Report {
            statusword: running.then(|| firmware.values().get(objects::STATUSWORD)),
            output: Some(self.output_shaft()),
            damage: self.damage(),
            outputs: Levels::new(OUTPUTS, &levels.map(|level| running && level)),
            brake: Some(if engaged { crate::Brake::Engaged } else { crate::Brake::Released }),
            ..common
        };
        with_demand(firmware.demand(), |counts_s| counts_s / COUNTS_S_PER_RPM, report)
    }

    /// Without the converter's voltage the encoder lives on its battery or not at all.
    fn set_supplied(&mut self, supplied: bool) {
        let JointMotor { encoder, model, rotor, .. } = &mut self.motor;
        model.encoder.step(encoder, 0.0, rotor.angle, supplied);
    }

    #[inline]
    fn counts_per_turn(&self, _axis: AxisId) -> u32 {
        COUNTS_PER_TURN
    }

    fn gear(&self) -> Option<&GearModel> {
        Some(&self.motor.model.gear)
    }

    fn free_run(&self, _axis: AxisId) -> Option<FreeRun> {
        let idle = self.last.power_stage == PowerStage::Off;
        let Actuation { running, brake, .. } = self.last;
        let engaged = if running { brake == Brake::Engaged } else { self.braked_without_power };
        idle.then(|| self.motor.free_run(!engaged)).flatten()
    }

    fn image(&self) -> &[u8] {
        &self.image.0
    }

    /// A blank image is what a firmware has that found the EEPROM broken: nothing was written then.
    fn keep_image(&mut self, image: &[u8]) {
        if image.iter().any(|byte| *byte != 0xFF) {
            self.image = Arc::new(StoredImage::from_bytes(image));
        }
    }

    fn set_fault(&mut self, _axis: AxisId, component: Component, broken: bool) -> Result<(), Refused> {
        let absent = |what| Err(Refused::Absent { model: self.model(), what });
        match component {
            Component::Hall => return absent("Hall sensors: its encoder is absolute"),
            Component::Reference => return absent("reference voltage that it watches: no alarm reports one"),
            Component::Short => return absent("short circuit to simulate"),
            Component::Bleeder => return absent("bleeder"),
            Component::Bridge if broken => self.motor.burn_power_stage(),
            Component::Bridge => self.motor.mend_power_stage(),
            Component::Encoder => {
                let now = self.encoder_reading(self.motor.sense().position_counts);
                self.last_reading = broken.then_some(now);
            }
            Component::Eeprom => self.eeprom_broken = broken,
            Component::Phase => self.motor.lost_phase = broken.then_some(Phase::U),
        }
        Ok(())
    }

    fn set_battery(&mut self, connected: bool) -> Result<(), Refused> {
        self.motor.encoder.battery.connected = connected;
        Ok(())
    }

    fn set_pulses(&mut self, train: PulseTrain) -> Result<(), Refused> {
        self.pulses.start(train)
    }

    fn modbus_unit(firmware: &MJoint) -> Option<u8> {
        firmware.modbus_address()
    }

    fn read_registers(firmware: &MJoint, address: u16, words: &mut [u16]) -> Result<(), RegisterError> {
        firmware.read_registers(address, words)
    }

    fn write_registers(firmware: &mut MJoint, address: u16, words: &[u16]) -> Result<(), RegisterError> {
        firmware.write_registers(address, words)
    }
}
