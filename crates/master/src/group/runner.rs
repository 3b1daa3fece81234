//! What a group does in one cycle: the state machine between its intents and its drives.

use core::time::Duration;

use can::Instant;
use cia402::{PowerState, Statusword};

use super::axis::GroupAxis;
use super::limits::{AxisLimits, PathPoint};
use super::state::{GroupState, Phase, StopCause};
use super::stream::{Due, Stream};
use super::trajectory::Trajectory;
use crate::core::Cycle;
use crate::cyclic::{CyclicState, Demand, Refusal};
use crate::network::Exchange;

/// How long drives may take to be enabled, and to be without power again.
pub(super) const POWER_LIMIT: Duration = Duration::from_secs(5);

/// What the axes are on.
#[derive(Debug)]
pub(super) enum Activity {
    Off,
    Enabling,
    Holding,
    Moving {
        path: Trajectory,
        time_s: f64,
    },
    Streaming(Stream),
    Stopping {
        path: Trajectory,
        time_s: f64,
    },
    /// No path to rest was found: each drive by its own quick stop (605Ah), for so many cycles now.
    QuickStop {
        cycles: u64,
    },
}

/// The axes of a group and their path, stepped once in each cycle of SYNC.
#[derive(Debug)]
pub(super) struct GroupRunner {
    pub(super) axes: Vec<GroupAxis>,
    pub(super) limits: Vec<AxisLimits>,
    /// Where each axis is on its path.
    pub(super) points: Vec<PathPoint>,
    pub(super) states: Vec<CyclicState>,
    pub(super) activity: Activity,
    pub(super) cause: Option<StopCause>,
    pub(super) period_s: f64,
    /// Cycles for which the axes have had nowhere to go.
    pub(super) still_cycles: u64,
    seen: Option<Cycle>,
    missed_cycles: u64,
    /// When the last move or stream sent its first set-points.
    pub(super) began: Option<Instant>,
}

const UNSEEN: CyclicState = CyclicState {
    statusword: None,
    power: None,
    is_live: false,
    follows: false,
    position: None,
    velocity: None,
    current: None,
    age: None,
    refused: None,
};

impl GroupRunner {
    pub(super) fn new(axes: Vec<GroupAxis>, limits: Vec<AxisLimits>, period_s: f64) -> Self {
        let count = axes.len();
        Self {
            axes,
            limits,
            points: vec![PathPoint::default(); count],
            states: vec![UNSEEN; count],
            activity: Activity::Off,
            cause: None,
            period_s,
            still_cycles: 0,
            seen: None,
            missed_cycles: 0,
            began: None,
        }
    }

    pub(super) const fn phase(&self) -> Phase {
        match self.activity {
            Activity::Off => Phase::Off,
            Activity::Enabling => Phase::Enabling,
            Activity::Holding => Phase::Holding,
            Activity::Moving { .. } => Phase::Moving,
            Activity::Streaming(_) => Phase::Streaming,
            Activity::Stopping { .. } | Activity::QuickStop { .. } => Phase::Stopping,
        }
    }

    pub(super) const fn state(&self) -> GroupState {
        GroupState { phase: self.phase(), cause: self.cause, missed_cycles: self.missed_cycles }
    }

    /// One cycle. Allocates nothing, but for a stop.
    pub(super) fn step(&mut self, io: &mut Exchange<'_>) -> GroupState {
        if let Some(cycle) = io.cycle() {
            self.missed_cycles += self.seen.map_or(0, |before| cycle.missed_since(&before));
            self.seen = Some(cycle);
        }
        self.advance(io.now());
        self.drive(io);
        if let Some(cause) = self.find_trouble() {
            self.stop(cause);
        }
        if matches!(self.activity, Activity::Enabling) && self.states.iter().all(|state| state.follows) {
            self.begin();
        }
        // Drives that a quick stop has left without power can be enabled again; those that it holds stay in it.
        if matches!(self.activity, Activity::QuickStop { .. }) && self.states.iter().all(CyclicState::is_without_power)
        {
            self.activity = Activity::Off;
        }
        let is_still = !self.is_under_way();
        if is_still && self.still_cycles == 0 {
            // One that was about to turn had still stood.
            self.axes.iter_mut().for_each(|axis| axis.drive.begin_rest());
        }
        self.still_cycles = if is_still { self.still_cycles + 1 } else { 0 };
        self.state()
    }

