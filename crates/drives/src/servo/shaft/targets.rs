//! What the modes that follow something at all times are given each period.

use canopen::od::{Dictionary, Storage};
use cia402::{Controlword, ModeOfOperation};
use motion::profile::Point;
use motion::set_points::{Following, Interpolation};

use super::{SUPERVISION_PERIOD_S, Shaft, TargetHold};
use crate::engine::axis::{Cyclic, Demand, Feedback, TrajectoryPoint};
use crate::engine::cia402::Targets;
use crate::servo::parameters::counter;
use crate::servo::{read, write};

const DT_S: f64 = SUPERVISION_PERIOD_S as f64;

impl Shaft {
    /// Targets from the objects, held to the limits.
    pub(super) fn read_targets(&mut self, values: &mut Dictionary<impl Storage>, feedback: &Feedback) {
        self.limited = false;
        self.travel_holds = false;
        let position = f64::from(feedback.position);
        let mode = self.power.mode();
        let cyclic = match mode {
            _ if !self.is_enabled() => {
                self.target_hold = TargetHold::None;
                self.follow_nothing(mode);
                None
            }
            ModeOfOperation::INTERPOLATED_POSITION if !self.power.controlword().has(Controlword::NEW_SET_POINT) => {
                self.follow_nothing(mode);
                None
            }
            ModeOfOperation::INTERPOLATED_POSITION => {
                self.take_waiting_set_point(values);
                self.cyclic_position(values)
            }
            ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION => self.cyclic_position(values),
            ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY => self.cyclic_velocity(values, feedback),
            ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE
            | ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE_WITH_COMMUTATION_ANGLE => self.cyclic_torque(values),
            _ => None,
        };
        let velocity = match mode {
            ModeOfOperation::PROFILE_VELOCITY => self.held_velocity(self.velocity(values), position),
            ModeOfOperation::VELOCITY => {
                let (wanted, limited) = self.velocity_mode_reference(values);
                let held = self.held_velocity(wanted, position);
                self.limited |= limited;
                held
            }
            _ => 0.0,
        };
        self.targets = Targets { velocity, current_a: self.torque_a(values), cyclic };
    }

    /// A set-point of the mode came: 607Ah in csp, 60FFh in csv, 6071h in cst, 60C1h in ip.
    pub(super) fn take_set_point(&mut self, values: &Dictionary<impl Storage>, by_rpdo: bool) {
        match self.power.mode() {
            ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY => {
                let from = self.servo.velocity_rad_s() / self.model.rad_per_count();
                let (target, following) = (self.velocity(values), self.following_straight());
                self.set_points.take(target, f64::from(from), false, by_rpdo, &following);
            }
            ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE
            | ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE_WITH_COMMUTATION_ANGLE => {
                let from = f64::from(self.servo.current_a());
                let (target, following) = (f64::from(self.torque_a(values)), self.following_straight());
                self.set_points.take(target, from, false, by_rpdo, &following);
            }
            ModeOfOperation::INTERPOLATED_POSITION => {
                let target = self.parameters.scales.increments(read(values, self.slots.interpolation_set_point, 0));
                if self.set_points.waiting.is_used() {
                    let place = read(values, self.slots.interpolation_buffer_position, 0);
                    let _ = self.set_points.waiting.put(counter(target), usize::try_from(place).unwrap_or(usize::MAX));
                } else if self.is_enabled() {
                    self.take_position(target, by_rpdo);
                }
            }
            _ => {
                let target = self.parameters.scales.increments(read(values, self.slots.target_position, 0));
                self.take_position(target, by_rpdo);
            }
        }
    }

    /// In a range of positions (607Bh) the path goes the short way round, in increments with the rounds of the counter.
    fn take_position(&mut self, target: i64, by_rpdo: bool) {
        let from = self.here();
        let wanted = match self.parameters.range {
            Some(range) => range.nearest(target as f64, from),
            None => target as f64,
        };
        let target = self.held_position(wanted);
        self.set_points.take(target, from, target != wanted, by_rpdo, &self.parameters.following);
    }

    /// In ip with a buffer, once a period: the next one that waits.
    fn take_waiting_set_point(&mut self, values: &mut Dictionary<impl Storage>) {
        if let Some(target) = self.set_points.take_waiting(DT_S, &self.parameters.following) {
            self.take_position(i64::from(target), false);
            self.publish_waiting(values);
        }
    }

    /// 60C4h:04 of a first-in-first-out buffer: how many set-points wait. That of a ring is the host's.
    pub(super) fn publish_waiting(&self, values: &mut Dictionary<impl Storage>) {
        if self.set_points.waiting.is_used() && self.set_points.waiting.is_first_in_first_out() {
            write(values, self.slots.interpolation_buffer_position, i64::from(self.set_points.waiting.count()));
        }
    }

    fn follow_nothing(&mut self, mode: ModeOfOperation) {
        // A set-point that came before the axis was enabled still holds in the cyclic modes: the host has aimed it.
        if mode == ModeOfOperation::INTERPOLATED_POSITION || self.power.is_live() {
            self.set_points.forget();
        }
    }

