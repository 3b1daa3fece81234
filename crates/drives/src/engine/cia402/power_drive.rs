//! One axis: who may move, and where to. Joins the power state machine, the modes and everything that stops a motor.
//!
//! In go controlwords, targets and what the shaft does; out comes a [`Demand`] for the control loops each period.
//! While something asks for a stop ([`StopCause`]), the shaft is ramped down and then held; the mode goes on when
//! nothing does any more. Nothing here knows objects, units or statusword bits.

use cia402::{Controlword, Direction, HaltOption, ModeOfOperation, PowerState, QuickStopOption, Transition};

use super::power::{DisableOptions, PowerMachine};
use super::set_points::{SetPoint, SetPoints};
use super::stop::{ExternalStop, Stop, StopCause, StopRamp};
use crate::engine::axis::{
    Demand, Feedback, Homing, HomingParameters, HomingStep, MoveLimits, Speed, Switches, Torque, Trajectory,
    TrajectoryPoint, VelocityRamps,
};

/// How the axis is set.
#[derive(Clone, Copy, Debug)]
pub struct Parameters {
    /// Speeds and times of position moves.
    pub moves: MoveLimits,
    /// Speeds and times of velocity changes.
    pub velocity: VelocityRamps,
    /// Time of a quick stop, s.
    pub quick_stop_time_s: f64,
    /// Slope of the torque, A/s; 0 for none.
    pub torque_slope_a_s: f32,
    /// 605Ah; also of the external stop and of the watch over the host.
    pub quick_stop: QuickStopOption,
    /// 605Bh and 605Ch.
    pub disable: DisableOptions,
    /// 605Dh.
    pub halt: HaltOption,
    /// What 605Ah and 605Dh call an emergency stop: how the drive reads their last value.
    pub emergency_stop: StopRamp,
    /// The shaft is held while the axis is not enabled.
    pub lock_when_disabled: bool,
    /// The shaft is held from Switched on.
    pub hold_when_switched_on: bool,
    /// How a limit switch stops a motion towards it; `None` lets it pass. Homing has rules of its own.
    pub limit_stop: Option<StopRamp>,
    /// Homing.
    pub homing: HomingParameters,
    /// How an external stop ends.
    pub external_stop: ExternalStop,
    /// Tolerances of the status.
    pub tolerances: Tolerances,
}

/// What the host wants of the modes that follow a target at all times.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Targets {
    /// Counts/s.
    pub velocity: f64,
    /// A.
    pub current_a: f32,
}

/// When a target counts as reached.
#[derive(Clone, Copy, Debug)]
pub struct Tolerances {
    /// Counts.
    pub position: u32,
    /// Counts/s.
    pub velocity: f64,
    /// A.
    pub current_a: f32,
}

/// What the statusword has to tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status {
    /// The mode's target is reached; while stopping: the motor stands.
    pub target_reached: bool,
    /// Set-point acknowledge.
    pub acknowledged: bool,
    /// The deviation of position is within its tolerance.
    pub in_position: bool,
    /// The motor stands.
    pub standing: bool,
    /// The motor turns, or is to.
    pub running: bool,
    /// The external stop acts.
    pub external_stop: bool,
    /// The last homing found its home position.
    pub homing_attained: bool,
}

/// Power state machine, mode and motion of one axis.
#[derive(Clone, Debug)]
pub struct PowerDrive {
    power: PowerMachine,
    mode: ModeOfOperation,
    requested_mode: ModeOfOperation,
    trajectory: Trajectory,
    position: SetPoints,
    velocity: Speed,
    torque: Torque,
    homing: Homing,
    /// Where the home position was found, until somebody asks.
    home: Option<i32>,
    switches: Switches,
    /// A limit switch ended the last move before its target.
    short_of_target: bool,
    stop: Option<Stop>,
    engaged: Engaged,
    external_stop: bool,
    host_lost: bool,
    feedback: Feedback,
}

/// What the trajectory stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Engaged {
    No,
    /// Held without being enabled.
    Locked,
    Yes,
}

/// A stop is over when the motor stands, or this long after its ramp: a load that drives the motor may never let it.
const STANDSTILL_PATIENCE_S: f64 = 1.0;

