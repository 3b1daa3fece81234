//! What a speed loop lets happen: the error after a step of its set-point and after a load, computed in time.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use crate::controller::Loop;
use crate::mechanics::{Elastic, Mechanics};

/// So fine is the time in which it is computed, and so long is looked at each of the two.
const STEP_S: f64 = 0.25e-3;
const LOOKED_AT_S: f64 = 0.75;

/// What a loop is to answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbance {
    /// A step of the set-point, rad/s.
    pub step_rad_s: f64,
    /// A load that comes on, by the current that holds it, A.
    pub load_a: f64,
}

impl Disturbance {
    /// Integral of the absolute error after both, rad; the set-point's own delay apart, which no gain changes.
    pub fn error(&self, mechanics: &Mechanics, around: &Loop) -> f64 {
        let step = Answering::new(mechanics, around).error(self.step_rad_s, 0.0);
        step + Answering::new(mechanics, around).error(0.0, self.load_a)
    }

    /// What that is at least: the error after a load, with its sign, is the load over the integral gain.
    pub(crate) fn least_error(&self, around: &Loop) -> f64 {
        self.load_a / around.integral
    }
}

/// A loop on its way.
struct Answering {
    around: Loop,
    gain: f64,
    viscous_per_s: f64,
    elastic: Option<Elastic>,
    /// Speeds on their way to the controller.
    late: VecDeque<f64>,
    filtered: f64,
    integral: f64,
    /// Speed of the whole, as if it were rigid.
    of_current: f64,
    of_load: f64,
    swing_of_current: Swing,
    swing_of_load: Swing,
}

/// `1 / (s²/w² + 2 d s/w + 1)`.
#[derive(Clone, Copy, Default)]
struct Swing {
    value: f64,
    rate: f64,
}

impl Swing {
    /// Its acceleration meanwhile.
    fn step(&mut self, omega: f64, damping: f64, input: f64) -> f64 {
        let acceleration = omega * omega * (input - self.value) - 2.0 * damping * omega * self.rate;
        self.rate += STEP_S * acceleration;
        self.value += STEP_S * self.rate;
        acceleration
    }
}

impl Answering {
    fn new(mechanics: &Mechanics, around: &Loop) -> Self {
        let late = ((mechanics.delay_s + around.seen_late_s) / STEP_S).round().max(0.0) as usize;
        Self {
            around: *around,
            gain: mechanics.gain,
            viscous_per_s: mechanics.viscous_per_s,
            elastic: mechanics.elastic,
            late: std::iter::repeat_n(0.0, late).collect(),
            filtered: 0.0,
            integral: 0.0,
            of_current: 0.0,
            of_load: 0.0,
            swing_of_current: Swing::default(),
            swing_of_load: Swing::default(),
        }
    }

    fn error(mut self, set_point: f64, load_a: f64) -> f64 {
        let steps = (LOOKED_AT_S / STEP_S) as usize;
        (0..steps).map(|_| (set_point - self.step(set_point, load_a)).abs() * STEP_S).sum()
    }

    /// The speed of the motor a step later.
    fn step(&mut self, set_point: f64, load_a: f64) -> f64 {
        let error = set_point - self.filtered;
        self.integral += STEP_S * self.around.integral * error;
        let current = self.around.proportional * error + self.integral;
        self.of_current += STEP_S * (self.gain * current - self.viscous_per_s * self.of_current);
        self.of_load += STEP_S * (self.gain * load_a - self.viscous_per_s * self.of_load);
        let speed = self.elastic.map_or(self.of_current - self.of_load, |elastic| self.swing(&elastic));
        self.late.push_back(speed);
        let seen = self.late.pop_front().unwrap_or(speed);
        // The exact solution of the filter: its time constant may be shorter than a step.
        self.filtered += (1.0 - (-STEP_S / self.around.filter_s.max(1e-9)).exp()) * (seen - self.filtered);
        speed
    }

    /// The load acts beyond the spring: it meets no anti-resonance.
    fn swing(&mut self, elastic: &Elastic) -> f64 {
        let (resonance, anti) = (TAU * elastic.resonance_hz, TAU * elastic.anti_resonance_hz);
        let acceleration = self.swing_of_current.step(resonance, elastic.damping, self.of_current);
        let Swing { value, rate } = self.swing_of_current;
        self.swing_of_load.step(resonance, elastic.damping, self.of_load);
        acceleration / (anti * anti) + 2.0 * elastic.anti_damping * rate / anti + value - self.swing_of_load.value
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    const WHEEL: Mechanics = Mechanics { gain: 50.0, viscous_per_s: 0.0, elastic: None, delay_s: 0.0, off: 0.0 };

    fn around(proportional: f64, integral: f64) -> Loop {
        Loop { proportional, integral, filter_s: 0.0, asked_late_s: 0.0, seen_late_s: 0.0, off: 0.0 }
    }

    /// Both poles real: the speed passes a step once, and the area beyond is the one before; a load pushes it one way.
    #[test]
    fn the_error_of_an_integrator_with_two_real_poles_is_that_of_its_closed_form() {
        for (fast, slow) in [(80.0, 20.0), (40.0, 25.0), (120.0, 30.0)] {
            let it = around((fast + slow) / WHEEL.gain, fast * slow / WHEEL.gain);
            let crossing = f64::ln(fast / slow) / (fast - slow);
            let area = ((-slow * crossing).exp() - (-fast * crossing).exp()) / (fast - slow);
            let step = Disturbance { step_rad_s: 3.0, load_a: 0.0 }.error(&WHEEL, &it);
            assert!((step / (2.0 * 3.0 * area) - 1.0).abs() < 0.03, "{step} {area}");
            let load = Disturbance { step_rad_s: 0.0, load_a: 2.0 };
            assert!((load.error(&WHEEL, &it) / load.least_error(&it) - 1.0).abs() < 0.02, "{fast}");
        }
    }

    /// About its end it swings with `exp(-d w t)`, two of pi of its amplitude on average: `2 / (pi d w)` in all, for a small damping.
    #[test]
    fn a_spring_swings_at_its_resonance_for_as_long_as_its_damping_lets_it() {
        let (hz, damping) = (20.0, 0.05);
        let mut swing = Swing::default();
        let area: f64 = (0..20_000)
            .map(|_| {
                swing.step(TAU * hz, damping, 1.0);
                (1.0 - swing.value).abs() * STEP_S
            })
            .sum();
        let closed_form = 2.0 / (PI * damping * TAU * hz);
        assert!((area / closed_form - 1.0).abs() < 0.02, "{area} {closed_form}");
    }

    #[test]
    fn a_loop_that_swings_by_itself_has_a_greater_error_than_one_that_does_not() {
        let late = |proportional| Loop { seen_late_s: 5e-3, ..around(proportional, 10.0) };
        let both = Disturbance { step_rad_s: 1.0, load_a: 1.0 };
        // Unstable from 6.3 on: a quarter turn in the delay.
        assert!(both.error(&WHEEL, &late(8.0)) > 10.0 * both.error(&WHEEL, &late(2.0)));
    }
}
