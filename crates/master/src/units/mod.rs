//! Physical units as people type them, and the one place where they are converted.
//!
//! In: texts like `60rpm`, `90deg`, `0.5turn`, `32000`, `1.5A`, `500ms`. Out: newtypes whose name is their unit.
//! A drive's own raw units are not known here: its description has them. Source of the SI symbols: BIPM
//! brochure; `r/min` and `rpm` are one unit.

mod along;

pub use along::{Along, Turning, parse_length};

use core::f64::consts::TAU;
use core::fmt;
use core::str::FromStr;
use std::time::Duration;

use can::ParseDurationError;

/// Speed of rotation in revolutions per minute.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Rpm(pub f64);

/// Speed of rotation in radians per second.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct RadiansPerSecond(pub f64);

/// Angle in degrees.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Degrees(pub f64);

/// Angle in revolutions.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Turns(pub f64);

/// Angle in the drive's own position counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Counts(pub i64);

/// Electric current in amperes.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Amperes(pub f64);

/// Voltage in volts.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Volts(pub f64);

/// Temperature in degrees Celsius.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Celsius(pub f64);

/// An angle as it was given: in counts, which are exact, or in turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Angle {
    /// The drive's own counts.
    Counts(i64),
    /// Revolutions of the output shaft.
    Turns(f64),
}

/// How fast a speed may change: a rate, or the time that one change may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ramp {
    /// (r/min)/s.
    RpmPerSecond(f64),
    /// Time from the present speed to the wanted one.
    Time(Duration),
}

impl From<RadiansPerSecond> for Rpm {
    fn from(speed: RadiansPerSecond) -> Self {
        Self(speed.0 * cia402::RPM_PER_RAD_S)
    }
}

impl From<Rpm> for RadiansPerSecond {
    fn from(speed: Rpm) -> Self {
        Self(speed.0 * cia402::RAD_S_PER_RPM)
    }
}

impl From<Degrees> for Angle {
    fn from(angle: Degrees) -> Self {
        Self::Turns(angle.0 / 360.0)
    }
}

impl From<Degrees> for Turns {
    fn from(angle: Degrees) -> Self {
        Self(angle.0 / 360.0)
    }
}

impl From<Turns> for Angle {
    fn from(angle: Turns) -> Self {
        Self::Turns(angle.0)
    }
}

impl From<Counts> for Angle {
    fn from(angle: Counts) -> Self {
        Self::Counts(angle.0)
    }
}

/// A number as people read it: the digits that matter, and no others. `2.7`, `60`, `0.088`, `12345.7`.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Shown(pub f64);

/// Decimals that may matter: four digits of a number below one, fewer of a larger one, never more than six.
const MOST_DECIMALS: i32 = 6;
const DIGITS_BEHIND_THE_FIRST: i32 = 3;

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let magnitude = self.0.abs().log10().floor();
        // Of zero the logarithm is minus infinity.
        let first = if magnitude.is_finite() { magnitude as i32 } else { 0 };
        let decimals = (DIGITS_BEHIND_THE_FIRST - first).clamp(1, MOST_DECIMALS) as usize;
        let text = format!("{:.decimals$}", self.0);
        let text = text.trim_end_matches('0').trim_end_matches('.');
        f.write_str(if text == "-0" { "0" } else { text })
    }
}

/// A text that is not the quantity it should be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParseUnitError {
    /// No number at the start.
    #[error("\"{text}\" does not begin with a number; expected {expected}")]
    NoNumber {
        /// What was given.
        text: String,
        /// What would have been right.
        expected: &'static str,
    },
    /// A number without a unit where the unit cannot be guessed.
    #[error("\"{text}\" has no unit; expected {expected}")]
    NoUnit {
        /// What was given.
        text: String,
        /// What would have been right.
        expected: &'static str,
    },
    /// The unit is unknown or of another quantity.
    #[error("\"{unit}\" in \"{text}\" is not a unit of this quantity; expected {expected}")]
    WrongUnit {
        /// What was given.
        text: String,
        /// The part after the number.
        unit: String,
        /// What would have been right.
        expected: &'static str,
    },
    /// Counts with a fraction, a negative time, or a number that is not finite.
    #[error("\"{text}\" is out of range: {why}")]
    OutOfRange {
        /// What was given.
        text: String,
        /// Which rule it breaks.
        why: &'static str,
    },
}

