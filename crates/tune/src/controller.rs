//! The speed loop that a drive has, from the same samples as its shaft.
//!
//! ```text
//! current = (proportional + integral / s) (set-point exp(-s asked_late) - speed exp(-s seen_late) / (1 + s filter))
//! ```
//!
//! So what one count of a gain is worth is measured, and not taken from a manual that does not say it.

use rustfft::num_complex::Complex;

use crate::least_squares::fit;
use crate::mechanics::Mechanics;
use crate::response::{DEVIATION, Line, Response, held};
use crate::samples::Unusable;

/// A set-point takes effect a whole number of samples after it was given, where it is found to within this share of one.
const WHOLE: f64 = 0.15;

/// A speed loop: gains, and what comes late in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loop {
    /// A/(rad/s).
    pub proportional: f64,
    /// A/rad.
    pub integral: f64,
    /// Time constant of the filter of the measured speed.
    pub filter_s: f64,
    /// How late a set-point takes effect, from the sample at which it was given.
    pub asked_late_s: f64,
    /// How late the speed is seen in the current, the filter apart.
    pub seen_late_s: f64,
    /// Root mean square of the relative differences from what was measured of current and speed; of less coherent lines they count less.
    pub off: f64,
}

impl Loop {
    /// Current per error, A/(rad/s).
    pub fn controller(&self, omega: f64) -> Complex<f64> {
        self.proportional + self.integral / Complex::new(0.0, omega)
    }

    /// What becomes of the speed before it is compared.
    pub fn feedback(&self, omega: f64) -> Complex<f64> {
        Complex::from_polar(1.0, -omega * self.seen_late_s) / Complex::new(1.0, omega * self.filter_s)
    }
}

/// The loop behind a response, around the shaft that was found in it. `filter_s` is what the drive's own filter of its speed is set to.
///
/// How the current follows the set-point and the speed shows the gains. How late the speed is seen hardly appears in it where few samples
/// are taken: that is found by how the speed follows the set-point.
///
/// # Errors
/// [`Unusable::Incoherent`], also where the set-point is not known.
pub fn identify_loop(response: &Response, mechanics: &Mechanics, filter_s: f64) -> Result<Loop, Unusable> {
    response.check()?;
    let lines: Vec<_> = response.coherent().filter(|line| line.drive.is_finite()).collect();
    if lines.is_empty() {
        return Err(Unusable::Constant { signal: "the set-point" });
    }
    let of = |[proportional, integral, asked, seen]: [f64; 4]| Loop {
        proportional: proportional.exp(),
        integral: integral.exp(),
        filter_s,
        asked_late_s: asked * 1e-3,
        seen_late_s: seen * 1e-3,
        off: 0.0,
    };
    let asked = |it: &Loop, omega: f64| Complex::from_polar(1.0, -omega * it.asked_late_s);
    // At high frequencies nothing comes back: the current is the set-point's.
    let highest = lines[lines.len() - 1].drive.norm().max(1e-12);
    let by_current = |it: &Loop, line: &Line| {
        let omega = line.omega();
        let current = it.controller(omega) * (asked(it, omega) - it.feedback(omega) * line.closed);
        // Where the loop is stiff hardly any current is seen, and the model's own error is as large.
        let off = (current - line.drive) / (line.drive.norm() + 0.5 * highest);
        [off.re, off.im]
    };
    let by_speed = |it: &Loop, line: &Line| {
        let omega = line.omega();
        let forward = it.controller(omega) * mechanics.response(omega);
        let closed = forward * asked(it, omega) / (1.0 + forward * it.feedback(omega));
        let off = held(0.5 * omega * response.sample_s) * closed / line.closed;
        [off.norm().max(1e-300).ln(), off.arg()].map(|off| off * DEVIATION / line.deviation(response.averages))
    };
    let period_ms = response.sample_s * 1e3;
    let mut free = [highest.ln(), (highest * 10.0).ln(), period_ms, period_ms];
    fit(&mut free, |parameters, into| {
        into.clear();
        into.extend(lines.iter().flat_map(|line| by_current(&of(*parameters), line)));
    });
    let by_both = |it: Loop, into: &mut Vec<f64>| {
        into.clear();
        into.extend(lines.iter().flat_map(|line| by_current(&it, line).into_iter().chain(by_speed(&it, line))));
    };
    let periods = free[2] / period_ms;
    let (it, sum) = if (periods - periods.round()).abs() < WHOLE {
        let late = periods.round() * period_ms;
        let with = |[proportional, integral, seen]: [f64; 3]| of([proportional, integral, late, seen]);
        let mut three = [free[0], free[1], free[3]];
        let sum = fit(&mut three, |parameters, into| by_both(with(*parameters), into));
        (with(three), sum)
    } else {
        let sum = fit(&mut free, |parameters, into| by_both(of(*parameters), into));
        (of(free), sum)
    };
    Ok(Loop { off: (sum / (2 * lines.len()) as f64).sqrt(), ..it })
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHEEL: Mechanics = Mechanics { gain: 12.0, viscous_per_s: 0.2, elastic: None, delay_s: -1e-3, off: 0.0 };
    const TRUTH: Loop =
        Loop { proportional: 2.4, integral: 19.0, filter_s: 1e-3, asked_late_s: 15e-3, seen_late_s: 2e-3, off: 0.0 };

    /// What is measured of this loop each 5 ms, up to 25 Hz, with a relative error of each line: of current and speed, which the loop
    /// carries from one to the other.
    fn measured(truth: &Loop, error: f64, seed: u64) -> Response {
        let mut state = seed;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let sample_s = 5e-3;
        let lines = (2..=50).map(|n| {
            let hz = 0.5 * f64::from(n);
            let omega = std::f64::consts::TAU * hz;
            let plant = WHEEL.response(omega);
            let forward = truth.controller(omega) * plant;
            let around = 1.0 + forward * truth.feedback(omega);
            let closed =
                forward * Complex::from_polar(held(0.5 * omega * sample_s), -omega * truth.asked_late_s) / around;
            let closed = closed * (1.0 + 0.3 * error * Complex::new(noise(), noise()));
            let asked = Complex::from_polar(1.0, -omega * truth.asked_late_s);
            let drive = truth.controller(omega) * (asked - truth.feedback(omega) * closed);
            let drive = drive * (1.0 + error * Complex::new(noise(), noise()));
            Line { hz, plant, closed, drive, coherence: 0.9995 }
        });
        Response { lines: lines.collect(), averages: 5, sample_s }
    }

    #[test]
    fn a_loop_is_found_where_its_current_shows_hardly_how_late_the_speed_is_seen() {
        for seed in 1..30 {
            let found = identify_loop(&measured(&TRUTH, 0.04, seed), &WHEEL, 1e-3).unwrap();
            assert!((found.proportional / 2.4 - 1.0).abs() < 0.03, "{seed}: {found:?}");
            assert!((found.seen_late_s - 2e-3).abs() < 1e-3, "{seed}: {found:?}");
        }
    }

    #[test]
    fn a_set_point_that_comes_between_two_samples_is_found_where_it_is() {
        let truth = Loop { asked_late_s: 12.3e-3, ..TRUTH };
        let found = identify_loop(&measured(&truth, 0.0, 1), &WHEEL, 1e-3).unwrap();
        assert!(
            (found.asked_late_s - 12.3e-3).abs() < 0.1e-3 && (found.seen_late_s - 2e-3).abs() < 0.3e-3,
            "{found:?}"
        );
        assert!((found.integral / 19.0 - 1.0).abs() < 0.05, "{found:?}");
    }
}
