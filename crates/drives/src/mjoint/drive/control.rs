//! The control task.

use cia402::ModeOfOperation;

use super::{MJoint, OwnMotion};
use crate::engine::axis::{Braking, Feedback, HomingState, Stop, StopEnd, Task};
use crate::engine::faults::FaultSet;
use crate::mjoint::alarms::{self, row};
use crate::mjoint::assumptions::*;
use crate::mjoint::hardware::Sensors;
use crate::mjoint::homing::switches;
use crate::mjoint::objects::TARGET_VELOCITY;
use crate::mjoint::parameters::{Parameters, TimeBase};
use crate::mjoint::power_on::Function;
use crate::mjoint::protection::FaultSituation;
use crate::mjoint::variations::STAYS_FREE;

const DT_S: f64 = SUPERVISION_PERIOD_S as f64;
/// A stop is abrupt and then holds ("stops abruptly, but is still in the self-locking state"); what was under way goes on
/// afterwards.
const STOP: Stop =
    Stop { braking: Braking::CurrentLimit, on_path: false, end: StopEnd::Hold, patience_s: f64::INFINITY };

impl MJoint {
    /// The encoder, every control period.
    pub(super) fn sense(&mut self, sensors: &Sensors) {
        if !self.encoder.is_awake() {
            self.encoder.wake(sensors);
            self.terminals.wake(sensors);
            let position = self.encoder.position();
            self.axis.observe(Feedback { position, standing: true, ..Feedback::default() });
        }
        let shift = self.encoder.follow(sensors);
        if shift != 0 {
            self.axis.shift(shift);
            self.publish_position();
        }
        self.terminals.sense(sensors);
        let electrical_turns = self.encoder.electrical_turns(self.model.pole_pairs);
        let (model, count) = (&self.parameters.servo, self.encoder.shaft_count());
        match &sensors.followed {
            None => self.output.servo.sense_absolute(model, electrical_turns, count),
            Some(followed) => {
                self.output.servo.sense_absolute_followed(model, electrical_turns, count, followed);
            }
        }
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
        self.terminals.debounce(sensors);
        self.watch_alarms(sensors);
        self.move_by_itself(sensors);
        self.update_power_stage();
        if self.axis.is_engaged() {
            self.direct();
        }
        let base_s = self.time_base_s();
        let homing = self.homing();
        self.output.demand = self.axis.update_by(DT_S, base_s);
        if homing == HomingState::Stopping && self.homing() == HomingState::Attained {
            self.make_origin();
        }
        self.output.control(&self.parameters, feedback.position, sensors.bus_v);
        self.publish(sensors);
    }

    /// By how much the time base of the interpolation went on in this period.
    fn time_base_s(&mut self) -> f64 {
        let changes = self.terminals.take_dir_changes();
        let by_dir = self.parameters.time_base == TimeBase::Dir && self.orders.are_the_hosts();
        if by_dir { f64::from(changes) * DIR_CLOCK_S } else { DT_S }
    }

    pub(super) fn refresh_parameters(&mut self) {
        if self.parameters_changed {
            self.parameters_changed = false;
            let output = self.parameters.gains.foc.modulation_limit;
            let Parameters { function, amplitude, .. } = self.parameters;
            self.parameters = Parameters::from(self.device.values(), self.model, function, amplitude, self.fidelity());
            self.parameters.gains.foc.modulation_limit = output;
        }
    }

    fn measure(&mut self, sensors: &Sensors) -> Feedback {
        let current_a = self.output.measure(&self.parameters, sensors);
        let rpm = self.output.servo.velocity_rpm();
        let stationary = rpm.abs() < STATIONARY_RPM;
        self.parameters.gains.foc.modulation_limit = self.protection.output_share(&self.parameters, stationary);
        Feedback {
            position: self.encoder.position(),
            velocity: f64::from(rpm) * COUNTS_S_PER_RPM,
            current_a,
            standing: rpm.abs() < STANDSTILL_RPM,
        }
    }

