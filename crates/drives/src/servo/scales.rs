//! User units and encoder increments of one axis, by the objects of its factor group.

use canopen::od::{Dictionary, Slot, Storage};
use cia402::{FactorGroup, Factors, NoFactor, Polarity, Ratio};

use super::read;
use super::slots::AxisSlots;

/// How one axis counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scales {
    factors: Factors,
    polarity: Polarity,
}

impl Scales {
    pub(super) fn of(values: &Dictionary<impl Storage>, slots: &AxisSlots, increments_per_turn: u32) -> Self {
        let pair = |numerator: Option<Slot>, divisor: Option<Slot>| {
            (numerator.is_some() && divisor.is_some())
                .then(|| [numerator, divisor].map(|slot| read(values, slot, 0) as u32))
        };
        let group = FactorGroup {
            position_encoder_resolution: pair(slots.encoder_increments, slots.encoder_turns),
            gear_ratio: pair(slots.gear_motor, slots.gear_shaft),
            feed_constant: pair(slots.feed, slots.feed_turns),
            position_factor: pair(slots.position_factor_numerator, slots.position_factor_divisor),
            velocity_encoder_factor: pair(slots.velocity_encoder_numerator, slots.velocity_encoder_divisor),
            // As delivered with a 0 in it, it has no meaning; a write of 0 is refused.
            velocity_factor_1: pair(slots.velocity_factor_1_numerator, slots.velocity_factor_1_divisor)
                .filter(|factor| !factor.contains(&0)),
            velocity_factor: pair(slots.velocity_factor_numerator, slots.velocity_factor_divisor),
            acceleration_factor: pair(slots.acceleration_factor_numerator, slots.acceleration_factor_divisor),
        };
        // Objects that make no sense leave increments in place of all units.
        let factors = in_increments(&group, increments_per_turn).unwrap_or(increments(increments_per_turn));
        Self { factors, polarity: Polarity(read(values, slots.polarity, 0) as u8) }
    }

    /// A position in increments. Units may be coarser than increments: what 32 bits of them say may need more bits.
    pub(super) fn increments(&self, position: i64) -> i64 {
        self.factors.position.scale(position.saturating_mul(self.polarity.position()))
    }

    /// A position in user units, held to 32 bits.
    pub(super) fn position(&self, increments: i32) -> i64 {
        saturated(self.whole_position(i64::from(increments)))
    }

    /// The same in 64 bits.
    pub(super) fn whole_position(&self, increments: i64) -> i64 {
        self.factors.position.inverse().scale(increments).saturating_mul(self.polarity.position())
    }

    /// Increments in a position unit, with the sign that 607Eh gives them.
    pub(super) fn increments_in_unit(&self) -> f64 {
        self.factors.position.as_f64() * self.polarity.position() as f64
    }

    /// A length in increments, whatever its sign; held to 32 bits, and at least one increment unless it is 0.
    pub(super) fn length(&self, user: u32) -> u32 {
        let least = u32::from(user != 0);
        u32::try_from(self.factors.position.scale(i64::from(user))).unwrap_or(u32::MAX).max(least)
    }

    /// Increments per second.
    pub(super) fn increments_s(&self, velocity: i64) -> f64 {
        velocity as f64 * self.factors.velocity.as_f64() * self.polarity.velocity() as f64
    }

    /// Increments per second, whatever the sign.
    pub(super) fn speed(&self, user: i64) -> f64 {
        user as f64 * self.factors.velocity.as_f64()
    }

    /// A speed of the motor (6080h) in increments per second.
    pub(super) fn motor_speed(&self, rpm: i64) -> f64 {
        rpm as f64 * self.factors.motor_speed.as_f64()
    }

    /// A velocity in user units, held to 32 bits.
    pub(super) fn velocity(&self, increments_s: f64) -> i64 {
        let user = increments_s / self.factors.velocity.as_f64() * self.polarity.velocity() as f64;
        saturated(libm::round(user) as i64)
    }

    /// Increments per second squared.
    pub(super) fn rate(&self, user: i64) -> f64 {
        user as f64 * self.factors.acceleration.as_f64()
    }

    /// -1 if positions change their sign, else 1.
    pub(super) const fn position_direction(&self) -> i64 {
        self.polarity.position()
    }

    /// -1 if velocities and torques change their sign, else 1.
    pub(super) fn direction(&self) -> f64 {
        self.polarity.velocity() as f64
    }
}

/// Increments in place of all units.
fn increments(per_turn: u32) -> Factors {
    let motor_speed = Ratio::new(per_turn, 60).unwrap_or(Ratio::ONE);
    Factors { position: Ratio::ONE, velocity: Ratio::ONE, acceleration: Ratio::ONE, motor_speed }
}

/// The factors in increments of the encoder that is there: 608Fh is that of the drive that the table was read from, and
/// only says what a turn is.
fn in_increments(group: &FactorGroup, increments_per_turn: u32) -> Result<Factors, NoFactor> {
    let factors = group.factors(increments_per_turn)?;
    let Some([increments, turns]) = group.position_encoder_resolution else { return Ok(factors) };
    let no_factor = NoFactor { index: 0x608F };
    let resolution = Ratio::new(increments, turns).ok_or(no_factor)?;
    let there = Ratio::new(increments_per_turn, 1).and_then(|there| there.over(resolution)).ok_or(no_factor)?;
    let scaled = |factor: Ratio| factor.times(there).ok_or(no_factor);
    Ok(Factors {
        position: scaled(factors.position)?,
        velocity: scaled(factors.velocity)?,
        acceleration: scaled(factors.acceleration)?,
        motor_speed: scaled(factors.motor_speed)?,
    })
}

fn saturated(value: i64) -> i64 {
    value.clamp(i64::from(i32::MIN), i64::from(i32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_resolution_of_another_encoder_only_says_what_a_turn_is() {
        // A drive of 10000 increments a turn, 36000 units of feed: on an encoder of 131072.
        let group = FactorGroup {
            position_encoder_resolution: Some([10_000, 1]),
            feed_constant: Some([36_000, 1]),
            ..FactorGroup::default()
        };
        assert_eq!(in_increments(&group, 131_072).unwrap().position.scale(36_000), 131_072);
        // Without a feed a unit is an increment of that other encoder.
        let bare = FactorGroup { feed_constant: None, ..group };
        assert_eq!(in_increments(&bare, 131_072).unwrap().position.scale(10_000), 131_072);
    }
}
