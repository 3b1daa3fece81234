//! Frequency response with coherence, by averaged spectra (P. D. Welch, "The use of fast Fourier transform for the estimation of
//! power spectra", IEEE Transactions on Audio and Electroacoustics 15, 1967).
//!
//! The drive is in its loop, so that current and speed both follow from the set-point, and from noise. What is taken is the ratio of
//! their cross spectra with the set-point, in which the noise that the loop carries round is not correlated
//! (L. Ljung, "System Identification", 2nd edition, 13.5):
//!
//! ```text
//! plant = S(speed, set-point) / S(current, set-point)
//! ```
//!
//! Without a set-point it is S(speed, current) / S(current, current), which noise in the loop biases.

use std::f64::consts::{PI, TAU};

use rustfft::num_complex::Complex;

use crate::excitation::Excitation;
use crate::fourier::Fourier;
use crate::samples::{Samples, Unusable};

/// Coherence from which a frequency counts. What is less coherent weighs less, and where the motor hardly moves, at an
/// anti-resonance, all is.
pub(crate) const COHERENT: f64 = 0.5;
/// What a linear model can be expected to be true to, relative.
pub(crate) const DEVIATION: f64 = 0.01;
/// How probable a coherence is, from which a frequency is taken to be seen, where nothing follows from the excitation.
const CHANCE: f64 = 0.01;
/// The share of lines that are most of them.
const MOST: f64 = 0.8;
/// How many frequencies it takes to say anything.
const LEAST_LINES: usize = 12;
/// Periods of an excitation: the first one is left out, since it begins at rest.
const LEAST_PERIODS: usize = 3;
/// Segments of a capture without a period: with half of each overlapping, eight are as good as four or five apart.
const SEGMENTS: usize = 8;
/// The shortest segment.
const LEAST_SEGMENT: usize = 128;

/// What was found at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// The frequency.
    pub hz: f64,
    /// Speed per current demand, (rad/s)/A.
    pub plant: Complex<f64>,
    /// Speed per set-point; the loop closed. NaN without a set-point.
    pub closed: Complex<f64>,
    /// Current demand per set-point, A/(rad/s). NaN without a set-point.
    pub drive: Complex<f64>,
    /// Share of current and speed that follows from what excites, the lesser of both: 0 to 1.
    pub coherence: f64,
}

/// A frequency response.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Ascending frequencies.
    pub lines: Vec<Line>,
    /// Periods or segments over which was averaged.
    pub averages: usize,
    /// Time between two samples, s.
    pub sample_s: f64,
}

impl Line {
    /// Angular frequency, rad/s.
    pub fn omega(&self) -> f64 {
        TAU * self.hz
    }

    /// Standard deviation of the logarithm of the plant's response (J. S. Bendat, A. G. Piersol, "Random Data", 4th edition,
    /// table 9.6), never below what a linear model can be expected to be true to.
    pub(crate) fn deviation(&self, averages: usize) -> f64 {
        let noise = (1.0 - self.coherence).max(0.0) / (2.0 * averages as f64 * self.coherence.max(1e-9));
        (noise + DEVIATION * DEVIATION).sqrt()
    }
}

impl Response {
    /// Those whose coherence is high enough to count.
    pub fn coherent(&self) -> impl Iterator<Item = &Line> {
        self.lines.iter().filter(|line| line.coherence >= COHERENT)
    }

    /// Whether nothing of the excitation is seen in it any more: at too few frequencies the coherence is above what chance alone shows. Of
    /// signals that have nothing to do with each other a coherence is above c with the probability (1 - c)^(averages - 1) (G. C. Carter,
    /// C. H. Knapp, A. H. Nuttall, "Estimation of the magnitude-squared coherence function via overlapped fast Fourier transform
    /// processing", IEEE Transactions on Audio and Electroacoustics 21, 1973).
    pub fn is_lost(&self) -> bool {
        let by_chance = 1.0 - CHANCE.powf(1.0 / (self.averages.max(2) - 1) as f64);
        self.lines.iter().filter(|line| line.coherence > by_chance).count() < LEAST_LINES
    }

    /// The highest frequency up to which most of the lines are coherent: a single one beyond may be so by chance. 0 where none is.
    pub fn seen_hz(&self) -> f64 {
        let mut coherent = 0;
        let mut seen_hz = 0.0;
        for (at, line) in self.lines.iter().enumerate() {
            let counts = line.coherence >= COHERENT;
            coherent += usize::from(counts);
            if counts && coherent as f64 >= MOST * (at + 1) as f64 {
                seen_hz = line.hz;
            }
        }
        seen_hz
    }

