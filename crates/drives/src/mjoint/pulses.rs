//! Pulse inputs PU and DIR: counts from pulses and direction or from an encoder, speed from a duty cycle, and the
//! electronic gear ("M Robot Joint Motor CanOpen Manual", "Driver wiring diagram and control mode", 2 and 3, and 5.04).

use super::assumptions::{DUTY_FULL, DUTY_FULL_RPM, DUTY_ZERO};
use super::power_on::Function;

/// The timers behind PU and DIR, as a microcontroller's capture units give them. Counters wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PulseInput {
    /// Rising edges of PU, up while DIR is low and down while it is high.
    pub rises: u16,
    /// Falling edges of PU, likewise.
    pub falls: u16,
    /// Quadrature of PU and DIR, four counts a line, up while PU leads.
    pub quadrature: u16,
    /// Duty cycle on PU, 0 to 1; `None` while PU does not change.
    pub duty: Option<f32>,
}

/// How pulses are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PulseParameters {
    /// The function of 2619h.
    pub function: Function,
    /// 260Ah: counts of the encoder ...
    pub numerator: u16,
    /// 260Bh: ... for so many pulses.
    pub denominator: u16,
    /// Ones digit of 60F9h:01 is odd: a pulse counts when PU begins to conduct, else when it ends.
    pub at_conduction: bool,
    /// 2609h: the shaft turns clockwise, which is positive, while DIR conducts (1) or while it does not (0).
    pub dir_is_clockwise: bool,
}

/// Counts pulses and gears them, without losing a remainder.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pulses {
    seen: Option<(Function, bool, u16)>,
    /// Geared counts that do not make a whole one yet, in units of 1/denominator.
    remainder: i64,
}

impl Pulses {
    /// Encoder counts that the shaft is to move by since the last call. The first call finds where the counters stand.
    pub fn update(&mut self, parameters: &PulseParameters, input: &PulseInput) -> i32 {
        let counter = match parameters.function {
            Function::EncoderFollowing => input.quadrature,
            Function::DutyCycleSpeed | Function::CommunicationControl => return 0,
            _ if parameters.at_conduction => input.rises,
            _ => input.falls,
        };
        let key = (parameters.function, parameters.at_conduction, counter);
        let before = self.seen.replace(key);
        let moved = match before {
            Some((function, edge, old)) if (function, edge) == (key.0, key.1) => counter.wrapping_sub(old) as i16,
            _ => 0,
        };
        self.gear(parameters, i64::from(moved) * parameters.sense())
    }

    fn gear(&mut self, parameters: &PulseParameters, pulses: i64) -> i32 {
        let denominator = i64::from(parameters.denominator.max(1));
        let share = pulses * i64::from(parameters.numerator) + self.remainder;
        self.remainder = share.rem_euclid(denominator);
        share.div_euclid(denominator) as i32
    }
}

impl PulseParameters {
    /// Which way is positive is not printed: clockwise is taken, so that a joint as delivered turns forward while DIR is
    /// not wired. The timers count down while DIR conducts. An encoder's sense is its own: PU ahead of DIR is positive.
    fn sense(&self) -> i64 {
        if self.function == Function::EncoderFollowing || !self.dir_is_clockwise { 1 } else { -1 }
    }

    /// Speed in r/min that a duty cycle asks for: 10 % to 90 % are 0 to 1000 r/min.
    pub fn duty_speed_rpm(&self, input: &PulseInput, dir: bool) -> f64 {
        let duty = input.duty.unwrap_or(0.0).clamp(DUTY_ZERO, DUTY_FULL);
        let rpm = f64::from((duty - DUTY_ZERO) / (DUTY_FULL - DUTY_ZERO)) * DUTY_FULL_RPM;
        if dir == self.dir_is_clockwise { rpm } else { -rpm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMETERS: PulseParameters = PulseParameters {
        function: Function::PulseAndDirection,
        numerator: 32768,
        denominator: 8192,
        at_conduction: false,
        dir_is_clockwise: false,
    };

    fn total(parameters: &PulseParameters, steps: impl Iterator<Item = PulseInput>) -> i64 {
        let mut pulses = Pulses::default();
        pulses.update(parameters, &PulseInput::default());
        steps.map(|input| i64::from(pulses.update(parameters, &input))).sum()
    }

    fn falls(count: i64, a_step: u16) -> impl Iterator<Item = PulseInput> {
        let steps = count / i64::from(a_step);
        (1..=steps).map(move |n| PulseInput { falls: (n as u16).wrapping_mul(a_step), ..PulseInput::default() })
    }

    #[test]
    fn as_delivered_8192_pulses_are_one_turn_and_nothing_is_lost_at_any_gear() {
        assert_eq!(total(&PARAMETERS, falls(8192, 4)), 32768);
        for (numerator, denominator) in [(32768, 3200), (256, 25), (1, 3), (7, 65535), (65535, 7)] {
            let parameters = PulseParameters { numerator, denominator, ..PARAMETERS };
            let count = 210_000;
            let expected = count * i64::from(numerator) / i64::from(denominator);
            assert_eq!(total(&parameters, falls(count, 1)), expected, "{numerator}/{denominator}");
        }
    }

    #[test]
    fn dir_polarity_turns_pulses_around_and_an_encoder_has_its_own_sense() {
        let reversed = PulseParameters { dir_is_clockwise: true, ..PARAMETERS };
        assert_eq!(total(&reversed, falls(8192, 4)), -32768);
        for dir_is_clockwise in [false, true] {
            let function = Function::EncoderFollowing;
            let parameters = PulseParameters { function, dir_is_clockwise, denominator: 32768, ..PARAMETERS };
            let steps = (1..=100).map(|n| PulseInput { quadrature: n * 3, ..PulseInput::default() });
            assert_eq!(total(&parameters, steps), 300);
        }
    }

    #[test]
    fn the_edge_that_counts_follows_the_polarity() {
        let input = PulseInput { rises: 5, falls: 4, ..PulseInput::default() };
        let unit = PulseParameters { numerator: 1, denominator: 1, ..PARAMETERS };
        assert_eq!(total(&unit, core::iter::once(input)), 4);
        assert_eq!(total(&PulseParameters { at_conduction: true, ..unit }, core::iter::once(input)), 5);
    }

    #[test]
    fn ten_to_ninety_percent_are_0_to_1000_revolutions() {
        let at = |duty: f32| PulseInput { duty: Some(duty), ..PulseInput::default() };
        let speed = |duty: f32| PARAMETERS.duty_speed_rpm(&at(duty), false);
        for (duty, rpm) in [(0.0, 0.0), (0.1, 0.0), (0.5, 500.0), (0.9, 1000.0), (1.0, 1000.0)] {
            assert!((speed(duty) - rpm).abs() < 1e-3, "{duty}: {}", speed(duty));
        }
        assert!((PARAMETERS.duty_speed_rpm(&at(0.5), true) + 500.0).abs() < 1e-3);
        assert_eq!(PARAMETERS.duty_speed_rpm(&PulseInput::default(), false), 0.0);
    }
}
