//! The drive: the engine's parts joined over the dictionary.
//!
//! Three rhythms: frames as they come (`handle_frame`, in [`commands`]), the communication task every 0.5 ms
//! (`handle_timeout`), and the control period of 50 us ([`Firmware::tick`]), of which every tenth is a supervision period.
//! At fidelity mechanical a tick is a supervision, of 1 ms.

mod commands;
mod resting;

use can::{Bitrate, Instant};
use canopen::node::{Node, NodeProfile};
use cia402::{ModeOfOperation, PowerState};
use devices::AxisId;
use motion::filter::LowPass;

use super::assumptions::*;
use super::faults::{DEBOUNCE, FAULT_COUNT, FAULTS, row};
use super::hardware::{Actuation, Hardware, PowerStage, Sensors};
use super::objects::*;
use super::parameters::Parameters;
use super::protection::{FaultSituation, Protection, is_over_current};
use super::statusword::statusword;
use super::terminals::{self, TERMINALS};
use super::variations::{FIRMWARE_2_01, VARIANT};
use super::{Values, storage};
use crate::communication::communication;
use crate::engine::actuator::bleeder::Bleeder;
use crate::engine::actuator::servo::{CurrentGains, Servo};
use crate::engine::axis::{Demand, Feedback};
use crate::engine::cia402::Targets;
use crate::engine::device::{Application, Device, ResetTimes};
use crate::engine::faults::{FaultMonitor, FaultSet};
use crate::engine::host_watchdog::HostWatchdog;
use crate::engine::storage::StoredImage;
use crate::zltech::Shell;
use crate::zltech::terminals::Conditions;
use crate::{Fidelity, Firmware, Report};
use devices::variant::Variant;

/// How this drive communicates.
pub static NODE_PROFILE: NodeProfile =
    NodeProfile { conditions: &CONDITIONS, ..communication(&devices::zltech::ZLAC8030L) };

/// The same with firmware 2.01.
static NODE_PROFILE_2_01: NodeProfile =
    NodeProfile { conditions: &CONDITIONS, ..communication(&devices::zltech::ZLAC8030L_2_01) };

/// The firmware of a ZLAC8030L V2.0.
#[derive(Clone)]
pub struct Zlac8030l {
    device: Device<TableStorage>,
    dip_address: u8,
    parameters: Parameters,
    shell: Shell<2>,
    servo: Servo,
    /// The sensors have been looked at since the restart.
    awake: bool,
    /// 60FFh is above 200Ah, and this firmware minds.
    speed_setting_wrong: bool,
    /// What is added to the counts since power-on to give 6064h.
    position_offset: i32,
    faults: FaultMonitor<FAULT_COUNT>,
    protection: Protection,
    bleeder: Bleeder,
    watchdog: HostWatchdog,
    /// The last SYNC, where that counts as a sign of the host.
    last_sync: Option<Instant>,
    shown_velocity_rpm: LowPass,
    shown_current_a: LowPass,
}

impl Zlac8030l {
    /// A drive without supply. [`Firmware::power_on`] starts it.
    pub fn new() -> Self {
        Self::of(VARIANT)
    }

    /// The same of another variant.
    pub fn of(variant: Variant) -> Self {
        let image = StoredImage::of(&storage::delivered(&variant));
        let profile = if variant.is(FIRMWARE_2_01) { &NODE_PROFILE_2_01 } else { &NODE_PROFILE };
        Self::over(Device::new(profile, Bitrate::K500, image, COMMUNICATION_PERIOD_NS, variant), Fidelity::Full)
    }

    /// Motor free, position 0, and the values of `device` in effect.
    fn over(mut device: Device<TableStorage>, fidelity: Fidelity) -> Self {
        let parameters = Parameters::of(device.values(), device.variant(), fidelity);
        // 202F:05 acts from a restart on (5.3).
        let resolution = device.values().get(VELOCITY_RESOLUTION);
        device.values_mut().set_resolution(u32::from(resolution));
        Self {
            servo: Servo::new(&parameters.model, 0, 0),
            device,
            dip_address: 0,
            parameters,
            shell: Shell::new(),
            awake: false,
            speed_setting_wrong: false,
            position_offset: 0,
            faults: FaultMonitor::new(&FAULTS, &DEBOUNCE),
            protection: Protection::default(),
            bleeder: Bleeder::default(),
            watchdog: HostWatchdog::default(),
            last_sync: None,
            shown_velocity_rpm: LowPass::default(),
            shown_current_a: LowPass::default(),
        }
    }