    /// Whether enough of them count.
    ///
    /// # Errors
    /// [`Unusable::Incoherent`].
    pub fn check(&self) -> Result<(), Unusable> {
        let found = self.coherent().count();
        if found >= LEAST_LINES {
            return Ok(());
        }
        Err(Unusable::Incoherent { least: COHERENT, found, lines: self.lines.len(), needed: LEAST_LINES })
    }
}

/// What a current loop lets through of a motor's back-emf. Its demand then moves more than the shaft: an inertia that is not there.
///
/// ```text
/// actual current = demand - emf constant * speed * s / (L s² + (R + kp) s + ki)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BackEmf {
    /// Amplitude of a phase's voltage per speed, V s/rad.
    pub constant_v_s: f64,
    /// Resistance of a phase with its switch.
    pub resistance_ohm: f64,
    /// Inductance of a phase.
    pub inductance_h: f64,
    /// Gain of the current loop, V/A.
    pub proportional: f64,
    /// Integral gain of the current loop, V/(A s).
    pub integral: f64,
}

impl BackEmf {
    fn current_per_speed(&self, omega: f64) -> Complex<f64> {
        let s = Complex::new(0.0, omega);
        let path = self.inductance_h * s * s + (self.resistance_ohm + self.proportional) * s + self.integral;
        self.constant_v_s * s / path
    }
}

impl Response {
    /// The same per actual current in place of the demand: `plant` without what the current loop lets through of the back-emf.
    #[must_use]
    pub fn without(&self, back_emf: &BackEmf) -> Self {
        let corrected = |line: &Line| {
            let plant = line.plant / (1.0 - back_emf.current_per_speed(line.omega()) * line.plant);
            Line { plant, ..*line }
        };
        Self { lines: self.lines.iter().map(corrected).collect(), ..*self }
    }
}

/// How far a response is from a model's: the median, over the coherent lines, of the relative difference of complex values. 0.1 is
/// 10 %, or 6 degrees. A mean would be that of the lines next to a sharp resonance.
pub fn distance(response: &Response, model: impl Fn(f64) -> Complex<f64>) -> f64 {
    let mut off: Vec<_> = response.coherent().map(|line| (model(line.omega()) / line.plant - 1.0).norm()).collect();
    off.sort_by(f64::total_cmp);
    off.get(off.len() / 2).copied().unwrap_or(f64::INFINITY)
}

/// The frequency response of what was sampled: of whole periods of an excitation after its first one, or of any capture.
///
/// # Errors
/// [`Unusable`]; low coherence is not one, see [`Response::check`].
pub fn response(samples: &Samples, excitation: Option<&Excitation>) -> Result<Response, Unusable> {
    samples.check()?;
    match excitation {
        Some(excitation) => periodic(samples, excitation),
        None => averaged(samples),
    }
}

fn periodic(samples: &Samples, excitation: &Excitation) -> Result<Response, Unusable> {
    let period = excitation.len();
    let periods = samples.len() / period;
    if periods < LEAST_PERIODS {
        let (found, needed) = (samples.len(), LEAST_PERIODS * period);
        return Err(Unusable::TooShort { found, needed, what: "three periods of the excitation" });
    }
    // The last sample of a period before is needed for the speed.
    let starts: Vec<_> = (1..periods).map(|n| n * period).collect();
    let mut spectra = Spectra::new(samples, period, vec![1.0; period]);
    starts.iter().for_each(|start| spectra.add(*start));
    Ok(spectra.response(excitation.lines().iter().copied(), starts.len()))
}

fn averaged(samples: &Samples) -> Result<Response, Unusable> {
    let len = (2 * samples.len() / (SEGMENTS + 1)) / 2 * 2;
    if len < LEAST_SEGMENT {
        let needed = LEAST_SEGMENT * (SEGMENTS + 1) / 2 + 1;
        return Err(Unusable::TooShort { found: samples.len(), needed, what: "eight overlapping segments" });
    }
    let hann = (0..len).map(|n| 0.5 - 0.5 * (TAU * n as f64 / len as f64).cos()).collect();
    let starts: Vec<_> = (1..).step_by(len / 2).take_while(|start| start + len <= samples.len()).collect();
    let mut spectra = Spectra::new(samples, len, hann);
    starts.iter().for_each(|start| spectra.add(*start));
    // What the window spreads over its neighbours says nothing of its own, and beyond a quarter of the rate most is what happened between
    // two samples.
    Ok(spectra.response(3..len / 4, starts.len()))
}

/// By how much a position that follows a current twice integrated is less than it would be if the current did not stand
/// still between two samples: half an angle of a sample, squared, by that of the discrete double integrator
/// (K. J. Åström, B. Wittenmark, "Computer-Controlled Systems", 3rd edition, table 2.1). The time is in the delay.
pub(crate) fn held(half: f64) -> f64 {
    if half == 0.0 { 1.0 } else { half.cos() * (half / half.sin()).powi(2) }
}

