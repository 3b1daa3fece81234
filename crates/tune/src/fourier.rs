//! Discrete Fourier transforms of any length, each by those of a power of two (L. I. Bluestein, "A linear filtering approach to the
//! computation of discrete Fourier transform", IEEE Transactions on Audio and Electroacoustics 18, 1970). A planner would find faster ones
//! for some lengths, and every program would have them all: a tenth of a page's module.

use std::sync::Arc;

use rustfft::algorithm::butterflies::{Butterfly4, Butterfly8};
use rustfft::algorithm::{BluesteinsAlgorithm, Radix4};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};

/// A transform of real values and back.
pub(crate) struct Fourier {
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    len: usize,
}

impl Fourier {
    /// Of so many values, at least one.
    pub(crate) fn of(len: usize) -> Self {
        let [forward, inverse] = [FftDirection::Forward, FftDirection::Inverse].map(|direction| of(len, direction));
        Self { forward, inverse, len }
    }

    /// The lines from zero up to half of the rate.
    pub(crate) fn spectrum(&self, values: impl Iterator<Item = f64>) -> Vec<Complex<f64>> {
        let mut buffer: Vec<_> = values.map(|value| Complex::new(value, 0.0)).collect();
        self.forward.process(&mut buffer);
        buffer.truncate(self.len / 2 + 1);
        buffer
    }

    /// The values of which these are the lines, times their number.
    pub(crate) fn values(&self, lines: impl Iterator<Item = (usize, Complex<f64>)>) -> Vec<f64> {
        let mut buffer = vec![Complex::default(); self.len];
        for (line, value) in lines {
            buffer[line] = value;
            buffer[(self.len - line) % self.len] = value.conj();
        }
        self.inverse.process(&mut buffer);
        buffer.iter().map(|value| value.re).collect()
    }
}

fn of(len: usize, direction: FftDirection) -> Arc<dyn Fft<f64>> {
    let inner = radix_4((2 * len - 1).next_power_of_two().max(4), direction);
    Arc::new(BluesteinsAlgorithm::new(len, inner))
}

/// Of a power of two, from 4 on.
fn radix_4(len: usize, direction: FftDirection) -> Arc<dyn Fft<f64>> {
    let exponent = len.ilog2();
    let base: Arc<dyn Fft<f64>> = if exponent.is_multiple_of(2) {
        Arc::new(Butterfly4::new(direction))
    } else {
        Arc::new(Butterfly8::new(direction))
    };
    Arc::new(Radix4::new_with_base((exponent - base.len().ilog2()) / 2, base))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_spectrum_is_the_sum_that_defines_it_and_its_values_come_back() {
        for len in [1, 2, 3, 4, 7, 12, 64, 125, 200] {
            let values: Vec<f64> = (0..len).map(|n| (0.7 * (n * n) as f64).sin() + 0.1 * n as f64).collect();
            let fourier = Fourier::of(len);
            let spectrum = fourier.spectrum(values.iter().copied());
            assert_eq!(spectrum.len(), len / 2 + 1);
            for (line, found) in spectrum.iter().enumerate() {
                let turn = |n: usize| Complex::from_polar(1.0, -TAU * (line * n) as f64 / len as f64);
                let sum: Complex<f64> = values.iter().enumerate().map(|(n, value)| value * turn(n)).sum();
                assert!((sum - found).norm() < 1e-11 * len as f64, "{len} {line}: {sum} {found}");
            }
            let back = fourier.values(spectrum.into_iter().enumerate());
            for (value, back) in values.iter().zip(back) {
                assert!((value - back / len as f64).abs() < 1e-12 * len as f64, "{len}: {value} {back}");
            }
        }
    }
}
