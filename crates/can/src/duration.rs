//! A time as people type it: `500ms`, `1.5s`, `2 h`. Wherever one is written, it is read here.
//!
//! In: a decimal number and a unit of [`DURATION_UNITS`], with blanks around them or not. Out: nanoseconds, rounded to the nearest.
//! What `{:?}` prints of a [`Duration`] is read back exactly. Times of day and dates are not read.

use core::fmt;
use core::time::Duration;

/// The units of a time and their nanoseconds (BIPM brochure, tables 1, 7 and 8). Both characters for micro are in use.
pub const DURATION_UNITS: [(&str, u64); 8] = [
    ("ns", 1),
    ("us", 1_000),
    ("µs", 1_000),
    ("μs", 1_000),
    ("ms", 1_000_000),
    ("s", NANOSECONDS_PER_SECOND),
    ("min", 60 * NANOSECONDS_PER_SECOND),
    ("h", 3600 * NANOSECONDS_PER_SECOND),
];

const NANOSECONDS_PER_SECOND: u64 = 1_000_000_000;

/// The longest time that is read: 365 days. What is longer is a mistake in the unit, and further below what [`crate::Instant`] holds.
const LONGEST: Duration = Duration::from_secs(365 * 86_400);

/// Why a text is not a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParseDurationError<'a> {
    /// It does not begin with a decimal number.
    NoNumber,
    /// It is a number alone.
    NoUnit,
    /// What follows the number.
    WrongUnit(&'a str),
    /// Negative, or longer than a year.
    OutOfRange,
}

impl ParseDurationError<'_> {
    /// What would have been right.
    pub const EXPECTED: &'static str = "a time such as 500ms, 2s, 5min or 1h";
}

impl fmt::Display for ParseDurationError<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoNumber => f.write_str("no number")?,
            Self::NoUnit => f.write_str("no unit")?,
            Self::WrongUnit(unit) => write!(f, "\"{unit}\" is not a unit of time")?,
            Self::OutOfRange => return f.write_str("a time is between 0 and a year"),
        }
        write!(f, "; expected {}", Self::EXPECTED)
    }
}

impl core::error::Error for ParseDurationError<'_> {}

/// The time that `text` says.
///
/// # Errors
/// [`ParseDurationError`] when it is not a time, has no unit, is negative, or is longer than a year.
pub fn parse_duration(text: &str) -> Result<Duration, ParseDurationError<'_>> {
    parse_duration_in("", text)
}

/// The time that `text` says, where a number alone is of `unit`.
///
/// # Errors
/// As [`parse_duration`].
pub fn parse_duration_in<'a>(unit: &'a str, text: &'a str) -> Result<Duration, ParseDurationError<'a>> {
    let text = text.trim();
    let number = text.trim_end_matches(char::is_alphabetic);
    let unit = if number.len() < text.len() { &text[number.len()..] } else { unit };
    let number = number.trim_end();
    // `f64` reads words such as inf, too.
    let is_decimal = number.ends_with(|last: char| last.is_ascii_digit() || last == '.');
    let value: f64 = number.parse().ok().filter(|_| is_decimal).ok_or(ParseDurationError::NoNumber)?;
    if unit.is_empty() {
        return Err(ParseDurationError::NoUnit);
    }
    let known = DURATION_UNITS.iter().find(|(name, _)| *name == unit);
    let unit_ns = known.ok_or(ParseDurationError::WrongUnit(unit))?.1;
    let point = number.find('.').unwrap_or(number.len());
    let ns = match number[..point].parse::<u64>() {
        // A double has not the digits for a year in nanoseconds; its whole part and its fraction have, each for itself.
        Ok(whole) if !number.contains(['e', 'E']) => {
            let fraction = number[point..].parse::<f64>().unwrap_or(0.0);
            whole.saturating_mul(unit_ns).saturating_add(rounded(fraction * unit_ns as f64))
        }
        _ => rounded(value * unit_ns as f64),
    };
    let time = Duration::from_nanos(ns);
    if value.is_sign_negative() || time > LONGEST { Err(ParseDurationError::OutOfRange) } else { Ok(time) }
}

