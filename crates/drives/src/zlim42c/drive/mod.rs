//! The drive: the engine's parts joined over the dictionary.
//!
//! Three rhythms: frames as they come (`handle_frame`, in [`commands`]), the communication task every 0.5 ms
//! (`handle_timeout`), and the control period of 50 us ([`Firmware::tick`]), of which every tenth is a supervision period.

mod commands;
mod resting;

use can::{Bitrate, Instant};
use canopen::node::{Node, NodeProfile};
use cia402::{Controlword, PowerState};
use devices::AxisId;

use super::assumptions::*;
use super::faults::{DEBOUNCE, FAULT_COUNT, FAULTS, FLASHES, row};
use super::hardware::{Actuation, Hardware, PowerStage, Sensors};
use super::objects::*;
use super::parameters::Parameters;
use super::protection::{FaultSituation, PhaseWatch, causes, is_over_current};
use super::statusword::{self, statusword};
use super::terminals::{self, TERMINALS};
use super::variations::VARIANT;
use super::{Values, led, storage};
use crate::communication::communication;
use crate::engine::actuator::stepper::{FieldDemand, Stepper, StepperGains};
use crate::engine::axis::{Demand, Feedback};
use crate::engine::cia402::Targets;
use crate::engine::device::{Application, Device, ResetTimes};
use crate::engine::faults::{FaultMonitor, FaultSet};
use crate::engine::storage::StoredImage;
use crate::zltech::Shell;
use crate::zltech::terminals::Conditions;
use crate::{Fidelity, Firmware, Report};
use devices::variant::Variant;

/// How this drive communicates.
pub static NODE_PROFILE: NodeProfile = communication(&devices::zltech::ZLIM42C);

/// The firmware of a ZLIM42-C.
#[derive(Clone)]
pub struct Zlim42c {
    device: Device<TableStorage>,
    fidelity: Fidelity,
    dip_address: u8,
    parameters: Parameters,
    shell: Shell<4>,
    stepper: Stepper,
    controlword: Controlword,
    faults: FaultMonitor<FAULT_COUNT>,
    phases: PhaseWatch,
    /// Current from the bus, A: its mean, growing through the supervision period.
    bus_a: f32,
    /// The fault that 603Fh and the red light show: the last that came.
    shown_fault: Option<usize>,
}

impl Zlim42c {
    /// A drive without supply. [`Firmware::power_on`] starts it.
    pub fn new() -> Self {
        Self::of(VARIANT)
    }

    /// The same of another variant.
    pub fn of(variant: Variant) -> Self {
        let image = StoredImage::of(&storage::delivered(&variant));
        Self::over(Device::new(&NODE_PROFILE, Bitrate::K500, image, COMMUNICATION_PERIOD_NS, variant), Fidelity::Full)
    }

