//! Whether a shaft stands, by what its drive shows in each cycle.

use core::time::Duration;

use can::Instant;

use super::demand::CyclicState;
use crate::units::{Rpm, Turns};

/// How long a shaft has to stand until it is taken to, where nothing else is said: a speed is a mean, and a shaft may swing through 0.
const STANDS_FOR: Duration = Duration::from_millis(50);

/// Whether a shaft stands: by its speed where that is mapped, else by how far it goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Standstill {
    /// Slower than this it stands, r/min of the output.
    limit_rpm: f64,
    /// How long it has to stand.
    time: Duration,
    /// As far as it may go in that time, in turns.
    way_turns: f64,
    /// The newest look.
    now: Instant,
    stood_since: Option<Instant>,
    /// Where it was then, in turns.
    from_turns: f64,
    /// How fast it was when it was last seen to turn, r/min.
    pub(super) turned_rpm: Option<f64>,
}

impl Standstill {
    /// Of a shaft that stands below this speed.
    pub(super) const fn new(limit_rpm: f64) -> Self {
        let (now, stood_since) = (Instant::ZERO, None);
        let way_turns = way_turns(limit_rpm, STANDS_FOR);
        Self { limit_rpm, time: STANDS_FOR, way_turns, now, stood_since, from_turns: 0.0, turned_rpm: None }
    }

    /// It has to stand for so long.
    pub(super) const fn set_time(&mut self, time: Duration) {
        (self.time, self.way_turns) = (time, way_turns(self.limit_rpm, time));
    }

    /// It has to stand from here on: that it stood before says nothing of what comes.
    pub(super) const fn begin(&mut self) {
        (self.stood_since, self.turned_rpm) = (None, None);
    }

    /// What its drive shows now.
    #[inline]
    pub(super) fn look(&mut self, shown: &CyclicState, now: Instant) {
        self.now = now;
        let position = shown.position.map(|Turns(turns)| turns);
        let speed_rpm = match (shown.velocity, position, self.stood_since) {
            (Some(Rpm(rpm)), _, _) => rpm,
            (None, Some(turns), Some(since)) => {
                let gone = turns - self.from_turns;
                // Further than it may go in the whole time: the speed that brought it there is a mean.
                if gone.abs() < self.way_turns {
                    return;
                }
                gone * 60.0 / (now - since).as_secs_f64().min(self.time.as_secs_f64())
            }
            (None, Some(_), None) => 0.0,
            (None, None, _) => {
                self.stood_since = None;
                return;
            }
        };
        if speed_rpm.abs() < self.limit_rpm {
            if self.stood_since.is_none() {
                (self.stood_since, self.from_turns) = (Some(now), position.unwrap_or_default());
            }
        } else {
            self.turned_rpm = Some(speed_rpm);
            // By the position alone a look has to be compared with one before.
            self.stood_since = shown.velocity.is_none().then_some(now);
            self.from_turns = position.unwrap_or_default();
        }
    }

    /// It was seen to stand, for as long as that takes.
    pub(super) fn stands(&self) -> bool {
        self.stood_since.is_some_and(|since| self.now - since >= self.time)
    }
}

const fn way_turns(limit_rpm: f64, time: Duration) -> f64 {
    limit_rpm / 60.0 * time.as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(velocity: Option<f64>, position: Option<f64>) -> CyclicState {
        CyclicState {
            statusword: None,
            power: None,
            is_live: false,
            follows: false,
            position: position.map(Turns),
            velocity: velocity.map(Rpm),
            current: None,
            age: None,
            refused: None,
        }
    }

    /// Looks each 10 ms, until it stands; how long that took, in ms.
    fn stands_after(looks: impl IntoIterator<Item = CyclicState>) -> Option<u64> {
        let mut shaft = Standstill::new(1.0);
        (0..).step_by(10).zip(looks).find_map(|(ms, look)| {
            shaft.look(&look, Instant::from_millis(ms));
            shaft.stands().then_some(ms)
        })
    }

    #[test]
    fn a_shaft_stands_once_it_has_stood_for_its_time() {
        assert_eq!(stands_after((0..20).map(|_| shown(Some(0.2), None))), Some(50));
        // It swings through 0 every third cycle.
        assert_eq!(stands_after((0..90).map(|n| shown(Some(if n % 3 == 0 { 0.0 } else { 4.0 }), None))), None);
        assert_eq!(stands_after((0..20).map(|_| shown(None, None))), None, "it was not seen");
    }

    #[test]
    fn without_a_speed_it_is_seen_by_where_the_shaft_is() {
        let turning = |rpm: f64| (0..90).map(move |n| shown(None, Some(rpm / 60.0 * 0.01 * f64::from(n))));
        assert_eq!(stands_after(turning(0.0)), Some(50));
        assert_eq!(stands_after(turning(1.5)), None);
        assert_eq!(stands_after(turning(-30.0)), None);
        // One count of a coarse encoder, back and forth: 1/2048 turn a cycle would be 2.9 r/min.
        assert_eq!(stands_after((0..20).map(|n| shown(None, Some(f64::from(n % 2) / 2048.0)))), Some(50));
        let mut shaft = Standstill::new(1.0);
        (0..).step_by(10).zip(turning(30.0)).for_each(|(ms, look)| shaft.look(&look, Instant::from_millis(ms)));
        assert!(shaft.turned_rpm.is_some_and(|rpm| (rpm - 30.0).abs() < 1e-6), "{shaft:?}");
    }
}
