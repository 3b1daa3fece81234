//! Homing (CiA 402-2, clause 11) after rows as those of [`cia402::HOMING_METHODS`].
//!
//! ```text
//! search (fast) --switch on--> leave and back off --> cross the edge (slow) = home position, stop
//!        \--limit: turn round, once
//! ```
//!
//! In go the switches and where the shaft is, out comes the velocity to go at, and the moment of the edge. Stopping,
//! reversing and its ramps are the trajectory's. A limit switch against the present direction ends the run unless the
//! method turns round there, or looks for that switch. An edge counts only while the shaft moves the way it is to be
//! crossed, so that running past a switch while slowing down does no harm.

use cia402::{Direction, HomingRow, HomingSwitch, SwitchEdge};

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
}

/// How homing is set; counts and counts/s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HomingParameters {
    /// The method; without one homing fails as it starts.
    pub row: Option<&'static HomingRow>,
    /// Speed of the search.
    pub search_speed: f64,
    /// Speed of the way back and of crossing the edge.
    pub latch_speed: f64,
    /// Start speed, highest speed, and the times of all ramps.
    pub ramps: VelocityRamps,
    /// How far beyond the edge to go before crossing it.
    pub back_off: u32,
}

/// What to do in this period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HomingStep {
    /// Go at this velocity; 0 also when nothing is under way.
    Go(f64),
    /// The edge is here, and the run is over: stop at once.
    Latched,
    /// A limit switch stands in the way, and the run is over: stop at once.
    Failed,
}

/// Where homing stands.
#[derive(Clone, Copy, Debug, Default)]
pub struct Homing {
    run: Option<Run>,
    /// How the last run ended: true with the home position.
    outcome: Option<bool>,
}

#[derive(Clone, Copy, Debug)]
struct Run {
    row: &'static HomingRow,
    phase: Phase,
    /// The method's switch in the preceding period.
    was_on: bool,
}

#[derive(Clone, Copy, Debug)]
enum Phase {
    Search { direction: Direction, turned: bool },
    Leave { fast: bool, left_at: Option<i32> },
    Cross,
    SlowDown,
}

impl Homing {
    /// Bit 4 rose.
    pub fn start(&mut self, row: Option<&'static HomingRow>, switches: Switches) {
        let Some(row) = row else { return self.end(false) };
        let mut run =
            Run { row, phase: Phase::Search { direction: row.search, turned: false }, was_on: switches.of(row) };
        if run.was_on {
            run.found(None);
        }
        *self = Self { run: Some(run), outcome: None };
    }

    /// Bit 4 fell: slows down, and the run counts as nothing.
    pub fn interrupt(&mut self) {
        if let Some(Run { phase, .. }) = &mut self.run {
            *phase = Phase::SlowDown;
        }
    }

    /// Somebody else stops the motor.
    pub fn abort(&mut self) {
        if self.is_running() {
            self.end(false);
        }
    }

    /// One period, before the trajectory moves on from `at`.
    pub fn update(&mut self, parameters: &HomingParameters, switches: Switches, at: TrajectoryPoint) -> HomingStep {
        let Some(run) = &mut self.run else { return HomingStep::Go(0.0) };
        let step = run.update(parameters, switches, at);
        match step {
            HomingStep::Go(_) => {}
            HomingStep::Latched => self.end(true),
            HomingStep::Failed => self.end(false),
        }
        step
    }

    /// The shaft rests after slowing down.
    pub fn come_to_rest(&mut self) {
        if self.run.is_some_and(|run| run.is_slowing_down()) {
            self.end(false);
        }
    }

    /// A run is under way.
    pub const fn is_running(&self) -> bool {
        self.run.is_some()
    }

    /// A run has ended, well or not, and none is under way.
    pub const fn has_ended(&self) -> bool {
        self.outcome.is_some()
    }

    /// The last run found the home position.
    pub fn is_attained(&self) -> bool {
        self.outcome == Some(true)
    }

    fn end(&mut self, attained: bool) {
        *self = Self { run: None, outcome: Some(attained) };
    }
}

impl Run {
    fn update(&mut self, parameters: &HomingParameters, switches: Switches, at: TrajectoryPoint) -> HomingStep {
        let on = switches.of(self.row);
        let was_on = core::mem::replace(&mut self.was_on, on);
        if let Phase::Search { direction, .. } = self.phase
            && on
        {
            self.found(Some(direction));
        }
        if self.meets_limit(switches) && !self.turn_round(switches) {
            return HomingStep::Failed;
        }
        let moves = at.velocity * f64::from(self.direction().sign()) > 0.0;
        match &mut self.phase {
            Phase::Search { .. } | Phase::SlowDown => {}
            Phase::Leave { left_at, .. } => {
                match *left_at {
                    _ if on => *left_at = None,
                    None if was_on && moves => *left_at = Some(at.position),
                    _ => {}
                }
                if left_at
                    .is_some_and(|left_at| at.position.wrapping_sub(left_at).unsigned_abs() >= parameters.back_off)
                {
                    self.phase = Phase::Cross;
                }
            }
            Phase::Cross => {
                let edge = match self.row.edge {
                    SwitchEdge::Rising => on && !was_on,
                    SwitchEdge::Falling => was_on && !on,
                };
                if edge && moves {
                    return HomingStep::Latched;
                }
            }
        }
        HomingStep::Go(self.speed(parameters) * f64::from(self.direction().sign()))
    }

    /// The switch is on, met while moving in `direction` or at the start.
    fn found(&mut self, direction: Option<Direction>) {
        self.phase = match self.row.edge {
            SwitchEdge::Falling => Phase::Cross,
            // Going on the same way needs no reversal, so it stays fast.
            SwitchEdge::Rising => Phase::Leave { fast: direction == Some(self.row.crossing.reversed()), left_at: None },
        };
    }

