//! The control task.

use cia402::{Controlword, ModeOfOperation};
use motion::field_weakening::torque_share;
use motion::filter::LowPassGains;

use super::{HomingState, MJoint, OwnMotion};
use crate::engine::actuator::servo::ServoLimits;
use crate::engine::axis::{Braking, Demand, Feedback, Stop, StopEnd, Task};
use crate::engine::faults::FaultSet;
use crate::mjoint::alarms::{self, row};
use crate::mjoint::assumptions::*;
use crate::mjoint::gains::MODULATION_LIMIT;
use crate::mjoint::hardware::Sensors;
use crate::mjoint::homing::switches;
use crate::mjoint::objects::TARGET_VELOCITY;
use crate::mjoint::parameters::{Parameters, TimeBase};
use crate::mjoint::power_on::Function;
use crate::mjoint::protection::Situation;
use crate::mjoint::variations::STAYS_FREE;

const DT_S: f64 = SUPERVISION_PERIOD_S as f64;
/// A stop is abrupt and then holds ("stops abruptly, but is still in the self-locking state"); what was under way goes on
/// afterwards.
const STOP: Stop =
    Stop { braking: Braking::CurrentLimit, on_path: false, end: StopEnd::Hold, patience_s: f64::INFINITY };
/// Amplitude of a phase over the voltage of the bus.
const INV_SQRT_3: f32 = 0.577_350_26;

impl MJoint {
    /// The encoder, every control period.
    pub(super) fn sense(&mut self, sensors: &Sensors) {
        let angle = sensors.angle_count % COUNTS_PER_TURN as u16;
        let position = self.turns.position(sensors.position_counts, sensors.turns_lost);
        if !self.awake {
            self.awake = true;
            self.dir = sensors.dir;
            (self.angle_count, self.position) = (angle, position);
            self.axis.observe(Feedback { position: self.position, standing: true, ..Feedback::default() });
        }
        let moved = within_half_a_turn(angle.wrapping_sub(self.angle_count));
        self.angle_count = angle;
        self.shaft_count = self.shaft_count.wrapping_add(moved as u16);
        // What the counts of turns moved by and the shaft did not is a new origin.
        let shift = self.position.wrapping_add(i32::from(moved)).wrapping_sub(position);
        self.position = position;
        if shift != 0 {
            self.axis.shift(shift);
            self.publish_position();
        }
        self.dir_changes = self.dir_changes.saturating_add(u8::from(self.dir != sensors.dir));
        self.dir = sensors.dir;
        let cycle = u32::from(angle) * u32::from(self.model.pole_pairs) % COUNTS_PER_TURN;
        let electrical_turns = cycle as f32 / COUNTS_PER_TURN as f32;
        self.servo.sense_absolute(&self.parameters.servo, electrical_turns, self.shaft_count);
    }

    /// Homing looks at its switch every control period, undelayed.
    pub(super) fn watch_for_origin(&mut self, sensors: &Sensors) {
        let (HomingState::Running, Task::Home(homing)) = (self.axis.homing(), self.axis.task()) else { return };
        self.axis.watch(switches(homing.sequence, sensors.pu, sensors.dir));
        if self.homing() == HomingState::Attained {
            self.make_origin();
        }
    }

    /// Every tenth control period.
    pub(super) fn supervise(&mut self, sensors: &Sensors) {
        self.refresh_parameters();
        let feedback = self.measure(sensors);
        self.axis.observe(feedback);
        self.battery = sensors.battery;
        self.inputs.update([sensors.pu, sensors.dir], INPUT_DEBOUNCE_PERIODS);
        self.watch_alarms(sensors);
        self.move_by_itself(sensors);
        self.update_power_stage();
        if self.axis.is_engaged() {
            self.direct();
        }
        let base_s = self.time_base_s();
        let homing = self.homing();
        self.demand = self.axis.update_by(DT_S, base_s);
        if homing == HomingState::Stopping && self.homing() == HomingState::Attained {
            self.make_origin();
        }
        let direct_a = self.weaken_field(sensors);
        let Parameters { servo, gains, limits, .. } = &self.parameters;
        let limits = ServoLimits { current_a: torque_share(limits.current_a, direct_a), ..*limits };
        self.servo.control(servo, gains, &self.demand, feedback.position, &limits);
        self.publish(sensors);
    }

