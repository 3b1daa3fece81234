//! What was measured, and why it may be of no use.

/// Samples of a drive in its speed loop, all taken at the same moments. Radians are those of the motor's shaft.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// Time from one to the next.
    pub period_s: f64,
    /// What the drive was asked for, rad/s. Empty where that is not known.
    pub set_point_rad_s: Vec<f64>,
    /// What its speed loop asks of its current loop, A.
    pub current_a: Vec<f64>,
    /// Where the shaft is, rad, without a jump at the end of a turn.
    pub position_rad: Vec<f64>,
}

/// Why nothing can be identified from samples, and what would be possible instead.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unusable {
    /// A period that is not a time.
    #[error("the time between two samples is {0} s: expected more than 0 and less than 1 s")]
    Period(f64),
    /// Not a number, or infinite.
    #[error(
        "{signal} is {value} at sample {at}: expected a finite number. Cut the capture before it, or measure again"
    )]
    NotFinite {
        /// Which one.
        signal: &'static str,
        /// Index of the first such sample.
        at: usize,
        /// What stands there.
        value: f64,
    },
    /// Signals of different lengths.
    #[error(
        "the capture is cut off: {expected} samples of the position, {found} of {signal}. Expected as many of each: keep the \
         rows that have all of them"
    )]
    CutOff {
        /// Which one.
        signal: &'static str,
        /// How many of it.
        found: usize,
        /// How many of the position.
        expected: usize,
    },
    /// Too few samples.
    #[error(
        "{found} samples are too few: {needed} are needed ({what}). Measure for longer, or begin at a higher frequency, which \
         needs shorter periods"
    )]
    TooShort {
        /// How many there are.
        found: usize,
        /// How many it takes.
        needed: usize,
        /// For what.
        what: &'static str,
    },
    /// Nothing moves.
    #[error("{signal} does not change: nothing can be identified from a drive that is not excited")]
    Constant {
        /// Which one.
        signal: &'static str,
    },
    /// What comes out does not follow from what goes in.
    #[error(
        "the coherence is above {least} at {found} of {lines} frequencies: {needed} are needed. The motion has other causes than the \
         set-point, or is lost in the encoder's counts: excite more, or let nothing else push the shaft"
    )]
    Incoherent {
        /// What counts as coherent.
        least: f64,
        /// At how many it is.
        found: usize,
        /// Of how many.
        lines: usize,
        /// How many it takes.
        needed: usize,
    },
    /// The excitation cannot be made.
    #[error(
        "frequencies {from_hz} to {to_hz} Hz: expected ascending ones from {least_hz} Hz (one period) to {most_hz} Hz (half of the sampling \
         rate), with a multiple of {least_hz} Hz between them"
    )]
    Band {
        /// Lowest that was asked for.
        from_hz: f64,
        /// Highest that was asked for.
        to_hz: f64,
        /// Lowest there is.
        least_hz: f64,
        /// Highest there is.
        most_hz: f64,
    },
    /// Not enough steady speeds.
    #[error("friction needs two speeds or more, in both directions: {0} usable ones were given")]
    TooFewSpeeds(usize),
    /// No model describes it.
    #[error("no model of one or two masses describes the response: it is off by {0:.0} %")]
    NoModel(f64),
}

impl Samples {
    /// The last of them.
    #[must_use]
    pub fn last(&self, count: usize) -> Self {
        let end = |values: &[f64]| values[values.len().saturating_sub(count)..].to_vec();
        Self {
            period_s: self.period_s,
            set_point_rad_s: end(&self.set_point_rad_s),
            current_a: end(&self.current_a),
            position_rad: end(&self.position_rad),
        }
    }

    /// The first of them.
    #[must_use]
    pub fn first(&self, count: usize) -> Self {
        let begin = |values: &[f64]| values[..count.min(values.len())].to_vec();
        Self {
            period_s: self.period_s,
            set_point_rad_s: begin(&self.set_point_rad_s),
            current_a: begin(&self.current_a),
            position_rad: begin(&self.position_rad),
        }
    }

    /// One more sample.
    pub fn push(&mut self, set_point_rad_s: f64, current_a: f64, position_rad: f64) {
        self.set_point_rad_s.push(set_point_rad_s);
        self.current_a.push(current_a);
        self.position_rad.push(position_rad);
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.position_rad.len()
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.position_rad.is_empty()
    }

    /// What speaks against using them at all.
    ///
    /// # Errors
    /// [`Unusable::Period`], [`Unusable::CutOff`], [`Unusable::NotFinite`], [`Unusable::Constant`].
    pub fn check(&self) -> Result<(), Unusable> {
        if !(self.period_s > 0.0 && self.period_s < 1.0) {
            return Err(Unusable::Period(self.period_s));
        }
        let signals = [
            ("the current", &self.current_a),
            ("the position", &self.position_rad),
            ("the set-point", &self.set_point_rad_s),
        ];
        // Files may have no set-point.
        let known = signals.into_iter().filter(|(name, values)| *name != "the set-point" || !values.is_empty());
        for (signal, values) in known {
            if values.len() != self.len() {
                return Err(Unusable::CutOff { signal, found: values.len(), expected: self.len() });
            }
            if let Some(at) = values.iter().position(|value| !value.is_finite()) {
                return Err(Unusable::NotFinite { signal, at, value: values[at] });
            }
            if values.windows(2).all(|pair| pair[0] == pair[1]) {
                return Err(Unusable::Constant { signal });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Excitation, response};

    fn samples() -> Samples {
        let mut samples = Samples { period_s: 1e-3, ..Samples::default() };
        (0..2000).for_each(|n| samples.push((f64::from(n) * 0.1).sin(), f64::from(n % 7), f64::from(n)));
        samples
    }

    #[test]
    fn what_cannot_be_used_is_refused_by_name_and_place() {
        let with = |change: fn(&mut Samples)| {
            let mut samples = samples();
            change(&mut samples);
            response(&samples, None).unwrap_err()
        };
        let nan = with(|samples| samples.current_a[17] = f64::NAN);
        assert!(matches!(nan, Unusable::NotFinite { signal: "the current", at: 17, .. }));
        assert!(nan.to_string().contains("NaN at sample 17"), "{nan}");
        assert!(matches!(
            with(|samples| samples.current_a.truncate(900)),
            Unusable::CutOff { found: 900, expected: 2000, .. }
        ));
        assert!(matches!(
            with(|samples| samples.position_rad.fill(3.0)),
            Unusable::Constant { signal: "the position" }
        ));
        assert!(matches!(with(|samples| samples.period_s = 0.0), Unusable::Period(_)));
        let few = with(|samples| {
            samples.position_rad.truncate(20);
            samples.current_a.truncate(20);
            samples.set_point_rad_s.truncate(20);
        });
        assert!(matches!(few, Unusable::TooShort { found: 20, .. }));
        assert!(matches!(
            with(|samples| *samples = Samples { period_s: 1e-3, ..Samples::default() }),
            Unusable::Constant { .. } | Unusable::TooShort { .. }
        ));
    }

    #[test]
    fn an_excitation_that_was_cut_off_is_too_short() {
        let excitation = Excitation::new(1e-3, 1.0, (1.0, 100.0)).unwrap();
        assert!(matches!(response(&samples(), Some(&excitation)), Err(Unusable::TooShort { needed: 3000, .. })));
    }
}
