//! How fast the time of a served world passes: with the clock, so many times as fast, as fast as the machine goes, or by hand.

use std::time::Duration;

use can::Instant;
use sim::pace::Pace;

/// How far a world that goes as fast as it can is moved between two looks at its clients: a client's frame waits for so much
/// of the bus's time at most.
const STEP: Duration = Duration::from_millis(1);

/// How long a world waits between two moves while no client is connected. What happens in it has its own time all the same.
const UNHEARD: Duration = Duration::from_millis(20);

/// A world that was not moved for longer does not catch up: the machine slept, or the program was frozen.
const ASLEEP: Duration = Duration::from_secs(10);

/// Fastest and slowest that can be asked for.
const SPEEDS: std::ops::RangeInclusive<f64> = 0.001..=100_000.0;

/// What `--speed` says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Speed {
    /// So many times as fast as the clock.
    Times(f64),
    /// As fast as the machine goes, while a client is connected; else with the clock.
    Max,
}

impl std::str::FromStr for Speed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "max" {
            return Ok(Self::Max);
        }
        let times = text.parse().ok().filter(|times| SPEEDS.contains(times));
        times.map(Self::Times).ok_or_else(|| {
            format!("expected a multiple of real time from 0.001 to 100000, e.g. 10, or max, not {text:?}; --clock manual stops time")
        })
    }
}

/// What `--clock` says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clock {
    /// Time passes by itself.
    #[default]
    Real,
    /// Time passes by `run 20ms` only.
    Manual,
}

/// See the [module](self).
#[derive(Debug)]
pub struct Pacer {
    way: Way,
    /// Of a world that follows the clock.
    pace: Pace,
    clients: usize,
    /// What the clock showed when the world was moved last.
    moved: Instant,
    /// With a client come or gone the pace begins anew.
    changed: bool,
    /// Time has not begun: it does with the first client.
    waits: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    Clock,
    Max,
    /// Time moves to there.
    Manual(Instant),
}

impl Pacer {
    /// A world at time zero when the clock shows zero.
    pub fn new(clock: Clock, speed: Speed) -> Self {
        let (way, times) = match (clock, speed) {
            (Clock::Manual, _) => (Way::Manual(Instant::ZERO), 0.0),
            (Clock::Real, Speed::Times(times)) => (Way::Clock, times),
            (Clock::Real, Speed::Max) => (Way::Max, 1.0),
        };
        Self {
            way,
            pace: Pace::with_speed(Instant::ZERO, times),
            clients: 0,
            moved: Instant::ZERO,
            changed: false,
            waits: false,
        }
    }

    /// Time stands until the first client comes, unless it is moved by hand.
    pub fn waiting_for_a_client(self) -> Self {
        Self { waits: !self.is_manual(), ..self }
    }

    /// How far a world at `now` is to come when the clock shows `clock`.
    pub fn target(&mut self, clock: Instant, now: Instant) -> Instant {
        // The time in which the machine slept is left out.
        self.changed |= clock - self.moved > ASLEEP;
        self.moved = clock;
        match self.way {
            Way::Manual(end) => end,
            _ if self.waits => now,
            Way::Max if self.clients > 0 => now + STEP,
            Way::Clock | Way::Max => {
                let elapsed = elapsed(clock);
                if std::mem::take(&mut self.changed) {
                    self.pace = self.pace.rebased(elapsed, now);
                }
                self.pace.target(elapsed)
            }
        }
    }

    /// What the clock shows when a world is to have come to `at`; `None` for never.
    pub fn clock_at(&self, at: Instant) -> Option<Instant> {
        match self.way {
            Way::Manual(end) => (at <= end).then_some(Instant::ZERO),
            _ if self.waits => None,
            Way::Max if self.clients > 0 => Some(Instant::ZERO),
            Way::Clock | Way::Max => {
                let due = Instant::ZERO + self.pace.elapsed_at(at)?;
                Some(if self.clients == 0 { due.max(self.moved + UNHEARD) } else { due })
            }
        }
    }

    /// Whether a world can fall behind: it follows the clock.
    pub fn follows_the_clock(&self) -> bool {
        self.way == Way::Clock || (self.way == Way::Max && self.clients == 0)
    }

    /// Time is moved by hand.
    pub fn is_manual(&self) -> bool {
        matches!(self.way, Way::Manual(_))
    }

    /// Has time pass up to `end`, where it is moved by hand.
    pub fn run_to(&mut self, end: Instant) {
        self.way = Way::Manual(end);
    }

    /// A client has come.
    pub fn joined(&mut self) {
        self.clients += 1;
        self.changed |= std::mem::take(&mut self.waits);
    }

