//! Ramps of a stepper that nothing measures: what its load needs, beside what its motor can give.
//!
//! A rotor in an open loop stays in step while the torque that it needs is below the pull-out torque at its speed. What is needed
//! follows from the load and the ramp, an S of two parabolas of the speed, whose acceleration is a triangle:
//!
//! ```text
//! acceleration = 2 (v - u) / T (1 - |2 t / T - 1|)        needed = J acceleration + dry + viscous speed + |load|
//! ```
//!
//! The margin is the least quotient of both on the way. A motion begins at its start speed without a ramp: the rotor, at rest, falls
//! behind a field that turns away from it, and is caught if the field takes its energy relative to it before it has fallen behind
//! by more than the angle from which the torque no longer holds the load:
//!
//! ```text
//! J w² / 2 <= (holding (1 + cos d) - held (pi - d)) / teeth        sin d = held / holding
//! ```

use std::f64::consts::PI;

/// What a rotor turns, itself included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turned {
    /// Inertia of all that turns.
    pub inertia_kg_m2: f64,
    /// Dry friction.
    pub dry_nm: f64,
    /// Viscous friction.
    pub viscous_nm_s: f64,
    /// What pushes in one direction. Either direction of motion is to bear it.
    pub load_nm: f64,
}

/// An S-shaped change of the speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// Speed before, rad/s.
    pub from_rad_s: f64,
    /// Speed after, rad/s; the larger one.
    pub to_rad_s: f64,
    /// How long it takes.
    pub time_s: f64,
}

/// Points at which a ramp is looked at.
const POINTS: usize = 200;

impl Ramp {
    /// Speed, rad/s, and acceleration, rad/s², after this share of its time.
    pub fn at(&self, share: f64) -> (f64, f64) {
        let (change, rest) = (self.to_rad_s - self.from_rad_s, 1.0 - share);
        let gone = if share < 0.5 { 2.0 * share * share } else { 1.0 - 2.0 * rest * rest };
        (self.from_rad_s + change * gone, 4.0 * change * share.min(rest) / self.time_s)
    }
}

impl Turned {
    /// Torque that turns it.
    pub fn needed_nm(&self, speed_rad_s: f64, acceleration_rad_s2: f64) -> f64 {
        let friction_nm = self.dry_nm + self.viscous_nm_s * speed_rad_s.abs();
        self.inertia_kg_m2 * acceleration_rad_s2.abs() + friction_nm + self.load_nm.abs()
    }

    /// The same, so many times as large.
    #[must_use]
    pub fn times(&self, factor: f64) -> Self {
        Self {
            inertia_kg_m2: factor * self.inertia_kg_m2,
            dry_nm: factor * self.dry_nm,
            viscous_nm_s: factor * self.viscous_nm_s,
            load_nm: factor * self.load_nm,
        }
    }

    /// How many times what is needed there is on a ramp and at the speed after it, where this much is there by speed, in rad/s.
    pub fn margin(&self, ramp: &Ramp, available_nm: impl Fn(f64) -> f64) -> f64 {
        let points = (0..=POINTS).map(|n| ramp.at(n as f64 / POINTS as f64));
        let margins = points.map(|(speed, acceleration)| available_nm(speed) / self.needed_nm(speed, acceleration));
        margins.fold(f64::INFINITY, f64::min)
    }

    /// The highest speed with which a motion may begin without a ramp, rad/s: see the module. 0 where the load itself is not held.
    pub fn start_rad_s(&self, holding_nm: f64, teeth: u32) -> f64 {
        let held_nm = self.dry_nm + self.load_nm.abs();
        if held_nm >= holding_nm {
            return 0.0;
        }
        let lag = (held_nm / holding_nm).asin();
        let energy_j = (holding_nm * (1.0 + lag.cos()) - held_nm * (PI - lag)) / f64::from(teeth);
        (2.0 * energy_j.max(0.0) / self.inertia_kg_m2).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHEEL: Turned = Turned { inertia_kg_m2: 1e-5, dry_nm: 0.0, viscous_nm_s: 0.0, load_nm: 0.0 };

    #[test]
    fn a_ramp_is_two_parabolas_with_twice_the_mean_acceleration_in_the_middle() {
        let ramp = Ramp { from_rad_s: 10.0, to_rad_s: 110.0, time_s: 0.2 };
        // Mean 500 rad/s²; after a quarter 2 / 16 of the way, half the peak.
        assert_eq!(
            [0.0, 0.25, 0.5, 1.0].map(|share| ramp.at(share)),
            [(10.0, 0.0), (22.5, 500.0), (60.0, 1000.0), (110.0, 0.0)]
        );
        // 1e-5 * 1000 of 0.03.
        assert!((WHEEL.margin(&ramp, |_| 0.03) - 3.0).abs() < 1e-9);
        // Half of it where it is faster than in the middle: it needs next to 0.01 there.
        let falls = |speed: f64| if speed > 60.0 { 0.015 } else { 0.03 };
        assert!((WHEEL.margin(&ramp, falls) - 1.5).abs() < 0.03);
    }

    #[test]
    fn the_start_speed_is_that_of_the_energy_between_rest_and_the_unstable_point() {
        // Without a load `w = sqrt(4 holding / (teeth J))`.
        assert!((WHEEL.start_rad_s(0.2, 50) - (4.0 * 0.2 / (50.0 * 1e-5_f64)).sqrt()).abs() < 1e-9);
        let loaded = Turned { load_nm: -0.1, ..WHEEL };
        // By a rotor that is integrated, behind a field that starts: one of 0.99 of it is caught, one of 1.01 is not.
        let is_caught = |start_rad_s: f64| {
            let (mut lag, mut speed, dt_s) = (0.0_f64, start_rad_s, 1e-6);
            for _ in 0..100_000 {
                speed -= dt_s * (0.2 * (50.0 * lag).sin() - 0.1) / 1e-5;
                lag += dt_s * speed;
            }
            50.0 * lag < PI
        };
        let most = loaded.start_rad_s(0.2, 50);
        assert!(is_caught(0.99 * most) && !is_caught(1.01 * most), "{most}");
        assert_eq!(Turned { load_nm: 0.3, ..WHEEL }.start_rad_s(0.2, 50), 0.0);
    }
}
