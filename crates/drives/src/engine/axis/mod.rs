//! Motion of one shaft: one task at a time, and a stop that can lie over it.
//!
//! ```text
//! engage, begin(Task), set_stop(Stop)      who may move decides on these
//! observe(Feedback)                        first in each period
//! update(dt) -> Demand                     last in each period
//! ```
//!
//! Units are counts of a wrapping 32-bit position, counts/s and A. A task is planned from where the shaft is to be at that
//! moment, or, where it has not been given a position, from where it is. While a stop lies over a task the task waits; it goes
//! on from wherever the shaft stands or turns by then. Nothing here knows modes, controlwords or objects.

mod change;
mod demand;
mod homing;
mod interpolation;
mod ramp;
mod speed;
mod stop;
mod task;
mod torque;
mod trajectory;

pub use demand::{Control, Demand, Feedback};
pub use homing::{HomingParameters, HomingState, Switches};
pub use ramp::Ramp;
pub use speed::VelocityRamps;
pub use task::{Braking, Cyclic, Stop, StopEnd, StopState, Task};
pub use trajectory::{MoveLimits, Trajectory, TrajectoryPoint};

use homing::Homing;
use interpolation::Interpolation;
use speed::Speed;
use stop::Stopping;
use torque::Torque;

/// One shaft.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    engaged: bool,
    task: Task,
    /// Where the shaft is to be, unless the task is to interpolate.
    trajectory: Trajectory,
    interpolation: Interpolation,
    speed: Speed,
    torque: Torque,
    homing: Homing,
    /// Where the home position was found, until it is taken.
    home: Option<i32>,
    switches: Switches,
    stop: Option<Stopping>,
    feedback: Feedback,
}

impl Axis {
    /// Free, at rest.
    pub fn new() -> Self {
        Self {
            engaged: false,
            task: REST,
            trajectory: Trajectory::resting(0),
            interpolation: Interpolation::resting(0),
            speed: Speed::default(),
            torque: Torque::default(),
            homing: Homing::default(),
            home: None,
            switches: Switches::default(),
            stop: None,
            feedback: Feedback { standing: true, ..Feedback::default() },
        }
    }

    /// What the shaft does now, before anything is decided on it.
    #[inline]
    pub fn observe(&mut self, feedback: Feedback) {
        self.feedback = feedback;
    }

    /// What the shaft did at the last look.
    pub const fn feedback(&self) -> &Feedback {
        &self.feedback
    }

    /// What the switches along the axis say.
    #[inline]
    pub fn set_switches(&mut self, switches: Switches) {
        self.switches = switches;
    }

    /// Looks for the home position now, instead of in the next period.
    #[inline]
    pub fn watch(&mut self, switches: Switches) {
        self.switches = switches;
        if self.homing.state() == HomingState::Running {
            self.look_for_home();
        }
    }

    /// The shaft is driven.
    pub const fn is_engaged(&self) -> bool {
        self.engaged
    }

    /// Takes the shaft over as it turns. A [`Task`] follows; without one it is brought to rest at once.
    pub fn engage(&mut self) {
        self.trajectory = self.as_it_turns();
        self.speed.restart();
        self.torque.restart();
        self.homing.abort();
        self.task = REST;
        self.stop = None;
        self.engaged = true;
    }

    /// Lets go of the shaft; what was under way is over.
    pub fn release(&mut self) {
        self.engage();
        self.engaged = false;
    }

    /// Stays where the shaft is now: what was planned is over.
    pub fn stay(&mut self) {
        self.trajectory = Trajectory::resting(self.feedback.position);
        self.task = REST;
    }

    /// Begins a task, or goes on with it: see [`Task`].
    #[inline]
    pub fn begin(&mut self, task: Task) {
        let goes_on = matches!(
            (&task, &self.task),
            (Task::Speed { .. }, Task::Speed { .. })
                | (Task::Hold { .. }, Task::Hold { .. })
                | (Task::Torque { .. }, Task::Torque { .. })
                | (Task::Cyclic(_), Task::Cyclic(_))
        );
        if !goes_on {
            self.change_task(&task);
        }
        self.task = task;
    }

    /// Whether the shaft is to stand, whatever its task is.
    pub fn set_stop(&mut self, stop: Option<Stop>) {
        match stop {
            Some(stop) => {
                let goes_on = self.stop.as_mut().is_some_and(|present| present.replace(stop));
                if !goes_on {
                    self.begin_stop(stop);
                }
            }
            None if self.stop.is_some() => self.resume(),
            None => {}
        }
    }

    /// How far the stop has come, if there is one.
    pub fn stop_state(&self) -> Option<StopState> {
        self.stop.as_ref().map(Stopping::state)
    }

    /// A stop lies over the task, and the shaft has come to rest under it, or was not waited for any longer.
    pub fn has_stopped(&self) -> bool {
        self.stop.is_some_and(|stopping| stopping.held)
    }

    /// The task.
    pub const fn task(&self) -> &Task {
        &self.task
    }