    /// A limit switch stands in the way; the one that the method looks for does not.
    fn meets_limit(&self, switches: Switches) -> bool {
        let looked_for = match self.direction() {
            Direction::Negative => HomingSwitch::NegativeLimit,
            Direction::Positive => HomingSwitch::PositiveLimit,
        };
        self.row.switch != looked_for && switches.limit(self.direction()) && !self.is_slowing_down()
    }

    /// A limit switch stands in the way of the search; true if the method turns round there.
    fn turn_round(&mut self, switches: Switches) -> bool {
        match self.phase {
            Phase::Search { direction, turned: false }
                if self.row.reverses_at_limit && !switches.limit(direction.reversed()) =>
            {
                self.phase = Phase::Search { direction: direction.reversed(), turned: true };
                true
            }
            _ => false,
        }
    }

    fn direction(&self) -> Direction {
        match self.phase {
            Phase::Search { direction, .. } => direction,
            Phase::Leave { .. } => self.row.crossing.reversed(),
            Phase::Cross | Phase::SlowDown => self.row.crossing,
        }
    }

    fn speed(&self, parameters: &HomingParameters) -> f64 {
        match self.phase {
            Phase::Search { .. } | Phase::Leave { fast: true, .. } => parameters.search_speed,
            Phase::Leave { fast: false, .. } | Phase::Cross => parameters.latch_speed,
            Phase::SlowDown => 0.0,
        }
    }

    const fn is_slowing_down(&self) -> bool {
        matches!(self.phase, Phase::SlowDown)
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

    const fn of(self, row: &HomingRow) -> bool {
        match row.switch {
            HomingSwitch::Home => self.home,
            HomingSwitch::NegativeLimit => self.negative_limit,
            HomingSwitch::PositiveLimit => self.positive_limit,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cia402::HomingMethod;

    /// Limits beyond ±1000, home from 0 to 100; moves without ramps.
    fn switches(position: i32) -> Switches {
        Switches {
            home: (0..=100).contains(&position),
            positive_limit: position >= 1000,
            negative_limit: position <= -1000,
        }
    }

    fn latch(method: i8, start: i32) -> Option<i32> {
        latch_by(HomingMethod(method).row().unwrap(), start)
    }

    /// Runs a row from `start`; the position latched, `None` if it fails.
    fn latch_by(row: &'static HomingRow, start: i32) -> Option<i32> {
        let method = row.method;
        let parameters = HomingParameters {
            row: Some(row),
            search_speed: 5.0,
            latch_speed: 1.0,
            back_off: 20,
            ..HomingParameters::default()
        };
        let mut homing = Homing::default();
        let (mut position, mut velocity) = (start, 0.0);
        homing.start(parameters.row, switches(position));
        for _ in 0..20_000 {
            match homing.update(&parameters, switches(position), TrajectoryPoint::moving(position, velocity)) {
                HomingStep::Go(next) => velocity = next,
                HomingStep::Latched => return Some(position),
                HomingStep::Failed => return None,
            }
            position += velocity as i32;
        }
        panic!("{method:?} from {start} has no end");
    }

    #[test]
    fn every_method_finds_its_edge_from_every_start() {
        // The figures of methods 17 to 30: limits go off just inside ±1000, home goes on at 0 and 100, off at -1 and 101.
        let expected = [(17, -999), (18, 999), (23, -1), (24, 0), (25, 100), (26, 101), (27, 101), (28, 100), (29, 0)];
        for (method, edge) in expected.into_iter().chain([(30, -1)]) {
            for start in [-1005, -990, -500, -1, 0, 50, 100, 101, 500, 990, 1005] {
                assert_eq!(latch(method, start), Some(edge), "method {method} from {start}");
            }
        }
    }

    #[test]
    fn a_limit_switch_may_be_left_and_met_again_from_inside() {
        const fn row(switch: HomingSwitch, search: Direction) -> HomingRow {
            let method = HomingMethod(-1);
            HomingRow { method, switch, search, reverses_at_limit: false, edge: SwitchEdge::Rising, crossing: search }
        }
        static ROWS: [HomingRow; 2] = [
            row(HomingSwitch::NegativeLimit, Direction::Negative),
            row(HomingSwitch::PositiveLimit, Direction::Positive),
        ];
        for start in [-1005, -990, -500, 0, 500, 990, 1005] {
            for (row, edge) in ROWS.iter().zip([-1000, 1000]) {
                assert_eq!(latch_by(row, start), Some(edge), "{row:?} from {start}");
            }
        }
    }

    #[test]
    fn both_limits_without_a_home_switch_end_the_search() {
        let parameters = HomingParameters { row: HomingMethod(24).row(), search_speed: 5.0, ..Default::default() };
        let mut homing = Homing::default();
        homing.start(parameters.row, Switches::default());
        let positive = Switches { positive_limit: true, ..Switches::default() };
        let negative = Switches { negative_limit: true, ..Switches::default() };
        let at = TrajectoryPoint::rest(0);
        assert_eq!(homing.update(&parameters, Switches::default(), at), HomingStep::Go(5.0));
        assert_eq!(homing.update(&parameters, positive, at), HomingStep::Go(-5.0));
        assert_eq!(homing.update(&parameters, negative, at), HomingStep::Failed);
        assert!(!homing.is_running() && homing.has_ended() && !homing.is_attained());
    }

    #[test]
    fn without_a_method_nothing_starts() {
        let mut homing = Homing::default();
        assert!(!homing.has_ended(), "nobody has asked for it");
        homing.start(None, Switches::default());
        assert!(!homing.is_running() && homing.has_ended() && !homing.is_attained());
    }
}
