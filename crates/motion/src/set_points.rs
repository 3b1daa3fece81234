//! A path through set-points that arrive one a period: csp, csv, cst and ip (CiA 402-2; period: object 60C2h).
//!
//! Each [`SetPoints::push`] plans from where the path is to the new set-point, which is reached one period later
//! ([`Interpolation::Linear`]) or two ([`Interpolation::Cubic`]). [`SetPoints::at`] is the plan: any time after the last set-point.
//!
//! A set-point that does not come leaves the path going on as it last went, for as many periods as are forgiven; then it slows
//! down, and comes back to rest on the last set-point. The standard leaves this to makers; going on is what keeps a single lost
//! frame from being a jerk, and only the last set-point is where the host has said to be.
//! Only a path whose last two set-points came in time goes on so: one that is written once, or comes in a bunch, is reached
//! and held, for what its velocity says is not the host's. A set-point that comes late starts its period when it comes, from
//! where the path is by then.

use crate::interpolate::{cubic, linear};
use crate::profile::Point;
use crate::trapezoid::PositionMove;

/// How the path runs from set-point to set-point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Interpolation {
    /// Straight; velocity steps at each set-point.
    #[default]
    Linear,
    /// A cubic with continuous velocity, one period later than straight.
    Cubic,
}

/// How set-points are followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Following {
    /// Straight or cubic.
    pub interpolation: Interpolation,
    /// Time from one set-point to the next, s; 0 goes to each at once.
    pub period_s: f64,
    /// Periods without a set-point that the path goes on for.
    pub forgiven: f64,
    /// How the path then slows down and comes back, units/s²; 0 turns round at once.
    pub deceleration: f64,
}

/// The last set-points, oldest first, and the plan from them. Time is counted from the last push.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetPoints {
    /// Where the plan's period began, its end, and for the cubic the neighbours on either side.
    before: f64,
    from: f64,
    to: f64,
    after: f64,
    /// The last set-point came in time,
    in_time: bool,
    /// and so did the one before.
    steady: bool,
}

impl SetPoints {
    /// At rest.
    pub const fn resting(position: f64) -> Self {
        Self { before: position, from: position, to: position, after: position, in_time: false, steady: false }
    }

    /// The next set-point came `age_s` after the last one; infinite for the first.
    pub fn push(&mut self, target: f64, age_s: f64, following: &Following) {
        let in_time = self.is_in_time(age_s, following);
        let steady = in_time && self.in_time;
        match following.interpolation {
            Interpolation::Linear => {
                let here = self.at(age_s, following).position;
                *self = Self { before: self.from, from: here, to: target, after: target, in_time, steady };
            }
            Interpolation::Cubic if in_time => {
                *self = Self { before: self.from, from: self.to, to: self.after, after: target, in_time, steady };
            }
            // Late: the path has left its set-points, and starts over from where and as fast as it goes.
            Interpolation::Cubic => {
                let Point { position, velocity, .. } = self.at(age_s, following);
                let step = velocity * following.period_s;
                // With these neighbours the slope at the start is `velocity`: (to - before) / 2 = step.
                let to = 0.5 * (position + target);
                *self = Self { before: to - 2.0 * step, from: position, to, after: target, in_time, steady };
            }
        }
    }

    /// Where the path is `age_s` after the last set-point.
    pub fn at(&self, age_s: f64, following: &Following) -> Point {
        let period_s = following.period_s;
        if age_s <= period_s {
            return self.within(age_s, following);
        }
        let end = self.within(period_s, following);
        if !self.steady {
            return self.catching_up(end, age_s, following);
        }
        let free_s = following.forgiven.max(0.0) * period_s;
        let over_s = age_s - period_s;
        if over_s < free_s {
            return Point { position: end.position + end.velocity * over_s, velocity: end.velocity, acceleration: 0.0 };
        }
        let position = end.position + end.velocity * free_s;
        self.coming_back(Point { position, ..end }, over_s - free_s, following.deceleration)
    }

    /// The last two set-points came in time, one a period.
    pub const fn is_steady(&self) -> bool {
        self.steady
    }

    /// Where the path leads to without another set-point, up to the end of its period.
    pub const fn target(&self) -> f64 {
        self.after
    }

    /// All positions move by this much: the zero has moved.
    pub fn shift(&mut self, by: f64) {
        for position in [&mut self.before, &mut self.from, &mut self.to, &mut self.after] {
            *position -= by;
        }
    }

    /// After the period of a path that does not go on: at its end, which for the cubic is one period further.
    fn catching_up(&self, end: Point, age_s: f64, following: &Following) -> Point {
        match following.interpolation {
            Interpolation::Cubic if age_s < 2.0 * following.period_s => {
                linear(end.position, self.after, following.period_s, age_s - following.period_s)
            }
            Interpolation::Cubic | Interpolation::Linear => Point { position: self.after, ..Point::default() },
        }
    }

