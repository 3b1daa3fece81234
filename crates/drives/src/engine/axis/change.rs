//! How tasks change, stop and go on.

use super::task::{Braking, Cyclic, Stop};
use super::{
    Axis, Control, Demand, Feedback, HomingParameters, HomingState, Interpolation, Ramp, Stopping, Task, Trajectory,
    TrajectoryPoint,
};

impl Axis {
    /// Another task: planned from where the shaft is to be now, or once the stop is gone.
    pub(super) fn change_task(&mut self, task: &Task) {
        if self.stop.is_none() {
            self.hand_over();
        }
        self.homing.abort();
        if let Task::Home(parameters) = task {
            self.home = self.homing.start(parameters, self.switches, self.feedback.position);
        }
        if self.stop.is_none() {
            self.plan(task);
        }
    }

    /// The trajectory stands for what the shaft is asked for now, whatever the task is that ends.
    fn hand_over(&mut self) {
        let Feedback { position, velocity, .. } = self.feedback;
        match self.task {
            Task::Hold { .. } | Task::Move { .. } | Task::Cyclic(Cyclic::Position(_)) => {}
            Task::Interpolate { .. } => self.trajectory = Trajectory::steady(self.interpolation.point()),
            Task::Torque { .. } | Task::Cyclic(Cyclic::Torque(_)) => {
                self.trajectory = Trajectory::steady(TrajectoryPoint::moving(position, velocity));
            }
            // No position was asked for: the next one counts from where the shaft is.
            Task::Speed { .. } | Task::Cyclic(Cyclic::Velocity(_)) => self.trajectory.place(position),
            Task::Home(HomingParameters { control: Control::Velocity, .. })
                if self.homing.state() == HomingState::Running =>
            {
                self.trajectory.place(position);
            }
            Task::Home(_) => {}
        }
    }

    fn plan(&mut self, task: &Task) {
        match *task {
            Task::Hold { ramp, .. } => self.come_to_rest(ramp),
            Task::Move { target, ref limits } => {
                self.trajectory = Trajectory::move_to(self.trajectory.point(), target, limits);
            }
            Task::Speed { .. } | Task::Home(_) => self.speed.restart(),
            Task::Torque { .. } => self.torque.restart(),
            Task::Interpolate { target, time_s, max_speed } => {
                if !matches!(self.task, Task::Interpolate { .. }) {
                    self.interpolation = Interpolation::resting(self.trajectory.point().position);
                }
                self.interpolation.lead_to(target, time_s, max_speed);
            }
            Task::Cyclic(_) => {}
        }
    }

    /// The shaft as it turns.
    pub(super) fn as_it_turns(&self) -> Trajectory {
        let velocity = if self.feedback.standing { 0.0 } else { self.feedback.velocity };
        Trajectory::steady(TrajectoryPoint::moving(self.feedback.position, velocity))
    }

    /// A shaft that is at rest already needs no time for it.
    fn come_to_rest(&mut self, ramp: Ramp) {
        let from = self.trajectory.point();
        let ramp = if from.velocity == 0.0 { Ramp::NONE } else { ramp };
        self.trajectory = Trajectory::change_velocity(from, 0.0, ramp);
    }

    /// The plan has run out and the shaft still turns, as after it was taken over: it is brought to rest.
    pub(super) fn slow_down(&mut self, ramp: Ramp) {
        if self.trajectory.is_done() && !self.trajectory.is_resting() {
            self.trajectory = Trajectory::change_velocity(self.trajectory.point(), 0.0, ramp);
        }
    }

    pub(super) fn begin_stop(&mut self, stop: Stop) {
        if self.stop.is_none() {
            self.hand_over();
        }
        self.come_to_rest(match stop.braking {
            Braking::Ramp(ramp) => ramp,
            Braking::CurrentLimit | Braking::Coast => Ramp::NONE,
        });
        self.stop = Some(Stopping::new(stop));
    }

