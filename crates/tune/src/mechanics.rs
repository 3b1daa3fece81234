//! One or two masses behind a frequency response.
//!
//! ```text
//!                       gain       s²/wa² + 2 za s/wa + 1
//! speed / current = ------------- ------------------------ exp(-s delay)
//!                    s + viscous   s²/wr² + 2 zr s/wr + 1
//! ```
//!
//! `gain` is torque constant over whole inertia, `viscous` viscous friction over whole inertia; the load swings against the held
//! motor at the anti-resonance `wa`, both against each other at the resonance `wr`. The share of the inertia at the motor
//! is `(wa/wr)²`.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex;

use crate::least_squares::fit;
use crate::response::{Line, Response};
use crate::samples::Unusable;

/// A second mass has to explain so much of what one leaves over.
const WORTH_A_MASS: f64 = 0.6;
/// The least distance of resonance and anti-resonance that is one, relative.
const LEAST_SPLIT: f64 = 1.02;
/// Relative difference from which nothing is described.
const MOST_OFF: f64 = 0.35;
/// Where the search for an anti-resonance begins: so many frequencies, and these distances of the resonance.
const STARTS: usize = 24;
const SPLITS: [f64; 5] = [1.06, 1.15, 1.35, 1.8, 3.0];
/// So many of the best beginnings are followed to their end.
const FOLLOWED: usize = 4;
const DAMPING: f64 = 0.03;
/// Steel alone damps as much.
const LEAST_DAMPING: f64 = 0.002;

/// What a shaft and its load are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mechanics {
    /// Acceleration per current of the whole, (rad/s²)/A.
    pub gain: f64,
    /// Viscous friction over inertia, 1/s.
    pub viscous_per_s: f64,
    /// The load swings.
    pub elastic: Option<Elastic>,
    /// From the sample of the current to that of the position. It may be negative where the current was sampled at the end of the
    /// time in which it was held.
    pub delay_s: f64,
    /// How far it is from what was measured: see [`distance`](crate::distance).
    pub off: f64,
}

/// A second mass behind a spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic {
    /// Where the motor moves least.
    pub anti_resonance_hz: f64,
    /// Damping there, 1 being critical.
    pub anti_damping: f64,
    /// Where it moves most.
    pub resonance_hz: f64,
    /// Damping there, 1 being critical.
    pub damping: f64,
}

impl Mechanics {
    /// Speed per current at an angular frequency, (rad/s)/A.
    pub fn response(&self, omega: f64) -> Complex<f64> {
        let s = Complex::new(0.0, omega);
        let rigid = self.gain / (s + self.viscous_per_s) * Complex::from_polar(1.0, -omega * self.delay_s);
        self.elastic.map_or(rigid, |elastic| rigid * elastic.factor(s))
    }

    /// Inertia of all that turns, as seen by the motor, kg m². For a motor with this torque constant, N m/A.
    pub fn inertia_kg_m2(&self, torque_constant_nm_a: f64) -> f64 {
        torque_constant_nm_a / self.gain
    }
}

impl Elastic {
    fn factor(&self, s: Complex<f64>) -> Complex<f64> {
        let pair = |hz: f64, damping: f64| {
            let relative = s / (TAU * hz);
            relative * relative + 2.0 * damping * relative + 1.0
        };
        pair(self.anti_resonance_hz, self.anti_damping) / pair(self.resonance_hz, self.damping)
    }

    /// Share of the whole inertia that is the motor's.
    pub fn motor_share(&self) -> f64 {
        (self.anti_resonance_hz / self.resonance_hz).powi(2)
    }
}

/// The one or two masses that explain a response best. Lines weigh by what their coherence makes of them.
///
/// # Errors
/// [`Unusable::Incoherent`], [`Unusable::NoModel`].
pub fn identify(response: &Response) -> Result<Mechanics, Unusable> {
    response.check()?;
    let lines: Vec<_> = response.coherent().map(|line| (*line, 1.0 / line.deviation(response.averages))).collect();
    let (rigid, one) = fit_rigid(&lines);
    let (elastic, two) = fit_elastic(&lines, &rigid);
    let found =
        if two < WORTH_A_MASS * one && elastic.elastic.is_some_and(|it| is_physical(&it)) { elastic } else { rigid };
    let off = crate::response::distance(response, |omega| found.response(omega));
    if found.gain.is_nan() || found.gain <= 0.0 || off > MOST_OFF {
        return Err(Unusable::NoModel(100.0 * off));
    }
    Ok(Mechanics { off, ..found })
}

/// Logarithms, so that each parameter acts alone, and none becomes negative.
fn rigid_of([gain, viscous, delay]: [f64; 3]) -> Mechanics {
    Mechanics { gain: gain.exp(), viscous_per_s: viscous.exp(), elastic: None, delay_s: delay * 1e-3, off: 0.0 }
}

fn elastic_of([gain, viscous, delay, anti, anti_damping, split, damping]: [f64; 7]) -> Mechanics {
    let anti_resonance_hz = anti.exp();
    let resonance_hz = anti_resonance_hz * (1.0 + split.exp());
    let elastic =
        Elastic { anti_resonance_hz, anti_damping: damped(anti_damping), resonance_hz, damping: damped(damping) };
    Mechanics { elastic: Some(elastic), ..rigid_of([gain, viscous, delay]) }
}

/// A damping by its logarithm. Noise may look like less than none, and with none it is open which way round a loop goes.
fn damped(logarithm: f64) -> f64 {
    logarithm.exp().max(LEAST_DAMPING)
}

