//! Where the shaft is to be: one task at a time, and the stop that can lie over it.
//!
//! Units are counts of the motor's shaft and counts/s. Who may move, and in which mode, is decided by the drive; this
//! only carries it out. A stop is abrupt and then holds ("stops abruptly, but is still in the self-locking state");
//! what was under way goes on afterwards.

use super::interpolation::Interpolation;
use crate::engine::axis::Demand;
use crate::engine::axis::{StraightRamps, Trajectory, TrajectoryPoint};

/// What the shaft does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Feedback {
    /// Counts.
    pub(super) position: i32,
    /// Counts/s.
    pub(super) velocity: f64,
    /// Slower than the threshold of standstill.
    pub(super) standing: bool,
}

/// What is under way.
#[derive(Clone, Copy, Debug)]
enum Task {
    /// Slow down and stay.
    Hold,
    /// Go to a position.
    Move { target: i32 },
    /// Turn at a speed; `None` until a ramp to it is planned.
    Speed { heading_for: Option<f64> },
    /// Follow targets in a fixed time base.
    Interpolate(Interpolation),
    /// Follow pulses, which have asked for this position and come at this speed.
    Follow { target: i32, velocity: f64 },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stop {
    Braking,
    /// At this position.
    Held(i32),
}

/// The axis.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    engaged: bool,
    task: Task,
    trajectory: Trajectory,
    stop: Option<Stop>,
    feedback: Feedback,
}

impl Axis {
    /// Free, at rest.
    pub(super) fn new() -> Self {
        Self {
            engaged: false,
            task: Task::Hold,
            trajectory: Trajectory::resting(0),
            stop: None,
            feedback: Feedback { standing: true, ..Feedback::default() },
        }
    }

    /// The shaft is driven.
    pub(super) const fn is_engaged(&self) -> bool {
        self.engaged
    }

    /// Takes the shaft over as it turns, and brings it to rest.
    pub(super) fn engage(&mut self, ramps: &StraightRamps) {
        let Feedback { position, velocity, standing } = self.feedback;
        let velocity = if standing { 0.0 } else { velocity };
        self.engaged = true;
        self.stop = None;
        self.task = Task::Hold;
        self.trajectory =
            Trajectory::ramp_velocity(TrajectoryPoint::moving(position, velocity), 0.0, ramps.acceleration);
    }

    /// Lets go of the shaft.
    pub(super) fn release(&mut self) {
        self.engaged = false;
        self.stop = None;
        self.task = Task::Hold;
    }

    /// Slows down and stays: whatever was under way is over.
    pub(super) fn hold(&mut self, ramps: &StraightRamps) {
        if !matches!(self.task, Task::Hold) {
            self.trajectory = Trajectory::ramp_velocity(self.departure(), 0.0, ramps.acceleration);
            self.task = Task::Hold;
        }
    }

    /// Stays where the shaft is now: what was planned is over.
    pub(super) fn stay(&mut self) {
        self.trajectory = Trajectory::resting(self.feedback.position);
        self.task = Task::Hold;
    }

    /// Forgets the target of what is under way; a stop lies over it.
    pub(super) fn abandon(&mut self) {
        if !matches!(self.task, Task::Hold) {
            self.stay();
        }
    }

    /// Goes to a position.
    pub(super) fn move_to(&mut self, target: i32, ramps: &StraightRamps) {
        self.trajectory = Trajectory::move_straight(self.departure(), target, ramps);
        self.task = Task::Move { target };
    }

    /// Where relative moves count from: the target under way, or where the shaft is held.
    pub(super) fn base(&self) -> i32 {
        match self.task {
            Task::Move { target } | Task::Follow { target, .. } => target,
            Task::Hold if self.engaged => self.trajectory.point().position,
            _ => self.feedback.position,
        }
    }

    /// Turns at a speed. To be told every period.
    pub(super) fn turn(&mut self, speed: f64, ramps: &StraightRamps) {
        let planned = matches!(self.task, Task::Speed { heading_for } if heading_for == Some(speed));
        if !planned {
            self.trajectory = Trajectory::ramp_velocity(self.departure(), speed, ramps.acceleration);
            self.task = Task::Speed { heading_for: Some(speed) };
        }
    }

    /// Leads to the next point of an interpolation.
    pub(super) fn interpolate(&mut self, target: i32, max_speed: f64) {
        let mut interpolation = match self.task {
            Task::Interpolate(interpolation) => interpolation,
            _ => Interpolation::resting(self.departure().position),
        };
        interpolation.lead_to(target, max_speed);
        self.task = Task::Interpolate(interpolation);
    }

    /// Pulses have asked for `by` counts more in the last `dt_s`. To be told every period while they are followed.
    pub(super) fn follow(&mut self, by: i32, ramps: &StraightRamps, dt_s: f64) {
        let target = self.base().wrapping_add(by);
        if by != 0 && ramps.acceleration > 0.0 {
            self.trajectory = Trajectory::move_straight(self.departure(), target, ramps);
        }
        let direct = ramps.acceleration <= 0.0;
        if direct {
            self.trajectory = Trajectory::resting(target);
        }
        self.task = Task::Follow { target, velocity: if direct { f64::from(by) / dt_s } else { 0.0 } };
    }

