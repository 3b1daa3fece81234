//! A move by the drive's own ramps: how it ends with some gains, on a twin and on the drive itself.

use canopen::Mux;
use cia402::object::{PROFILE_ACCELERATION, PROFILE_DECELERATION, PROFILE_VELOCITY, TARGET_POSITION};
use master::units::{Angle, Ramp, Rpm};
use master::{Drive, MotionOptions};
use serde::Serialize;
use words::failure::Failure;

/// The time that the way takes at its speed, that of its ramps, how long it is looked at, and the share of the way within which it has
/// settled.
const WAY_S: f64 = 0.75;
const RAMP_S: f64 = 0.25;
pub(super) const LOOKED_AT_S: f64 = 2.5;
const WITHIN: f64 = 0.01;

/// What a move writes beside its target.
pub(super) const WRITTEN: [Mux; 3] = [PROFILE_VELOCITY, PROFILE_ACCELERATION, PROFILE_DECELERATION];

/// How a move ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MoveRow {
    /// By how much the motor's shaft went beyond its target.
    pub overshoot_deg: f64,
    /// From the command until it stayed within 1 % of the way; `None` where it did not.
    pub settled_s: Option<f64>,
}

/// A move that is looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrialMove {
    speed_rpm: f64,
    way_deg: f64,
    row: MoveRow,
}

impl TrialMove {
    /// At half of this speed, by as much as takes three quarters of a second.
    pub(super) fn new(highest_rpm: f64) -> Self {
        let speed_rpm = 0.5 * highest_rpm;
        let row = MoveRow { overshoot_deg: 0.0, settled_s: None };
        Self { speed_rpm, way_deg: WAY_S * speed_rpm / 60.0 * 360.0, row }
    }

    /// Whether a drive has what it takes: profile position.
    pub(super) fn is_possible(drive: &Drive) -> bool {
        let has = |object| drive.description().is_some_and(|model| model.row(object).is_some());
        has(TARGET_POSITION) && has(PROFILE_VELOCITY)
    }

    /// Begins it, or the way back.
    pub(super) async fn begin(&self, drive: &Drive, is_back: bool) -> Result<(), Failure> {
        let ramp = Some(Ramp::RpmPerSecond(self.speed_rpm / RAMP_S));
        let options = MotionOptions {
            speed: Some(Rpm(self.speed_rpm)),
            acceleration: ramp,
            deceleration: ramp,
            wait: false,
            ..MotionOptions::default()
        };
        let turns = self.way_deg / 360.0;
        drive.move_relative(Angle::Turns(if is_back { -turns } else { turns }), options).await?;
        Ok(())
    }

    /// Where the shaft is, from where it began, so long after the command.
    pub(super) fn see(&mut self, after_s: f64, gone_deg: f64) {
        let left_deg = self.way_deg - gone_deg;
        self.row.overshoot_deg = self.row.overshoot_deg.max(-left_deg);
        if left_deg.abs() > WITHIN * self.way_deg {
            self.row.settled_s = None;
        } else {
            self.row.settled_s = self.row.settled_s.or(Some(after_s));
        }
    }

    pub(super) const fn row(&self) -> MoveRow {
        self.row
    }
}

impl MoveRow {
    /// Why it is worse than one before, and than the twin's.
    pub(super) fn objection(
        &self,
        before: &Self,
        twin: Option<&Self>,
        more_than_twin: f64,
        highest_rpm: f64,
    ) -> Option<String> {
        let settles = |row: &Self| row.settled_s.is_some();
        if !settles(self) && (settles(before) || twin.is_some_and(settles)) {
            return Some("a move does not settle with the new gains".to_owned());
        }
        let of_twin_deg = twin.map_or(0.0, |twin| more_than_twin * twin.overshoot_deg);
        let most_deg = before.overshoot_deg.max(of_twin_deg).max(WITHIN * TrialMove::new(highest_rpm).way_deg);
        (self.overshoot_deg > most_deg).then(|| {
            format!("a move goes {:.1} degrees beyond with the new gains, more than {most_deg:.1}", self.overshoot_deg)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_that_does_not_settle_or_goes_far_beyond_is_objected_to() {
        let row = |overshoot_deg, settled_s| MoveRow { overshoot_deg, settled_s };
        let (good, unsettled) = (row(1.0, Some(0.9)), row(1.0, None));
        let objection =
            |after: MoveRow, before: &MoveRow, twin: &MoveRow| after.objection(before, Some(twin), 1.3, 120.0);
        assert_eq!(objection(good, &good, &good), None);
        let why = objection(unsettled, &good, &unsettled).unwrap_or_default();
        assert!(why.contains("does not settle"), "{why}");
        assert!(objection(unsettled, &unsettled, &good).is_some(), "its twin does");
        assert_eq!(objection(unsettled, &unsettled, &unsettled), None, "as before, and as on its twin");
        // A hundredth of three quarters of a turn; what it did before; 1.3 times what its twin does.
        for (before, twin, most) in [(0.0, 0.0, 2.7), (5.0, 0.0, 5.0), (0.0, 5.0, 6.5)] {
            let (before, twin) = (row(before, Some(0.9)), row(twin, Some(0.9)));
            assert_eq!(objection(row(most - 0.01, Some(0.9)), &before, &twin), None);
            let why = objection(row(most + 0.01, Some(0.9)), &before, &twin).unwrap_or_default();
            assert!(why.contains("degrees beyond"), "{why}");
        }
    }
}