    fn cyclic_position(&mut self, values: &Dictionary<impl Storage>) -> Option<Cyclic> {
        let point = self.set_points.advance(DT_S, &self.parameters.following)?;
        let offset = self.parameters.scales.increments(read(values, self.slots.position_offset, 0));
        let at = point.position + offset as f64;
        let held = self.held_position(at);
        self.limited = held != at || self.set_points.is_held();
        let velocity = match self.velocity_offset(values) {
            0.0 => point.velocity,
            fed_forward => fed_forward,
        };
        Some(Cyclic::Position(trajectory_point(Point { position: held, velocity, ..point })))
    }

    fn cyclic_velocity(&mut self, values: &Dictionary<impl Storage>, feedback: &Feedback) -> Option<Cyclic> {
        let following = self.following_straight();
        let patience_s = self.parameters.set_point_patience_s;
        let wanted = self.set_points.advance_while_fed(DT_S, &following, patience_s)? + self.velocity_offset(values);
        let velocity = self.held_velocity(wanted, f64::from(feedback.position));
        Some(Cyclic::Velocity(TrajectoryPoint::moving(feedback.position, velocity)))
    }

    fn cyclic_torque(&mut self, values: &Dictionary<impl Storage>) -> Option<Cyclic> {
        let following = self.following_straight();
        let patience_s = self.parameters.set_point_patience_s;
        let target_a = self.set_points.advance_while_fed(DT_S, &following, patience_s)? as f32;
        Some(Cyclic::Torque(target_a + self.offset_a(values)))
    }

    /// How velocities and torques are followed: straight, whatever 60C0h says of positions, and at once without 60C2h.
    fn following_straight(&self) -> Following {
        let period_s = match self.slots.interpolation_period_value {
            Some(_) => self.parameters.following.period_s,
            None => 0.0,
        };
        Following { interpolation: Interpolation::Linear, period_s, ..self.parameters.following }
    }

    /// 6042h, increments/s, by the ramp's bits of the controlword; and whether 6046h limits it.
    fn velocity_mode_reference(&self, values: &Dictionary<impl Storage>) -> (f64, bool) {
        let output = self.power.axis().point().velocity;
        let target = read(values, self.slots.vl_target, 0);
        self.parameters.velocity_mode.reference(target, self.power.controlword(), output)
    }

    /// 60EAh in cstca, while a torque is followed: electrical turns, of which there are 65536 parts. A stop has the encoder's.
    pub(super) fn wanted_commutation(&self, values: &Dictionary<impl Storage>) -> Option<f32> {
        let in_mode = self.power.mode() == ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE_WITH_COMMUTATION_ANGLE;
        let follows = in_mode && matches!(self.demand, Demand::Torque(_)) && self.power.stop_cause().is_none();
        follows.then(|| read(values, self.slots.commutation_angle, 0) as u16 as f32 / 65_536.0)
    }

    /// 60FFh, increments/s.
    fn velocity(&self, values: &Dictionary<impl Storage>) -> f64 {
        self.parameters.scales.increments_s(read(values, self.slots.target_velocity, 0))
    }

    fn velocity_offset(&self, values: &Dictionary<impl Storage>) -> f64 {
        self.parameters.scales.increments_s(read(values, self.slots.velocity_offset, 0))
    }

    /// 6071h as a current.
    fn torque_a(&self, values: &Dictionary<impl Storage>) -> f32 {
        self.parameters.current_a(read(values, self.slots.target_torque, 0), &self.motor) * self.direction()
    }

    /// 60B2h as a current.
    fn offset_a(&self, values: &Dictionary<impl Storage>) -> f32 {
        self.parameters.current_a(read(values, self.slots.torque_offset, 0), &self.motor) * self.direction()
    }

    fn direction(&self) -> f32 {
        self.parameters.scales.direction() as f32
    }

    /// 60B2h in cyclic position and velocity, as a current: what the host knows to be needed beside the loops.
    pub(super) fn torque_offset_a(&self, values: &Dictionary<impl Storage>) -> f32 {
        let takes = [ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION, ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY];
        if self.is_enabled() && takes.contains(&self.power.mode()) { self.offset_a(values) } else { 0.0 }
    }

    /// A set-point held to the software limits, and to what the counter can show: its ends, and half of its round from here.
    fn held_position(&self, wanted: f64) -> f64 {
        let (here, most) = (self.here(), f64::from(i32::MAX));
        let within = self.parameters.travel.map_or(wanted, |travel| travel.hold(wanted));
        let least = f64::from(i32::MIN);
        let within = if self.parameters.range.is_some() { within } else { within.clamp(least, most) };
        within.clamp(here - most, here + most)
    }

    /// The position; in a range of positions with the rounds of the counter.
    fn here(&self) -> f64 {
        match self.parameters.range {
            Some(_) => self.whole_position as f64,
            None => f64::from(self.position()),
        }
    }

    /// A velocity held to the highest speed, and to what can still be stopped before a software limit.
    fn held_velocity(&mut self, wanted: f64, position: f64) -> f64 {
        let bounds = self.parameters.bounds;
        let mut held = wanted.clamp(-bounds.speed, bounds.speed);
        if let Some(travel) = self.parameters.travel {
            let stoppable = travel.hold_velocity(position, held, self.parameters.following.deceleration);
            self.travel_holds = stoppable != held;
            held = stoppable;
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
