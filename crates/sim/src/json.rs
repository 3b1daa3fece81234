//! JSON with numbers that people can read: a tenth of three is 0.3, not 0.30000000000000004, and what is left of a decaying
//! current is 0, not 7.006e-45.

use std::io;

use serde::Serialize;
use serde_json::ser::Formatter;

/// A millionth of the unit: below what any sensor here resolves (counts of 0.01 V, 0.5 mA, a 4096th of a turn), and the
/// resolution of time stamps in candump logs.
const DECIMALS: f64 = 1e6;

/// Above this a `f64` has no millionths to round.
const WHOLE: f64 = 9_007_199_254_740_992.0;

/// One line of JSON. Numbers with a fraction are rounded to a millionth; what is not a number is `null`.
///
/// # Errors
/// Those of the value's own `Serialize`.
pub fn to_string(value: &(impl Serialize + ?Sized)) -> serde_json::Result<String> {
    let mut bytes = Vec::with_capacity(128);
    value.serialize(&mut serde_json::Serializer::with_formatter(&mut bytes, Rounded))?;
    // serde_json writes UTF-8 only.
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// One line of JSON that answers a request. Answers are flags, numbers and texts: they always become JSON.
pub fn line(answer: &impl Serialize) -> String {
    to_string(answer).unwrap_or_else(|_| r#"{"ok":false,"error":{"kind":"failed","message":"an answer cannot be written","node":null,"object":null,"abort":null,"next":null}}"#.to_owned())
}

/// A number without the digits that come of binary fractions.
pub fn rounded(value: f64) -> f64 {
    let scaled = value * DECIMALS;
    if scaled.abs() >= WHOLE {
        return value;
    }
    // The sum makes a negative zero a zero.
    scaled.round() / DECIMALS + 0.0
}

struct Rounded;

impl Formatter for Rounded {
    fn write_f64<W: io::Write + ?Sized>(&mut self, writer: &mut W, value: f64) -> io::Result<()> {
        serde_json::ser::CompactFormatter.write_f64(writer, rounded(value))
    }

    fn write_f32<W: io::Write + ?Sized>(&mut self, writer: &mut W, value: f32) -> io::Result<()> {
        self.write_f64(writer, f64::from(value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_that_were_meant() {
        let values = [3.0 * 0.1, 7.006e-45, -1e-12, 1.0 / 3.0, 12.5, -60.0, 1_700_000_000.123_456, 1e300];
        let text = "[0.3,0.0,0.0,0.333333,12.5,-60.0,1700000000.123456,1e+300]";
        assert_eq!(to_string(&values).unwrap(), text);
        assert_eq!(to_string(&[0.1_f32, 23.6]).unwrap(), "[0.1,23.6]");
        assert_eq!(to_string(&[f64::NAN, f64::INFINITY]).unwrap(), "[null,null]");
    }

    #[test]
    fn rounding_costs_half_a_millionth_at_most() {
        for step in 0..10_000 {
            let value = f64::from(step) * 0.123_456_789 - 600.0;
            assert!((rounded(value) - value).abs() <= 0.5e-6 + 1e-12, "{value}");
        }
    }
}