/// A number that is not negative, to the nearest; a larger one than fits is the largest.
fn rounded(ns: f64) -> u64 {
    (ns + 0.5) as u64
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::ParseDurationError as Error;
    use super::*;
    use proptest::prelude::*;
    use std::format;
    use std::string::String;

    #[test]
    fn each_unit_is_what_the_brochure_says() {
        let times =
            [("7ns", 7), ("7us", 7_000), ("7 µs", 7_000), ("7μs", 7_000), ("7ms", 7_000_000), (" 7s ", 7_000_000_000)];
        for (text, ns) in times {
            assert_eq!(parse_duration(text), Ok(Duration::from_nanos(ns)), "{text}");
        }
        assert_eq!(parse_duration("1.5min"), Ok(Duration::from_secs(90)));
        assert_eq!(parse_duration("2h"), Ok(Duration::from_secs(7200)));
        assert_eq!(parse_duration("+1.5e3ms"), Ok(Duration::from_millis(1500)));
        assert_eq!(parse_duration(".5s"), parse_duration("500ms"));
        assert_eq!(parse_duration("5.s"), parse_duration("5s"));
        assert_eq!(parse_duration("1.4ns"), Ok(Duration::from_nanos(1)));
        assert_eq!(parse_duration("8760h"), Ok(LONGEST));
    }

    #[test]
    fn what_is_not_a_time_is_refused() {
        let wrong = [
            ("1.5sss", Error::WrongUnit("sss")),
            ("2d", Error::WrongUnit("d")),
            ("5MS", Error::WrongUnit("MS")),
            ("5e", Error::WrongUnit("e")),
            ("1s2", Error::NoNumber),
            ("", Error::NoNumber),
            (" ", Error::NoNumber),
            ("h", Error::NoNumber),
            ("-", Error::NoNumber),
            (".s", Error::NoNumber),
            ("1 2s", Error::NoNumber),
            ("1,5s", Error::NoNumber),
            ("NaN", Error::NoNumber),
            ("nan s", Error::NoNumber),
            ("infs", Error::NoNumber),
            ("0x10s", Error::NoNumber),
            ("2", Error::NoUnit),
            ("-1s", Error::OutOfRange),
            ("-1e-30h", Error::OutOfRange),
            ("8760.1h", Error::OutOfRange),
            ("1e999s", Error::OutOfRange),
            ("99999999999999999999999s", Error::OutOfRange),
            ("18446744073709551615h", Error::OutOfRange),
        ];
        for (text, error) in wrong {
            assert_eq!(parse_duration(text), Err(error), "{text}");
        }
        let said = format!("{}", Error::WrongUnit("sss"));
        assert_eq!(said, "\"sss\" is not a unit of time; expected a time such as 500ms, 2s, 5min or 1h");
    }

    #[test]
    fn a_number_alone_is_of_the_unit_that_is_usual_there() {
        assert_eq!(parse_duration_in("s", "1.5"), Ok(Duration::from_millis(1500)));
        assert_eq!(parse_duration_in("s", "1.5ms"), Ok(Duration::from_micros(1500)));
        assert_eq!(parse_duration_in("ms", "1.5sss"), Err(Error::WrongUnit("sss")));
    }

    proptest! {
        #[test]
        fn a_time_that_was_printed_is_read_back(ns in 0..=LONGEST.as_nanos() as u64) {
            let time = Duration::from_nanos(ns);
            let text = format!("{time:?}");
            prop_assert_eq!(parse_duration(&text), Ok(time));
        }

        #[test]
        fn whole_numbers_of_a_unit_are_exact(number in 0_u64..8760, (unit, ns) in prop::sample::select(&DURATION_UNITS[..])) {
            let text = format!("{number} {unit}");
            prop_assert_eq!(parse_duration(&text), Ok(Duration::from_nanos(number * ns)));
        }

        #[test]
        fn any_text_is_answered(text in ".{0,12}|-?[0-9.eE+]{0,25} ?(s|ms|µs|min|h|x)?") {
            let is_short = |time: Duration| time <= LONGEST;
            prop_assert!(parse_duration(&text).map_or(true, is_short), "{}", text);
            let unit_twice: String = [&text, "s"].concat();
            if parse_duration(&text).is_ok() {
                prop_assert!(parse_duration(&unit_twice).is_err(), "{}", unit_twice);
            }
        }
    }
}
