//! Friction from currents at steady speeds.
//!
//! ```text
//! current = dry sign(speed) + viscous speed + load
//! ```
//!
//! The load (a weight, a slope) has one sign; it is what is left when both directions are looked at.

use crate::least_squares::solve;
use crate::samples::Unusable;

/// How many times the slowest speed the fastest has to be.
const LEAST_SPREAD: f64 = 1.5;

/// One steady speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyRun {
    /// Mean speed of the motor's shaft, signed, rad/s.
    pub speed_rad_s: f64,
    /// Mean current meanwhile, signed, A.
    pub current_a: f64,
}

/// What a shaft takes to turn steadily, as currents. Times the torque constant they are torques.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Friction {
    /// Against any motion, A.
    pub dry_a: f64,
    /// Per speed, A/(rad/s).
    pub viscous_a_s_rad: f64,
    /// Of one direction, A: positive where it opposes positive motion.
    pub load_a: f64,
    /// The most that a run is off from this, A.
    pub off_a: f64,
}

/// The friction that explains steady runs best, in the sense of least squares.
///
/// # Errors
/// [`Unusable::TooFewSpeeds`], [`Unusable::NotFinite`].
pub fn fit_friction(runs: &[SteadyRun]) -> Result<Friction, Unusable> {
    for (at, run) in runs.iter().enumerate() {
        for (signal, value) in [("the speed", run.speed_rad_s), ("the current", run.current_a)] {
            if !value.is_finite() {
                return Err(Unusable::NotFinite { signal, at, value });
            }
        }
    }
    let turning = || runs.iter().filter(|run| run.speed_rad_s != 0.0);
    let usable = Unusable::TooFewSpeeds(turning().count());
    let forward = turning().filter(|run| run.speed_rad_s > 0.0).count();
    let speeds = || turning().map(|run| run.speed_rad_s.abs());
    let is_spread = speeds().fold(0.0, f64::max) >= LEAST_SPREAD * speeds().fold(f64::INFINITY, f64::min);
    if turning().count() < 3 || forward == 0 || forward == turning().count() || !is_spread {
        return Err(usable);
    }
    let terms = |run: &SteadyRun| [run.speed_rad_s.signum(), run.speed_rad_s, 1.0];
    let (mut matrix, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
    for run in turning() {
        let terms = terms(run);
        for (i, term) in terms.iter().enumerate() {
            right[i] += term * run.current_a;
            for (j, other) in terms.iter().enumerate() {
                matrix[i][j] += term * other;
            }
        }
    }
    // One speed in each direction does not distinguish dry friction from viscous.
    let [dry_a, viscous_a_s_rad, load_a] = solve(matrix, right).ok_or(usable)?;
    let off = |run: &SteadyRun| {
        let [sign, speed, one] = terms(run);
        (run.current_a - dry_a * sign - viscous_a_s_rad * speed - load_a * one).abs()
    };
    Ok(Friction { dry_a, viscous_a_s_rad, load_a, off_a: turning().map(off).fold(0.0, f64::max) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_each_way_is_found_with_its_load() {
        let run = |speed_rad_s: f64| SteadyRun {
            speed_rad_s,
            current_a: 0.3 * speed_rad_s.signum() + 0.02 * speed_rad_s - 0.1,
        };
        let found = fit_friction(&[2.0, 8.0, -2.0, -8.0].map(run)).unwrap();
        assert!((found.dry_a - 0.3).abs() < 1e-12 && (found.viscous_a_s_rad - 0.02).abs() < 1e-12, "{found:?}");
        assert!((found.load_a + 0.1).abs() < 1e-12 && found.off_a < 1e-12, "{found:?}");
    }

    #[test]
    fn one_direction_one_speed_or_no_number_is_refused() {
        let run = |speed_rad_s: f64| SteadyRun { speed_rad_s, current_a: 1.0 };
        assert_eq!(fit_friction(&[1.0, 2.0, 3.0].map(run)), Err(Unusable::TooFewSpeeds(3)));
        assert_eq!(fit_friction(&[2.0, 0.0, -2.0].map(run)), Err(Unusable::TooFewSpeeds(2)));
        assert!(matches!(fit_friction(&[run(f64::NAN)]), Err(Unusable::NotFinite { at: 0, .. })));
    }
}
