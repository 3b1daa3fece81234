//! Tracking observer: velocity from an encoder as a filter of third order that follows the position.
//!
//! ```text
//! e = position - p        dp/dt = v + l1 e        dv/dt = a + l2 e        da/dt = l3 e
//! ```
//!
//! With `l = (3w, 3w², w³)` its three poles lie at `w`; with `l3 = 0` it is of second order.

/// How the observer is set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrackingGains {
    /// Correction of the position, 1/s.
    pub position_per_s: f32,
    /// Correction of the velocity, 1/s².
    pub velocity_per_s2: f32,
    /// Correction of the acceleration, 1/s³.
    pub acceleration_per_s3: f32,
}

impl TrackingGains {
    /// Whether an observer with these follows at all when it is updated so often: Jury's criterion for its error,
    ///
    /// ```text
    /// w³ + (L1 + L2 + L3) w² + (L2 + 2 L3) w + L3 = 0        w = z - 1        Ln = ln dt^n
    /// ```
    pub fn follow(&self, dt_s: f32) -> bool {
        let first = self.position_per_s * dt_s;
        let second = self.velocity_per_s2 * dt_s * dt_s;
        let third = self.acceleration_per_s3 * dt_s * dt_s * dt_s;
        if !(first > 0.0 && first < 2.0 && second > 0.0 && third >= 0.0) {
            return false;
        }
        if third == 0.0 {
            return 4.0 - 2.0 * first - second > 0.0;
        }
        let sum = first + second + third;
        let (quadratic, linear, constant) = (sum - 3.0, 3.0 - 2.0 * sum + second + 2.0 * third, first - 1.0);
        8.0 - 4.0 * first - 2.0 * second - third > 0.0
            && 1.0 - constant * constant > (constant * quadratic - linear).abs()
    }
}

/// State: what the observer believes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tracking {
    position: i32,
    fraction: f32,
    velocity: f32,
    acceleration: f32,
}

/// An error beyond this many counts is not noise: the observer starts over there.
const LOST: f32 = 10_000.0;

impl Tracking {
    /// At rest at a position.
    pub fn resting(position: i32) -> Self {
        Self { position, ..Self::default() }
    }

    /// Takes in the position in counts and returns the velocity in counts/s.
    pub fn update(&mut self, gains: &TrackingGains, position: i32, dt_s: f32) -> f32 {
        let error = position.wrapping_sub(self.position) as f32 - self.fraction;
        if !(error.abs() < LOST && self.velocity.is_finite()) {
            *self = Self::resting(position);
            return 0.0;
        }
        self.acceleration += gains.acceleration_per_s3 * error * dt_s;
        self.velocity += (self.acceleration + gains.velocity_per_s2 * error) * dt_s;
        self.fraction += (self.velocity + gains.position_per_s * error) * dt_s;
        let whole = libm::floorf(self.fraction);
        self.position = self.position.wrapping_add(whole as i32);
        self.fraction -= whole;
        self.velocity
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_observer_that_is_said_to_follow_does_and_another_does_not() {
        const DT_S: f32 = 0.5e-3;
        // Third order near 300 rad/s, second order, each coefficient alone, and what is too much for the period.
        let near = |share: f32| TrackingGains {
            position_per_s: 900.0 * share,
            velocity_per_s2: 0.27e6 * share * share,
            acceleration_per_s3: 27e6 * share * share * share,
        };
        let second = TrackingGains { acceleration_per_s3: 0.0, ..near(1.0) };
        let only_first = TrackingGains { velocity_per_s2: 0.0, ..second };
        let only_second = TrackingGains { position_per_s: 0.0, ..second };
        let undamped = TrackingGains { position_per_s: 90.0, ..near(1.0) };
        for (gains, follows) in [
            (TrackingGains::default(), false),
            (near(1.0), true),
            (near(0.3), true),
            (near(10.0), false),
            (second, true),
            (only_first, false),
            (only_second, false),
            (undamped, false),
        ] {
            assert_eq!(gains.follow(DT_S), follows, "{gains:?}");
            let mut tracking = Tracking::resting(0);
            let mut velocity = 0.0;
            // 2000 counts/s.
            (0..20_000).for_each(|period| velocity = tracking.update(&gains, period, DT_S));
            assert_eq!((velocity - 2000.0).abs() < 20.0, follows, "{gains:?}: {velocity} counts/s");
        }
    }

    #[test]
    fn follows_a_steady_velocity_without_error() {
        let w = 300.0_f32;
        let gains =
            TrackingGains { position_per_s: 3.0 * w, velocity_per_s2: 3.0 * w * w, acceleration_per_s3: w * w * w };
        let mut tracking = Tracking::resting(0);
        let mut velocity = 0.0;
        for period in 0..2000 {
            velocity = tracking.update(&gains, period * 5, 0.5e-3);
        }
        assert!((velocity - 10_000.0).abs() < 5.0, "{velocity}");
    }

    #[test]
    fn wild_gains_and_jumps_start_it_over_instead_of_breaking_it() {
        let gains = TrackingGains { position_per_s: 30e3, velocity_per_s2: 2.25e7, acceleration_per_s3: 2.25e9 };
        let mut tracking = Tracking::resting(0);
        for period in 0..10_000_i32 {
            let position = if period % 100 == 0 { i32::MIN } else { period };
            assert!(tracking.update(&gains, position, 0.5e-3).is_finite());
        }
    }
}
