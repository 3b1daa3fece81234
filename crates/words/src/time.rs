//! Times of options and lines for which none at all makes no sense.

use std::time::Duration;

use master::units::parse_duration;

/// A time above 0, such as `500ms`.
///
/// # Errors
/// What is expected.
pub fn some_time(text: &str) -> Result<Duration, String> {
    let time = parse_duration(text).map_err(|error| error.to_string())?;
    if time.is_zero() { Err("expected a time above 0, e.g. 500ms".into()) } else { Ok(time) }
}
