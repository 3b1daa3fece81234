//! One axis of a group: from a point of its path to the set-point of its drive in a cycle, and how far behind it is.

use crate::cyclic::{CyclicDrive, CyclicState, Demand};
use crate::network::{Claim, Exchange};
use crate::units::{Angle, Rpm, Turns};

use super::limits::{AxisLimits, PathPoint};

/// How much speed a drive that follows speeds gets for each turn that it is behind, in turns/s for a turn. Slow beside the
/// loops of any drive, so that the loop over the bus does not swing at a cycle of 10 ms.
const POSITION_GAIN_PER_S: f64 = 8.0;

/// The share of the highest speed that may be added to catch up.
const MOST_CORRECTION: f64 = 0.2;

/// Set-points that are kept to compare an older position with.
const KEPT: usize = 8;

/// One axis of a group.
#[derive(Debug)]
pub(super) struct GroupAxis {
    pub(super) drive: CyclicDrive,
    following: FollowedSetPoints,
    /// The newest set-points, in turns, newest first.
    asked: [f64; KEPT],
    /// How far the shaft was from its set-point in the last cycle, in turns.
    pub(super) error_turns: Option<f64>,
    /// The axis belongs to this group.
    _claim: Claim,
}

/// What its drive follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FollowedSetPoints {
    /// The drive closes its position loop.
    Positions,
    /// The drive follows speeds; the position loop is closed here.
    Speeds,
}

impl GroupAxis {
    pub(super) fn new(drive: CyclicDrive, claim: Claim) -> Self {
        let following =
            if drive.set_point().is_some() { FollowedSetPoints::Positions } else { FollowedSetPoints::Speeds };
        Self { drive, following, asked: [0.0; KEPT], error_turns: None, _claim: claim }
    }

    /// It rests here: what a path begins with.
    pub(super) fn begin(&mut self, state: &CyclicState) -> Option<PathPoint> {
        let Turns(position_turns) = self.drive.set_point().or(state.position)?;
        self.asked = [position_turns; KEPT];
        Some(PathPoint { position_turns, ..PathPoint::default() })
    }

    /// Steps the drive towards a point of its path.
    pub(super) fn follow(
        &mut self,
        io: &mut Exchange<'_>,
        point: PathPoint,
        limits: &AxisLimits,
        before: &CyclicState,
    ) -> CyclicState {
        let demand = match self.following {
            FollowedSetPoints::Positions => Demand::Position(Angle::Turns(point.position_turns)),
            FollowedSetPoints::Speeds => Demand::Velocity(self.speed(point, limits, before)),
        };
        self.asked.rotate_right(1);
        self.asked[0] = point.position_turns;
        let state = self.drive.step(io, demand);
        self.error_turns = self.distance(&state);
        state
    }

    /// The path's speed, and some more to catch up.
    fn speed(&self, point: PathPoint, limits: &AxisLimits, before: &CyclicState) -> Rpm {
        let most = limits.velocity_turns_s * MOST_CORRECTION;
        // A drive that is not heard is not sent to an unknown place.
        let behind = before.position.map_or(0.0, |Turns(at)| self.asked[self.age(before)] - at);
        let correction = (behind * POSITION_GAIN_PER_S).clamp(-most, most);
        let highest = limits.velocity_turns_s;
        Rpm((point.velocity_turns_s + correction).clamp(-highest, highest) * 60.0)
    }

    /// Which set-point had reached the drive when it took the position that is seen now: it is sent after one SYNC, taken by
    /// the drive with the next, and the position of that SYNC comes before the third.
    fn age(&self, state: &CyclicState) -> usize {
        usize::try_from(state.age.unwrap_or(1)).map_or(KEPT - 1, |age| (age + 1).min(KEPT - 1))
    }

    /// How far the shaft is from its set-point: none between that of its time and the one before, which a drive that
    /// interpolates is still on the way to.
    fn distance(&self, state: &CyclicState) -> Option<f64> {
        let Turns(at) = state.position?;
        let newer = self.age(state);
        let (a, b) = (self.asked[newer], self.asked[(newer + 1).min(KEPT - 1)]);
        Some((at - at.clamp(a.min(b), a.max(b))).abs())
    }
}
