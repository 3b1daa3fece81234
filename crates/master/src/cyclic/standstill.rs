//! Whether a shaft stands, by what its drive shows in each cycle.

use core::time::Duration;

use super::demand::CyclicState;
use crate::units::{Rpm, Turns};

/// Whether a shaft stands: by its speed where that is mapped, else by how far it goes. It stands once it has stood for some time,
/// since a speed is a mean, and a shaft may swing through 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standstill {
    /// Slower than this it stands, r/min.
    limit_rpm: f64,
    period_s: f64,
    /// Cycles in a row in which it has to stand.
    needed: u64,
    stood: u64,
    /// Where it was when they began, in turns.
    from_turns: Option<f64>,
    /// How fast it was when it was last seen to turn, r/min.
    turned_rpm: f64,
}

impl Standstill {
    /// Of a shaft that stands below this speed, after this time.
    pub(crate) fn new(limit_rpm: f64, time: Duration, period_s: f64) -> Self {
        let needed = (time.as_secs_f64() / period_s).ceil().max(1.0) as u64;
        Self { limit_rpm, period_s, needed, stood: 0, from_turns: None, turned_rpm: 0.0 }
    }

    /// What its drive shows in this cycle.
    pub(crate) fn look(&mut self, shown: &CyclicState) {
        let speed_rpm = match (shown.velocity, shown.position, self.from_turns) {
            (Some(Rpm(rpm)), _, _) => rpm,
            // Further away than it may go in the whole time; the speed that brought it there is a mean.
            (None, Some(Turns(at)), Some(from)) => {
                let cycles = if (at - from).abs() * 60.0 < self.limit_rpm * self.needed as f64 * self.period_s {
                    self.needed
                } else {
                    (self.stood + 1).min(self.needed)
                };
                (at - from) * 60.0 / (cycles as f64 * self.period_s)
            }
            (None, Some(Turns(at)), None) => {
                self.from_turns = Some(at);
                return;
            }
            (None, None, _) => {
                (self.stood, self.from_turns) = (0, None);
                return;
            }
        };
        if speed_rpm.abs() < self.limit_rpm {
            self.stood += 1;
        } else {
            self.stood = 0;
            self.from_turns = shown.position.map(|Turns(at)| at);
            self.turned_rpm = speed_rpm;
        }
    }

    /// It was seen to stand, for as long as that takes.
    pub(crate) const fn stands(&self) -> bool {
        self.stood >= self.needed
    }

    /// How fast it was when it was last seen to turn, in r/min.
    pub(crate) const fn turned_rpm(&self) -> f64 {
        self.turned_rpm
    }

    /// How many cycles it takes to see that it stands.
    pub(crate) const fn needed(&self) -> u64 {
        self.needed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(velocity: Option<f64>, position: Option<f64>) -> CyclicState {
        CyclicState {
            statusword: None,
            power: None,
            follows: false,
            position: position.map(Turns),
            velocity: velocity.map(Rpm),
            current: None,
            age: None,
            refused: None,
        }
    }

    /// Cycles of 10 ms, one a row, until it stands.
    fn stands_after(looks: impl IntoIterator<Item = CyclicState>) -> Option<usize> {
        let mut shaft = Standstill::new(1.0, Duration::from_millis(50), 0.01);
        looks.into_iter().position(|look| {
            shaft.look(&look);
            shaft.stands()
        })
    }

    #[test]
    fn a_shaft_stands_once_it_has_stood_for_its_time() {
        assert_eq!(stands_after((0..20).map(|_| shown(Some(0.2), None))), Some(4));
        // It swings through 0 every third cycle.
        assert_eq!(stands_after((0..90).map(|n| shown(Some(if n % 3 == 0 { 0.0 } else { 4.0 }), None))), None);
        assert_eq!(stands_after((0..20).map(|_| shown(None, None))), None, "it was not seen");
    }

    #[test]
    fn without_a_speed_it_is_seen_by_where_the_shaft_is() {
        let turning = |rpm: f64| (0..90).map(move |n| shown(None, Some(rpm / 60.0 * 0.01 * f64::from(n))));
        assert_eq!(stands_after(turning(0.0)), Some(5));
        assert_eq!(stands_after(turning(1.5)), None);
        assert_eq!(stands_after(turning(-30.0)), None);
        // One count of a coarse encoder, back and forth: 1/2048 turn a cycle would be 2.9 r/min.
        assert_eq!(stands_after((0..20).map(|n| shown(None, Some(f64::from(n % 2) / 2048.0)))), Some(5));
        let mut shaft = Standstill::new(1.0, Duration::from_millis(50), 0.01);
        turning(30.0).for_each(|look| shaft.look(&look));
        assert!((shaft.turned_rpm() - 30.0).abs() < 1e-6, "{shaft:?}");
    }
}
