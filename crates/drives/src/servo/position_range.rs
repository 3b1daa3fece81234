//! Positions that go round (CiA 402-2, position range limit 607Bh): a turntable shows 0 to 359999 however often it has turned.
//!
//! Both limits are positions that are shown, so that a round has one more than their difference (read so; some makers take
//! the difference). What is shown is counted from all increments since power-on, in 64 bits, so that no round is a bit longer than another.

use super::scales::Scales;

/// The positions of one round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PositionRange {
    /// User units.
    low: i64,
    /// User units in a round.
    size: i64,
    /// Increments in a round, which need not be whole.
    increments: f64,
}

impl PositionRange {
    /// From `low` to `high`, which is more, both shown.
    pub(super) fn new(low: i64, high: i64, scales: &Scales) -> Self {
        let size = high - low + 1;
        Self { low, size, increments: size as f64 * scales.increments_in_unit() }
    }

    /// A position as it is shown.
    pub(super) const fn shown(&self, position: i64) -> i64 {
        self.low + position.wrapping_sub(self.low).rem_euclid(self.size)
    }

    /// A target (increments) in the round in which a position (user units) is.
    pub(super) fn in_round_of(&self, target: i64, position: i64) -> f64 {
        let round = position.wrapping_sub(self.low).div_euclid(self.size);
        libm::round(target as f64 + round as f64 * self.increments)
    }

    /// A target (increments) in the round in which it is nearest to a position (increments).
    pub(super) fn nearest(&self, target: f64, position: f64) -> f64 {
        target + libm::round((position - target) / self.increments) * self.increments
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RANGE: PositionRange = PositionRange { low: -10, size: 100, increments: 250.0 };

    #[test]
    fn after_the_greatest_position_comes_the_least() {
        let shown = [-11, -10, 0, 89, 90, 189, 1_000_000_000_000_089, i64::MIN].map(|position| RANGE.shown(position));
        assert_eq!(shown[..7], [89, -10, 0, 89, -10, 89, 89]);
        assert!((-10..90).contains(&shown[7]));
    }

    #[test]
    fn a_target_is_taken_in_the_present_round_or_in_the_nearest() {
        // 2.5 increments a unit: 20 units are 50 increments.
        assert_eq!([0, 89, 90, -11].map(|position| RANGE.in_round_of(50, position)), [50.0, 50.0, 300.0, -200.0]);
        assert_eq!(
            [0.0, 174.0, 176.0, -80.0].map(|position| RANGE.nearest(50.0, position)),
            [50.0, 50.0, 300.0, -200.0]
        );
    }
}
