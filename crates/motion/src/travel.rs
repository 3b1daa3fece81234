//! The travel that a motion may use, and the speeds and accelerations that it may have: software position limits (CiA
//! 402-2, object 607Dh), maximum profile velocity, acceleration and deceleration (607Fh, 60C5h, 60C6h).
//!
//! A limit is never run over: a motion towards it is slowed down so that it comes to rest there. Positions and speeds are
//! in the caller's unit.

use crate::profile::{Point, Profile};
use crate::trapezoid;

/// The positions between which the motion may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Travel {
    low: f64,
    high: f64,
}

impl Travel {
    /// Between two positions; `None` (no limits) unless the low one is below the high one.
    pub fn new(low: f64, high: f64) -> Option<Self> {
        (low < high).then_some(Self { low, high })
    }

    /// A target held to the travel.
    pub fn hold(&self, target: f64) -> f64 {
        target.clamp(self.low, self.high)
    }

    /// Whether a position is beyond a limit.
    pub fn is_beyond(&self, position: f64) -> bool {
        !(self.low..=self.high).contains(&position)
    }

    /// The way left from `position` in the direction of `velocity`; negative beyond the limit, infinite at rest.
    pub fn way_left(&self, position: f64, velocity: f64) -> f64 {
        if velocity > 0.0 {
            self.high - position
        } else if velocity < 0.0 {
            position - self.low
        } else {
            f64::INFINITY
        }
    }

    /// A velocity held to what can still be stopped before the limit: `v^2 = 2 a s`. Away from a limit it is free.
    pub fn hold_velocity(&self, position: f64, velocity: f64, deceleration: f64) -> f64 {
        // At rest the way left is infinite, and without a deceleration its product is not a number.
        if velocity == 0.0 {
            return velocity;
        }
        let way = self.way_left(position, velocity).max(0.0);
        let stoppable = libm::sqrt(2.0 * deceleration.max(0.0) * way);
        velocity.clamp(-stoppable, stoppable)
    }

    /// The plan that brings a motion to rest at the limit that it runs towards, when that needs `deceleration` or more from
    /// here on; its positions are relative to `point`. `None` while there is more way than that.
    ///
    /// A motion that is too fast for the way left is slowed down as fast as the way demands: it does not pass the limit.
    pub fn stop_before_limit(&self, point: Point, deceleration: f64) -> Option<Profile> {
        let Point { position, velocity, .. } = point;
        let way = self.way_left(position, velocity).max(0.0);
        let needed = 0.5 * velocity * velocity / way;
        (velocity != 0.0 && needed >= deceleration).then(|| {
            trapezoid::PositionMove {
                distance: way.copysign(velocity),
                velocity,
                max_speed: velocity.abs(),
                deceleration: if needed.is_finite() { needed } else { 0.0 },
                ..trapezoid::PositionMove::default()
            }
            .plan()
        })
    }
}

/// What a motion may do at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Units/s.
    pub speed: f64,
    /// Units/s², for speeding up.
    pub acceleration: f64,
    /// Units/s², for slowing down.
    pub deceleration: f64,
}

impl Bounds {
    /// None at all.
    pub const NONE: Self = Self { speed: f64::INFINITY, acceleration: f64::INFINITY, deceleration: f64::INFINITY };

