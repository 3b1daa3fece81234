//! The factor group: user units and the drive's increments. Source: CiA 402-2, clause factor group (IEC 61800-7-201 has the
//! same objects); 6093h to 6095h as in the first edition (DSP 402 V2.0).
//!
//! ```text
//! position [inc]   = position [user]     * 608Fh * 6091h / 6092h
//! velocity [inc/s] = velocity [user]     * (position factor) / 6096h
//! accel. [inc/s^2] = acceleration [user] * (velocity factor) / 6097h
//! velocity [user]  = motor speed [r/min] * 6095h
//! ```
//!
//! Every factor is an exact fraction. A value is multiplied and divided in 128 bits and rounded to the nearest whole, half
//! away from zero; what does not fit is held to the ends of its range.

use core::f64::consts::TAU;
use core::fmt;

/// rad/s in one r/min.
pub const RAD_S_PER_RPM: f64 = TAU / 60.0;

/// r/min in one rad/s.
pub const RPM_PER_RAD_S: f64 = 60.0 / TAU;

/// A positive fraction in lowest terms, both parts below 2^64: a 64-bit value times it is exact.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ratio {
    numerator: u64,
    denominator: u64,
}

impl Ratio {
    /// One to one.
    pub const ONE: Self = Self { numerator: 1, denominator: 1 };

    /// A fraction of two object values; `None` if either is 0.
    pub const fn new(numerator: u32, denominator: u32) -> Option<Self> {
        Self::reduced(numerator as u64, denominator as u64)
    }

    /// The product; `None` if a part of it is 2^64 or more in lowest terms.
    pub const fn times(self, other: Self) -> Option<Self> {
        // Reduced across before multiplying, the product is in lowest terms, and does not grow needlessly.
        let (Some(a), Some(b)) =
            (Self::reduced(self.numerator, other.denominator), Self::reduced(other.numerator, self.denominator))
        else {
            return None;
        };
        match (a.numerator.checked_mul(b.numerator), a.denominator.checked_mul(b.denominator)) {
            (Some(numerator), Some(denominator)) => Some(Self { numerator, denominator }),
            _ => None,
        }
    }

    /// The quotient; `None` as for [`times`](Self::times).
    pub const fn over(self, other: Self) -> Option<Self> {
        self.times(other.inverse())
    }

    /// The reciprocal: numerator and denominator change places.
    #[must_use]
    pub const fn inverse(self) -> Self {
        Self { numerator: self.denominator, denominator: self.numerator }
    }

    /// `value` times the fraction, to the nearest whole, half away from zero; held to the range of `i64`.
    pub const fn scale(self, value: i64) -> i64 {
        if self.numerator == self.denominator {
            return value;
        }
        let (product, denominator) = (value.unsigned_abs() as u128 * self.numerator as u128, self.denominator as u128);
        let (whole, rest) = (product / denominator, product % denominator);
        let size = if rest >= denominator - rest { whole + 1 } else { whole };
        match (value < 0, size > i64::MAX as u128) {
            (false, false) => size as i64,
            (false, true) => i64::MAX,
            (true, false) => -(size as i64),
            (true, true) => i64::MIN,
        }
    }

    /// The fraction as a floating-point number, for values that are measurements anyway.
    pub const fn as_f64(self) -> f64 {
        self.numerator as f64 / self.denominator as f64
    }

    const fn reduced(numerator: u64, denominator: u64) -> Option<Self> {
        if numerator == 0 || denominator == 0 {
            return None;
        }
        let divisor = greatest_common_divisor(numerator, denominator);
        Some(Self { numerator: numerator / divisor, denominator: denominator / divisor })
    }
}

impl fmt::Debug for Ratio {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.numerator, self.denominator)
    }
}

impl fmt::Display for Ratio {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}

const fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    let (mut a, mut b) = (a, b);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// The objects of the factor group as they stand: numerator and denominator of each, `None` for an object that the drive
/// does not have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FactorGroup {
    /// 608Fh: encoder increments (sub-index 1) per motor revolutions (sub-index 2).
    pub position_encoder_resolution: Option<[u32; 2]>,
    /// 6091h: motor shaft revolutions per driving shaft revolutions.
    pub gear_ratio: Option<[u32; 2]>,
    /// 6092h: feed in position units per driving shaft revolutions.
    pub feed_constant: Option<[u32; 2]>,
    /// 6093h (first edition): increments per position unit. Takes the place of the three above.
    pub position_factor: Option<[u32; 2]>,
    /// 6094h (first edition): increments per second for a velocity unit. Takes the place of 6096h.
    pub velocity_encoder_factor: Option<[u32; 2]>,
    /// 6095h (first edition): velocity units for one r/min of the motor, in which 6080h is. Without it the encoder's
    /// resolution says how fast that is.
    pub velocity_factor_1: Option<[u32; 2]>,
    /// 6096h: velocity units for a position unit per second.
    pub velocity_factor: Option<[u32; 2]>,
    /// 6097h: acceleration units for a velocity unit per second.
    pub acceleration_factor: Option<[u32; 2]>,
}

/// Increments for one user unit of each kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Factors {
    /// Increments in a position unit.
    pub position: Ratio,
    /// Increments per second in a velocity unit.
    pub velocity: Ratio,
    /// Increments per second squared in an acceleration unit.
    pub acceleration: Ratio,
    /// Increments per second in one r/min of the motor.
    pub motor_speed: Ratio,
}

/// Which fraction makes no sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoFactor {
    /// Index of the object that is 0, or that makes the product too large.
    pub index: u16,
}

impl FactorGroup {
    /// The factors. `increments_per_turn` is the encoder's own resolution, for a drive without 608Fh; without 6091h there is
    /// no gear, without 6092h a position unit is an increment of the encoder.
    ///
    /// # Errors
    /// An object with a 0 in it, or a product of 2^64 or more in lowest terms.
    pub const fn factors(&self, increments_per_turn: u32) -> Result<Factors, NoFactor> {
        let position = match self.position(increments_per_turn) {
            Ok(position) => position,
            Err(error) => return Err(error),
        };
        let velocity = match (self.velocity_encoder_factor, self.velocity_factor) {
            (Some(_), _) => ratio(0x6094, self.velocity_encoder_factor),
            (None, factor) => divided(position, 0x6096, factor),
        };
        let velocity = match velocity {
            Ok(velocity) => velocity,
            Err(error) => return Err(error),
        };
        match (divided(velocity, 0x6097, self.acceleration_factor), self.motor_speed(velocity, increments_per_turn)) {
            (Ok(acceleration), Ok(motor_speed)) => Ok(Factors { position, velocity, acceleration, motor_speed }),
            (Err(error), _) | (_, Err(error)) => Err(error),
        }
    }

    const fn motor_speed(&self, velocity: Ratio, increments_per_turn: u32) -> Result<Ratio, NoFactor> {
        if self.velocity_factor_1.is_none() {
            return match self.resolution(increments_per_turn) {
                Ok(resolution) => divided(resolution, 0x608F, Some([60, 1])),
                Err(error) => Err(error),
            };
        }
        match ratio(0x6095, self.velocity_factor_1) {
            Ok(factor) => match velocity.times(factor) {
                Some(motor_speed) => Ok(motor_speed),
                None => Err(NoFactor { index: 0x6095 }),
            },
            Err(error) => Err(error),
        }
    }

    const fn resolution(&self, increments_per_turn: u32) -> Result<Ratio, NoFactor> {
        match self.position_encoder_resolution {
            None => ratio(0x608F, Some([increments_per_turn, 1])),
            some => ratio(0x608F, some),
        }
    }