const SPEED: &str = "a speed such as 60rpm, 6.28rad/s, 360deg/s or 1turn/s (a bare number is r/min)";
const ANGLE: &str = "an angle such as 90deg, 0.5turn, 1.57rad or 32000 (a bare number is counts)";
const CURRENT: &str = "a current such as 1.5A or 1500mA";
const RAMP: &str = "a ramp such as 500ms, 0.5s, 120rpm/s, 12.6rad/s2, 720deg/s2 or 2turn/s2";
const NO_SIGN: &str = "a ramp has no sign";
const NO_RATE: &str = "at a rate of zero no speed is ever reached; without a ramp it is 0ms";

impl FromStr for Rpm {
    type Err = ParseUnitError;

    fn from_str(text: &str) -> Result<Self, ParseUnitError> {
        let (number, unit) = split(text, SPEED)?;
        let unit = if unit.is_empty() { "rpm" } else { unit };
        speed(number, unit).ok_or_else(|| wrong_unit(text, unit, SPEED))
    }
}

/// A number of a unit of speed.
fn speed(number: f64, unit: &str) -> Option<Rpm> {
    Some(match unit {
        "rpm" | "r/min" | "1/min" => Rpm(number),
        "rad/s" => RadiansPerSecond(number).into(),
        "deg/s" | "°/s" => Rpm(number / 6.0),
        "turn/s" | "turns/s" | "rps" | "r/s" => Rpm(number * 60.0),
        _ => return None,
    })
}

/// A number of a unit of speed in a second, as a speed in r/min gained in one: `rpm/s`, `deg/s2`.
fn rate(number: f64, unit: &str) -> Option<f64> {
    let squared = ["^2", "2", "²"].into_iter().find_map(|power| unit.strip_suffix(power));
    let unit = squared.filter(|unit| unit.ends_with("/s")).or_else(|| unit.strip_suffix("/s"))?;
    speed(number, unit).map(|Rpm(gained)| gained)
}

impl FromStr for Angle {
    type Err = ParseUnitError;

    fn from_str(text: &str) -> Result<Self, ParseUnitError> {
        let (number, unit) = split(text, ANGLE)?;
        Ok(match unit {
            "" | "counts" | "count" | "inc" => {
                if number.fract() != 0.0 || number.abs() > i64::from(u32::MAX) as f64 {
                    return Err(out_of_range(text, "counts are whole numbers of at most 32 bits"));
                }
                Self::Counts(number as i64)
            }
            "deg" | "°" => Degrees(number).into(),
            "turn" | "turns" | "rev" | "r" => Self::Turns(number),
            "rad" => Self::Turns(number / TAU),
            _ => return Err(wrong_unit(text, unit, ANGLE)),
        })
    }
}

impl FromStr for Amperes {
    type Err = ParseUnitError;

    fn from_str(text: &str) -> Result<Self, ParseUnitError> {
        let (number, unit) = split(text, CURRENT)?;
        match unit {
            "A" | "a" => Ok(Self(number)),
            "mA" | "ma" => Ok(Self(number / 1000.0)),
            "" => Err(ParseUnitError::NoUnit { text: text.to_owned(), expected: CURRENT }),
            _ => Err(wrong_unit(text, unit, CURRENT)),
        }
    }
}

impl FromStr for Ramp {
    type Err = ParseUnitError;

    fn from_str(text: &str) -> Result<Self, ParseUnitError> {
        let (number, unit) = split(text, RAMP)?;
        if number < 0.0 {
            return Err(out_of_range(text, NO_SIGN));
        }
        if unit.is_empty() {
            return Err(ParseUnitError::NoUnit { text: text.to_owned(), expected: RAMP });
        }
        match rate(number, unit) {
            Some(0.0) => Err(out_of_range(text, NO_RATE)),
            Some(rpm_per_s) => Ok(Self::RpmPerSecond(rpm_per_s)),
            None => match parse_duration(text) {
                // It begins with a number, whatever a time makes of what follows.
                Err(ParseUnitError::WrongUnit { .. } | ParseUnitError::NoNumber { .. }) => {
                    Err(wrong_unit(text, unit, RAMP))
                }
                time => time.map(Self::Time),
            },
        }
    }
}

