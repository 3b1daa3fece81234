//! So many a second, and so many at once.

use std::time::Duration;

use can::Instant;

/// A bucket of tokens: it begins full, each event takes one, and they come back at a rate.
#[derive(Debug)]
pub(super) struct Rate {
    /// Time for one.
    gap: Duration,
    /// As much time as a full bucket has.
    burst: Duration,
    /// When the bucket would be empty, if nothing came back: in the future, the debt of events that had to wait.
    spent: Instant,
}

impl Rate {
    /// `a_second` of them on average, `at_once` after a pause.
    pub(super) fn new(a_second: u32, at_once: u32) -> Self {
        let gap = Duration::from_secs(1) / a_second;
        let burst = gap * at_once;
        Self { gap, burst, spent: Instant::ZERO }
    }

    /// How long the next has to wait at `now`; it is counted.
    pub(super) fn delay(&mut self, now: Instant) -> Duration {
        self.spent = self.spent.max(now) + self.gap;
        (self.spent - now).saturating_sub(self.burst)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_a_burst_they_come_one_by_one_and_a_pause_fills_the_bucket_again() {
        let mut rate = Rate::new(10, 3);
        let start = Instant::from_secs(5);
        let delays: Vec<_> = (0..5).map(|_| rate.delay(start).as_millis()).collect();
        assert_eq!(delays, [0, 0, 0, 100, 200]);
        // Of the time until then five have used half a second.
        let later = start + Duration::from_millis(500);
        assert_eq!((0..4).map(|_| rate.delay(later).as_millis()).collect::<Vec<_>>(), [0, 0, 0, 100]);
    }
}