    /// The axes have somewhere to go, or to come to rest. A quick stop has no end that the group plans: its drives stand when
    /// they report it, and the wait is bounded.
    pub(super) fn is_under_way(&self) -> bool {
        match self.activity {
            Activity::Off | Activity::Enabling | Activity::Holding => false,
            Activity::Moving { .. } | Activity::Streaming(_) | Activity::Stopping { .. } => true,
            Activity::QuickStop { cycles } => !self.has_quick_stopped() && cycles <= self.cycles(POWER_LIMIT),
        }
    }

    pub(super) fn cycles(&self, time: Duration) -> u64 {
        (time.as_secs_f64() / self.period_s).ceil() as u64
    }

    /// The points of this cycle. A path goes on by one period a step: cycles that the program missed delay it, since to make
    /// up for them would take a leap.
    fn advance(&mut self, now: Instant) {
        let period_s = self.period_s;
        match &mut self.activity {
            Activity::Off | Activity::Enabling | Activity::Holding => {}
            Activity::QuickStop { cycles } => *cycles += 1,
            Activity::Moving { path, time_s } | Activity::Stopping { path, time_s } => {
                if *time_s == 0.0 {
                    self.began = Some(now);
                }
                *time_s += period_s;
                path.at(*time_s, &mut self.points);
                if *time_s >= path.duration_s() {
                    self.activity = Activity::Holding;
                }
            }
            Activity::Streaming(stream) => match stream.take(&mut self.points, &self.limits) {
                Due::Point | Due::Late | Due::Wait => {}
                Due::Underrun => {
                    let cycles = stream.grace();
                    self.stop(StopCause::Underrun { cycles });
                    self.advance(now);
                }
                Due::OutOfReach { cycles } => {
                    self.stop(StopCause::OutOfReach { cycles });
                    self.advance(now);
                }
                Due::End => {
                    self.come_to_rest();
                    self.advance(now);
                }
            },
        }
        if matches!(self.activity, Activity::Holding) {
            for point in &mut self.points {
                *point = PathPoint { position_turns: point.position_turns, ..PathPoint::default() };
            }
        }
        self.keep_in_range();
    }

    /// The way to rest of a stop, or the way on of a stream that is late, may lead over a software limit. There the limit
    /// counts more than a smooth stop. An axis that began outside is let come back.
    fn keep_in_range(&mut self) {
        if !matches!(self.activity, Activity::Streaming(_) | Activity::Stopping { .. }) {
            return;
        }
        for (point, limits) in self.points.iter_mut().zip(&self.limits) {
            let Some(range) = &limits.range_turns else { continue };
            let outward = (point.position_turns > *range.end() && point.velocity_turns_s > 0.0)
                || (point.position_turns < *range.start() && point.velocity_turns_s < 0.0);
            if outward {
                let position_turns = point.position_turns.clamp(*range.start(), *range.end());
                *point = PathPoint { position_turns, ..PathPoint::default() };
            }
        }
    }

    fn drive(&mut self, io: &mut Exchange<'_>) {
        let demand = match self.activity {
            Activity::Off => Some(Demand::Off),
            Activity::Enabling => Some(Demand::Hold),
            Activity::QuickStop { .. } => Some(Demand::QuickStop),
            _ => None,
        };
        let axes = self.axes.iter_mut().zip(&self.points).zip(&self.limits);
        for (((axis, point), limits), state) in axes.zip(&mut self.states) {
            *state = match demand {
                Some(demand) => axis.drive.step(io, demand),
                None => axis.follow(io, *point, limits, state),
            };
        }
    }

