//! An M joint motor on its hardware: motor, reducer, load, absolute encoder with battery, brake, supply, EEPROM, and what
//! is wired to its pulse inputs.
//!
//! In go the firmware's power stage, brake and outputs, out come its sensors and the report for people. Figures of the
//! motors are those of `plant`; what is assumed of the surroundings is a constant below.

use can::Bitrate;
use drives::RegisterError;
use drives::engine::axis::Demand;
use drives::engine::storage::Image;
use drives::mjoint::readings::{COUNTS_PER_TURN, COUNTS_S_PER_RPM};
use drives::mjoint::{Actuation, Battery, Brake, Hardware, MJoint, Model, PowerStage, Sensors, objects, storage};
use plant::absolute_encoder::BatteryState;
use plant::pmsm::Phase;
use plant::{Angle, Inverter, JointMotor, JointMotorModel, Rig, joint_motor};

use super::Machine;
use super::assembly::{Assembly, within};
use super::pulse_source::PulseSource;
use crate::{Component, Levels, PulseTrain, Refused, Report, TemperatureSensor};

const OUTPUTS: &[&str] = &["ZO", "WR", "RED", "GREEN"];
const PERIOD_S: f64 = <MJoint as drives::Firmware>::CONTROL_PERIOD_NS as f64 * 1e-9;
const SUPPLY_V: f64 = 36.0;
const AMBIENT_C: f64 = 25.0;

/// Assumed: at the output of a 36 V supply of some 200 W. A bare joint that stops from its full speed stays under 52 V
/// with it; a loaded one does not.
const SUPPLY_CAPACITANCE_F: f64 = 3_000e-6;

/// The drive's own converter starts above and stops below these bus voltages. Assumed: well below the 24 V that the
/// manual wants at least.
const START_V: f64 = 12.0;
const STOP_V: f64 = 9.0;

const RPM_PER_RAD_S: f64 = 30.0 / core::f64::consts::PI;

/// An M joint motor, as a station of a world.
pub type MJointMachine = Machine<Joint>;

/// A joint as delivered but for its address (2615h), on 36 V, its battery full, without power.
///
/// `bitrate` is the rate that its CAN controller is built for: 1 Mbit/s on a real one.
pub fn mjoint(model: &'static Model, node: u8, bitrate: Bitrate) -> MJointMachine {
    Machine::new(MJoint::new(model), Joint::new(model, storage::with_address(node), bitrate))
}

/// Motor, gear, load, supply and memory of a joint.
#[derive(Clone, Debug)]
pub struct Joint {
    model: &'static Model,
    motor: JointMotor,
    image: Image,
    bitrate: Bitrate,
    pulses: PulseSource,
    last: Actuation,
    /// A brake that was fitted holds the shaft when the drive has no power.
    braked_without_power: bool,
}

