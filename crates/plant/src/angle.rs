//! The rotor's angle: whole turns apart from the fraction of a turn.
//!
//! A plain `f64` of radians loses resolution as a motor runs for days; an integer of turns and a fraction in
//! `[0, 1)` keeps the same resolution (about 1e-16 of a turn) for as long as `i64` lasts.
//! [`sin_cos_turns`] is the one transcendental function of the plant's hot path.

/// An angle that never loses resolution: `turns + fraction` turns, with `fraction` in `[0, 1)`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Angle {
    turns: i64,
    fraction: f64,
}

impl Angle {
    /// The angle of `turns` whole turns and `fraction` of a turn. The fraction may be any finite number.
    pub fn new(turns: i64, fraction: f64) -> Self {
        Angle { turns, fraction: 0.0 }.advanced_by(fraction)
    }

    /// An angle of so many turns.
    pub fn from_turns(turns: f64) -> Self {
        Angle::new(0, turns)
    }

    /// Whole turns, rounded towards minus infinity.
    pub fn turns(self) -> i64 {
        self.turns
    }

    /// The rest of a turn, in `[0, 1)`.
    pub fn fraction(self) -> f64 {
        self.fraction
    }

    /// The angle in turns as one number; loses resolution when the number of turns is large.
    pub fn as_turns(self) -> f64 {
        self.turns as f64 + self.fraction
    }

    /// The angle in radians as one number; loses resolution when the number of turns is large.
    pub fn as_rad(self) -> f64 {
        self.as_turns() * core::f64::consts::TAU
    }

    /// How many turns this angle is ahead of another, to the full resolution while they are near each other.
    pub fn turns_from(self, other: Angle) -> f64 {
        self.turns.wrapping_sub(other.turns) as f64 + (self.fraction - other.fraction)
    }

    /// This angle moved on by `delta` turns.
    #[inline]
    pub fn advanced_by(self, delta: f64) -> Self {
        let sum = self.fraction + delta;
        if (0.0..1.0).contains(&sum) {
            return Angle { turns: self.turns, fraction: sum };
        }
        let whole = floor(sum);
        let fraction = sum - whole;
        // A tiny negative sum rounds up to a whole turn.
        if fraction < 1.0 {
            Angle { turns: self.turns.wrapping_add(whole as i64), fraction }
        } else {
            Angle { turns: self.turns.wrapping_add(whole as i64).wrapping_add(1), fraction: 0.0 }
        }
    }

    /// The position on a scale of `divisions` per turn, rounded towards minus infinity: what a counter would read.
    #[inline]
    pub fn count(self, divisions: u32) -> i64 {
        let within = (self.fraction * f64::from(divisions)) as u32;
        self.turns.wrapping_mul(i64::from(divisions)).wrapping_add(i64::from(within))
    }
}

/// A direction in the plane, kept as sine and cosine so that it can be turned a little without new series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Sine of its angle.
    pub sin: f64,
    /// Cosine of its angle.
    pub cos: f64,
}

impl Default for Axis {
    /// The direction at angle zero.
    fn default() -> Self {
        Axis { sin: 0.0, cos: 1.0 }
    }
}

impl Axis {
    /// The direction at an angle in turns.
    #[inline]
    pub fn at_turns(turns: f64) -> Self {
        let (sin, cos) = sin_cos_turns(turns);
        Axis { sin, cos }
    }

    /// The direction at a small angle: what to turn another one by.
    ///
    /// Up to a tenth of a radian it is summed from the series up to the fifth power, error `0.1^6 / 720 = 1.4e-9`;
    /// beyond that the full functions are used.
    #[inline]
    pub fn at_small_rad(rad: f64) -> Self {
        if rad.abs() > 0.1 {
            return Axis::at_turns(rad / core::f64::consts::TAU);
        }
        let x = rad * rad;
        Axis { sin: rad * (1.0 - x * (1.0 / 6.0 - x * (1.0 / 120.0))), cos: 1.0 - x * (0.5 - x * (1.0 / 24.0)) }
    }

    /// The direction turned on by the angle of another.
    #[inline]
    pub fn turned_by(self, other: Axis) -> Self {
        Axis { sin: self.sin * other.cos + self.cos * other.sin, cos: self.cos * other.cos - self.sin * other.sin }
    }
}

/// The largest whole number not above `x`, for `|x| < 2^63`.
#[inline]
pub(crate) fn floor(x: f64) -> f64 {
    let truncated = x as i64 as f64;
    if truncated > x { truncated - 1.0 } else { truncated }
}

/// Sine and cosine of an angle in turns (`|turns| < 2^62`).
///
/// The angle is reduced to a quarter turn about its nearest multiple, `|r| <= pi/4`, and both functions are summed
/// from their Taylor series up to `r^11` and `r^12`. The first terms left out bound the error:
/// `(pi/4)^13 / 13! = 7e-12` for the sine, `(pi/4)^14 / 14! = 4e-13` for the cosine.
#[inline]
pub fn sin_cos_turns(turns: f64) -> (f64, f64) {
    let quarters = floor(turns * 4.0 + 0.5);
    let r = (turns - quarters * 0.25) * core::f64::consts::TAU;
    let x = r * r;
    let sin = r
        * (1.0
            + x * (-1.0 / 6.0
                + x * (1.0 / 120.0 + x * (-1.0 / 5_040.0 + x * (1.0 / 362_880.0 + x * (-1.0 / 39_916_800.0))))));
    let cos = 1.0
        + x * (-0.5
            + x * (1.0 / 24.0
                + x * (-1.0 / 720.0 + x * (1.0 / 40_320.0 + x * (-1.0 / 3_628_800.0 + x * (1.0 / 479_001_600.0))))));
    match quarters as i64 & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_stay_within_the_stated_error() {
        for step in -40_000..40_000 {
            let turns = f64::from(step) * 1.3e-4;
            let (sin, cos) = sin_cos_turns(turns);
            let rad = turns * core::f64::consts::TAU;
            assert!((sin - libm::sin(rad)).abs() < 1e-11, "sin of {turns} turns");
            assert!((cos - libm::cos(rad)).abs() < 1e-11, "cos of {turns} turns");
        }
    }

    #[test]
    fn an_angle_keeps_its_resolution_after_a_million_turns() {
        let mut near = Angle::default();
        let mut far = Angle::new(1_000_000, 0.0);
        for _ in 0..1000 {
            near = near.advanced_by(1e-9);
            far = far.advanced_by(1e-9);
        }
        assert_eq!(near.fraction(), far.fraction());
        assert_eq!(far.turns(), 1_000_000);
    }

    #[test]
    fn the_fraction_stays_in_its_range_across_zero() {
        let below = Angle::default().advanced_by(-1e-18);
        assert!((0.0..1.0).contains(&below.fraction()));
        let back = Angle::default().advanced_by(-0.25);
        assert_eq!((back.turns(), back.fraction()), (-1, 0.75));
        assert_eq!(back.count(4096), -1024);
    }
}