    /// What stops the whole group.
    fn find_trouble(&self) -> Option<StopCause> {
        // The first cause is reported; a stop that was asked for is not an error.
        let is_reported = self.cause.is_some_and(|cause| cause != StopCause::Asked);
        if is_reported || matches!(self.activity, Activity::Off | Activity::QuickStop { .. }) {
            return None;
        }
        let enabling = matches!(self.activity, Activity::Enabling);
        for ((number, axis), (state, limits)) in (1..).zip(&self.axes).zip(self.states.iter().zip(&self.limits)) {
            let node = axis.drive.node();
            match state.refused {
                // Its first TPDO is on its way.
                Some(Refusal::NotHeard | Refusal::NoCycle) if enabling => {}
                Some(refusal) => return Some(StopCause::Axis { axis: number, node, refusal }),
                None => {}
            }
            let limit_turns = limits.following_error_turns;
            if let Some(error_turns) = axis.error_turns.filter(|error| !enabling && *error > limit_turns) {
                return Some(StopCause::FollowingError { axis: number, node, error_turns, limit_turns });
            }
        }
        None
    }

    /// All axes follow: their path begins where they are held.
    fn begin(&mut self) {
        let begun = self.axes.iter_mut().zip(&self.states).zip(&mut self.points);
        let mut known = true;
        for ((axis, state), point) in begun {
            match axis.begin(state) {
                Some(at) => *point = at,
                None => known = false,
            }
        }
        if known {
            self.activity = Activity::Holding;
        }
    }

    /// Brings all axes to rest, for this reason.
    pub(super) fn stop(&mut self, cause: StopCause) {
        self.note(cause);
        match self.activity {
            Activity::Enabling => self.activity = Activity::Off,
            Activity::Moving { .. } | Activity::Streaming(_) => self.come_to_rest(),
            Activity::Off | Activity::Holding | Activity::Stopping { .. } | Activity::QuickStop { .. } => {}
        }
    }

    /// The first cause stays, but for a stop that was merely asked for.
    fn note(&mut self, cause: StopCause) {
        if matches!(self.cause, None | Some(StopCause::Asked)) {
            self.cause = Some(cause);
        }
    }

    /// True once the quick stop has ended at all drives: they have no power, or are held where they came to rest
    /// (605Ah of 5 to 8: target reached, CiA 402-2, 8.4.2; one without the state machine has power and no longer follows).
    pub(super) fn has_quick_stopped(&self) -> bool {
        self.states.iter().all(|state| {
            let held = state.power == Some(PowerState::QuickStopActive)
                && state.statusword.is_some_and(|word| word.has(Statusword::TARGET_REACHED));
            let holds = state.is_live && state.power == Some(PowerState::SwitchedOn);
            held || holds || state.is_without_power()
        })
    }

    fn come_to_rest(&mut self) {
        self.activity = match Trajectory::to_rest(&self.points, &self.limits) {
            Ok(path) => Activity::Stopping { path, time_s: 0.0 },
            Err(_) => {
                self.note(StopCause::NoPathToRest);
                Activity::QuickStop { cycles: 0 }
            }
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A group without axes, for which the planner finds no path.
    fn runner(activity: Activity) -> GroupRunner {
        GroupRunner { activity, ..GroupRunner::new(Vec::new(), Vec::new(), 0.001) }
    }

    fn stream() -> Activity {
        Activity::Streaming(Stream::new(&[], 0.001, super::super::stream::StreamOptions::default()))
    }

    #[test]
    fn a_quick_stop_has_a_cause_also_where_a_stop_was_asked_for() {
        let mut asked = runner(stream());
        asked.stop(StopCause::Asked);
        assert!(matches!(asked.activity, Activity::QuickStop { .. }), "{:?}", asked.activity);
        assert_eq!(asked.state().cause, Some(StopCause::NoPathToRest));
        // At the end of a stream there was no request to stop.
        let mut ended = runner(stream());
        ended.come_to_rest();
        assert_eq!(ended.state().cause, Some(StopCause::NoPathToRest));
        let text = StopCause::NoPathToRest.to_string();
        assert!(text.contains("quick stop (605Ah)") && text.contains("Switch it off"), "{text}");
    }

    #[test]
    fn what_made_the_stop_necessary_stays_its_cause() {
        let mut late = runner(stream());
        late.stop(StopCause::Underrun { cycles: 2 });
        late.stop(StopCause::Asked);
        assert_eq!(late.state().cause, Some(StopCause::Underrun { cycles: 2 }));
    }
}
