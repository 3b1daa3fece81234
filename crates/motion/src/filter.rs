//! First-order low-pass.
//!
//! `dy/dt = (x - y) / tau`, stepped implicitly so that any time constant is stable: `y += (x - y) dt / (tau + dt)`.

/// How much of a new sample is taken in each period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowPassGains {
    share: f32,
}

impl LowPassGains {
    /// A time constant at a period; zero passes everything.
    pub fn from_time_constant(time_constant_s: f32, dt_s: f32) -> Self {
        LowPassGains { share: dt_s / (time_constant_s.max(0.0) + dt_s) }
    }
}

/// State: the filtered value.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LowPass {
    /// The filtered value.
    pub value: f32,
}

impl LowPass {
    /// Takes in a sample and returns the filtered value.
    #[inline]
    pub fn update(&mut self, gains: &LowPassGains, sample: f32) -> f32 {
        self.value += gains.share * (sample - self.value);
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_reaches_63_percent_after_one_time_constant() {
        let gains = LowPassGains::from_time_constant(0.1, 1e-4);
        let mut filter = LowPass::default();
        for _ in 0..1000 {
            filter.update(&gains, 1.0);
        }
        let expected = 1.0 - libm::expf(-1.0);
        assert!((filter.value - expected).abs() < 1e-3, "{}", filter.value);
    }

    #[test]
    fn no_time_constant_passes_everything() {
        let mut filter = LowPass::default();
        assert_eq!(filter.update(&LowPassGains::from_time_constant(0.0, 1e-4), 7.0), 7.0);
    }
}