    /// The velocity towards `wanted` that may be had `dt_s` after `velocity`: held to the speed, and reached no faster than
    /// the accelerations allow. A reversal slows down to zero first and speeds up in what is left of the time.
    pub fn hold_velocity(&self, velocity: f64, wanted: f64, dt_s: f64) -> f64 {
        let wanted = wanted.clamp(-self.speed, self.speed);
        let speeds_up = wanted.abs() > velocity.abs() && wanted * velocity >= 0.0;
        if speeds_up {
            let most = velocity.abs() + self.acceleration * dt_s;
            return wanted.abs().min(most).copysign(wanted);
        }
        let slowest = (velocity.abs() - self.deceleration * dt_s).max(0.0);
        if wanted * velocity > 0.0 || slowest > 0.0 {
            return if wanted * velocity > 0.0 { wanted.abs().max(slowest) } else { slowest }.copysign(velocity);
        }
        let left_s = dt_s - if self.deceleration > 0.0 { velocity.abs() / self.deceleration } else { 0.0 };
        wanted.abs().min(self.acceleration * left_s.max(0.0)).copysign(wanted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(left: f64, right: f64) -> bool {
        (left - right).abs() < 1e-9 * (1.0 + right.abs())
    }

    #[test]
    fn limits_the_wrong_way_round_are_none() {
        assert_eq!(Travel::new(1.0, 1.0), None);
        assert_eq!(Travel::new(2.0, 1.0), None);
        assert_eq!(Travel::new(f64::NAN, 1.0), None);
        let travel = Travel::new(-10.0, 20.0).unwrap();
        assert_eq!([-11.0, 5.0, 21.0].map(|target| travel.hold(target)), [-10.0, 5.0, 20.0]);
        assert_eq!([-10.0, 20.0, 20.1].map(|position| travel.is_beyond(position)), [false, false, true]);
    }

    #[test]
    fn the_stop_begins_where_the_deceleration_is_just_enough_and_ends_at_the_limit() {
        let travel = Travel::new(0.0, 100.0).unwrap();
        // From 40 units/s at 20 units/s^2 the stop takes 40 units and 2 s.
        let moving = |position| Point { position, velocity: 40.0, acceleration: 0.0 };
        assert_eq!(travel.stop_before_limit(moving(59.9), 20.0), None);
        let plan = travel.stop_before_limit(moving(60.0), 20.0).unwrap();
        assert!(close(plan.duration(), 2.0) && close(plan.end().position, 40.0));
        assert!(close(plan.at(1.0).position, 30.0) && close(plan.at(1.0).velocity, 20.0));
        let back = Point { position: 40.0, velocity: -40.0, acceleration: 0.0 };
        assert!(close(travel.stop_before_limit(back, 20.0).unwrap().end().position, -40.0));
    }

    #[test]
    fn too_little_way_is_braked_harder_and_none_at_once() {
        let travel = Travel::new(0.0, 100.0).unwrap();
        let plan = travel.stop_before_limit(Point { position: 90.0, velocity: 40.0, acceleration: 0.0 }, 20.0).unwrap();
        assert!(close(plan.end().position, 10.0) && close(plan.duration(), 0.5), "2 s / v");
        for position in [100.0, 130.0] {
            let plan = travel.stop_before_limit(Point { position, velocity: 40.0, acceleration: 0.0 }, 20.0).unwrap();
            assert_eq!((plan.duration(), plan.end().position), (0.0, 0.0));
        }
        assert_eq!(travel.stop_before_limit(Point { position: 130.0, velocity: -40.0, acceleration: 0.0 }, 20.0), None);
        assert_eq!(travel.stop_before_limit(Point { position: 130.0, ..Point::default() }, 20.0), None);
    }

    #[test]
    fn a_velocity_is_held_to_what_can_be_stopped() {
        let travel = Travel::new(0.0, 100.0).unwrap();
        assert!(close(travel.hold_velocity(60.0, 99.0, 20.0), 40.0));
        assert!(close(travel.hold_velocity(60.0, 30.0, 20.0), 30.0));
        assert_eq!(travel.hold_velocity(100.0, 5.0, 20.0), 0.0);
        assert_eq!(travel.hold_velocity(120.0, 5.0, 20.0), 0.0);
        assert_eq!(travel.hold_velocity(120.0, -7.0, 20.0), -7.0, "back is free");
    }

    #[test]
    fn bounds_hold_speed_and_both_accelerations() {
        let bounds = Bounds { speed: 100.0, acceleration: 10.0, deceleration: 20.0 };
        assert_eq!(bounds.hold_velocity(0.0, 500.0, 1.0), 10.0);
        assert_eq!(bounds.hold_velocity(95.0, 500.0, 1.0), 100.0);
        assert_eq!(bounds.hold_velocity(50.0, 0.0, 1.0), 30.0);
        assert_eq!(bounds.hold_velocity(50.0, 45.0, 1.0), 45.0);
        assert_eq!(bounds.hold_velocity(-50.0, 500.0, 1.0), -30.0);
        // 10 at 20 units/s^2 are gone in half a second; the other half speeds up to 5.
        assert_eq!(bounds.hold_velocity(-10.0, 500.0, 1.0), 5.0);
        assert_eq!(bounds.hold_velocity(-10.0, 2.0, 1.0), 2.0);
        assert_eq!(Bounds::NONE.hold_velocity(-10.0, 2000.0, 1e-3), 2000.0);
        assert_eq!(Bounds::NONE.hold_velocity(10.0, 0.0, 1e-3), 0.0);
    }
}
