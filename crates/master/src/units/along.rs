//! Ways, speeds and accelerations of something that a gear's output moves along: `40mm`, `0.2m/s`, `500mm/s2`.

use core::fmt;
use core::str::FromStr;

use super::{Angle, NO_RATE, NO_SIGN, ParseUnitError, Ramp, Rpm, Shown, out_of_range, split, wrong_unit};

/// A quantity of rotation, or the same along the way of what is moved. A [`Gear`](crate::Gear) with a feed makes the one
/// of the other: [`Drive::turning`](crate::Drive::turning).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Along<T> {
    /// As a rotation.
    Turning(T),
    /// In m, m/s or m/s².
    Metres(f64),
}

/// A quantity of rotation that a way belongs to.
pub trait Turning: Copy + fmt::Display + FromStr<Err = ParseUnitError> {
    /// What stands behind the unit of length, in its spellings.
    const PER: &'static [&'static str];

    /// Turns, turns a second, or turns a second squared.
    fn of_turns(turns: f64) -> Self;

    /// What is wrong with this number of metres, of which `text` speaks.
    ///
    /// # Errors
    /// [`ParseUnitError`].
    fn check(_metres: f64, _text: &str) -> Result<(), ParseUnitError> {
        Ok(())
    }
}

impl Turning for Angle {
    const PER: &'static [&'static str] = &[""];

    fn of_turns(turns: f64) -> Self {
        Self::Turns(turns)
    }
}

impl Turning for Rpm {
    const PER: &'static [&'static str] = &["/s"];

    fn of_turns(turns: f64) -> Self {
        Self(turns * 60.0)
    }
}

impl Turning for Ramp {
    const PER: &'static [&'static str] = &["/s2", "/s²", "/s^2"];

    fn of_turns(turns: f64) -> Self {
        Self::RpmPerSecond(turns * 60.0)
    }

    fn check(metres: f64, text: &str) -> Result<(), ParseUnitError> {
        let why = if metres < 0.0 {
            NO_SIGN
        } else if metres == 0.0 {
            NO_RATE
        } else {
            return Ok(());
        };
        Err(out_of_range(text, why))
    }
}

const LENGTHS: [(&str, f64); 5] = [("um", 1e-6), ("µm", 1e-6), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];

/// A length such as `10mm` or `0.5m`, in metres.
///
/// # Errors
/// [`ParseUnitError`] when it is not one.
pub fn parse_length(text: &str) -> Result<f64, ParseUnitError> {
    const LENGTH: &str = "a length such as 10mm or 0.5m";
    let (number, unit) = split(text, LENGTH)?;
    let factor = metres(unit, &[""]);
    factor.map(|factor| number * factor).ok_or_else(|| match unit {
        "" => ParseUnitError::NoUnit { text: text.to_owned(), expected: LENGTH },
        _ => wrong_unit(text, unit, LENGTH),
    })
}

/// How many metres this unit is, if it is one of length.
fn metres(unit: &str, per: &[&str]) -> Option<f64> {
    LENGTHS.iter().find_map(|(name, factor)| per.contains(&unit.strip_prefix(name)?).then_some(*factor))
}

impl<T> From<T> for Along<T> {
    fn from(turning: T) -> Self {
        Self::Turning(turning)
    }
}

impl<T: Turning> FromStr for Along<T> {
    type Err = ParseUnitError;

    fn from_str(text: &str) -> Result<Self, ParseUnitError> {
        let length = split(text, "a number and its unit").ok().and_then(|(number, unit)| {
            let factor = metres(unit, T::PER)?;
            Some(number * factor)
        });
        match length {
            Some(metres) => T::check(metres, text).map(|()| Self::Metres(metres)),
            None => text.parse().map(Self::Turning),
        }
    }
}

/// `90°`, `40 mm`, `200 mm/s`.
impl<T: Turning> fmt::Display for Along<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Turning(turning) => turning.fmt(f),
            Self::Metres(metres) => write!(f, "{} mm{}", Shown(metres * 1e3), T::PER[0]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along<T: Turning>(text: &str) -> Along<T> {
        text.parse().unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn a_unit_of_length_is_a_way_and_everything_else_a_rotation() {
        assert_eq!(along("40mm"), Along::<Angle>::Metres(0.04));
        assert_eq!(along("-2.5 cm"), Along::<Angle>::Metres(-0.025));
        assert_eq!(along("90deg"), Along::Turning(Angle::Turns(0.25)));
        assert_eq!(along("32000"), Along::Turning(Angle::Counts(32_000)));
        assert_eq!(along("0.2m/s"), Along::<Rpm>::Metres(0.2));
        assert_eq!(along("60rpm"), Along::Turning(Rpm(60.0)));
        assert_eq!(along("500mm/s^2"), Along::<Ramp>::Metres(0.5));
        assert_eq!(along("120rpm/s"), Along::Turning(Ramp::RpmPerSecond(120.0)));
        assert_eq!(along::<Rpm>("200mm/s").to_string(), "200 mm/s");
    }

    #[test]
    fn a_way_is_no_speed_and_a_ramp_has_no_sign() {
        assert!("40mm".parse::<Along<Rpm>>().is_err());
        assert!("40mm/s".parse::<Along<Angle>>().is_err());
        assert!("40mm/s".parse::<Along<Ramp>>().is_err());
        assert!("-1m/s2".parse::<Along<Ramp>>().is_err_and(|error| error.to_string().contains("no sign")));
        assert!("0m/s2".parse::<Along<Ramp>>().is_err_and(|error| error.to_string().contains("rate of zero")));
        assert!("mm".parse::<Along<Angle>>().is_err());
    }

    #[test]
    fn lengths_want_their_unit() {
        assert_eq!(parse_length("10mm"), Ok(0.01));
        assert!(parse_length("10").is_err_and(|error| error.to_string().contains("has no unit")));
        assert!(parse_length("10mm/s").is_err_and(|error| error.to_string().contains("not a unit of this quantity")));
    }
}
