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

/// State: what the observer believes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tracking {
    position: i32,
    fraction: f32,
    velocity: f32,
    acceleration: f32,
}

/// An error beyond this many counts is no noise: the observer starts over there.
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