impl Joint {
    /// At rest at ambient temperature, the supply not yet connected.
    pub fn new(model: &'static Model, image: Image, bitrate: Bitrate) -> Self {
        let mut motor = JointMotor::new(motor_of(model), Angle::default(), SUPPLY_V, AMBIENT_C);
        motor.model.rig.supply.capacitance_f += SUPPLY_CAPACITANCE_F;
        motor.rig.supply.connected = false;
        motor.rig.supply.bus_v = 0.0;
        Self {
            model,
            motor,
            image,
            bitrate,
            pulses: PulseSource::default(),
            last: Actuation::default(),
            braked_without_power: false,
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

    /// Fits a brake as soon as the drive is set for one (2619h = 7 or 8), and moves it.
    fn is_braked(&mut self, actuation: &Actuation) -> bool {
        if !actuation.running {
            return self.braked_without_power;
        }
        self.braked_without_power = actuation.brake != Brake::Absent;
        if self.braked_without_power && self.motor.model.brake.holding_nm == 0.0 {
            self.motor.model = self.motor.model.with_brake();
        }
        actuation.brake == Brake::Engaged
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

    const MODEL: &'static str = "M joint";
    const INPUTS: &'static [&'static str] = &["PU", "DIR"];

    fn model(&self) -> &'static str {
        self.model.name
    }

    fn hardware(&self) -> Hardware {
        Hardware { eeprom: self.image, bitrate: self.bitrate }
    }

    #[inline]
    fn sense(&self, inputs: u32) -> Sensors {
        let sensed = self.motor.sense();
        Sensors {
            angle_count: self.motor.rotor.angle.count(COUNTS_PER_TURN).rem_euclid(i64::from(COUNTS_PER_TURN)) as u16,
            position_counts: sensed.position_counts,
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
            dir: inputs & 2 != 0,
            pulses: self.pulses.read(),
        }
    }

    #[inline]
    fn step(&mut self, actuation: &Actuation) {
        self.last = *actuation;
        let pins = joint_motor::Actuation {
            inverter: match actuation.power_stage {
                PowerStage::Off => Inverter::Open,
                PowerStage::Modulate { duty } => Inverter::Driven(duty.map(f64::from)),
            },
            brake_released: !self.is_braked(actuation),
            set_origin: actuation.set_origin,
        };
        self.motor.step(PERIOD_S, &pins);
        self.pulses.advance(PERIOD_S);
    }

    fn report(&self, firmware: &MJoint, running: bool) -> Report {
        let own = drives::Firmware::report(firmware);
        let rotor = &self.motor.rotor;
        let engaged = if running { own.brake_engaged } else { self.braked_without_power };
        let bits = [self.last.zero_output, self.last.alarm_output, self.last.red_led, self.last.green_led];
        Report {
            node: own.node_id.raw(),
            powered: running,
            statusword: running.then(|| firmware.values().get(objects::STATUSWORD)),
            error_code: u32::from(own.fault_code),
            position: i64::from(own.position_counts),
            velocity_rpm: rotor.velocity_rad_s * RPM_PER_RAD_S,
            current_a: f64::from(own.current_a),
            supply_v: self.motor.rig.supply.bus_v,
            motor_c: Some(self.motor.rig.winding.temperature_c),
            driver_c: Some(self.motor.rig.heat_sink.temperature_c),
            outputs: Levels {
                names: OUTPUTS,
                bits: bits.iter().enumerate().fold(0, |all, (n, bit)| all | u32::from(running && *bit) << n),
            },
            brake: Some(if engaged { crate::Brake::Engaged } else { crate::Brake::Released }),
            shaft_angle_rad: rotor.angle.as_rad(),
            ..demands(firmware)
        }
    }

    fn connect_supply(&mut self, on: bool) {
        let JointMotor { rig: Rig { supply, .. }, encoder, model, rotor, .. } = &mut self.motor;
        if on && !supply.connected {
            // The inrush limiter has charged the capacitor by the time the drive's converter starts.
            supply.bus_v = supply.bus_v.max(supply.source_v);
            model.encoder.step(encoder, 0.0, rotor.angle, true);
        }
        if !on {
            // However short the off time of a person's hand: the capacitor is empty after it, and the encoder lives on
            // its battery or not at all.
            supply.bus_v = 0.0;
            model.encoder.step(encoder, 0.0, rotor.angle, false);
        }
        supply.connected = on;
    }

    fn supplies_firmware(&self, running: bool) -> bool {
        self.motor.rig.supply.bus_v >= if running { STOP_V } else { START_V }
    }

    #[inline]
    fn shaft_counts(&self) -> i64 {
        self.motor.rotor.angle.count(COUNTS_PER_TURN)
    }

    fn counts_reversed(&self, _firmware: &MJoint) -> bool {
        false
    }

    fn image(&self) -> &[u8] {
        &self.image.0
    }

    fn keep_image(&mut self, image: &[u8]) {
        self.image = Image::from_bytes(image);
    }

    fn set_load_torque(&mut self, torque_nm: f64) -> Result<(), Refused> {
        self.motor.rig.load.torque_nm = within("load torque", "-1000 to 1000 N·m", -1000.0..=1000.0, torque_nm)?;
        Ok(())
    }

    fn set_load_inertia(&mut self, inertia_kg_m2: f64) -> Result<(), Refused> {
        self.motor.rig.load.inertia_kg_m2 = within("load inertia", "0 to 1000 kg·m²", 0.0..=1000.0, inertia_kg_m2)?;
        Ok(())
    }

    fn set_rotor_locked(&mut self, locked: bool) {
        self.motor.rig.load.locked = locked;
    }

    fn set_supply(&mut self, supply_v: f64) -> Result<(), Refused> {
        let supply = &mut self.motor.rig.supply;
        supply.source_v = within("supply", "0 to 100 V", 0.0..=100.0, supply_v)?;
        // A supply that is turned down discharges its own output; only the motor's energy it cannot take.
        if supply.connected {
            supply.bus_v = supply.bus_v.min(supply_v);
        }
        Ok(())
    }

    fn hold_temperature(&mut self, sensor: TemperatureSensor, celsius: Option<f64>) -> Result<(), Refused> {
        if let Some(celsius) = celsius {
            within("temperature", "-55 to 200 °C", -55.0..=200.0, celsius)?;
        }
        let body = match sensor {
            TemperatureSensor::Motor => &mut self.motor.rig.winding,
            TemperatureSensor::Driver => &mut self.motor.rig.heat_sink,
        };
        body.hold_c = celsius;
        Ok(())
    }

    fn set_fault(&mut self, component: Component, broken: bool) -> Result<(), Refused> {
        let what = match component {
            Component::Phase => {
                self.motor.lost_phase = broken.then_some(Phase::U);
                return Ok(());
            }
            Component::Hall => "Hall sensors",
            Component::Encoder => "fault of the encoder; take its battery away",
            Component::Eeprom => "fault of the EEPROM",
            Component::Reference => "reference voltage to measure",
        };
        Err(Refused::Absent { model: self.model(), what })
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

/// Set-points of the control loops.
fn demands(firmware: &MJoint) -> Report {
    let rpm = |counts_s: f64| Some(counts_s / COUNTS_S_PER_RPM);
    match *firmware.demand() {
        Demand::Off => Report::default(),
        Demand::Position(point) => Report {
            position_demand: Some(i64::from(point.position)),
            velocity_demand_rpm: rpm(point.velocity),
            ..Report::default()
        },
        Demand::Velocity(point) => Report { velocity_demand_rpm: rpm(point.velocity), ..Report::default() },
        Demand::Torque(current_a) => Report { current_demand_a: Some(f64::from(current_a)), ..Report::default() },
    }
}
