//! What the modes that follow something at all times are given each period.

use canopen::od::{Dictionary, Storage};
use cia402::{Controlword, ModeOfOperation};
use motion::profile::Point;

use super::{SUPERVISION_PERIOD_S, Shaft};
use crate::engine::axis::{Cyclic, Feedback, TrajectoryPoint};
use crate::engine::cia402::Targets;
use crate::servo::read;

impl Shaft {
    /// Targets from the objects, held to the limits.
    pub(super) fn read_targets(&mut self, values: &Dictionary<impl Storage>, feedback: &Feedback) {
        self.limited = false;
        let position = f64::from(feedback.position);
        let cyclic = match self.power.mode() {
            mode if !self.is_enabled() => {
                self.follow_nothing(mode);
                None
            }
            ModeOfOperation::INTERPOLATED_POSITION if !self.power.controlword().has(Controlword::NEW_SET_POINT) => {
                self.follow_nothing(ModeOfOperation::INTERPOLATED_POSITION);
                None
            }
            ModeOfOperation::INTERPOLATED_POSITION | ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION => {
                self.cyclic_position(values)
            }
            ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY => {
                let wanted = self.velocity(values) + self.velocity_offset(values);
                let velocity = self.held_velocity(wanted, position);
                Some(Cyclic::Velocity(TrajectoryPoint::moving(feedback.position, velocity)))
            }
            ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE => Some(Cyclic::Torque(self.torque_a(values))),
            _ => None,
        };
        let wanted = self.velocity(values);
        let profile = self.power.mode() == ModeOfOperation::PROFILE_VELOCITY;
        self.targets = Targets {
            velocity: if profile { self.held_velocity(wanted, position) } else { 0.0 },
            current_a: self.torque_a(values),
            cyclic,
        };
    }

    /// A set-point came: 607Ah in csp, 60C1h in ip.
    pub(super) fn take_set_point(&mut self, target: i64, feedback_position: i32) {
        let wanted = f64::from(self.parameters.scales.increments(target));
        let target = self.parameters.travel.map_or(wanted, |travel| travel.hold(wanted));
        self.set_point_held = target != wanted;
        let following = self.parameters.following;
        if self.set_point_age_s.is_none() {
            self.set_points = motion::set_points::SetPoints::resting(f64::from(feedback_position));
        }
        let age_s = self.set_point_age_s.unwrap_or(f64::INFINITY);
        self.set_points.push(target, age_s, &following);
        self.set_point_age_s = Some(0.0);
    }

    fn follow_nothing(&mut self, mode: ModeOfOperation) {
        // A set-point that came before the axis was enabled still holds in csp: the host has aimed it.
        if mode != ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION || self.power.is_live() {
            self.set_point_age_s = None;
        }
    }

    fn cyclic_position(&mut self, values: &Dictionary<impl Storage>) -> Option<Cyclic> {
        let age_s = self.set_point_age_s? + f64::from(SUPERVISION_PERIOD_S);
        self.set_point_age_s = Some(age_s);
        let point = self.set_points.at(age_s, &self.parameters.following);
        let offset = self.parameters.scales.increments(read(values, self.slots.position_offset, 0));
        let at = point.position + f64::from(offset);
        let held = self.parameters.travel.map_or(at, |travel| travel.hold(at));
        self.limited = held != at || self.set_point_held;
        let velocity = match self.velocity_offset(values) {
            0.0 => point.velocity,
            fed_forward => fed_forward,
        };
        Some(Cyclic::Position(trajectory_point(Point { position: held, velocity, ..point })))
    }

    /// 60FFh, increments/s.
    fn velocity(&self, values: &Dictionary<impl Storage>) -> f64 {
        self.parameters.scales.increments_s(read(values, self.slots.target_velocity, 0))
    }

    fn velocity_offset(&self, values: &Dictionary<impl Storage>) -> f64 {
        self.parameters.scales.increments_s(read(values, self.slots.velocity_offset, 0))
    }

    /// 6071h and in the cyclic mode 60B2h, as a current.
    fn torque_a(&self, values: &Dictionary<impl Storage>) -> f32 {
        let cyclic = self.power.mode() == ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE;
        let offset = if cyclic { read(values, self.slots.torque_offset, 0) } else { 0 };
        let per_mille = read(values, self.slots.target_torque, 0) + offset;
        self.parameters.current_a(per_mille, &self.motor) * self.parameters.scales.direction() as f32
    }

    /// 60B2h in cyclic position and velocity, as a current: what the host knows to be needed beside the loops.
    pub(super) fn torque_offset_a(&self, values: &Dictionary<impl Storage>) -> f32 {
        let takes = [ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION, ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY];
        if !self.is_enabled() || !takes.contains(&self.power.mode()) {
            return 0.0;
        }
        let per_mille = read(values, self.slots.torque_offset, 0);
        self.parameters.current_a(per_mille, &self.motor) * self.parameters.scales.direction() as f32
    }

    /// A velocity held to the highest speed, and to what can still be stopped before a software limit.
    fn held_velocity(&mut self, wanted: f64, position: f64) -> f64 {
        let bounds = self.parameters.bounds;
        let mut held = wanted.clamp(-bounds.speed, bounds.speed);
        if let Some(travel) = self.parameters.travel {
            held = travel.hold_velocity(position, held, self.parameters.following.deceleration);
        }
        self.limited |= held != wanted;
        held
    }
}

/// A point of a plan as the axis has it: whole counts, which wrap, and a share.
fn trajectory_point(point: Point) -> TrajectoryPoint {
    let whole = libm::floor(point.position);
    TrajectoryPoint {
        position: whole as i64 as i32,
        fraction: point.position - whole,
        velocity: point.velocity,
        acceleration: point.acceleration,
    }
}
