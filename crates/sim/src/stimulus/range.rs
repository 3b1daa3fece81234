//! Where something is beside a shaft.

use super::error::StimulusError;

/// A stretch of the actual position in the drive's counts, ends included; `None` reaches for ever.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SwitchRange {
    /// Lower end.
    pub low: Option<i64>,
    /// Upper end.
    pub high: Option<i64>,
}

impl SwitchRange {
    /// From `low` to `high`.
    ///
    /// # Errors
    /// It is empty.
    pub const fn new(low: Option<i64>, high: Option<i64>) -> Result<Self, StimulusError> {
        match (low, high) {
            (Some(low), Some(high)) if low > high => Err(StimulusError::EmptyRange { low, high }),
            _ => Ok(Self { low, high }),
        }
    }

    /// True while the switch is active.
    pub fn contains(&self, position: i64) -> bool {
        self.low.is_none_or(|low| low <= position) && self.high.is_none_or(|high| position <= high)
    }
}