    /// One period.
    #[inline]
    pub fn update(&mut self, dt_s: f64) -> Demand {
        self.update_by(dt_s, dt_s)
    }

    /// One period of `dt_s`, in which the time base of an interpolation goes on by `base_s`.
    #[inline]
    pub fn update_by(&mut self, dt_s: f64, base_s: f64) -> Demand {
        if !self.engaged {
            return Demand::Off;
        }
        if self.stop.is_some() {
            return self.update_stop(dt_s);
        }
        match self.task {
            Task::Speed { velocity, ref ramps } => {
                self.speed.update(velocity, &mut self.trajectory, ramps);
                Demand::Velocity(self.trajectory.advance(dt_s))
            }
            Task::Move { .. } => Demand::Position(self.trajectory.advance(dt_s)),
            Task::Hold { control, ramp } => {
                self.slow_down(ramp);
                control.demand(self.trajectory.advance(dt_s))
            }
            Task::Torque { current_a, slope_a_s } => {
                self.trajectory = Trajectory::resting(self.feedback.position);
                Demand::Torque(self.torque.update(current_a, slope_a_s, dt_s as f32))
            }
            Task::Interpolate { .. } => {
                let point = self.interpolation.advance(base_s);
                Demand::Position(TrajectoryPoint { velocity: point.velocity * base_s / dt_s, ..point })
            }
            Task::Cyclic(set_point) => self.follow(set_point),
            Task::Home(_) => self.update_homing(dt_s),
        }
    }

    /// Where the shaft is to be.
    #[inline]
    pub fn point(&self) -> TrajectoryPoint {
        match self.task {
            Task::Interpolate { .. } if self.stop.is_none() => self.interpolation.point(),
            _ => self.trajectory.point(),
        }
    }

    /// Current asked for by [`Task::Torque`], A.
    pub const fn torque_demand_a(&self) -> f32 {
        self.torque.demand_a()
    }

    /// Where relative moves count from: the target under way, or where the shaft is held.
    pub fn target(&self) -> i32 {
        match self.task {
            Task::Move { target, .. } | Task::Interpolate { target, .. } => target,
            Task::Hold { .. } | Task::Home(_) if self.engaged => self.trajectory.point().position,
            _ => self.feedback.position,
        }
    }

    /// Counts from where the shaft is to where its task ends.
    pub fn way_to_go(&self) -> i32 {
        match self.task {
            Task::Move { target, .. } | Task::Interpolate { target, .. } => target.wrapping_sub(self.feedback.position),
            _ => 0,
        }
    }

    /// The task has come to its end, whether or not the shaft is there yet; a speed has, once it is planned to be reached.
    pub fn is_done(&self) -> bool {
        match self.task {
            _ if self.stop.is_some() => self.is_stopped_at_rest(),
            Task::Interpolate { .. } => self.interpolation.is_done(),
            Task::Speed { .. } => self.trajectory.is_done(),
            _ => self.trajectory.is_resting(),
        }
    }

    /// A move has come to its target, from which it may go on; of other tasks: [`is_resting`](Self::is_resting).
    pub fn has_arrived(&self) -> bool {
        if matches!(self.task, Task::Move { .. }) { self.trajectory.is_done() } else { self.is_resting() }
    }

    /// A move has passed its target and goes on.
    pub fn runs_on(&self) -> bool {
        matches!(self.task, Task::Move { .. }) && self.has_arrived() && self.trajectory.point().velocity != 0.0
    }

    /// The shaft is planned to stand, and has been for a period.
    pub fn is_resting(&self) -> bool {
        match self.task {
            Task::Interpolate { .. } if self.stop.is_none() => self.interpolation.is_resting(),
            _ => self.trajectory.is_resting(),
        }
    }

    /// Where homing stands.
    pub const fn homing(&self) -> HomingState {
        self.homing.state()
    }

    /// Homing slows down, and the run counts as nothing.
    pub fn interrupt_homing(&mut self) {
        self.homing.interrupt();
    }

    /// Homing that is under way has failed; what it has begun to move is held.
    pub fn abort_homing(&mut self) {
        self.homing.abort();
    }

    /// As if homing had never begun.
    pub fn forget_homing(&mut self) {
        self.homing.forget();
    }

    /// Where homing has just found the home position, reported once.
    #[inline]
    pub fn take_home(&mut self) -> Option<i32> {
        self.home.take()
    }

    /// The zero of positions: what was `by` is 0 from now on.
    pub fn shift(&mut self, by: i32) {
        self.trajectory.shift(by);
        self.interpolation.shift(by);
        self.feedback.position = self.feedback.position.wrapping_sub(by);
        match &mut self.task {
            Task::Move { target, .. } | Task::Interpolate { target, .. } => *target = target.wrapping_sub(by),
            _ => {}
        }
    }
}

impl Default for Axis {
    fn default() -> Self {
        Self::new()
    }
}

/// Nothing to do: stays where the trajectory is, and steps to rest.
const REST: Task = Task::Hold { control: Control::Position, ramp: Ramp::NONE };

#[cfg(test)]
mod tests;