    /// A client is gone. A world that has hurried goes on from where it is.
    pub fn left(&mut self) {
        self.clients = self.clients.saturating_sub(1);
        self.changed |= self.clients == 0 && self.way == Way::Max;
    }
}

fn elapsed(clock: Instant) -> Duration {
    clock - Instant::ZERO
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Instant {
        Instant::from_millis(ms)
    }

    #[test]
    fn a_machine_that_slept_does_not_hurry_after() {
        let mut pacer = Pacer::new(Clock::Real, Speed::Times(1.0));
        assert_eq!(pacer.target(at(5_000), at(4_900)), at(5_000));
        // Held up for a moment it does; asleep for an hour it goes on from where it is.
        assert_eq!(pacer.target(at(9_000), at(5_000)), at(9_000));
        assert_eq!(pacer.target(at(3_609_000), at(9_000)), at(9_000));
        assert_eq!(pacer.target(at(3_609_100), at(9_000)), at(9_100));
    }

    #[test]
    fn ten_times_as_fast_is_ten_times_as_far() {
        let mut pacer = Pacer::new(Clock::Real, Speed::Times(10.0));
        assert_eq!(pacer.target(at(50), at(3)), at(500));
        pacer.joined();
        assert_eq!(pacer.clock_at(at(510)), Some(at(51)));
        assert!(pacer.follows_the_clock());
    }

    #[test]
    fn a_world_that_nobody_hears_is_moved_seldom() {
        let mut pacer = Pacer::new(Clock::Real, Speed::Times(1.0));
        assert_eq!(pacer.target(at(50), at(30)), at(50));
        assert_eq!((pacer.clock_at(at(51)), pacer.clock_at(at(90))), (Some(at(70)), Some(at(90))));
        pacer.joined();
        assert_eq!(pacer.clock_at(at(51)), Some(at(51)));
        pacer.left();
        assert_eq!(pacer.clock_at(at(51)), Some(at(70)));
    }

    #[test]
    fn at_most_means_step_by_step_while_somebody_is_there_and_with_the_clock_else() {
        let mut pacer = Pacer::new(Clock::Real, Speed::Max);
        assert_eq!(pacer.target(at(50), at(40)), at(50));
        pacer.joined();
        assert_eq!(pacer.target(at(60), at(50)), at(51));
        assert_eq!(pacer.clock_at(at(9000)), Some(Instant::ZERO));
        assert!(!pacer.follows_the_clock());
        pacer.left();
        assert_eq!(pacer.target(at(70), at(8000)), at(8000));
        assert_eq!(pacer.target(at(75), at(8000)), at(8005));
        assert_eq!(pacer.clock_at(at(8050)), Some(at(120)));
    }

    #[test]
    fn by_hand_time_stands_until_somebody_moves_it() {
        let mut pacer = Pacer::new(Clock::Manual, Speed::Times(1.0));
        assert_eq!((pacer.target(at(9000), Instant::ZERO), pacer.clock_at(at(1))), (Instant::ZERO, None));
        pacer.run_to(at(20));
        assert_eq!((pacer.target(at(9000), Instant::ZERO), pacer.clock_at(at(1))), (at(20), Some(Instant::ZERO)));
        assert_eq!(pacer.clock_at(at(21)), None);
        assert!(pacer.is_manual() && !pacer.follows_the_clock());
    }

    #[test]
    fn time_that_waits_for_a_client_begins_with_the_first_and_goes_on_without_it() {
        let mut pacer = Pacer::new(Clock::Real, Speed::Times(2.0)).waiting_for_a_client();
        assert_eq!((pacer.target(at(900), Instant::ZERO), pacer.clock_at(at(1))), (Instant::ZERO, None));
        pacer.joined();
        assert_eq!(
            (pacer.target(at(1000), Instant::ZERO), pacer.target(at(1010), Instant::ZERO)),
            (Instant::ZERO, at(20))
        );
        pacer.left();
        assert_eq!(pacer.target(at(1500), at(20)), at(1000));
        let by_hand = Pacer::new(Clock::Manual, Speed::Times(1.0)).waiting_for_a_client();
        assert!(!by_hand.waits);
    }

    #[test]
    fn a_speed_is_a_number_above_zero_or_max() {
        assert_eq!("10".parse(), Ok(Speed::Times(10.0)));
        assert_eq!("0.5".parse(), Ok(Speed::Times(0.5)));
        assert_eq!("max".parse(), Ok(Speed::Max));
        for wrong in ["0", "-1", "nan", "inf", "fast", "1e9", ""] {
            let error = wrong.parse::<Speed>().unwrap_err();
            assert!(error.contains("0.001 to 100000") && error.contains("max"), "{wrong}: {error}");
        }
    }
}