    /// Whether the shaft is to stand, whatever is under way.
    pub(super) fn set_stop(&mut self, stop: bool, ramps: &StraightRamps, max_speed: f64) {
        match (stop, self.stop) {
            (true, None) => self.stop = Some(Stop::Braking),
            (false, Some(_)) => self.resume(ramps, max_speed),
            _ => {}
        }
    }

    /// What the shaft does now, before anything is decided on it.
    pub(super) fn observe(&mut self, feedback: Feedback) {
        self.feedback = feedback;
    }

    /// One period of `dt_s`, in which the time base of the interpolation goes on by `base_s`.
    pub(super) fn update(&mut self, dt_s: f64, base_s: f64) -> Demand {
        if !self.engaged {
            return Demand::Off;
        }
        if let Some(stop) = self.stop {
            return self.stand(stop);
        }
        match &mut self.task {
            Task::Speed { .. } => Demand::Velocity(self.trajectory.advance(dt_s)),
            Task::Interpolate(interpolation) => {
                let point = interpolation.advance(base_s);
                Demand::Position(TrajectoryPoint { velocity: point.velocity * base_s / dt_s, ..point })
            }
            Task::Follow { velocity, .. } => {
                let point = self.trajectory.advance(dt_s);
                Demand::Position(TrajectoryPoint { velocity: point.velocity + *velocity, ..point })
            }
            Task::Hold | Task::Move { .. } => Demand::Position(self.trajectory.advance(dt_s)),
        }
    }

    /// The plan has come to its end, whether or not the shaft is there yet.
    pub(super) fn is_done(&self) -> bool {
        match self.task {
            _ if self.stop == Some(Stop::Braking) => false,
            Task::Interpolate(interpolation) => interpolation.is_done(),
            Task::Speed { .. } => self.trajectory.is_done(),
            Task::Hold | Task::Move { .. } | Task::Follow { .. } => self.trajectory.is_resting(),
        }
    }

    /// The plan moves nothing, and has not moved anything in the last period either.
    pub(super) fn is_resting(&self) -> bool {
        match self.task {
            Task::Interpolate(interpolation) => interpolation.is_resting(),
            _ => self.is_done(),
        }
    }

    /// Counts from where the shaft is to where its task ends.
    pub(super) fn way_to_go(&self) -> i32 {
        match self.task {
            Task::Move { target } | Task::Follow { target, .. } => target.wrapping_sub(self.feedback.position),
            Task::Interpolate(interpolation) => interpolation.target().wrapping_sub(self.feedback.position),
            Task::Hold | Task::Speed { .. } => 0,
        }
    }

    /// Direction that the shaft is told to move in, 0 for none.
    pub(super) fn direction(&self) -> i8 {
        let velocity = if self.stop.is_some() { 0.0 } else { self.trajectory.point().velocity };
        i8::from(velocity > 0.0) - i8::from(velocity < 0.0)
    }

    /// The zero of positions: what was `by` is 0 from now on.
    pub(super) fn shift(&mut self, by: i32) {
        self.trajectory.shift(by);
        self.feedback.position = self.feedback.position.wrapping_sub(by);
        if let Some(Stop::Held(position)) = &mut self.stop {
            *position = position.wrapping_sub(by);
        }
        match &mut self.task {
            Task::Move { target } | Task::Follow { target, .. } => *target = target.wrapping_sub(by),
            Task::Interpolate(interpolation) => interpolation.shift(by),
            Task::Hold | Task::Speed { .. } => {}
        }
    }

    /// Where a new plan begins: on the old one, unless the old one gave no position.
    fn departure(&self) -> TrajectoryPoint {
        match self.task {
            Task::Speed { .. } => TrajectoryPoint::moving(self.feedback.position, self.trajectory.point().velocity),
            Task::Interpolate(interpolation) => interpolation.point(),
            Task::Hold | Task::Move { .. } | Task::Follow { .. } => self.trajectory.point(),
        }
    }

    fn stand(&mut self, stop: Stop) -> Demand {
        let here = self.feedback.position;
        match stop {
            Stop::Held(position) => Demand::Position(TrajectoryPoint::rest(position)),
            Stop::Braking if self.feedback.standing => {
                self.stop = Some(Stop::Held(here));
                Demand::Position(TrajectoryPoint::rest(here))
            }
            Stop::Braking => Demand::Velocity(TrajectoryPoint::rest(here)),
        }
    }

    fn resume(&mut self, ramps: &StraightRamps, max_speed: f64) {
        self.stop = None;
        // From where it stands, or still turns.
        let Feedback { position, velocity, standing } = self.feedback;
        let from = TrajectoryPoint::moving(position, if standing { 0.0 } else { velocity });
        match self.task {
            Task::Move { target } | Task::Follow { target, .. } => {
                self.trajectory = Trajectory::move_straight(from, target, ramps);
            }
            Task::Speed { .. } => {
                self.trajectory = Trajectory::ramp_velocity(from, from.velocity, 0.0);
                self.task = Task::Speed { heading_for: None };
            }
            Task::Interpolate(stopped) => {
                let target = stopped.target();
                let mut interpolation = Interpolation::resting(position);
                interpolation.lead_to(target, max_speed);
                self.task = Task::Interpolate(interpolation);
            }
            Task::Hold => self.trajectory = Trajectory::ramp_velocity(from, 0.0, ramps.acceleration),
        }
    }
}
