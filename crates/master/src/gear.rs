//! What is between a drive's shaft and what the machine moves: a gear, a belt, a spindle.

use core::fmt;

use crate::units::Shown;

/// Ratio and feed behind a drive's shaft. With it, angles, speeds and accelerations of a [`Drive`](crate::Drive) are those
/// of the gear's output.
///
/// The words are those of CiA 402-2, 6091h and 6092h. Those objects are the drive's own business: a drive that reckons with
/// them counts behind that gear already, and this one stands behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gear {
    ratio: f64,
    feed_m: Option<f64>,
}

/// A ratio or a feed that no machine has.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GearError {
    /// The ratio is not a number above 0 within what gears have.
    #[error(
        "a gear ratio of {} is out of range: expected turns of the drive's shaft for one turn of the output, {LEAST_RATIO} to {MOST_RATIO}. \
         For a machine that turns the other way round see polarity (607Eh), or the drive's own object for it",
        Shown(*.0)
    )]
    Ratio(f64),
    /// The feed is not a length above 0.
    #[error("a feed constant of {} m is out of range: expected the way for one turn of the output, 1 um to 100 m", Shown(*.0))]
    Feed(f64),
}

const LEAST_RATIO: f64 = 1e-3;
const MOST_RATIO: f64 = 1e5;
const LEAST_FEED_M: f64 = 1e-6;
const MOST_FEED_M: f64 = 100.0;

impl Gear {
    /// No gear: the machine is on the drive's shaft.
    pub const DIRECT: Self = Self { ratio: 1.0, feed_m: None };

    /// A gear whose output turns once for this many turns of the drive's shaft.
    ///
    /// # Errors
    /// [`GearError::Ratio`].
    pub fn new(ratio: f64) -> Result<Self, GearError> {
        let is_one = (LEAST_RATIO..=MOST_RATIO).contains(&ratio);
        if is_one { Ok(Self { ratio, feed_m: None }) } else { Err(GearError::Ratio(ratio)) }
    }

    /// The same, whose output moves something by this many metres with each turn: the lead of a spindle, the circumference of
    /// a wheel or pulley.
    ///
    /// # Errors
    /// [`GearError::Feed`].
    pub fn with_feed(self, metres: f64) -> Result<Self, GearError> {
        let is_one = (LEAST_FEED_M..=MOST_FEED_M).contains(&metres);
        if is_one { Ok(Self { feed_m: Some(metres), ..self }) } else { Err(GearError::Feed(metres)) }
    }

    /// Turns of the drive's shaft for one turn of the output.
    pub const fn ratio(self) -> f64 {
        self.ratio
    }

    /// Metres for one turn of the output, where something moves along.
    pub const fn feed_m(self) -> Option<f64> {
        self.feed_m
    }

    /// A speed of the drive's shaft as one of the output, both in the same unit.
    pub(crate) fn at_output(self, of_shaft: f64) -> f64 {
        of_shaft / self.ratio
    }
}

impl Default for Gear {
    fn default() -> Self {
        Self::DIRECT
    }
}

/// `gear ratio 50, feed constant 10 mm`.
impl fmt::Display for Gear {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "gear ratio {}", Shown(self.ratio))?;
        self.feed_m.map_or(Ok(()), |metres| write!(f, ", feed constant {} mm", Shown(metres * 1e3)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_gear_is_refused() {
        for ratio in [0.0, -50.0, f64::NAN, f64::INFINITY, 1e6] {
            assert!(matches!(Gear::new(ratio), Err(GearError::Ratio(_))), "{ratio}");
        }
        let gear = Gear::new(160.0 / 3.0).expect("a gear");
        for feed in [0.0, -0.01, f64::NAN, 1e3] {
            assert!(matches!(gear.with_feed(feed), Err(GearError::Feed(_))), "{feed}");
        }
        assert_eq!(gear.with_feed(0.01).expect("a feed").to_string(), "gear ratio 53.33, feed constant 10 mm");
    }
}