    /// The values of the objects, to look at.
    pub fn values(&self) -> &Values {
        self.device.values()
    }

    /// How long the next resets by NMT take, which depends on the microcontroller: none unless it is set.
    pub const fn set_reset_times(&mut self, times: ResetTimes) {
        self.device.set_reset_times(times);
    }

    /// What the control loops are asked for, to look at.
    pub const fn demand(&self) -> &Demand {
        &self.shell.demand
    }

    /// How the current loop is set, for a power stage that follows by itself.
    pub fn current_gains(&self) -> CurrentGains {
        CurrentGains::of(&self.parameters.gains.foc, &self.parameters.model)
    }

    /// The communication side, to look at.
    pub const fn node(&self) -> &Node<TableStorage> {
        self.device.node()
    }

    const fn fidelity(&self) -> Fidelity {
        self.parameters.model.fidelity
    }

    /// The first look at the sensors after a restart.
    fn wake(&mut self, sensors: &Sensors) {
        self.awake = true;
        self.servo = Servo::new(&self.parameters.model, sensors.hall, sensors.encoder_count);
    }

    /// Every tenth control period: faults, power state, demand, and what is reported of it. The voltages follow every period.
    fn supervise(&mut self, sensors: &Sensors, now: Instant) {
        self.refresh_parameters();
        let feedback = self.measure(sensors);
        self.watch_faults(sensors, now);
        self.read_inputs(sensors);
        self.read_targets();
        let Parameters { axis, holding, model, gains, limits, .. } = &self.parameters;
        let dt_s = f64::from(model.supervision_period_s);
        self.shell.demand = self.shell.move_axis(feedback, axis, *holding, dt_s);
        self.servo.control(model, gains, &self.shell.demand, feedback.position, limits);
        self.publish(sensors);
    }

    /// Takes over changed parameters. Sensor and direction changes wait until the motor is free: they would turn
    /// position and angle over under the loops.
    fn refresh_parameters(&mut self) {
        if !self.shell.parameters_changed {
            return;
        }
        let mut parameters = Parameters::of(self.device.values(), self.device.variant(), self.fidelity());
        if self.shell.demand == Demand::Off {
            self.shell.parameters_changed = false;
            let position = self.position();
            self.awake &= parameters.model.commutation == self.parameters.model.commutation;
            self.parameters = parameters;
            self.position_offset = position.wrapping_sub(self.servo.position(&parameters.model));
        } else {
            self.shell.parameters_changed = parameters.model != self.parameters.model;
            parameters.model = self.parameters.model;
            self.parameters = parameters;
        }
    }

    fn measure(&mut self, sensors: &Sensors) -> Feedback {
        self.servo.measure(&self.parameters.model, &self.parameters.gains, sensors.phase_current_a);
        let velocity_rpm = self.servo.velocity_rpm();
        self.shown_velocity_rpm.update(&self.parameters.shown, velocity_rpm);
        self.shown_current_a.update(&self.parameters.shown, self.servo.current_a());
        Feedback {
            position: self.position(),
            velocity: f64::from(velocity_rpm) * self.parameters.counts_s_per_rpm,
            current_a: self.shown_current_a.value,
            standing: velocity_rpm.abs() < STANDSTILL_RPM,
        }
    }

    fn watch_faults(&mut self, sensors: &Sensors, now: Instant) {
        self.device.set_eeprom_ok(sensors.eeprom_ok);
        let situation = FaultSituation {
            servo: &self.servo,
            demand: &self.shell.demand,
            position: self.position(),
            velocity_rpm: self.servo.velocity_rpm(),
            eeprom_sound: self.device.is_eeprom_sound(),
            speed_setting_wrong: self.speed_setting_wrong,
            latched: self.faults.latched(),
        };
        let causes = self.protection.causes(&self.parameters, sensors, &situation);
        let new = self.faults.observe_for(causes, self.parameters.supervisions);
        if causes.has(row::ENCODER) {
            // Reported once: whether encoder and Hall sensors still disagree shows at the next edges.
            self.servo.realign(&self.parameters.model, sensors.hall, sensors.encoder_count);
        }
        self.enter_fault(new, now);
    }