    pub(super) fn update_stop(&mut self, dt_s: f64) -> Demand {
        let Some(mut stopping) = self.stop else { return Demand::Off };
        let point = self.trajectory.advance(dt_s);
        let over = (self.trajectory.is_resting() || stopping.free) && !stopping.held;
        if over && stopping.wait(self.feedback.standing, dt_s) && !stopping.stop.on_path {
            self.trajectory = Trajectory::resting(self.feedback.position);
        }
        stopping.free = stopping.is_to_be_free();
        if stopping.free {
            // Holding it again begins from wherever it has got to.
            self.trajectory = self.as_it_turns();
        }
        self.stop = Some(stopping);
        match stopping {
            Stopping { free: true, .. } => Demand::Off,
            Stopping { held: true, .. } => Demand::Position(self.trajectory.point()),
            Stopping { stop: Stop { on_path: true, .. }, .. } => Demand::Position(point),
            _ => Demand::Velocity(point),
        }
    }

    /// Nothing asks for a stop any more: the task goes on from where the shaft is to be, or, where no ramp says that, as it
    /// stands or turns.
    pub(super) fn resume(&mut self) {
        let Some(stopping) = self.stop.take() else { return };
        if stopping.free || stopping.stop.braking == Braking::CurrentLimit {
            self.trajectory = self.as_it_turns();
        }
        match self.task {
            Task::Hold { .. } | Task::Cyclic(_) => {}
            Task::Move { target, ref limits } => {
                self.trajectory = Trajectory::move_to(self.trajectory.point(), target, limits);
            }
            Task::Speed { .. } | Task::Home(_) => self.speed.restart(),
            Task::Torque { .. } => self.torque.restart(),
            Task::Interpolate { target, time_s, max_speed } => {
                self.interpolation = Interpolation::resting(self.trajectory.point().position);
                self.interpolation.lead_to(target, time_s, max_speed);
            }
        }
    }

    /// Held by a stop, with nothing left of the task.
    pub(super) fn is_stopped_at_rest(&self) -> bool {
        let nothing_left = matches!(self.task, Task::Hold { .. });
        nothing_left && self.stop.is_some_and(|stopping| stopping.held)
    }

    pub(super) fn follow(&mut self, set_point: Cyclic) -> Demand {
        match set_point {
            Cyclic::Position(point) => {
                self.trajectory = Trajectory::steady(point);
                Demand::Position(point)
            }
            Cyclic::Velocity(point) => {
                self.trajectory = Trajectory::steady(TrajectoryPoint { position: self.feedback.position, ..point });
                Demand::Velocity(point)
            }
            Cyclic::Torque(current_a) => {
                self.trajectory = Trajectory::resting(self.feedback.position);
                Demand::Torque(current_a)
            }
        }
    }

    /// The run under way looks at its switches. While a stop lies over it no edge counts.
    pub(super) fn look_for_home(&mut self) {
        let Task::Home(ref parameters) = self.task else { return };
        let at = self.trajectory.point();
        let at = if self.stop.is_some() { TrajectoryPoint::rest(at.position) } else { at };
        let found = self.homing.watch(parameters, self.switches, at, self.feedback.position);
        if found.is_some() {
            self.home = found;
        }
    }

    pub(super) fn update_homing(&mut self, dt_s: f64) -> Demand {
        let Task::Home(parameters) = self.task else { return Demand::Off };
        if self.homing.state() == HomingState::Running {
            self.look_for_home();
        }
        if self.homing.take_end() {
            self.end_homing(&parameters);
        }
        let by_velocity = parameters.control == Control::Velocity;
        match self.homing.state() {
            HomingState::Running => {
                let velocity = self.homing.velocity(&parameters);
                self.speed.update(velocity, &mut self.trajectory, &parameters.ramps);
                let point = self.trajectory.advance(dt_s);
                if self.trajectory.is_resting() {
                    self.homing.come_to_rest();
                }
                return parameters.control.demand(point);
            }
            HomingState::Stopping if self.trajectory.is_resting() && (self.feedback.standing || !by_velocity) => {
                self.homing.come_to_rest();
                if by_velocity {
                    self.trajectory = Trajectory::resting(self.feedback.position);
                }
            }
            _ => self.slow_down(parameters.end),
        }
        Demand::Position(self.trajectory.advance(dt_s))
    }

    /// The run has ended at its home position, or at a limit switch. Without a ramp the shaft stops on the whole count.
    fn end_homing(&mut self, parameters: &HomingParameters) {
        if parameters.control == Control::Velocity {
            self.trajectory.place(self.feedback.position);
        }
        if parameters.end.is_none() {
            self.trajectory = Trajectory::resting(self.trajectory.point().position);
        } else {
            self.come_to_rest(parameters.end);
        }
    }
}
