//! Whether a machine's control periods are computed, and a round of them that is watched: [`resting`](super::resting).

use can::Instant;
use drives::Resting;

/// Whether the control periods of a machine are computed.
#[derive(Clone)]
pub(super) enum Rest<F: Resting> {
    /// They are. From this time on it is worth a look whether they have to be.
    Awake { look_at: Instant },
    /// They are, for a whole round, while nothing may change.
    Watching(Box<RestWatch<F>>),
    /// They are not, until the machine is disturbed.
    Resting(LeftOut<F>),
}

/// Control periods that are left out.
#[derive(Clone)]
pub(super) struct LeftOut<F: Resting> {
    /// What the firmware would read in each; `None` if it has no power, and reads nothing.
    pub(super) sensors: Option<F::Sensors>,
    /// So many since its last one.
    pub(super) periods: u64,
    /// When the sensors may read otherwise: nothing is foretold of what comes then.
    pub(super) foretold_to: Instant,
}

/// A round under way.
#[derive(Clone)]
pub(super) struct RestWatch<F: Resting> {
    /// The firmware as it was at the beginning.
    before: F,
    sensors: Option<F::Sensors>,
    actuation: F::Actuation,
    /// Periods that are still to come.
    left: u32,
    same: bool,
}

impl<F: Resting> Rest<F> {
    pub(super) const fn from(look_at: Instant) -> Self {
        Self::Awake { look_at }
    }

    pub(super) const fn is_resting(&self) -> bool {
        matches!(self, Self::Resting(_))
    }

    /// While they are left out of a firmware that runs: when its sensors may read otherwise.
    pub(super) const fn foretold_to(&self) -> Option<Instant> {
        match self {
            Self::Resting(LeftOut { sensors: Some(_), foretold_to, .. }) => Some(*foretold_to),
            _ => None,
        }
    }
}

impl<F: Resting> RestWatch<F> {
    /// Begins, with what the pins do now.
    pub(super) fn begin(firmware: &F, actuation: &F::Actuation) -> Self {
        let (before, actuation) = (firmware.clone(), actuation.clone());
        Self { before, sensors: None, actuation, left: F::ROUND, same: true }
    }

    /// The round is over.
    pub(super) const fn is_over(&self) -> bool {
        self.left == 0
    }

    /// What the sensors read all the time, if the round has changed nothing.
    pub(super) fn end(self, firmware: &F, now: Instant) -> Option<F::Sensors> {
        if self.same && firmware.rests_since(&self.before, now) { self.sensors } else { None }
    }

    /// A period has been computed.
    pub(super) fn note(&mut self, sensors: &F::Sensors, actuation: &F::Actuation) {
        let first = self.sensors.get_or_insert_with(|| sensors.clone());
        self.same &= first == sensors && self.actuation == *actuation;
        self.left = self.left.saturating_sub(1);
    }
}
