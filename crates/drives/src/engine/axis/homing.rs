//! Homing (CiA 402-2, clause 11) by sequences as those of [`cia402::HomingMethod::sequence`].
//!
//! ```text
//! search (fast) --switch on--> leave and back off --> cross the edge (slow) [--> index pulse (slow)] = home position
//!        \--limit: turn round, once
//! ```
//!
//! In go the switches and where the shaft is, out comes the velocity to go at, and the home position when it is found.
//! Stopping, reversing and its ramps are the trajectory's. A limit switch against the present direction ends the run unless
//! the method turns round there, or looks for that switch. An edge counts only while the shaft moves the way it is to be
//! crossed, so that running past a switch while slowing down does no harm.

use cia402::{Direction, HomingRow, HomingSequence, HomingSwitch, SwitchEdge};

use super::demand::Control;
use super::ramp::Ramp;
use super::speed::VelocityRamps;
use super::trajectory::TrajectoryPoint;

/// The switches along the axis: true is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Switches {
    /// Home switch.
    pub home: bool,
    /// Limit switch at the positive end.
    pub positive_limit: bool,
    /// Limit switch at the negative end.
    pub negative_limit: bool,
    /// Where the encoder's index pulse came since the last look.
    pub index: Option<i32>,
}

/// How homing is set; counts and counts/s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HomingParameters {
    /// What to look for; without it homing fails as it starts.
    pub sequence: Option<HomingSequence>,
    /// Speed of the search.
    pub search_speed: f64,
    /// Speed of the way back, of crossing the edge and of the way to the index pulse.
    pub latch_speed: f64,
    /// Start speed, highest speed, and all ramps of the run.
    pub ramps: VelocityRamps,
    /// How the motion ends where the home position is found, or a limit switch met.
    pub end: Ramp,
    /// How far beyond the edge to go before crossing it.
    pub back_off: u32,
    /// An edge that is met by the search, moving the way that it is to be crossed, needs no second pass.
    pub single_pass: bool,
    /// The loop that the run closes; at its end the position is held.
    pub control: Control,
}

/// Where homing stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HomingState {
    /// Not begun.
    #[default]
    None,
    /// On the way.
    Running,
    /// The home position is found, and the shaft slows down.
    Stopping,
    /// The last run found the home position.
    Attained,
    /// The last run ended without.
    Failed,
}