    /// `time_s` after the path, at `from` by then, was given up: on the way to rest on the last set-point.
    fn coming_back(&self, from: Point, time_s: f64, deceleration: f64) -> Point {
        let at_rest = Point { position: self.after, ..Point::default() };
        if from.velocity == 0.0 && from.position == self.after {
            return at_rest;
        }
        let way = PositionMove {
            distance: self.after - from.position,
            velocity: from.velocity,
            max_speed: from.velocity.abs(),
            acceleration: deceleration,
            deceleration,
            ..PositionMove::default()
        }
        .plan();
        if time_s >= way.duration() {
            return at_rest;
        }
        let point = way.at(time_s);
        Point { position: from.position + point.position, ..point }
    }

    fn within(&self, age_s: f64, following: &Following) -> Point {
        let period_s = following.period_s;
        match following.interpolation {
            Interpolation::Linear => linear(self.from, self.to, period_s, age_s),
            Interpolation::Cubic => cubic(self.before, self.from, self.to, self.after, period_s, age_s),
        }
    }

    /// Within half a period of when it was to come: jitter of the bus does not count as late.
    fn is_in_time(&self, age_s: f64, following: &Following) -> bool {
        (age_s - following.period_s).abs() <= 0.5 * following.period_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 2e-3;
    const LINEAR: Following =
        Following { interpolation: Interpolation::Linear, period_s: PERIOD_S, forgiven: 2.0, deceleration: 50_000.0 };
    const CUBIC: Following = Following { interpolation: Interpolation::Cubic, ..LINEAR };

    fn close(left: f64, right: f64) -> bool {
        (left - right).abs() < 1e-9 * (1.0 + right.abs())
    }

    #[test]
    fn a_straight_path_is_at_each_set_point_one_period_after_it_came() {
        let mut path = SetPoints::resting(0.0);
        for (step, target) in [3.0, 8.0, 2.0, 2.0].into_iter().enumerate() {
            let from = path.target();
            path.push(target, if step == 0 { 1.0 } else { PERIOD_S }, &LINEAR);
            let half = path.at(0.5 * PERIOD_S, &LINEAR);
            assert!(close(half.position, 0.5 * (from + target)));
            assert!(close(half.velocity, (target - from) / PERIOD_S));
            assert!(close(path.at(PERIOD_S, &LINEAR).position, target));
        }
    }

    #[test]
    fn a_cubic_path_follows_a_parabola_exactly_two_periods_late() {
        let sample = |k: i32| {
            let t = f64::from(k) * PERIOD_S;
            4.0 + 300.0 * t + 7000.0 * t * t
        };
        let mut path = SetPoints::resting(sample(0));
        for k in 1..=3 {
            path.push(sample(k), PERIOD_S, &CUBIC);
        }
        for k in 4..20 {
            path.push(sample(k), PERIOD_S, &CUBIC);
            let t = (f64::from(k) - 2.0 + 0.25) * PERIOD_S;
            let point = path.at(0.25 * PERIOD_S, &CUBIC);
            assert!(close(point.position, 4.0 + 300.0 * t + 7000.0 * t * t), "{k}");
            assert!(close(point.velocity, 300.0 + 14_000.0 * t), "{k}");
        }
    }

    #[test]
    fn a_missed_set_point_is_bridged_at_the_last_velocity() {
        let mut path = SetPoints::resting(0.0);
        path.push(2.0, PERIOD_S, &LINEAR);
        path.push(4.0, PERIOD_S, &LINEAR);
        // 1000 units/s: half a period and one and a half periods beyond the set-point.
        assert!(close(path.at(1.5 * PERIOD_S, &LINEAR).position, 5.0));
        assert!(close(path.at(2.5 * PERIOD_S, &LINEAR).position, 7.0));
        // The next one comes when it should have been the next but one: no jump, and on as before.
        path.push(8.0, 2.0 * PERIOD_S, &LINEAR);
        assert!(close(path.at(0.0, &LINEAR).position, 6.0));
        assert!(close(path.at(0.0, &LINEAR).velocity, 1000.0));
    }

    #[test]
    fn beyond_what_is_forgiven_the_path_slows_down_and_comes_back_to_the_last_set_point() {
        let mut path = SetPoints::resting(0.0);
        path.push(0.0, PERIOD_S, &LINEAR);
        path.push(2.0, PERIOD_S, &LINEAR);
        // On at 1000 units/s for two periods to 6, then 1000 / 50000 = 20 ms and 1000^2 / (2 * 50000) = 10 units more.
        let middle = path.at(3.0 * PERIOD_S + 0.010, &LINEAR);
        assert!(close(middle.velocity, 500.0) && close(middle.position, 6.0 + 7.5));
        let turn = path.at(3.0 * PERIOD_S + 0.020, &LINEAR);
        assert!(close(turn.position, 16.0) && turn.velocity.abs() < 1e-6);
        // 14 units back, half of them up and half of them down: sqrt(14 / 50000) each.
        let back_s = (14.0_f64 / 50_000.0).sqrt();
        let half_way = path.at(3.0 * PERIOD_S + 0.020 + back_s, &LINEAR);
        assert!(close(half_way.position, 9.0) && close(half_way.velocity, -50_000.0 * back_s));
        for age_s in [3.0 * PERIOD_S + 0.020 + 2.0 * back_s + 1e-9, 1.0, 1e6] {
            assert_eq!(path.at(age_s, &LINEAR), Point { position: 2.0, ..Point::default() }, "{age_s}");
        }
        let strict = Following { forgiven: 0.0, deceleration: 0.0, ..LINEAR };
        assert_eq!(path.at(PERIOD_S * 1.01, &strict), Point { position: 2.0, ..Point::default() });
    }

    #[test]
    fn a_stream_that_ends_at_any_speed_comes_to_rest_on_its_last_set_point_without_a_jump() {
        for following in [LINEAR, CUBIC] {
            for (period_s, step) in [(1e-3, 7.0), (2e-3, -3.0), (4e-3, 0.01), (10e-3, 500.0), (10e-3, 0.0)] {
                let following = Following { period_s, ..following };
                let mut path = SetPoints::resting(0.0);
                for k in 1..=10 {
                    path.push(step * f64::from(k), period_s, &following);
                }
                let mut before = path.at(0.0, &following).position;
                let most = 2.0 * (step / period_s).abs() * 1e-4 + 1e-9;
                for tick in 1..100_000 {
                    let now = path.at(f64::from(tick) * 1e-4, &following).position;
                    assert!((now - before).abs() <= most, "{following:?} {step}: {before} {now}");
                    before = now;
                }
                assert_eq!(path.at(10.0, &following), Point { position: 10.0 * step, ..Point::default() });
            }
        }
    }

    #[test]
    fn a_set_point_that_comes_alone_or_in_a_bunch_is_reached_and_held() {
        for following in [LINEAR, CUBIC] {
            let mut path = SetPoints::resting(0.0);
            path.push(100.0, f64::INFINITY, &following);
            for age_s in [2.0, 3.0, 10.0, 1e6] {
                let point = path.at(age_s * PERIOD_S, &following);
                assert_eq!((point.position, point.velocity), (100.0, 0.0), "{following:?} after {age_s} periods");
            }
        }
        // Five at once, again and again: the path never leaves what was asked for.
        let mut path = SetPoints::resting(0.0);
        let mut target = 0.0;
        for _ in 0..20 {
            for _ in 0..5 {
                target += 1.0;
                path.push(target, 0.1 * PERIOD_S, &LINEAR);
            }
            for step in 0..50_u8 {
                let point = path.at(f64::from(step) * 0.1 * PERIOD_S, &LINEAR);
                assert!(
                    point.position <= target && (step < 10 || point.position == target),
                    "{} {target}",
                    point.position
                );
            }
        }
    }

    #[test]
    fn a_late_set_point_makes_no_jump_on_either_course() {
        for following in [LINEAR, CUBIC] {
            let mut path = SetPoints::resting(0.0);
            for k in 1..=5 {
                path.push(f64::from(k), PERIOD_S, &following);
            }
            let before = path.at(2.2 * PERIOD_S, &following);
            path.push(9.0, 2.2 * PERIOD_S, &following);
            let after = path.at(0.0, &following);
            assert!(close(before.position, after.position), "{following:?}");
            if following.interpolation == Interpolation::Cubic {
                assert!(close(before.velocity, after.velocity));
            }
        }
    }

    #[test]
    fn no_period_goes_to_each_set_point_at_once() {
        let following = Following { period_s: 0.0, ..LINEAR };
        let mut path = SetPoints::resting(1.0);
        path.push(5.0, 0.1, &following);
        assert_eq!(path.at(0.0, &following), Point { position: 5.0, ..Point::default() });
        assert_eq!(path.at(1.0, &following), Point { position: 5.0, ..Point::default() });
    }

    #[test]
    fn a_moved_zero_moves_the_numbers_and_not_the_path() {
        let mut path = SetPoints::resting(10.0);
        path.push(12.0, PERIOD_S, &CUBIC);
        path.push(15.0, PERIOD_S, &CUBIC);
        let before = path.at(0.3 * PERIOD_S, &CUBIC);
        path.shift(100.0);
        let after = path.at(0.3 * PERIOD_S, &CUBIC);
        assert!(close(before.position - 100.0, after.position) && close(before.velocity, after.velocity));
    }
}