impl PowerDrive {
    /// Not ready to switch on, without a mode.
    pub fn new(extra: &'static [Transition]) -> Self {
        Self {
            power: PowerMachine::new(extra),
            mode: ModeOfOperation::NONE,
            requested_mode: ModeOfOperation::NONE,
            trajectory: Trajectory::resting(0),
            position: SetPoints::resting(0),
            velocity: Speed::default(),
            torque: Torque::default(),
            homing: Homing::default(),
            home: None,
            switches: Switches::default(),
            short_of_target: false,
            stop: None,
            engaged: Engaged::No,
            external_stop: false,
            host_lost: false,
            feedback: Feedback { standing: true, ..Feedback::default() },
        }
    }

    /// State of the power drive state machine.
    pub const fn state(&self) -> PowerState {
        self.power.state()
    }

    /// The mode in effect.
    pub const fn mode(&self) -> ModeOfOperation {
        self.mode
    }

    /// What the motor is being stopped for.
    pub fn stop_cause(&self) -> Option<StopCause> {
        self.stop.map(|stop| stop.cause)
    }

    /// Demanded current of profile torque, A.
    pub const fn torque_demand_a(&self) -> f32 {
        self.torque.demand_a()
    }

    /// Operation enabled or quick stop active: the motor is under control.
    pub const fn is_live(&self) -> bool {
        matches!(self.power.state(), PowerState::OperationEnabled | PowerState::QuickStopActive)
    }

    /// Self-test has ended well.
    pub fn self_test_done(&mut self) {
        self.power.self_test_done();
    }

    /// Takes a controlword; `target` is the target position that a rising bit 4 takes. True if a fault reset is asked
    /// for.
    pub fn command(&mut self, controlword: Controlword, target: i32, parameters: &Parameters) -> bool {
        let before = self.power.controlword();
        let wants_reset = self.power.command(controlword, parameters.disable);
        if self.is_live() && self.engaged != Engaged::Yes {
            self.engage();
        }
        if self.power.is_ramping_down() && self.is_at_rest() {
            self.power.ramp_done();
        }
        let new = controlword.has(Controlword::NEW_SET_POINT);
        if controlword.rises(before, Controlword::NEW_SET_POINT) && self.takes_starts() {
            let set_point = SetPoint {
                target,
                relative: controlword.has(Controlword::RELATIVE),
                immediately: controlword.has(Controlword::CHANGE_SET_IMMEDIATELY),
            };
            self.start(set_point, parameters);
        } else if !new {
            self.homing.interrupt();
        }
        self.position.release(new);
        wants_reset
    }

    /// Asks for a mode: it takes effect at standstill.
    pub fn request_mode(&mut self, mode: ModeOfOperation) {
        self.requested_mode = mode;
        self.adopt_mode();
    }

    /// Whether the external stop input is active.
    pub fn set_external_stop(&mut self, active: bool) {
        self.external_stop = active;
    }

    /// What the limit and home switches say.
    pub fn set_switches(&mut self, switches: Switches) {
        self.switches = switches;
    }

    /// Where homing has just found the home position, told once: the caller then shifts the position.
    pub fn take_home(&mut self) -> Option<i32> {
        self.home.take()
    }

    /// The power stage is to be on: enabled and not let go, or held for another reason.
    pub fn is_energised(&self, parameters: &Parameters) -> bool {
        let coasts = self.stop.is_some_and(|stop| stop.free);
        (self.is_live() && !coasts) || self.is_locked(parameters)
    }

    /// The host is silent: stops the motor once.
    pub fn on_host_timeout(&mut self) {
        self.host_lost = self.power.state() == PowerState::OperationEnabled;
    }

    /// A fault: off at once.
    pub fn fault(&mut self) {
        self.power.fault();
        self.disengage();
    }

    /// The cause of the fault is gone.
    pub fn reset_fault(&mut self) {
        self.power.reset_fault();
    }

    /// The zero of position moves: what was `by` is 0 from now on.
    pub fn shift_position(&mut self, by: i32) {
        self.trajectory.shift(by);
        self.position.shift(by);
        self.feedback.position = self.feedback.position.wrapping_sub(by);
    }

    /// One period.
    pub fn update(&mut self, feedback: Feedback, targets: &Targets, parameters: &Parameters, dt_s: f64) -> Demand {
        self.feedback = feedback;
        self.adopt_mode();
        if !self.is_live() {
            return self.idle(parameters);
        }
        if self.engaged != Engaged::Yes {
            self.engage();
        }
        self.choose_stop(targets, parameters);
        match self.stop {
            Some(stop) => self.stopping(stop, parameters, dt_s),
            None => self.following(targets, parameters, dt_s),
        }
    }