/// A duration such as `500ms` or `2s`: [`can::parse_duration`], with the text in the error.
///
/// # Errors
/// [`ParseUnitError`] when it is not a time, negative, or longer than a year.
pub fn parse_duration(text: &str) -> Result<Duration, ParseUnitError> {
    let expected = ParseDurationError::EXPECTED;
    can::parse_duration(text).map_err(|error| match error {
        ParseDurationError::NoNumber => ParseUnitError::NoNumber { text: text.to_owned(), expected },
        ParseDurationError::NoUnit => ParseUnitError::NoUnit { text: text.to_owned(), expected },
        ParseDurationError::WrongUnit(unit) => wrong_unit(text, unit, expected),
        ParseDurationError::OutOfRange => out_of_range(text, "a time is between 0 and a year"),
    })
}

/// Number and unit of `text`; blanks between them are allowed.
fn split<'a>(text: &'a str, expected: &'static str) -> Result<(f64, &'a str), ParseUnitError> {
    let trimmed = text.trim();
    let end = number_end(trimmed.as_bytes());
    let (number, unit) = trimmed.split_at(end);
    let number: f64 = number.parse().map_err(|_| ParseUnitError::NoNumber { text: text.to_owned(), expected })?;
    if !number.is_finite() {
        return Err(out_of_range(text, "the number is too large"));
    }
    Ok((number, unit.trim_start()))
}

/// Where a decimal number with optional sign, fraction and exponent ends.
fn number_end(text: &[u8]) -> usize {
    let digits = |from: usize| text[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let mut end = usize::from(matches!(text.first(), Some(b'+' | b'-')));
    end += digits(end);
    if text.get(end) == Some(&b'.') {
        end += 1 + digits(end + 1);
    }
    if let Some(b'e' | b'E') = text.get(end) {
        let sign = usize::from(matches!(text.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits((end + 1 + sign).min(text.len()));
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    end
}

fn wrong_unit(text: &str, unit: &str, expected: &'static str) -> ParseUnitError {
    ParseUnitError::WrongUnit { text: text.to_owned(), unit: unit.to_owned(), expected }
}

fn out_of_range(text: &str, why: &'static str) -> ParseUnitError {
    ParseUnitError::OutOfRange { text: text.to_owned(), why }
}

macro_rules! display {
    ($($unit:ty => $form:literal;)*) => {$(
        impl fmt::Display for $unit {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, $form, Shown(self.0))
            }
        }
    )*};
}

display! {
    Rpm => "{} r/min";
    RadiansPerSecond => "{} rad/s";
    Degrees => "{}°";
    Turns => "{} turns";
    Amperes => "{} A";
    Volts => "{} V";
    Celsius => "{} °C";
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} counts", self.0)
    }
}

impl fmt::Display for Angle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Counts(counts) => Counts(counts).fmt(f),
            Self::Turns(turns) => Degrees(turns * 360.0).fmt(f),
        }
    }
}