    const fn position(&self, increments_per_turn: u32) -> Result<Ratio, NoFactor> {
        if self.position_factor.is_some() {
            return ratio(0x6093, self.position_factor);
        }
        let resolution = match self.resolution(increments_per_turn) {
            Ok(resolution) => resolution,
            Err(error) => return Err(error),
        };
        let feed = match self.feed_constant {
            None => Ok(resolution),
            some => ratio(0x6092, some),
        };
        let (gear, feed) = match (ratio(0x6091, self.gear_ratio), feed) {
            (Ok(gear), Ok(feed)) => (gear, feed),
            (Err(error), _) | (_, Err(error)) => return Err(error),
        };
        let Some(per_turn) = resolution.times(gear) else { return Err(NoFactor { index: 0x6091 }) };
        match per_turn.over(feed) {
            Some(position) => Ok(position),
            None => Err(NoFactor { index: 0x6092 }),
        }
    }
}

const fn ratio(index: u16, object: Option<[u32; 2]>) -> Result<Ratio, NoFactor> {
    let Some([numerator, denominator]) = object else { return Ok(Ratio::ONE) };
    match Ratio::new(numerator, denominator) {
        Some(ratio) => Ok(ratio),
        None => Err(NoFactor { index }),
    }
}

const fn divided(factor: Ratio, index: u16, object: Option<[u32; 2]>) -> Result<Ratio, NoFactor> {
    match ratio(index, object) {
        Ok(divisor) => match factor.over(divisor) {
            Some(quotient) => Ok(quotient),
            None => Err(NoFactor { index }),
        },
        Err(error) => Err(error),
    }
}

/// Polarity, object 607Eh: which values change their sign between the host and the motor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Polarity(pub u8);

impl Polarity {
    /// Bit 7: positions.
    pub const POSITION: u8 = 1 << 7;
    /// Bit 6: velocities.
    pub const VELOCITY: u8 = 1 << 6;

    /// -1 if positions change their sign, else 1.
    pub const fn position(self) -> i64 {
        if self.0 & Self::POSITION == 0 { 1 } else { -1 }
    }

    /// -1 if velocities change their sign, else 1.
    pub const fn velocity(self) -> i64 {
        if self.0 & Self::VELOCITY == 0 { 1 } else { -1 }
    }
}

/// SI unit of position, velocity, acceleration or jerk, objects 60A8h to 60ABh. Source: CiA 303-2 for the codes.
///
/// Bits 24 to 31: the power of ten; 16 to 23: the numerator's unit; 8 to 15: the denominator's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SiUnit(pub u32);

impl SiUnit {
    /// Metre.
    pub const METRE: u8 = 0x01;
    /// Second.
    pub const SECOND: u8 = 0x03;
    /// Radian.
    pub const RADIAN: u8 = 0x10;
    /// Degree.
    pub const DEGREE: u8 = 0x41;
    /// Minute of time.
    pub const MINUTE: u8 = 0x47;
    /// Revolution.
    pub const REVOLUTION: u8 = 0xB4;

    /// A unit from its parts.
    pub const fn new(power_of_ten: i8, numerator: u8, denominator: u8) -> Self {
        Self(u32::from_be_bytes([power_of_ten.to_be_bytes()[0], numerator, denominator, 0]))
    }

    /// The power of ten.
    pub const fn power_of_ten(self) -> i8 {
        i8::from_be_bytes([self.0.to_be_bytes()[0]])
    }

    /// The numerator's unit.
    pub const fn numerator(self) -> u8 {
        self.0.to_be_bytes()[1]
    }