    /// What the statusword has to tell.
    pub fn status(&self, targets: &Targets, parameters: &Parameters) -> Status {
        let standing = self.feedback.standing;
        Status {
            target_reached: self.target_reached(targets, parameters),
            acknowledged: self.position.is_acknowledged(),
            in_position: self.is_in_position(&parameters.tolerances),
            standing,
            running: !standing
                || (self.engaged == Engaged::Yes && self.trajectory.point().velocity != 0.0)
                || (self.homing.is_running() && self.stop.is_none()),
            external_stop: self.external_stop,
            homing_attained: self.homing.is_attained(),
        }
    }

    /// Bit 4 rose: a set-point or homing begins.
    fn start(&mut self, set_point: SetPoint, parameters: &Parameters) {
        let SetPoint { target, relative, .. } = set_point;
        let way = if relative { target } else { target.wrapping_sub(self.trajectory.point().position) };
        match self.mode {
            ModeOfOperation::PROFILE_POSITION if !self.meets_limit(f64::from(way), parameters) => {
                self.short_of_target = false;
                let sets_off = self.position.take(set_point);
                // Under halt the move waits for `resume`.
                if sets_off && self.stop.is_none() {
                    self.position.resume(&mut self.trajectory, &parameters.moves);
                }
            }
            ModeOfOperation::HOMING => {
                self.velocity.restart();
                self.homing.start(parameters.homing.row, self.switches);
            }
            _ => {}
        }
    }

    fn takes_starts(&self) -> bool {
        let stopped = self.stop.is_some_and(|stop| stop.cause != StopCause::Halt);
        self.power.state() == PowerState::OperationEnabled
            && !stopped
            && !self.external_stop
            && !self.power.is_ramping_down()
    }

    fn is_at_rest(&self) -> bool {
        let no_way_to_go = self.trajectory.is_resting() || self.mode == ModeOfOperation::PROFILE_TORQUE;
        self.feedback.standing && no_way_to_go && !self.homing.is_running()
    }

    fn adopt_mode(&mut self) {
        if self.requested_mode == self.mode || (self.engaged == Engaged::Yes && !self.is_at_rest()) {
            return;
        }
        self.mode = self.requested_mode;
        if self.engaged == Engaged::Yes && self.stop.is_none() {
            self.engage();
        } else {
            self.position.abort(self.feedback.position);
        }
    }

    /// Takes the shaft over as it turns.
    fn engage(&mut self) {
        self.trajectory = self.as_it_turns();
        self.position.abort(self.feedback.position);
        self.velocity.restart();
        self.torque.restart();
        self.homing.abort();
        self.short_of_target = false;
        self.stop = None;
        self.engaged = Engaged::Yes;
    }

    fn as_it_turns(&self) -> Trajectory {
        let velocity = if self.feedback.standing { 0.0 } else { self.feedback.velocity };
        Trajectory::change_velocity(TrajectoryPoint::moving(self.feedback.position, velocity), velocity, 0.0)
    }

    fn disengage(&mut self) {
        self.engage();
        self.host_lost = false;
        self.engaged = Engaged::No;
    }

    /// Held without being enabled.
    fn is_locked(&self, parameters: &Parameters) -> bool {
        if self.external_stop && parameters.external_stop != ExternalStop::Hold {
            return false;
        }
        match self.power.state() {
            PowerState::NotReadyToSwitchOn | PowerState::FaultReactionActive | PowerState::Fault => false,
            PowerState::SwitchedOn => parameters.lock_when_disabled || parameters.hold_when_switched_on,
            _ => parameters.lock_when_disabled,
        }
    }

    fn idle(&mut self, parameters: &Parameters) -> Demand {
        if !self.is_locked(parameters) {
            if self.engaged != Engaged::No {
                self.disengage();
            }
            return Demand::Off;
        }
        if self.engaged != Engaged::Locked {
            self.disengage();
            self.trajectory = Trajectory::resting(self.feedback.position);
            self.engaged = Engaged::Locked;
        }
        Demand::Position(self.trajectory.point())
    }

    fn choose_stop(&mut self, targets: &Targets, parameters: &Parameters) {
        let wanted = self.wanted_stop(targets, parameters);
        let present = self.stop.map(|stop| (stop.cause, stop.ramp));
        let free = self.stop.is_some_and(|stop| stop.free);
        let end = parameters.external_stop;
        if wanted == present && self.stop.is_none_or(|stop| stop.free == stop.is_released(end)) {
            return;
        }
        match (wanted, self.stop) {
            (Some((cause, ramp)), Some(stop)) if !free && (stop.ramp == ramp || stop.held) => {
                self.stop = Some(Stop { cause, ramp, ..stop });
            }
            (Some((cause, ramp)), _) => self.begin_stop(cause, ramp, parameters),
            (None, _) => self.resume(parameters),
        }
        if let Some((cause, _)) = wanted
            && cause != StopCause::Halt
        {
            self.short_of_target = cause == StopCause::Limit && self.position.is_under_way();
            self.position.abort(self.trajectory.point().position);
            self.homing.abort();
        }
    }