/// Sums of products of spectra.
struct Spectra<'a> {
    samples: &'a Samples,
    window: Vec<f64>,
    fourier: Fourier,
    sums: Vec<Sums>,
}

/// At one frequency: r set-point, u current, v speed.
#[derive(Clone, Copy, Default)]
struct Sums {
    rr: f64,
    uu: f64,
    vv: f64,
    ur: Complex<f64>,
    vr: Complex<f64>,
}

impl<'a> Spectra<'a> {
    fn new(samples: &'a Samples, len: usize, window: Vec<f64>) -> Self {
        Self { samples, window, fourier: Fourier::of(len), sums: vec![Sums::default(); len / 2 + 1] }
    }

    /// The spectrum of a stretch, without its mean.
    fn spectrum(&self, value: impl Fn(usize) -> f64) -> Vec<Complex<f64>> {
        let len = self.window.len();
        let mean = (0..len).map(&value).sum::<f64>() / len as f64;
        self.fourier.spectrum(self.window.iter().enumerate().map(|(n, window)| window * (value(n) - mean)))
    }

    fn add(&mut self, start: usize) {
        let Samples { period_s, set_point_rad_s, current_a, position_rad } = self.samples;
        let current = self.spectrum(|n| current_a[start + n]);
        let way = self.spectrum(|n| position_rad[start + n] - position_rad[start + n - 1]);
        let asked =
            if set_point_rad_s.is_empty() { current.clone() } else { self.spectrum(|n| set_point_rad_s[start + n]) };
        let len = self.window.len() as f64;
        for (line, sums) in self.sums.iter_mut().enumerate() {
            let (r, u) = (asked[line], current[line]);
            // The way of a period has as its spectrum that of the position by (1 - exp(-jwT)); the speed, by jw.
            let half = PI * line as f64 / len;
            let per_way = if line == 0 { 1.0 } else { half / half.sin() } / period_s;
            let v = way[line] * Complex::from_polar(per_way, half);
            sums.rr += r.norm_sqr();
            sums.uu += u.norm_sqr();
            sums.vv += v.norm_sqr();
            sums.ur += u * r.conj();
            sums.vr += v * r.conj();
        }
    }

    fn response(&self, lines: impl Iterator<Item = usize>, averages: usize) -> Response {
        let sample_s = self.samples.period_s;
        let whole_s = self.window.len() as f64 * sample_s;
        let known = !self.samples.set_point_rad_s.is_empty();
        let unknown = Complex::new(f64::NAN, f64::NAN);
        let line = |line: usize| {
            let Sums { rr, uu, vv, ur, vr } = self.sums[line];
            let share = |cross: Complex<f64>, power: f64| {
                if power > 0.0 && rr > 0.0 { (cross.norm_sqr() / (power * rr)).min(1.0) } else { 0.0 }
            };
            Line {
                hz: line as f64 / whole_s,
                plant: vr / ur / held(PI * line as f64 / self.window.len() as f64),
                closed: if known { vr / rr } else { unknown },
                drive: if known { ur / rr } else { unknown },
                coherence: share(ur, uu).min(share(vr, vv)),
            }
        };
        let lines = lines.map(line).filter(|line| line.plant.is_finite() && line.plant.norm_sqr() > 0.0).collect();
        Response { lines, averages, sample_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A loop of P and I that is asked for nothing holds against the back-emf: (R + s L + Kp + Ki / s) i = -K speed. At 100 rad/s the
    /// figures below give 10j / (90 + 200j) = (2000 + 900j) / 48100.
    #[test]
    fn the_current_that_a_speed_drives_is_what_the_loop_lets_through() {
        let back_emf =
            BackEmf { constant_v_s: 0.1, resistance_ohm: 0.5, inductance_h: 1e-3, proportional: 1.5, integral: 100.0 };
        let through = Complex::new(2000.0, 900.0) / 48_100.0;
        assert!((back_emf.current_per_speed(100.0) - through).norm() < 1e-12);
        let line = Line {
            hz: 100.0 / TAU,
            plant: Complex::new(3.0, -4.0),
            closed: Complex::new(0.5, 0.0),
            drive: Complex::new(0.1, 0.0),
            coherence: 1.0,
        };
        let measured = Response { lines: vec![line], averages: 1, sample_s: 1e-3 };
        // Per actual current: speed / (demand - through * speed).
        let expected = line.plant / (1.0 - through * line.plant);
        assert!((measured.without(&back_emf).lines[0].plant - expected).norm() < 1e-12);
    }
}