    /// The current against the magnets, for more speed than the bus gives by itself. A motor that stands needs its voltage
    /// for torque.
    fn weaken_field(&mut self, sensors: &Sensors) -> f32 {
        let turns = self.demand != Demand::Off && self.servo.velocity_rpm().abs() >= STATIONARY_RPM;
        let direct_a = if turns {
            let available_v = sensors.bus_v * INV_SQRT_3 * MODULATION_LIMIT;
            let wanted_v = self.servo.wanted_magnitude_v();
            self.weakening.update(&self.parameters.weakening, wanted_v, available_v, SUPERVISION_PERIOD_S)
        } else {
            self.weakening.reset();
            0.0
        };
        self.servo.set_direct_current(direct_a);
        direct_a
    }

    /// By how much the time base of the interpolation went on in this period.
    fn time_base_s(&mut self) -> f64 {
        let changes = core::mem::take(&mut self.dir_changes);
        let by_dir = self.parameters.time_base == TimeBase::Dir && self.own_motion == OwnMotion::None;
        if by_dir { f64::from(changes) * DIR_CLOCK_S } else { DT_S }
    }

    pub(super) fn modulate(&mut self, sensors: &Sensors) {
        if self.demand != Demand::Off {
            let Parameters { servo, gains, .. } = &self.parameters;
            self.duty = self.servo.modulate(servo, gains, sensors.phase_current_a, sensors.bus_v);
        }
    }

    pub(super) fn refresh_parameters(&mut self) {
        if self.parameters_changed {
            self.parameters_changed = false;
            let output = self.parameters.gains.foc.modulation_limit;
            self.parameters = Parameters::from(self.device.values(), self.model, self.function, self.amplitude);
            self.parameters.gains.foc.modulation_limit = output;
        }
    }

    fn measure(&mut self, sensors: &Sensors) -> Feedback {
        self.servo.measure(&self.parameters.servo, &self.parameters.gains, sensors.phase_current_a);
        let rpm = self.servo.velocity_rpm();
        let shown = LowPassGains::from_time_constant(DISPLAY_FILTER_S, SUPERVISION_PERIOD_S);
        self.shown_velocity_rpm.update(&shown, rpm);
        let current_a = self.servo.current_magnitude_a().copysign(self.servo.current_a());
        self.shown_current_a.update(&shown, current_a / self.amplitude);
        let stationary = rpm.abs() < STATIONARY_RPM;
        self.parameters.gains.foc.modulation_limit = self.protection.output_share(&self.parameters, stationary);
        Feedback {
            position: self.position,
            velocity: f64::from(rpm) * COUNTS_S_PER_RPM,
            current_a,
            standing: rpm.abs() < STANDSTILL_RPM,
        }
    }

    fn watch_alarms(&mut self, sensors: &Sensors) {
        let situation = Situation {
            servo: &self.servo,
            live: self.axis.is_engaged(),
            current_a: self.shown_current_a.value.abs() * self.amplitude,
            velocity_rpm: self.servo.velocity_rpm(),
            latched: self.alarms.latched(),
            host_lost: self.host_lost,
            has_brake: self.function.has_brake(),
            turns_known: self.turns.are_known(sensors.turns_lost),
        };
        let causes = self.protection.causes(&self.parameters, sensors, &situation);
        let new = self.alarms.observe(causes);
        if !new.is_empty() {
            self.enter_fault(new);
        }
    }

    /// New alarms. Those that stop the motor leave it free, and end what was under way.
    fn enter_fault(&mut self, new: FaultSet) {
        if new.0 & alarms::RELEASING.0 != 0 {
            self.own_motion = OwnMotion::None;
            self.fail_homing();
            self.update_power_stage();
        }
        self.publish_alarms();
    }

    pub(super) fn fail_homing(&mut self) {
        if self.is_homing() {
            self.rest();
        }
    }

    /// Forgets the alarms whose cause is gone.
    pub(super) fn reset_alarms(&mut self) {
        self.protection.reset();
        self.alarms.reset();
        self.publish_alarms();
    }

    /// Pulses, and what 2619h starts after power-on.
    fn move_by_itself(&mut self, sensors: &Sensors) {
        let by = self.pulses.update(&self.parameters.pulses, &sensors.pulses);
        match self.own_motion {
            OwnMotion::Starting => self.start_by_itself(sensors),
            OwnMotion::Returning if self.axis.is_done() => self.own_motion = OwnMotion::Following,
            OwnMotion::Returning => {}
            _ if self.is_host_in_control() || !self.can_be_live() => {}
            _ if self.is_homing() => {}
            _ if self.function == Function::DutyCycleSpeed => self.follow_duty(sensors),
            _ => self.follow_pulses(by),
        }
    }