    fn wanted_stop(&self, targets: &Targets, parameters: &Parameters) -> Option<(StopCause, StopRamp)> {
        let quick = StopRamp::of_quick_stop(parameters.quick_stop, parameters.emergency_stop);
        let external = parameters.external_stop.ramp(parameters.quick_stop, parameters.emergency_stop);
        // A stop that ends disabled goes before one that holds the motor.
        if self.external_stop && parameters.external_stop == ExternalStop::Disable {
            Some((StopCause::External, external))
        } else if self.power.state() == PowerState::QuickStopActive {
            Some((StopCause::QuickStop, quick))
        } else if self.external_stop {
            Some((StopCause::External, external))
        } else if self.power.is_ramping_down() {
            Some((StopCause::RampDown, StopRamp::SlowDown))
        } else if self.host_lost {
            Some((StopCause::HostTimeout, quick))
        } else if let Some(ramp) = parameters.limit_stop.filter(|_| self.meets_limit(self.heading(targets), parameters))
        {
            Some((StopCause::Limit, ramp))
        } else if self.power.controlword().has(Controlword::HALT) {
            Some((StopCause::Halt, StopRamp::of_halt(parameters.halt, parameters.emergency_stop)))
        } else {
            None
        }
    }

    /// Where the shaft moves to, or is to: a sign.
    fn heading(&self, targets: &Targets) -> f64 {
        let velocity = self.trajectory.point().velocity;
        match self.mode {
            ModeOfOperation::HOMING => 0.0,
            ModeOfOperation::PROFILE_VELOCITY if velocity == 0.0 => targets.velocity,
            _ => velocity,
        }
    }

    fn meets_limit(&self, heading: f64, parameters: &Parameters) -> bool {
        let direction = if heading < 0.0 { Direction::Negative } else { Direction::Positive };
        heading != 0.0 && parameters.limit_stop.is_some() && self.switches.limit(direction)
    }

    fn begin_stop(&mut self, cause: StopCause, ramp: StopRamp, parameters: &Parameters) {
        let from = match self.mode {
            ModeOfOperation::PROFILE_TORQUE if self.stop.is_none() => {
                TrajectoryPoint::moving(self.feedback.position, self.feedback.velocity)
            }
            _ => self.trajectory.point(),
        };
        let time_s = match ramp {
            StopRamp::SlowDown if self.mode == ModeOfOperation::HOMING => parameters.homing.ramps.deceleration_time_s,
            StopRamp::SlowDown => parameters.moves.deceleration_time_s,
            StopRamp::QuickStop => parameters.quick_stop_time_s,
            StopRamp::CurrentLimit | StopRamp::Coast => 0.0,
        };
        // Already at rest: there is no way to take any time.
        let time_s = if from.velocity == 0.0 { 0.0 } else { time_s };
        self.trajectory = Trajectory::change_velocity(from, 0.0, time_s);
        self.stop = Some(Stop { cause, ramp, over_for_s: 0.0, held: false, free: false });
    }

    /// Nothing asks for a stop any more.
    fn resume(&mut self, parameters: &Parameters) {
        // A halted move or homing goes on, from wherever the motor coasted to.
        if self.stop.is_some_and(|stop| stop.free && stop.cause != StopCause::Halt) {
            self.engage();
        }
        self.stop = None;
        self.velocity.restart();
        self.torque.restart();
        self.position.rebase(self.trajectory.point().position);
        self.position.resume(&mut self.trajectory, &parameters.moves);
    }