    fn watch_alarms(&mut self, sensors: &Sensors) {
        let situation = FaultSituation {
            servo: &self.output.servo,
            live: self.axis.is_engaged(),
            current_a: self.output.shown_current_a().abs() * self.parameters.amplitude,
            velocity_rpm: self.output.servo.velocity_rpm(),
            latched: self.alarms.latched(),
            host_lost: self.host.is_lost(),
            has_brake: self.parameters.function.has_brake(),
            turns_known: self.encoder.are_turns_known(sensors),
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
            self.orders.own_motion = OwnMotion::None;
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
        let by = self.terminals.count(&self.parameters.pulses, sensors);
        match self.orders.own_motion {
            OwnMotion::Starting => self.start_by_itself(sensors),
            OwnMotion::Returning if self.axis.is_done() => self.orders.own_motion = OwnMotion::Following,
            OwnMotion::Returning => {}
            _ if self.is_host_in_control() || !self.can_be_live() => {}
            _ if self.is_homing() => {}
            _ if self.parameters.function == Function::DutyCycleSpeed => self.follow_duty(sensors),
            _ => self.follow_pulses(by),
        }
    }

    /// With its turns lost it has no position to go to.
    fn start_by_itself(&mut self, sensors: &Sensors) {
        self.orders.own_motion = OwnMotion::None;
        let record = self.encoder.take_record();
        let known = self.encoder.are_turns_known(sensors);
        let (function, position) = (self.parameters.function, self.encoder.position());
        let target = match function {
            Function::TurnToAngle(_) => function.target(position),
            _ if self.returns_to_power_off_position() => Some(record.filter(|_| known).unwrap_or(position)),
            _ => function.target(position).filter(|_| known),
        };
        let Some(target) = target.filter(|_| self.can_be_live()) else { return };
        self.orders.own_motion = OwnMotion::Returning;
        self.update_power_stage();
        self.axis.begin(Task::Move { target, limits: self.parameters.returning });
    }

    /// "Pulse mode: reenergize automatically back to the power off position" ("Characteristic").
    fn returns_to_power_off_position(&self) -> bool {
        self.parameters.function.takes_pulses() && !self.is_host_in_control() && !self.device.variant().is(STAYS_FREE)
    }

    fn follow_pulses(&mut self, by: i32) {
        if by == 0 && self.orders.own_motion != OwnMotion::Following {
            return;
        }
        self.orders.own_motion = OwnMotion::Following;
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
        if rpm == 0.0 && self.orders.own_motion != OwnMotion::Following {
            return;
        }
        self.orders.own_motion = OwnMotion::Following;
        self.update_power_stage();
        self.axis.begin(Task::Speed { velocity: rpm * COUNTS_S_PER_RPM, ramps: self.parameters.velocity });
    }

    /// Stops, and modes that give a new demand each period.
    fn direct(&mut self) {
        let by_host = self.orders.are_the_hosts();
        let homing = self.has_homing_the_motor();
        let forbidden = by_host && !homing && !self.may_move();
        let halted = self.orders.are_halted();
        let host_lost = self.alarms.latched().has(row::COMMUNICATION);
        self.axis.set_stop((forbidden || halted || host_lost).then_some(STOP));
        if forbidden {
            // Quick stop and disabled operation end a move; halt and a lost host let it go on afterwards.
            self.orders.next_point = None;
            self.rest();
        }
        if by_host && !forbidden {
            self.direct_by_mode();
        }
    }

    fn direct_by_mode(&mut self) {
        match self.orders.mode {
            ModeOfOperation::PROFILE_VELOCITY => {
                let (velocity, ramps) = (self.target_velocity(), self.parameters.velocity);
                self.axis.begin(Task::Speed { velocity, ramps });
            }
            ModeOfOperation::INTERPOLATED_POSITION => {
                if self.rhythm.is_base_over()
                    && let Some(target) = self.orders.next_point.take()
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