    /// The denominator's unit; 0 for none.
    pub const fn denominator(self) -> u8 {
        self.0.to_be_bytes()[2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ratio_of(numerator: u32, denominator: u32) -> Ratio {
        Ratio::new(numerator, denominator).unwrap()
    }

    #[test]
    fn scaling_rounds_half_away_from_zero() {
        let half = ratio_of(1, 2);
        assert_eq!([-3, -2, -1, 0, 1, 2, 3].map(|value| half.scale(value)), [-2, -1, -1, 0, 1, 1, 2]);
        let third = ratio_of(1, 3);
        assert_eq!([-2, -1, 1, 2, 4, 5].map(|value| third.scale(value)), [-1, 0, 0, 1, 1, 2]);
    }

    #[test]
    fn nothing_overflows_at_the_ends_of_every_range() {
        let large = ratio_of(u32::MAX, 1).times(ratio_of(u32::MAX, 1)).unwrap();
        assert_eq!(large.scale(i64::from(i32::MIN)), i64::MIN);
        assert_eq!(large.scale(i64::from(i32::MAX)), i64::MAX);
        assert_eq!(large.scale(i64::MIN), i64::MIN);
        assert_eq!(large.scale(0), 0);
        let small = large.inverse();
        assert_eq!(small.scale(i64::MAX), 1, "2^63 over (2^32 - 1)^2 is just above a half");
        assert_eq!(small.scale(i64::MAX - (1 << 33)), 0, "and this just below");
        // 2^32 - 1 over 2^32 - 2 of i32::MIN: -2^31 * (1 + 1/(2^32 - 2)) is -2^31 - 0.5 and a little more.
        assert_eq!(ratio_of(u32::MAX, u32::MAX - 1).scale(i64::from(i32::MIN)), i64::from(i32::MIN) - 1);
    }

    #[test]
    fn what_does_not_fit_in_lowest_terms_is_refused() {
        let big = ratio_of(u32::MAX, 1);
        let square = big.times(big).unwrap();
        assert_eq!(square.times(big), None);
        assert_eq!(square.times(ratio_of(1, u32::MAX)), Some(big), "it is reduced before it grows");
        assert_eq!(square.over(square), Some(Ratio::ONE));
        assert_eq!(Ratio::new(0, 1), None);
        assert_eq!(Ratio::new(1, 0), None);
    }

    #[test]
    fn fine_increments_give_back_every_user_value() {
        // 131072 increments for 36000 user units (hundredths of a degree).
        let factor = ratio_of(131_072, 36_000);
        for user in (-40_000..40_000).chain([i64::from(i32::MIN), i64::from(i32::MAX)]) {
            assert_eq!(factor.inverse().scale(factor.scale(user)), user);
        }
    }

    #[test]
    fn a_screw_behind_a_gear_is_the_standards_formula() {
        // 2000 increments a turn, gear 5:1, 10 mm feed in micrometres: 2000 * 5 / 10000 = 1 increment a micrometre.
        let group = FactorGroup {
            position_encoder_resolution: Some([2000, 1]),
            gear_ratio: Some([5, 1]),
            feed_constant: Some([10_000, 1]),
            ..FactorGroup::default()
        };
        assert_eq!(group.factors(1).unwrap().position, Ratio::ONE);
        let screw = FactorGroup { feed_constant: Some([5_000, 2]), ..group };
        assert_eq!(screw.factors(1).unwrap().position, ratio_of(4, 1));
    }

    #[test]
    fn velocity_in_turns_a_minute_is_sixty_over_the_units_of_a_turn() {
        // 4096 position units a turn of 131072 increments; 6096h = 60 / 4096.
        let group = FactorGroup {
            position_encoder_resolution: Some([131_072, 1]),
            feed_constant: Some([4096, 1]),
            velocity_factor: Some([60, 4096]),
            ..FactorGroup::default()
        };
        let factors = group.factors(1).unwrap();
        // 3000 r/min are 50 turns a second.
        assert_eq!(factors.velocity.scale(3000), 50 * 131_072);
        assert_eq!(factors.acceleration.scale(60), 131_072, "one turn per second squared in r/min/s");
        let slow = FactorGroup { acceleration_factor: Some([1000, 1]), ..group };
        assert_eq!(slow.factors(1).unwrap().acceleration.scale(60_000), 131_072, "in thousandths of it");
    }

    #[test]
    fn without_objects_all_units_are_increments() {
        let factors = FactorGroup::default().factors(65_536).unwrap();
        let motor_speed = ratio_of(65_536, 60);
        assert_eq!(
            factors,
            Factors { position: Ratio::ONE, velocity: Ratio::ONE, acceleration: Ratio::ONE, motor_speed }
        );
        // With a gear and no feed the unit is an increment at the driving shaft.
        let geared = FactorGroup { gear_ratio: Some([10, 1]), ..FactorGroup::default() };
        assert_eq!(geared.factors(65_536).unwrap().position, ratio_of(10, 1));
    }

    #[test]
    fn the_first_editions_factors_take_the_place_of_the_others() {
        let group = FactorGroup {
            gear_ratio: Some([7, 3]),
            position_factor: Some([100, 3]),
            velocity_encoder_factor: Some([8192, 60]),
            velocity_factor: Some([9, 9]),
            ..FactorGroup::default()
        };
        let factors = group.factors(8192).unwrap();
        assert_eq!(factors.position, ratio_of(100, 3));
        assert_eq!(factors.velocity.scale(60), 8192);
    }

    #[test]
    fn velocity_factor_1_turns_motor_speeds_into_velocity_units() {
        // A screw of 10 mm behind a gear of 5:1, velocities in mm/min: one r/min of the motor is 10 / 5 of them.
        let group = FactorGroup {
            position_encoder_resolution: Some([4096, 1]),
            gear_ratio: Some([5, 1]),
            feed_constant: Some([10, 1]),
            velocity_factor: Some([60, 1]),
            ..FactorGroup::default()
        };
        let with = FactorGroup { velocity_factor_1: Some([10, 5]), ..group };
        let [by_encoder, by_object] = [group, with].map(|group| group.factors(1).unwrap());
        assert_eq!(by_object, by_encoder, "the two ways to say it agree");
        assert_eq!(by_object.motor_speed.scale(3000), 50 * 4096);
        // A unit of 6094h for one r/min; 6095h = 1/2.
        let first = FactorGroup {
            velocity_encoder_factor: Some([8192, 60]),
            velocity_factor_1: Some([1, 2]),
            ..FactorGroup::default()
        };
        assert_eq!(first.factors(8192).unwrap().motor_speed.scale(120), 8192);
    }

    #[test]
    fn a_zero_is_named_by_its_object() {
        let zero = |group: FactorGroup| group.factors(1).unwrap_err().index;
        assert_eq!(zero(FactorGroup { gear_ratio: Some([1, 0]), ..FactorGroup::default() }), 0x6091);
        assert_eq!(zero(FactorGroup { feed_constant: Some([0, 1]), ..FactorGroup::default() }), 0x6092);
        assert_eq!(zero(FactorGroup { position_factor: Some([0, 0]), ..FactorGroup::default() }), 0x6093);
        assert_eq!(zero(FactorGroup { velocity_encoder_factor: Some([1, 0]), ..FactorGroup::default() }), 0x6094);
        assert_eq!(zero(FactorGroup { velocity_factor_1: Some([1, 0]), ..FactorGroup::default() }), 0x6095);
        assert_eq!(zero(FactorGroup { velocity_factor: Some([0, 1]), ..FactorGroup::default() }), 0x6096);
        assert_eq!(zero(FactorGroup { acceleration_factor: Some([0, 1]), ..FactorGroup::default() }), 0x6097);
        assert_eq!(FactorGroup::default().factors(0).unwrap_err().index, 0x608F);
    }

    #[test]
    fn polarity_has_a_bit_for_positions_and_one_for_velocities() {
        assert_eq!([0x00, 0x80, 0x40, 0xC0].map(|bits| Polarity(bits).position()), [1, -1, 1, -1]);
        assert_eq!([0x00, 0x80, 0x40, 0xC0].map(|bits| Polarity(bits).velocity()), [1, 1, -1, -1]);
    }

    #[test]
    fn units_are_packed_as_the_object_has_them() {
        // r/min, the usual value of 60A9h: 00B44700h. Hundredths of a degree: FE410000h.
        assert_eq!(SiUnit::new(0, SiUnit::REVOLUTION, SiUnit::MINUTE), SiUnit(0x00B4_4700));
        let hundredths = SiUnit(0xFE41_0000);
        assert_eq!((hundredths.power_of_ten(), hundredths.numerator(), hundredths.denominator()), (-2, 0x41, 0));
    }
}