    fn stopping(&mut self, mut stop: Stop, parameters: &Parameters, dt_s: f64) -> Demand {
        let point = self.trajectory.advance(dt_s);
        let follows_position = self.mode == ModeOfOperation::PROFILE_POSITION && stop.ramp == StopRamp::SlowDown;
        if (self.trajectory.is_resting() || stop.free) && !stop.held {
            stop.over_for_s += dt_s;
            if self.feedback.standing || stop.over_for_s > STANDSTILL_PATIENCE_S {
                stop.held = true;
                if !follows_position {
                    self.trajectory = Trajectory::resting(self.feedback.position);
                }
                self.position.rebase(self.trajectory.point().position);
                self.host_lost = false;
                self.power.ramp_done();
            }
        }
        if stop.disables(parameters.external_stop) {
            self.power.disable();
            return self.idle(parameters);
        }
        stop.free = stop.is_released(parameters.external_stop);
        if stop.free {
            // Whoever holds it again begins from wherever it has got to.
            self.trajectory = self.as_it_turns();
        }
        self.stop = Some(stop);
        match stop {
            _ if !self.is_live() => self.idle(parameters),
            _ if stop.free => Demand::Off,
            _ if stop.held => Demand::Position(self.trajectory.point()),
            _ if follows_position => Demand::Position(point),
            _ => Demand::Velocity(point),
        }
    }

    fn following(&mut self, targets: &Targets, parameters: &Parameters, dt_s: f64) -> Demand {
        match self.mode {
            ModeOfOperation::PROFILE_POSITION => {
                self.slow_down_if_adrift(parameters);
                self.trajectory.advance(dt_s);
                let new_set_point = self.power.controlword().has(Controlword::NEW_SET_POINT);
                self.position.update(new_set_point, &mut self.trajectory, &parameters.moves);
                Demand::Position(self.trajectory.point())
            }
            ModeOfOperation::PROFILE_VELOCITY => {
                self.velocity.update(targets.velocity, &mut self.trajectory, &parameters.velocity);
                Demand::Velocity(self.trajectory.advance(dt_s))
            }
            ModeOfOperation::PROFILE_TORQUE => {
                self.trajectory = Trajectory::resting(self.feedback.position);
                Demand::Torque(self.torque.update(targets.current_a, parameters.torque_slope_a_s, dt_s as f32))
            }
            ModeOfOperation::HOMING => self.homing(&parameters.homing, dt_s),
            _ => {
                self.slow_down_if_adrift(parameters);
                Demand::Velocity(self.trajectory.advance(dt_s))
            }
        }
    }

    fn homing(&mut self, parameters: &HomingParameters, dt_s: f64) -> Demand {
        let at = self.trajectory.point();
        let target = match self.homing.update(parameters, self.switches, at) {
            HomingStep::Go(velocity) => velocity,
            step @ (HomingStep::Latched | HomingStep::Failed) => {
                self.home = Some(at.position).filter(|_| step == HomingStep::Latched);
                self.trajectory = Trajectory::resting(at.position);
                0.0
            }
        };
        self.velocity.update(target, &mut self.trajectory, &parameters.ramps);
        let point = self.trajectory.advance(dt_s);
        if self.trajectory.is_resting() {
            self.homing.come_to_rest();
        }
        Demand::Position(point)
    }

    /// Enabled on a turning shaft, with nothing that asks for it: bring it to rest.
    fn slow_down_if_adrift(&mut self, parameters: &Parameters) {
        if self.trajectory.is_done() && !self.trajectory.is_resting() {
            let time_s = parameters.moves.deceleration_time_s;
            self.trajectory = Trajectory::change_velocity(self.trajectory.point(), 0.0, time_s);
        }
    }

    fn target_reached(&self, targets: &Targets, parameters: &Parameters) -> bool {
        let Tolerances { velocity, current_a, .. } = parameters.tolerances;
        let homing = self.mode == ModeOfOperation::HOMING;
        if homing && !self.homing.has_ended() && self.stop_cause() != Some(StopCause::Halt) {
            return false;
        }
        if self.engaged != Engaged::Yes || self.stop.is_some() {
            return self.feedback.standing;
        }
        match self.mode {
            ModeOfOperation::PROFILE_POSITION => {
                !self.position.is_under_way() && !self.short_of_target && self.is_in_position(&parameters.tolerances)
            }
            ModeOfOperation::PROFILE_VELOCITY => {
                let limit = parameters.velocity.max_speed;
                (self.feedback.velocity - targets.velocity.clamp(-limit, limit)).abs() <= velocity
            }
            ModeOfOperation::PROFILE_TORQUE => {
                self.torque.demand_a() == targets.current_a
                    && (self.feedback.current_a - targets.current_a).abs() <= current_a
            }
            _ => self.feedback.standing,
        }
    }

    fn is_in_position(&self, tolerances: &Tolerances) -> bool {
        let follows = self.mode == ModeOfOperation::PROFILE_POSITION && self.engaged != Engaged::No;
        let deviation = self.trajectory.point().position.wrapping_sub(self.feedback.position);
        !follows || deviation.unsigned_abs() <= tolerances.position
    }
}
