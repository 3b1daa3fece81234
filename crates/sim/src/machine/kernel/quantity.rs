//! A quantity that a person at the machine sets, with the bounds of what makes sense.

use crate::Refused;

/// A quantity that a command sets, and what makes sense for it.
pub struct QuantityRange {
    /// Its name.
    pub what: &'static str,
    /// The range with its unit, for people.
    pub expected: &'static str,
    /// Lower end.
    pub least: f64,
    /// Upper end.
    pub greatest: f64,
}

impl QuantityRange {
    /// `value` if it is a number in the range.
    pub fn check(&self, value: f64) -> Result<f64, Refused> {
        if (self.least..=self.greatest).contains(&value) {
            return Ok(value);
        }
        Err(Refused::OutOfRange { what: self.what, expected: self.expected, value })
    }
}