impl fmt::Display for Ramp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::RpmPerSecond(rate) => write!(f, "{} r/min/s", Shown(*rate)),
            Self::Time(time) => write!(f, "{} ms", Shown(time.as_secs_f64() * 1e3)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_in_every_unit_mean_the_same() {
        for text in ["60rpm", "60 r/min", "60", "360deg/s", "1turn/s", "6.283185307179586rad/s", "6e1rpm", "+60.0rpm"] {
            let Rpm(speed) = text.parse().unwrap();
            assert!((speed - 60.0).abs() < 1e-9, "{text}: {speed}");
        }
        assert_eq!("-50rpm".parse(), Ok(Rpm(-50.0)));
    }

    #[test]
    fn angles_keep_counts_exact_and_turn_the_rest_into_turns() {
        assert_eq!("32000".parse(), Ok(Angle::Counts(32_000)));
        assert_eq!("-32000 counts".parse(), Ok(Angle::Counts(-32_000)));
        assert_eq!("90deg".parse(), Ok(Angle::Turns(0.25)));
        assert_eq!("0.5turn".parse(), Ok(Angle::Turns(0.5)));
        assert_eq!("0.5rev".parse(), Ok(Angle::Turns(0.5)));
    }

    #[test]
    fn numbers_are_shown_with_the_digits_that_matter() {
        let shown = [2.7, 60.0, -0.0, 0.3 - 1e-17, 1.0 / 3.0, 12_345.678, 0.087_890_6, 1e-9, -1234.5678, 1e12];
        let texts = shown.map(|number| Shown(number).to_string());
        assert_eq!(texts, ["2.7", "60", "0", "0.3", "0.3333", "12345.7", "0.08789", "0", "-1234.6", "1000000000000"]);
        assert_eq!(Rpm(2.75).to_string(), "2.75 r/min");
    }

    #[test]
    fn currents_want_their_unit() {
        assert_eq!("1.5A".parse(), Ok(Amperes(1.5)));
        assert_eq!("1500mA".parse(), Ok(Amperes(1.5)));
        let error = "1500".parse::<Amperes>().unwrap_err();
        assert_eq!(error.to_string(), "\"1500\" has no unit; expected a current such as 1.5A or 1500mA");
    }

    #[test]
    fn ramps_are_times_or_rates() {
        assert_eq!("500ms".parse(), Ok(Ramp::Time(Duration::from_millis(500))));
        assert_eq!("0.5s".parse(), Ok(Ramp::Time(Duration::from_millis(500))));
        assert_eq!("500000µs".parse(), Ok(Ramp::Time(Duration::from_millis(500))));
        assert_eq!("120rpm/s".parse(), Ok(Ramp::RpmPerSecond(120.0)));
        assert!("-120rpm/s".parse::<Ramp>().is_err());
        // A turn is 360 degrees, a minute 60 seconds.
        for same in ["720deg/s2", "720 °/s²", "720deg/s^2", "2turn/s2", "2turns/s2", "2r/s2", "2rps/s", "120r/min/s"]
        {
            assert_eq!(same.parse(), Ok(Ramp::RpmPerSecond(120.0)), "{same}");
        }
        for wrong in ["100deg", "100deg/s", "100deg2", "100rpm2", "100rpm", "100/s2", "100s2", "100deg/s3", "0deg/s2"] {
            let error = wrong.parse::<Ramp>().unwrap_err().to_string();
            let is_said = error.contains("a ramp such as") || error.contains("rate of zero");
            assert!(is_said && !error.contains("begin with a number"), "{wrong}: {error}");
        }
    }

    #[test]
    fn a_time_that_is_refused_is_quoted() {
        for (wrong, why) in [
            ("2", "\"2\" has no unit; expected a time such as 500ms, 2s, 5min or 1h"),
            ("h", "\"h\" does not begin with a number; expected a time such as 500ms, 2s, 5min or 1h"),
            (
                "1.5sss",
                "\"sss\" in \"1.5sss\" is not a unit of this quantity; expected a time such as 500ms, 2s, 5min or 1h",
            ),
            ("-1s", "\"-1s\" is out of range: a time is between 0 and a year"),
        ] {
            assert_eq!(parse_duration(wrong).unwrap_err().to_string(), why);
        }
    }

    #[test]
    fn what_is_wrong_is_reported() {
        let says = |text: &str| text.parse::<Angle>().unwrap_err().to_string();
        assert!(says("deg").starts_with("\"deg\" does not begin with a number"));
        assert!(says("90rpm").starts_with("\"rpm\" in \"90rpm\" is not a unit of this quantity"));
        assert!(says("0.5").contains("whole numbers"));
        assert!(says("1e999turn").contains("too large"));
        for text in ["", " ", ".", "-", "e5", "--5deg", "nandeg", "infdeg", "5.e", "µ"] {
            assert!(text.parse::<Angle>().is_err(), "{text:?}");
        }
    }
}