/// State: the last run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Homing {
    state: HomingState,
    run: Option<HomingRun>,
    /// The run has just ended by itself.
    ended: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct HomingRun {
    sequence: HomingSequence,
    phase: HomingPhase,
    /// The method's switch in the preceding look.
    was_on: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum HomingPhase {
    Search { direction: Direction, turned: bool },
    Leave { direction: Direction, fast: bool, left_at: Option<i32> },
    Cross { direction: Direction },
    Index { direction: Direction },
    SlowDown,
}

impl Homing {
    /// Begins, at the position `here`; it is the home position if nothing is to be looked for.
    pub(super) fn start(&mut self, parameters: &HomingParameters, switches: Switches, here: i32) -> Option<i32> {
        *self = Self { state: HomingState::Failed, ..Self::default() };
        let sequence = parameters.sequence?;
        let phase = match sequence {
            HomingSequence { switch: Some(row), .. } => HomingPhase::at_start(row, parameters, switches),
            HomingSequence { switch: None, index: Some(direction) } => HomingPhase::Index { direction },
            HomingSequence { switch: None, index: None } => {
                *self = Self { state: HomingState::Stopping, run: None, ended: true };
                return Some(here);
            }
        };
        let was_on = switches.of(sequence.switch);
        *self = Self { state: HomingState::Running, run: Some(HomingRun { sequence, phase, was_on }), ended: false };
        None
    }

    /// Slows down, and the run counts as nothing.
    pub(super) fn interrupt(&mut self) {
        if let Some(run) = &mut self.run {
            run.phase = HomingPhase::SlowDown;
        }
    }

    /// Another command moves or stops the motor.
    pub(super) fn abort(&mut self) {
        if matches!(self.state, HomingState::Running | HomingState::Stopping) {
            *self = Self { state: HomingState::Failed, ..Self::default() };
        }
    }

    /// As if it had never begun.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// A look at the switches, while the trajectory is at `at` and the shaft at `here`; the home position when it is found.
    /// A run that fails has ended then.
    pub(super) fn watch(
        &mut self,
        parameters: &HomingParameters,
        switches: Switches,
        at: TrajectoryPoint,
        here: i32,
    ) -> Option<i32> {
        let found = match self.run.as_mut()?.watch(parameters, switches, at, here) {
            Ok(found) => found?,
            Err(LimitMet) => {
                *self = Self { state: HomingState::Failed, run: None, ended: true };
                return None;
            }
        };
        *self = Self { state: HomingState::Stopping, run: None, ended: true };
        Some(found)
    }

    /// The run has ended by itself, reported once: the motion is to be ended.
    pub(super) fn take_end(&mut self) -> bool {
        core::mem::take(&mut self.ended)
    }

    /// Velocity to go at.
    pub(super) fn velocity(&self, parameters: &HomingParameters) -> f64 {
        self.run.map_or(0.0, |run| run.phase.speed(parameters))
    }

    /// The shaft has come to rest.
    pub(super) fn come_to_rest(&mut self) {
        match (self.state, self.run) {
            (HomingState::Stopping, _) => self.state = HomingState::Attained,
            (_, Some(HomingRun { phase: HomingPhase::SlowDown, .. })) => self.abort(),
            _ => {}
        }
    }

    /// Where it stands.
    pub(super) const fn state(&self) -> HomingState {
        self.state
    }
}

/// A limit switch stands in the way.
struct LimitMet;

impl HomingRun {
    fn watch(
        &mut self,
        parameters: &HomingParameters,
        switches: Switches,
        at: TrajectoryPoint,
        here: i32,
    ) -> Result<Option<i32>, LimitMet> {
        let on = switches.of(self.sequence.switch);
        let was_on = core::mem::replace(&mut self.was_on, on);
        if let (HomingPhase::Search { direction, .. }, Some(row)) = (self.phase, self.sequence.switch)
            && on
        {
            self.phase = HomingPhase::found(row, Some(direction));
        }
        let reverses = self.sequence.switch.is_some_and(|row| row.reverses_at_limit);
        if self.meets_limit(switches) && !self.phase.turn_round(reverses, switches) {
            return Err(LimitMet);
        }
        let moves = self.phase.direction().is_some_and(|direction| at.velocity * f64::from(direction.sign()) > 0.0);
        match &mut self.phase {
            HomingPhase::Search { .. } | HomingPhase::SlowDown => {}
            HomingPhase::Leave { direction, left_at, .. } => {
                match *left_at {
                    _ if on => *left_at = None,
                    None if was_on && moves => *left_at = Some(at.position),
                    _ => {}
                }
                if left_at
                    .is_some_and(|left_at| at.position.wrapping_sub(left_at).unsigned_abs() >= parameters.back_off)
                {
                    self.phase = HomingPhase::Cross { direction: direction.reversed() };
                }
            }
            HomingPhase::Cross { .. } => {
                let edge = match self.sequence.switch.map(|row| row.edge) {
                    Some(SwitchEdge::Rising) => on && !was_on,
                    Some(SwitchEdge::Falling) => was_on && !on,
                    None => false,
                };
                if edge && moves {
                    let Some(direction) = self.sequence.index else { return Ok(Some(here)) };
                    self.phase = HomingPhase::Index { direction };
                }
            }
            HomingPhase::Index { .. } => return Ok(switches.index.filter(|_| moves)),
        }
        Ok(None)
    }

    /// A limit switch stands in the way; the one that the method looks for does not.
    fn meets_limit(&self, switches: Switches) -> bool {
        let Some(direction) = self.phase.direction() else { return false };
        let at_this_end = match direction {
            Direction::Negative => HomingSwitch::NegativeLimit,
            Direction::Positive => HomingSwitch::PositiveLimit,
        };
        let looked_for = self.sequence.switch.is_some_and(|row| row.switch == at_this_end);
        !looked_for && switches.limit(direction)
    }
}

impl HomingPhase {
    fn at_start(row: &HomingRow, parameters: &HomingParameters, switches: Switches) -> Self {
        let is_met_by_search = row.edge == SwitchEdge::Rising && row.search == row.crossing;
        match switches.of(Some(row)) {
            true => Self::found(row, None),
            false if parameters.single_pass && is_met_by_search => Self::Cross { direction: row.crossing },
            false => Self::Search { direction: row.search, turned: false },
        }
    }

    /// The switch is on, met while moving in `direction` or at the start.
    fn found(row: &HomingRow, direction: Option<Direction>) -> Self {
        let away = row.crossing.reversed();
        match row.edge {
            SwitchEdge::Falling => Self::Cross { direction: row.crossing },
            // Going on the same way needs no reversal, so it stays fast.
            SwitchEdge::Rising => Self::Leave { direction: away, fast: direction == Some(away), left_at: None },
        }
    }

    /// A limit switch stands in the way of the search; true if the method turns round there.
    fn turn_round(&mut self, reverses: bool, switches: Switches) -> bool {
        match *self {
            Self::Search { direction, turned: false } if reverses && !switches.limit(direction.reversed()) => {
                *self = Self::Search { direction: direction.reversed(), turned: true };
                true
            }
            _ => false,
        }
    }

    /// The way to go; none while it slows down.
    const fn direction(&self) -> Option<Direction> {
        match *self {
            Self::Search { direction, .. }
            | Self::Leave { direction, .. }
            | Self::Cross { direction }
            | Self::Index { direction } => Some(direction),
            Self::SlowDown => None,
        }
    }

    /// Signed.
    fn speed(&self, parameters: &HomingParameters) -> f64 {
        let speed = match self {
            Self::Search { .. } | Self::Leave { fast: true, .. } => parameters.search_speed,
            _ => parameters.latch_speed,
        };
        self.direction().map_or(0.0, |direction| speed * f64::from(direction.sign()))
    }
}

impl Switches {
    /// The limit switch at the end that `direction` leads to.
    pub const fn limit(self, direction: Direction) -> bool {
        match direction {
            Direction::Negative => self.negative_limit,
            Direction::Positive => self.positive_limit,
        }
    }

    fn of(self, row: Option<&HomingRow>) -> bool {
        row.is_some_and(|row| match row.switch {
            HomingSwitch::Home => self.home,
            HomingSwitch::NegativeLimit => self.negative_limit,
            HomingSwitch::PositiveLimit => self.positive_limit,
        })
    }
}

#[cfg(test)]
mod tests;