    /// New faults: off, and report.
    fn enter_fault(&mut self, new: FaultSet, now: Instant) {
        if new.is_empty() {
            return;
        }
        self.shell.enter_fault();
        self.device.values_mut().set(ERROR_CODE, self.faults.code_bits());
        self.device.report_faults(new, &self.faults, now);
        self.publish_status();
    }

    /// Forgets the faults whose cause is gone; with the last one the drive leaves Fault.
    fn reset_faults(&mut self, now: Instant) {
        self.protection.reset();
        let all_gone = self.faults.reset();
        self.device.values_mut().set(ERROR_CODE, self.faults.code_bits());
        self.device.report_reset(&self.faults, now);
        if all_gone {
            self.shell.axis.reset_fault();
        }
        self.publish_status();
    }

    /// Debounced inputs.
    fn read_inputs(&mut self, sensors: &Sensors) {
        const MECHANICAL: u8 = INPUT_DEBOUNCE_PERIODS.div_ceil(MECHANICAL_SUPERVISIONS as u8);
        let levels = self.shell.inputs.update(sensors.inputs, self.fidelity().tick(INPUT_DEBOUNCE_PERIODS, MECHANICAL));
        let signals = TERMINALS.signals(self.values(), levels);
        if self.shell.take_signals(&signals) {
            self.drop_targets();
        }
    }

    fn read_targets(&mut self) {
        let values = self.device.values();
        let rpm = f64::from(values.get(TARGET_VELOCITY)) / f64::from(values.resolution());
        let max_rpm = self.parameters.max_rpm;
        self.speed_setting_wrong = rpm.abs() > max_rpm
            && self.shell.axis.mode() == ModeOfOperation::PROFILE_VELOCITY
            && self.device.variant().is(FIRMWARE_2_01);
        self.shell.targets = Targets {
            velocity: rpm.clamp(-max_rpm, max_rpm) * self.parameters.counts_s_per_rpm,
            current_a: f32::from(values.get(TARGET_TORQUE)) * 1e-3,
            cyclic: None,
        };
    }

    fn drop_targets(&mut self) {
        let values = self.device.values_mut();
        values.set(TARGET_VELOCITY, 0);
        values.set(TARGET_TORQUE, 0);
    }

    fn power_stage(&mut self, sensors: &Sensors) -> PowerStage {
        if self.shell.demand != Demand::Off {
            let Parameters { model, gains, .. } = &self.parameters;
            if model.fidelity == Fidelity::Mechanical {
                return PowerStage::Follow(self.servo.current_demand(model, gains));
            }
            let duty = self.servo.modulate(model, gains, sensors.phase_current_a, sensors.bus_v);
            return PowerStage::Modulate { duty };
        }
        let alarm = self.shell.axis.state() == PowerState::Fault;
        if alarm && self.parameters.alarm_pwm { PowerStage::Shorted } else { PowerStage::Off }
    }

    fn publish(&mut self, sensors: &Sensors) {
        let position = self.position();
        let (velocity, current) = (self.shown_velocity_rpm.value, self.shown_current_a.value);
        let demand_ma = self.servo.setpoint_a() * 1e3;
        let levels = self.shell.inputs.levels();
        let brake = terminals::brake_engaged(self.values());
        let values = self.device.values_mut();
        values.set(POSITION_ACTUAL_VALUE, position);
        values.set(VELOCITY_ACTUAL_VALUE, round(velocity * 10.0) as i32);
        values.set(TORQUE_ACTUAL_VALUE, round(current * 10.0) as i16);
        // 16 bits end at 32.767 A, half of what 2015h goes to: saturated, as the cast is.
        values.set(TORQUE_DEMAND, round(demand_ma) as i16);
        values.set(MOTOR_TEMPERATURE, temperature(sensors.motor_c));
        values.set(DRIVER_TEMPERATURE, temperature(sensors.driver_c));
        values.set(BUS_VOLTAGE, round(sensors.bus_v * 100.0) as u16);
        values.set(HALL_STATUS, u16::from(sensors.hall & 7));
        values.set(INPUT_STATUS, levels);
        values.set(OUTPUT_STATUS, terminals::output_status(self.shell.outputs, brake));
        self.publish_status();
    }

