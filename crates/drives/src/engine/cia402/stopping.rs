//! The stop that lies over the mode: the first cause that applies, and what follows when the shaft stands.

use cia402::{Controlword, Direction, ModeOfOperation, PowerState, StopRamp};

use super::modes::is_cyclic;
use super::parameters::{Parameters, Targets};
use super::power_drive::{HERE, PowerDrive};
use super::stop::{ExternalStop, StopCause, of_halt, of_quick_stop, or_emergency};
use crate::engine::axis::{Braking, Cyclic, Demand, MoveLimits, Stop, StopEnd, Task};

/// A stop is over when the motor stands, or this long after its ramp: a load that drives the motor may never let it.
const STANDSTILL_PATIENCE_S: f64 = 1.0;
/// The same of a stop on the voltage limit, which has no ramp and takes as long as the supply makes it. Guess: a flywheel that
/// coasts.
const VOLTAGE_LIMIT_PATIENCE_S: f64 = 60.0;

impl PowerDrive {
    /// Lays the stop that is wanted over the mode, or takes it away.
    pub(super) fn choose_stop(&mut self, targets: &Targets, parameters: &Parameters) {
        let wanted = self.wanted_stop(targets, parameters);
        // Whether an external stop lets go of the shaft in the end can change while it lasts.
        let is_external = matches!(wanted, Some((StopCause::External, _)));
        if wanted == self.stop && !is_external {
            return;
        }
        let Some((cause, ramp)) = wanted else { return self.resume(parameters) };
        self.axis.set_stop(Some(self.stop_by(cause, ramp, parameters)));
        if wanted == self.stop {
            return;
        }
        self.stop = wanted;
        // A halted move goes on afterwards; every other stop ends what was under way.
        if cause != StopCause::Halt {
            self.short_of_target = cause == StopCause::Limit && self.set_points.is_under_way();
            self.set_points.abort(self.axis.point().position);
            self.axis.begin(HERE);
        }
        // A shaft that a halt holds already stands for the stop that takes its place, too.
        if self.axis.has_stopped() {
            self.end_stop(parameters);
        }
    }

    fn wanted_stop(&self, targets: &Targets, parameters: &Parameters) -> Option<(StopCause, StopRamp)> {
        let emergency = parameters.emergency_stop;
        let quick = of_quick_stop(parameters.quick_stop, emergency);
        let external = parameters.external_stop.ramp(parameters.quick_stop, emergency);
        if self.power.state() == PowerState::FaultReactionActive {
            Some((StopCause::Fault, or_emergency(self.fault_reaction.ramp(), emergency)))
        } else if self.external_stop && parameters.external_stop == ExternalStop::Disable {
            // A stop that ends disabled goes before one that holds the motor.
            Some((StopCause::External, external))
        } else if self.power.state() == PowerState::QuickStopActive {
            Some((StopCause::QuickStop, quick))
        } else if self.external_stop {
            Some((StopCause::External, external))
        } else if self.power.is_ramping_down() {
            Some((StopCause::RampDown, StopRamp::SlowDown))
        } else if self.host_timeout {
            Some((StopCause::HostTimeout, quick))
        } else if let Some(ramp) = parameters.limit_stop.filter(|_| self.meets_limit(self.heading(targets), parameters))
        {
            Some((StopCause::Limit, ramp))
        } else if self.power.controlword().has(Controlword::HALT) {
            Some((StopCause::Halt, of_halt(parameters.halt, emergency)))
        } else {
            None
        }
    }

    /// Where the shaft moves to, or is to: a sign.
    fn heading(&self, targets: &Targets) -> f64 {
        let velocity = self.axis.point().velocity;
        match self.mode {
            ModeOfOperation::HOMING => 0.0,
            ModeOfOperation::PROFILE_VELOCITY | ModeOfOperation::VELOCITY if velocity == 0.0 => targets.velocity,
            mode if is_cyclic(mode) && velocity == 0.0 => match targets.cyclic {
                Some(Cyclic::Position(point)) => f64::from(point.position.wrapping_sub(self.axis.point().position)),
                Some(Cyclic::Velocity(point)) => point.velocity,
                Some(Cyclic::Torque(current_a)) => f64::from(current_a),
                None => 0.0,
            },
            _ => velocity,
        }
    }

    pub(super) fn meets_limit(&self, heading: f64, parameters: &Parameters) -> bool {
        let direction = if heading < 0.0 { Direction::Negative } else { Direction::Positive };
        heading != 0.0 && parameters.limit_stop.is_some() && self.switches.limit(direction)
    }

    fn stop_by(&self, cause: StopCause, ramp: StopRamp, parameters: &Parameters) -> Stop {
        let braking = match ramp {
            StopRamp::SlowDown if self.mode == ModeOfOperation::HOMING => {
                Braking::Ramp(parameters.homing.ramps.deceleration)
            }
            StopRamp::SlowDown => Braking::Ramp(parameters.moves.deceleration),
            StopRamp::QuickStop => Braking::Ramp(parameters.quick_stop_ramp),
            StopRamp::CurrentLimit | StopRamp::VoltageLimit => Braking::CurrentLimit,
            StopRamp::Free => Braking::Coast,
        };
        let lets_go = cause == StopCause::External && parameters.external_stop == ExternalStop::LetGo;
        Stop {
            braking,
            // A quick stop gives up the way for the sake of time.
            on_path: ramp == StopRamp::SlowDown && self.follows_positions(),
            end: if lets_go { StopEnd::LetGo } else { StopEnd::Hold },
            patience_s: match ramp {
                StopRamp::VoltageLimit => VOLTAGE_LIMIT_PATIENCE_S,
                _ => STANDSTILL_PATIENCE_S,
            },
        }
    }

    /// The mode plans positions, or is given them.
    fn follows_positions(&self) -> bool {
        matches!(
            self.mode,
            ModeOfOperation::PROFILE_POSITION
                | ModeOfOperation::INTERPOLATED_POSITION
                | ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION
        )
    }

    /// Nothing asks for a stop any more.
    fn resume(&mut self, parameters: &Parameters) {
        if self.set_points.is_under_way() {
            self.set_off(parameters);
        } else if matches!(self.axis.task(), Task::Move { limits: MoveLimits { passes: true, .. }, .. }) {
            // It had passed its target: there is none to go back to.
            self.axis.begin(HERE);
        }
        self.stop = None;
        self.axis.set_stop(None);
        self.set_points.rebase(self.axis.point().position);
    }

    /// One period of the stop; `None` if the axis is not enabled at its end.
    pub(super) fn stopping(&mut self, parameters: &Parameters, dt_s: f64) -> Option<Demand> {
        let was_over = self.axis.has_stopped();
        let demand = self.axis.update(dt_s);
        let over = self.axis.has_stopped();
        if over && !was_over {
            self.end_stop(parameters);
        }
        if let Some((StopCause::External, ramp)) = self.stop
            && parameters.external_stop == ExternalStop::Disable
            && (over || ramp == StopRamp::Free)
        {
            self.power.disable();
        }
        self.is_live().then_some(demand)
    }

    /// What waited for the shaft to stand.
    fn end_stop(&mut self, parameters: &Parameters) {
        self.set_points.rebase(self.axis.point().position);
        self.host_timeout = false;
        self.power.ramp_done();
        match self.power.state() {
            PowerState::QuickStopActive if !parameters.quick_stop.stays() => self.power.quick_stop_done(),
            PowerState::FaultReactionActive => self.power.fault_reaction_done(),
            _ => {}
        }
    }
}