    /// Motor free, position 0, and the values of `device` in effect.
    fn over(device: Device<TableStorage>, fidelity: Fidelity) -> Self {
        Self {
            parameters: Parameters::of(device.values(), device.variant(), fidelity),
            device,
            fidelity,
            dip_address: 0,
            shell: Shell::new(),
            stepper: Stepper::default(),
            controlword: Controlword(0),
            faults: FaultMonitor::new(&FAULTS, &DEBOUNCE),
            phases: PhaseWatch::default(),
            bus_a: 0.0,
            shown_fault: None,
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

    /// What the current vector is asked for, to look at.
    pub const fn demand(&self) -> &Demand {
        &self.shell.demand
    }

    /// Amplitude of the current vector asked for, A.
    pub const fn current_demand_a(&self) -> f32 {
        self.stepper.reference_a()
    }

    /// Pulses in one turn: 2006h as it is in effect.
    pub const fn pulses_per_turn(&self) -> u16 {
        self.parameters.pulses_per_turn
    }

    /// How far the current vector has turned since power-on, in electrical turns.
    pub fn vector_turns(&self) -> f64 {
        self.stepper.vector_turns(&self.parameters.model)
    }

    /// The way of the current vector until the next tick, for a power stage that follows by itself.
    pub const fn path(&self) -> &FieldDemand {
        self.stepper.path()
    }

    /// How such a power stage is set.
    pub const fn current_gains(&self) -> &StepperGains {
        &self.parameters.gains
    }

    /// The communication side, to look at.
    pub const fn node(&self) -> &Node<TableStorage> {
        self.device.node()
    }

    /// Every tenth control period: faults, power state, demand, and what is reported of it. The voltages follow every period.
    fn supervise(&mut self, sensors: &Sensors, now: Instant) {
        self.refresh_parameters();
        self.watch_faults(sensors, now);
        self.read_inputs(sensors);
        self.read_targets();
        let feedback = self.feedback();
        let Parameters { axis, holding, supervisions, .. } = &self.parameters;
        let demand = self.shell.move_axis(feedback, axis, *holding, f64::from(*supervisions) * SUPERVISION_PERIOD_S);
        self.energise(demand);
        if let Some(home) = self.shell.axis.take_home() {
            let offset = self.values().get(HOME_OFFSET);
            self.shift_position(home.wrapping_add(offset));
        }
        self.publish(sensors);
    }

    /// Takes over changed parameters. Another number of pulses waits until the motor is free: it would turn the meaning of
    /// every position over under the trajectory.
    fn refresh_parameters(&mut self) {
        if !self.shell.parameters_changed {
            return;
        }
        let (values, variant, before) = (self.device.values(), self.device.variant(), self.parameters);
        let mut after = Parameters::of(values, variant, self.fidelity);
        let waits = after.pulses_per_turn != before.pulses_per_turn && self.shell.demand != Demand::Off;
        if waits {
            after = Parameters::with_pulses(values, variant, before.pulses_per_turn, self.fidelity);
        } else {
            self.stepper.rescale(before.model.pulses_per_electrical_turn, after.model.pulses_per_electrical_turn);
        }
        self.shell.parameters_changed = waits;
        self.parameters = after;
    }

    fn watch_faults(&mut self, sensors: &Sensors, now: Instant) {
        self.device.set_eeprom_ok(sensors.eeprom_ok);
        let (peaks, speed_rpm) = (self.stepper.take_peaks(), self.velocity_rpm());
        let situation = FaultSituation {
            bus_a: core::mem::take(&mut self.bus_a),
            phase_lost: self.phases.observe(&peaks, self.stepper.reference_a(), speed_rpm),
            eeprom_sound: self.device.is_eeprom_sound(),
            latched: self.faults.latched(),
        };
        let new = self.faults.observe_for(causes(sensors, &situation), self.parameters.supervisions);
        self.enter_fault(new, now);
    }

    /// New faults: off, and report.
    fn enter_fault(&mut self, new: FaultSet, now: Instant) {
        if new.is_empty() {
            return;
        }
        self.shell.enter_fault();
        self.energise(Demand::Off);
        for row in new.rows() {
            self.shown_fault = Some(row);
        }
        self.device.report_faults(new, &self.faults, now);
        self.publish_error_code();
        self.publish_status();
    }

    /// Forgets the faults whose cause is gone; with the last one the drive leaves Fault.
    fn reset_faults(&mut self, now: Instant) {
        let all_gone = self.faults.reset();
        self.shown_fault = self.shown_fault.filter(|row| self.faults.latched().has(*row));
        self.shown_fault = self.shown_fault.or_else(|| self.faults.latched().rows().last());
        self.publish_error_code();
        self.device.report_reset(&self.faults, now);
        if all_gone {
            self.shell.axis.reset_fault();
        }
        self.publish_status();
    }

    /// Debounced inputs.
    fn read_inputs(&mut self, sensors: &Sensors) {
        let supervisions = self.parameters.supervisions;
        let periods = terminals::filter_periods(self.values()).map(|periods| periods.div_ceil(supervisions));
        let levels = self.shell.inputs.update_each(sensors.inputs, periods);
        let signals = TERMINALS.signals(self.values(), levels);
        if self.shell.take_signals(&signals) {
            self.device.values_mut().set(TARGET_VELOCITY, 0);
        }
    }

    fn read_targets(&mut self) {
        let max_speed = self.parameters.axis.velocity.max_speed;
        let target_rpm = f64::from(self.values().get(TARGET_VELOCITY));
        let velocity = (target_rpm * self.parameters.pulses_s_per_rpm).clamp(-max_speed, max_speed);
        self.shell.targets = Targets { velocity, ..Targets::default() };
    }

    /// The motor follows its command, as far as the drive knows.
    fn feedback(&self) -> Feedback {
        let velocity = self.stepper.velocity();
        Feedback {
            position: self.stepper.position(),
            velocity,
            current_a: self.stepper.current_a(),
            standing: velocity == 0.0,
        }
    }

    fn energise(&mut self, demand: Demand) {
        self.shell.demand = demand;
        self.stepper.command(&self.parameters.model, &demand, &self.parameters.currents);
    }

    fn power_stage(&mut self, sensors: &Sensors) -> PowerStage {
        if self.shell.demand == Demand::Off {
            return PowerStage::Off;
        }
        let Parameters { model, gains, .. } = &self.parameters;
        PowerStage::Modulate { duty: self.stepper.modulate(model, gains, sensors.phase_current_a, sensors.bus_v) }
    }

    /// The tick of a supervision period, on a power stage that follows by itself.
    #[cold]
    #[inline(never)]
    fn tick_mechanical(&mut self, sensors: &Sensors, now: Instant) -> Actuation {
        let phase_current_a = sensors.largest_a.map_or(sensors.phase_current_a, |largest_a| [largest_a; 2]);
        let largest = Sensors { phase_current_a, ..*sensors };
        if is_over_current(&largest) && self.faults.raise(row::OVER_CURRENT) {
            self.enter_fault(FaultSet::row(row::OVER_CURRENT), now);
        }
        self.bus_a = sensors.bus_current_a;
        self.supervise(&largest, now);
        let power_stage = if self.shell.demand == Demand::Off {
            PowerStage::Off
        } else {
            self.stepper.follow(&self.parameters.model, sensors.phase_current_a);
            PowerStage::Follow
        };
        self.actuation(power_stage, now)
    }

    #[inline(always)]
    fn actuation(&self, power_stage: PowerStage, now: Instant) -> Actuation {
        let flashes = self.shown_fault.map_or(0, |row| FLASHES[row]);
        Actuation { power_stage, outputs: self.shell.outputs, led: led::shown(flashes, now) }
    }

    fn publish(&mut self, sensors: &Sensors) {
        let position = self.stepper.position();
        let rpm = libm::round(self.velocity_rpm()) as i32;
        let levels = self.shell.inputs.levels();
        let values = self.device.values_mut();
        values.set(POSITION_ACTUAL_VALUE, position);
        values.set(VELOCITY_ACTUAL_VALUE, rpm);
        values.set(MOTOR_SPEED, rpm as i16);
        values.set(BUS_VOLTAGE, libm::roundf(sensors.bus_v) as u16);
        values.set(INPUT_STATUS, levels);
        self.publish_status();
    }

    /// Statusword, mode display and what follows from them; also right after a command, for a host that reads back.
    fn publish_status(&mut self) {
        let status = self.shell.status(&self.parameters.axis);
        let (state, mode) = (self.shell.axis.state(), self.shell.axis.mode());
        let energised = self.shell.is_energised(self.parameters.axis.external_stop, self.parameters.holding);
        let word = statusword(statusword::StatusCondition {
            state,
            mode,
            controlword: self.controlword,
            energised,
            axis: status,
        });
        let conditions = Conditions {
            alarm: state == PowerState::Fault,
            enabled: self.shell.axis.is_live(),
            homing_attained: status.homing_attained,
            in_position: word.has(statusword::IN_POSITION),
        };
        self.shell.outputs = TERMINALS.outputs(self.values(), conditions);
        let [y0, y1] = self.shell.outputs;
        let values = self.device.values_mut();
        values.set(STATUSWORD, word.0);
        values.set(MODES_OF_OPERATION_DISPLAY, mode.0);
        values.set(MOTOR_STATUS, u16::from(status.running));
        values.set(OUTPUT_STATUS, u16::from(y0) | u16::from(y1) << 1);
    }

    fn publish_error_code(&mut self) {
        let code = self.error_code();
        self.device.values_mut().set(ERROR_CODE, code);
    }

    fn error_code(&self) -> u16 {
        self.shown_fault.map_or(0, |row| FAULTS[row].code)
    }

    /// The zero of the position: what was `by` is 0 from now on, and whatever moves goes on moving.
    fn shift_position(&mut self, by: i32) {
        self.shell.shift_position(by);
        self.stepper.shift(by);
        let position = self.stepper.position();
        self.device.values_mut().set(POSITION_ACTUAL_VALUE, position);
    }

    /// Commanded velocity in r/min.
    fn velocity_rpm(&self) -> f64 {
        self.stepper.velocity() / self.parameters.pulses_s_per_rpm
    }
}

impl Default for Zlim42c {
    fn default() -> Self {
        Self::new()
    }
}

impl Firmware for Zlim42c {
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
        self.stepper = Stepper::default();
        self.restart(now);
    }

    fn power_off(&mut self, _now: Instant) {
        self.device.power_off();
        self.shell.power_off();
        self.energise(Demand::Off);
    }

    // Inlined by force: a run of a machine that wakes up calls it too, and the frequent caller would not get it.
    #[inline(always)]
    fn tick(&mut self, sensors: &Sensors, now: Instant) -> Actuation {
        if !self.device.is_running() {
            return Actuation::default();
        }
        if self.fidelity == Fidelity::Mechanical {
            return self.tick_mechanical(sensors, now);
        }
        if is_over_current(sensors) && self.faults.raise(row::OVER_CURRENT) {
            self.enter_fault(FaultSet::row(row::OVER_CURRENT), now);
        }
        self.bus_a += sensors.bus_current_a / f32::from(SUPERVISION_DIVIDER);
        if self.shell.is_supervision_due(SUPERVISION_DIVIDER) {
            self.supervise(sensors, now);
        }
        let power_stage = self.power_stage(sensors);
        self.actuation(power_stage, now)
    }

    fn eeprom(&self) -> (&[u8], u32) {
        self.device.eeprom()
    }

    fn is_storing(&self) -> bool {
        self.device.is_storing()
    }

    fn report(&self, axis: AxisId) -> Report {
        Report {
            fault_code: self.error_code(),
            position_counts: self.stepper.position(),
            velocity_rpm: self.velocity_rpm() as f32,
            current_a: self.stepper.current_a(),
            ..self.shell.report(&self.device, axis)
        }
    }
}