    /// Statusword, mode display and what follows from them; also right after a command, for a host that reads back.
    fn publish_status(&mut self) {
        let status = self.shell.status(&self.parameters.axis);
        let (state, mode) = (self.shell.axis.state(), self.shell.axis.mode());
        let conditions = Conditions {
            alarm: state == PowerState::Fault,
            enabled: self.shell.axis.is_live(),
            homing_attained: false,
            in_position: status.target_reached,
        };
        self.shell.outputs = TERMINALS.outputs(self.values(), conditions);
        let values = self.device.values_mut();
        values.set(STATUSWORD, statusword(state, mode, &status).0);
        values.set(MODES_OF_OPERATION_DISPLAY, mode.0);
        values.set(MOTOR_STATUS, u16::from(status.running));
    }

    fn position(&self) -> i32 {
        self.position_offset.wrapping_add(self.servo.position(&self.parameters.model))
    }
}

impl Default for Zlac8030l {
    fn default() -> Self {
        Self::new()
    }
}

impl Firmware for Zlac8030l {
    type Sensors = Sensors;
    type Actuation = Actuation;
    type Hardware = Hardware;

    const CONTROL_PERIOD_NS: u64 = CONTROL_PERIOD_NS;
    const MECHANICAL_PERIODS: Option<[u32; 2]> =
        Some([SUPERVISION_DIVIDER as u32, SUPERVISION_DIVIDER as u32 * MECHANICAL_SUPERVISIONS as u32]);

    fn set_fidelity(&mut self, fidelity: Fidelity) {
        *self = Self { dip_address: self.dip_address, ..Self::over(self.device.clone(), fidelity) };
    }

    fn power_on(&mut self, hardware: &Hardware, now: Instant) {
        self.dip_address = hardware.dip_address;
        self.device.power_on(hardware.eeprom);
        self.restart(now);
    }

    fn power_off(&mut self, _now: Instant) {
        self.device.power_off();
        self.shell.power_off();
    }

    fn tick(&mut self, sensors: &Sensors, now: Instant) -> Actuation {
        if !self.device.is_running() {
            return Actuation::default();
        }
        if !self.awake {
            self.wake(sensors);
        }
        let (model, count) = (&self.parameters.model, sensors.encoder_count);
        match &sensors.followed {
            None => self.servo.sense(model, sensors.hall, count),
            Some(followed) => self.servo.sense_followed(model, sensors.hall, count, followed),
        }
        if is_over_current(sensors) && self.faults.raise(row::OVER_CURRENT) {
            self.enter_fault(FaultSet::row(row::OVER_CURRENT), now);
        }
        if self.shell.is_supervision_due(self.fidelity().tick(SUPERVISION_DIVIDER, 1)) {
            self.supervise(sensors, now);
        }
        Actuation {
            power_stage: self.power_stage(sensors),
            bleeder_on: self.bleeder.update(
                &self.parameters.bleeder,
                sensors.bus_v,
                self.parameters.model.control_period_s,
            ),
            outputs: self.shell.outputs,
            brake_engaged: terminals::brake_engaged(self.values()),
        }
    }

    fn eeprom(&self) -> (&[u8], u32) {
        self.device.eeprom()
    }

    fn is_storing(&self) -> bool {
        self.device.is_storing()
    }

    fn report(&self, axis: AxisId) -> Report {
        Report {
            fault_code: self.faults.code_bits(),
            position_counts: self.position(),
            velocity_rpm: self.servo.velocity_rpm(),
            current_a: self.shown_current_a.value,
            brake_engaged: self.device.is_running() && terminals::brake_engaged(self.values()),
            ..self.shell.report(&self.device, axis)
        }
    }
}

/// 0.1 degC, held to the range of 2026h.
fn temperature(celsius: f32) -> i16 {
    round(celsius * 10.0).clamp(-550.0, 1200.0) as i16
}

fn round(value: f32) -> f32 {
    libm::roundf(value)
}