/// Differences of the logarithms, magnitude and phase, in standard deviations.
fn residuals(lines: &[(Line, f64)], model: &Mechanics, into: &mut Vec<f64>) {
    into.clear();
    for (line, weight) in lines {
        let off = line.plant / model.response(line.omega());
        into.push(weight * 0.5 * off.norm_sqr().max(1e-300).ln());
        into.push(weight * off.arg());
    }
}

fn cost(lines: &[(Line, f64)], model: &Mechanics) -> f64 {
    let mut all = Vec::new();
    residuals(lines, model, &mut all);
    all.iter().map(|off| off * off).sum()
}

fn fit_rigid(lines: &[(Line, f64)]) -> (Mechanics, f64) {
    // Where nothing swings, speed times frequency is the same everywhere.
    let mut flat: Vec<_> = lines.iter().map(|(line, _)| (line.plant.norm() * line.omega()).ln()).collect();
    flat.sort_by(f64::total_cmp);
    let mut parameters = [flat[flat.len() / 2], 0.0, 1.0];
    let cost = fit(&mut parameters, |parameters, into| residuals(lines, &rigid_of(*parameters), into));
    (rigid_of(parameters), cost)
}

fn fit_elastic(lines: &[(Line, f64)], rigid: &Mechanics) -> (Mechanics, f64) {
    let (first, last) = (lines[0].0.hz, lines[lines.len() - 1].0.hz);
    let begin = [rigid.gain.ln(), rigid.viscous_per_s.max(1e-3).ln(), rigid.delay_s * 1e3];
    let mut starts = Vec::new();
    for n in 0..STARTS {
        let anti = (first * (last / first).powf((n as f64 + 0.5) / STARTS as f64)).ln();
        for split in SPLITS {
            // Below the anti-resonance the whole turns, above the resonance the motor alone; the fit of one mass lies between.
            for whole in [1.0, split] {
                let gain = begin[0] - 2.0 * f64::ln(whole);
                let split = (split - 1.0_f64).ln();
                let start = [gain, begin[1], begin[2], anti, f64::ln(DAMPING), split, f64::ln(DAMPING)];
                starts.push((cost(lines, &elastic_of(start)), start));
            }
        }
    }
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let followed = starts.into_iter().take(FOLLOWED).map(|(_, mut parameters)| {
        let cost = fit(&mut parameters, |parameters, into| residuals(lines, &elastic_of(*parameters), into));
        (elastic_of(parameters), cost)
    });
    followed.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((*rigid, f64::INFINITY))
}

/// A pair that nearly cancels itself, or is not within the range of anything, is a fit of noise.
fn is_physical(elastic: &Elastic) -> bool {
    let Elastic { anti_resonance_hz, anti_damping, resonance_hz, damping } = *elastic;
    let split = resonance_hz / anti_resonance_hz;
    split > LEAST_SPLIT && split < 50.0 && anti_damping < 0.7 && damping < 0.7 && anti_resonance_hz > 0.1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a known machine would have been measured as, with a relative error of each line.
    fn measured(truth: &Mechanics, error: f64) -> Response {
        let mut state = 7_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let lines = (1..=200).map(|n| {
            let hz = 1.0 * f64::from(n);
            let nan = Complex::new(f64::NAN, f64::NAN);
            let plant = truth.response(TAU * hz) * (1.0 + error * Complex::new(noise(), noise()));
            Line { hz, plant, closed: nan, drive: nan, coherence: 0.99 }
        });
        Response { lines: lines.collect(), averages: 4, sample_s: 1e-3 }
    }

    const RIGID: Mechanics = Mechanics { gain: 30.0, viscous_per_s: 0.5, elastic: None, delay_s: 1.2e-3, off: 0.0 };

    #[test]
    fn one_mass_is_found_and_no_second_one_in_noise() {
        for error in [0.0, 0.1] {
            let found = identify(&measured(&RIGID, error)).unwrap();
            assert!((found.gain / 30.0 - 1.0).abs() < 0.01, "{found:?}");
            assert!((found.delay_s - 1.2e-3).abs() < 2e-5, "{found:?}");
            assert_eq!(found.elastic, None);
        }
    }

    #[test]
    fn two_masses_are_found_wherever_they_swing() {
        for (anti_resonance_hz, resonance_hz) in [(5.0, 9.0), (20.0, 22.0), (40.0, 120.0), (90.0, 140.0)] {
            let swing = Elastic {
                anti_resonance_hz,
                anti_damping: 0.01,
                resonance_hz,
                damping: 0.01 * resonance_hz / anti_resonance_hz,
            };
            let found = identify(&measured(&Mechanics { elastic: Some(swing), ..RIGID }, 0.05)).unwrap();
            let elastic = found.elastic.unwrap_or_else(|| panic!("{swing:?} was not found"));
            assert!((found.gain / 30.0 - 1.0).abs() < 0.01, "{found:?}");
            assert!((elastic.resonance_hz / resonance_hz - 1.0).abs() < 0.005, "{found:?}");
            assert!((elastic.anti_resonance_hz / anti_resonance_hz - 1.0).abs() < 0.005, "{found:?}");
            let share = (anti_resonance_hz / resonance_hz).powi(2);
            assert!((elastic.motor_share() / share - 1.0).abs() < 0.02, "{found:?}");
        }
    }

    #[test]
    fn what_no_machine_does_is_no_model() {
        let mut response = measured(&RIGID, 0.0);
        for (n, line) in response.lines.iter_mut().enumerate() {
            line.plant = Complex::from_polar(1.0 + (n % 7) as f64, n as f64);
        }
        assert!(matches!(identify(&response), Err(Unusable::NoModel(_))));
        response.lines.iter_mut().for_each(|line| line.coherence = 0.2);
        assert!(matches!(identify(&response), Err(Unusable::Incoherent { found: 0, .. })));
    }
}
