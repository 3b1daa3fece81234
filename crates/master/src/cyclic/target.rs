//! The set-point of one cycle: from what was asked for to counts, within the limits in force.

use core::time::Duration;

use super::demand::{Bound, Demand, Refusal};
use crate::core::{SetPoint, Signal};
use crate::limits::Limits;
use crate::units::{Amperes, Angle, Rpm};

/// The object that the mode follows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub(super) set_point: SetPoint<i64>,
    pub(super) limits: Limits,
    pub(super) kind: TargetKind,
    /// What was sent last.
    pub(super) last_sent: i64,
}

/// What the set-point is.
#[derive(Clone, Copy, Debug)]
pub(super) enum TargetKind {
    /// A position in counts. The way from one to the next is bounded by the highest speed.
    Position { actual: Signal<i64>, counts_per_turn: f64, counts_per_s: f64, speed: Bound },
    /// A speed: r/min in one count.
    Velocity { per_count: f64 },
    /// A current: A in one count.
    Current { per_count: f64 },
}

impl Target {
    /// What to send for a demand that wants power.
    pub(super) fn follow(&self, demand: Demand, period: Duration) -> Result<i64, Refusal> {
        let raw = match (demand, self.kind) {
            (Demand::Hold, _) => return Ok(self.hold()),
            (Demand::Position(Angle::Counts(counts)), TargetKind::Position { .. }) => counts,
            (Demand::Position(Angle::Turns(turns)), TargetKind::Position { counts_per_turn, .. }) => {
                whole(turns * counts_per_turn)?
            }
            (Demand::Velocity(Rpm(value)), TargetKind::Velocity { per_count })
            | (Demand::Current(Amperes(value)), TargetKind::Current { per_count }) => whole(value / per_count)?,
            _ => return Err(Refusal::WrongKind),
        };
        let limits = &self.limits;
        if !limits.take(raw) || limits.changed(raw).is_some() {
            return Err(Refusal::OutOfLimits { asked: raw, bound: self.limits.into() });
        }
        self.check_step(raw, period)?;
        Ok(raw)
    }

    /// What to send so that the drive comes to rest with power: the last position; no speed, no current.
    pub(super) const fn hold(&self) -> i64 {
        match self.kind {
            TargetKind::Position { .. } => self.last_sent,
            TargetKind::Velocity { .. } | TargetKind::Current { .. } => 0,
        }
    }

    /// What to send while the drive has no power: where it is, so that it does not jump when it gets some; no speed, no current.
    pub(super) const fn rest(&self, actual: Option<i64>) -> i64 {
        match (self.kind, actual) {
            (TargetKind::Position { .. }, Some(actual)) => actual,
            _ => self.hold(),
        }
    }

    fn check_step(&self, raw: i64, period: Duration) -> Result<(), Refusal> {
        let TargetKind::Position { counts_per_s, speed, .. } = self.kind else { return Ok(()) };
        let way = raw.saturating_sub(self.last_sent);
        // A drive that was given nothing for some cycles stands where it was: the next step is no longer for that.
        // A count more, for set-points that are rounded to whole ones.
        let longest = (counts_per_s * period.as_secs_f64()) as i64 + 1;
        if way.saturating_abs() <= longest {
            return Ok(());
        }
        Err(Refusal::StepTooLarge { way, longest, bound: speed })
    }
}

/// The nearest count, half a count away from zero: [`f64::round`] without its call in each cycle.
fn whole(value: f64) -> Result<i64, Refusal> {
    // No object of 64 bits goes beyond this, and what is not a number is not below it.
    if value.abs() < 9e18 {
        let whole = value as i64;
        // Exact: there are no more digits than before.
        let rest = value - whole as f64;
        Ok(whole + i64::from(rest >= 0.5) - i64::from(rest <= -0.5))
    } else {
        Err(Refusal::NoNumber)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_is_rounded_as_the_standard_library_rounds() {
        let near =
            [0.0, 0.25, 0.499_999_999_999_999_94, 0.5, 0.75, 1.5, 2.5, 1e6 + 0.5, 1e15 + 0.5, 4.5e15 + 0.5, 8.9e18];
        for value in near.into_iter().flat_map(|value: f64| [value, -value, value.next_up(), value.next_down()]) {
            assert_eq!(whole(value), Ok(value.round() as i64), "{value}");
        }
        for value in [9e18, -9e18, f64::INFINITY, f64::NAN] {
            assert_eq!(whole(value), Err(Refusal::NoNumber), "{value}");
        }
    }
}