    /// With its turns lost it has no position to go to.
    fn start_by_itself(&mut self, sensors: &Sensors) {
        self.own_motion = OwnMotion::None;
        let record = self.power_off_position.take();
        let known = self.turns.are_known(sensors.turns_lost);
        let target = match self.function {
            Function::TurnToAngle(_) => self.function.target(self.position),
            _ if self.returns_to_power_off_position() => Some(record.filter(|_| known).unwrap_or(self.position)),
            _ => self.function.target(self.position).filter(|_| known),
        };
        let Some(target) = target.filter(|_| self.can_be_live()) else { return };
        self.own_motion = OwnMotion::Returning;
        self.update_power_stage();
        self.axis.begin(Task::Move { target, limits: self.parameters.returning });
    }

    /// "Pulse mode: reenergize automatically back to the power off position" ("Characteristic").
    fn returns_to_power_off_position(&self) -> bool {
        self.function.takes_pulses() && !self.is_host_in_control() && !self.device.variant().is(STAYS_FREE)
    }

    fn follow_pulses(&mut self, by: i32) {
        if by == 0 && self.own_motion != OwnMotion::Following {
            return;
        }
        self.own_motion = OwnMotion::Following;
        self.update_power_stage();
        let target = self.axis.target().wrapping_add(by);
        if self.parameters.ramp.is_none() {
            self.axis.begin(Task::Interpolate { target, time_s: DT_S, max_speed: 0.0 });
        } else if by != 0 || !matches!(self.axis.task(), Task::Move { .. }) {
            self.axis.begin(Task::Move { target, limits: self.parameters.pulse_moves });
        }
    }

    fn follow_duty(&mut self, sensors: &Sensors) {
        let rpm = self.parameters.pulses.duty_speed_rpm(&sensors.pulses, sensors.dir);
        if rpm == 0.0 && self.own_motion != OwnMotion::Following {
            return;
        }
        self.own_motion = OwnMotion::Following;
        self.update_power_stage();
        self.axis.begin(Task::Speed { velocity: rpm * COUNTS_S_PER_RPM, ramps: self.parameters.velocity });
    }

    /// Stops, and modes that give a new demand each period.
    fn direct(&mut self) {
        let by_host = self.own_motion == OwnMotion::None;
        let homing = self.has_homing_the_motor();
        let forbidden = by_host && !homing && !self.may_move();
        let halted = self.controlword.has(Controlword::HALT) && by_host;
        let host_lost = self.alarms.latched().has(row::COMMUNICATION);
        self.axis.set_stop((forbidden || halted || host_lost).then_some(STOP));
        if forbidden {
            // Quick stop and disabled operation end a move; halt and a lost host let it go on afterwards.
            self.next_point = None;
            self.rest();
        }
        if by_host && !forbidden {
            self.direct_by_mode();
        }
    }

    fn direct_by_mode(&mut self) {
        match self.mode {
            ModeOfOperation::PROFILE_VELOCITY => {
                let (velocity, ramps) = (self.target_velocity(), self.parameters.velocity);
                self.axis.begin(Task::Speed { velocity, ramps });
            }
            ModeOfOperation::INTERPOLATED_POSITION => {
                self.base_periods = (self.base_periods + 1) % INTERPOLATION_PERIODS;
                if self.base_periods == 0
                    && let Some(target) = self.next_point.take()
                {
                    self.interpolate(target);
                }
            }
            ModeOfOperation::HOMING if !matches!(self.axis.task(), Task::Home(_)) => self.rest(),
            _ => {}
        }
    }

    /// 60FFh, no faster than the motor, counts/s.
    pub(super) fn target_velocity(&self) -> f64 {
        let speed = f64::from(self.values().get(TARGET_VELOCITY)) * COUNTS_S_PER_RPM;
        speed.clamp(-self.parameters.max_speed, self.parameters.max_speed)
    }
}

/// Counts between two angles, the short way.
fn within_half_a_turn(difference: u16) -> i16 {
    let difference = difference % COUNTS_PER_TURN as u16;
    if difference >= COUNTS_PER_TURN as u16 / 2 {
        difference.wrapping_sub(COUNTS_PER_TURN as u16) as i16
    } else {
        difference as i16
    }
}
