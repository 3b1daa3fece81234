//! A periodic excitation: a sum of sines whose phases keep its peak low (M. R. Schroeder, "Synthesis of low-peak-factor
//! signals and binary sequences with low autocorrelation", IEEE Transactions on Information Theory 16, 1970).
//!
//! Each sine fits into the period a whole number of times, so that a spectrum of whole periods has no leakage.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex;

use crate::fourier::Fourier;
use crate::samples::Unusable;

/// Neighbouring frequencies are this far apart, relative: as far as a lightly damped resonance (damping of 1 %) is wide.
const SPACING: f64 = 0.02;
/// The amplitude of a line grows with this power of its frequency: the shaft follows high ones less.
const SLOPE: f64 = 0.5;
/// How often the peak is cut off, and to what share.
const SWAPS: usize = 40;
const CLIPPED: f64 = 0.85;

/// One period of a speed that is added to a steady one; its peak is 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Excitation {
    sample_s: f64,
    values: Vec<f64>,
    lines: Vec<usize>,
}

impl Excitation {
    /// For samples each `sample_s`, repeated after `period_s`, with frequencies between these two (Hz).
    ///
    /// # Errors
    /// [`Unusable::Band`], [`Unusable::Period`].
    pub fn new(sample_s: f64, period_s: f64, (from_hz, to_hz): (f64, f64)) -> Result<Self, Unusable> {
        if !(sample_s > 0.0 && sample_s < 1.0 && period_s >= 8.0 * sample_s && period_s < 1e6 * sample_s) {
            return Err(Unusable::Period(sample_s));
        }
        let len = (period_s / sample_s).round() as usize;
        let (least_hz, most_hz) = (1.0 / (len as f64 * sample_s), 0.5 / sample_s);
        let band = Unusable::Band { from_hz, to_hz, least_hz, most_hz };
        if !(from_hz >= least_hz * (1.0 - 1e-9) && to_hz <= most_hz && from_hz < to_hz) {
            return Err(band);
        }
        let lines = spaced((from_hz / least_hz).round() as usize, ((to_hz / least_hz) as usize).min(len / 2 - 1));
        // No sine of the band fits into the period a whole number of times.
        let Some(&first) = lines.first() else { return Err(band) };
        let amplitudes: Vec<_> = lines.iter().map(|line| (*line as f64).powf(SLOPE)).collect();
        let whole: f64 = amplitudes.iter().map(|amplitude| amplitude * amplitude).sum();
        // Schroeder: the moment at which a line has its phase stationary goes through the period as the power below it grows.
        let (mut delay, mut phase, mut previous) = (0.0, 0.0, first);
        let spectrum = lines.iter().zip(&amplitudes).map(|(line, amplitude)| {
            phase -= TAU * delay * (line - previous) as f64;
            delay += amplitude * amplitude / whole;
            previous = *line;
            Complex::from_polar(*amplitude, phase)
        });
        let spectrum = spectrum.collect();
        let values = flattened(len, &lines, spectrum);
        Ok(Self { sample_s, values, lines })
    }

    /// Samples in a period.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// False: there are at least eight.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Time between two samples, s.
    pub fn sample_s(&self) -> f64 {
        self.sample_s
    }

    /// The value at sample `n`, periodically; from -1 to 1.
    pub fn at(&self, n: usize) -> f64 {
        self.values[n % self.values.len()]
    }

    /// How often each of its sines fits into the period.
    pub fn lines(&self) -> &[usize] {
        &self.lines
    }
}

/// The sum of lines with this spectrum, of peak 1. Lines that are apart have peaks where the others have theirs: what is above is cut
/// off, and of what is left the phases are taken (E. Van der Ouderaa, J. Schoukens, J. Renneboog, "Peak factor minimization
/// using a time-frequency domain swapping algorithm", IEEE Transactions on Instrumentation and Measurement 37, 1988).
fn flattened(len: usize, lines: &[usize], mut spectrum: Vec<Complex<f64>>) -> Vec<f64> {
    let fourier = Fourier::of(len);
    let mut best = (f64::INFINITY, Vec::new());
    for _ in 0..SWAPS {
        let values = fourier.values(lines.iter().copied().zip(spectrum.iter().copied()));
        let peak = values.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
        if peak < best.0 {
            best = (peak, values.iter().map(|value| value / peak).collect());
        }
        let bins = fourier.spectrum(values.iter().map(|value| value.clamp(-CLIPPED * peak, CLIPPED * peak)));
        for (line, value) in lines.iter().zip(&mut spectrum) {
            *value = Complex::from_polar(value.norm(), bins[*line].arg());
        }
    }
    best.1
}

/// From one to the other, each the next whole number or further away by the spacing.
fn spaced(from: usize, to: usize) -> Vec<usize> {
    let next = |line: &usize| Some((line + 1).max((*line as f64 * (1.0 + SPACING)).round() as usize));
    std::iter::successors(Some(from.max(1)), next).take_while(|line| *line <= to).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_peak_is_one_and_lower_than_a_random_sums() {
        let excitation = Excitation::new(1e-3, 2.0, (1.0, 200.0)).unwrap();
        let values: Vec<_> = (0..excitation.len()).map(|n| excitation.at(n)).collect();
        let rms = (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt();
        assert!(values.iter().all(|value| value.abs() <= 1.0));
        // A sine has 1.41; a hundred sines at random phases have four.
        assert!(1.0 / rms < 3.0, "crest factor {}", 1.0 / rms);
        assert!(values.iter().sum::<f64>().abs() < 1e-6);
    }

    #[test]
    fn a_band_that_its_period_or_rate_cannot_hold_is_refused() {
        for band in [(0.1, 100.0), (1.0, 600.0), (50.0, 20.0), (f64::NAN, 1.0)] {
            assert!(matches!(Excitation::new(1e-3, 2.0, band), Err(Unusable::Band { .. })), "{band:?}");
        }
        // Sines that fit are 0.5 Hz apart, and there is none from 1.35 to 1.45 Hz.
        assert!(matches!(Excitation::new(1e-3, 2.0, (1.35, 1.45)), Err(Unusable::Band { .. })));
        assert!(matches!(Excitation::new(0.0, 2.0, (1.0, 2.0)), Err(Unusable::Period(_))));
        assert!(matches!(Excitation::new(1e-3, f64::NAN, (1.0, 2.0)), Err(Unusable::Period(_))));
    }
}
