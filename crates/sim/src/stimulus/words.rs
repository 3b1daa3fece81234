//! Single words of a stimulus, and what is wrong with them.

use super::error::StimulusError;
use super::range::SwitchRange;

/// The longest word that is said again in an error.
const LONGEST_SHOWN: usize = 40;

/// A word to be said again in an error: no more of it than shows which one is meant.
pub(crate) fn excerpt(text: &str) -> String {
    match text.char_indices().nth(LONGEST_SHOWN) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}...", &text[..end]),
    }
}

/// A finite number, not below `least`.
pub(super) fn number(text: &str, what: &'static str, least: f64, usage: &'static str) -> Result<f64, StimulusError> {
    let value: Option<f64> = text.parse().ok().filter(|value: &f64| value.is_finite() && *value >= least);
    value.ok_or_else(|| StimulusError::BadValue { text: excerpt(text), what, usage })
}

/// A finite number, not negative.
pub(super) fn value(text: &str, what: &'static str, usage: &'static str) -> Result<f64, StimulusError> {
    number(text, what, 0.0, usage)
}

/// A stretch of positions, whose ends may be `min` and `max`.
pub(super) fn range(low: &str, high: &str, usage: &'static str) -> Result<SwitchRange, StimulusError> {
    SwitchRange::new(bound(low, "min", usage)?, bound(high, "max", usage)?)
}

fn bound(text: &str, open: &str, usage: &'static str) -> Result<Option<i64>, StimulusError> {
    if text == open {
        return Ok(None);
    }
    let bad = |_| StimulusError::BadValue { text: excerpt(text), what: "position", usage };
    text.parse().map(Some).map_err(bad)
}

/// An end of a stretch of positions.
pub(super) fn bound_word(bound: Option<i64>, open: &str) -> String {
    bound.map_or_else(|| open.to_owned(), |bound| bound.to_string())
}
