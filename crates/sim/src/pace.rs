//! Pace: which virtual instant belongs to an elapsed wall-clock time, and how far a world is behind.
//!
//! Pure arithmetic. The caller reads the clock and hands the elapsed time in; nothing here reads one.

use core::time::Duration;

use can::Instant;

/// A linear map from wall-clock time to virtual time.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// This virtual time belongs to the wall clock's `since`.
    origin: Instant,
    since: Duration,
    speed: f64,
}

impl Pace {
    /// Virtual time `origin` belongs to an elapsed time of zero; both run equally fast.
    pub const fn real_time(origin: Instant) -> Self {
        Self { origin, since: Duration::ZERO, speed: 1.0 }
    }

    /// As [`real_time`](Self::real_time), with virtual time `speed` times as fast (2: twice as fast).
    ///
    /// A speed that is negative or not a number counts as 0: virtual time stands still.
    pub fn with_speed(origin: Instant, speed: f64) -> Self {
        Self { origin, since: Duration::ZERO, speed: if speed > 0.0 { speed } else { 0.0 } }
    }

    /// The instant a world should have reached when `elapsed` has passed on the wall clock.
    pub fn target(&self, elapsed: Duration) -> Instant {
        let elapsed = elapsed.saturating_sub(self.since);
        if self.speed == 1.0 {
            // Exact: a double holds nanoseconds for 104 days only.
            return self.origin + elapsed;
        }
        self.origin.plus_nanos((elapsed.as_nanos() as f64 * self.speed) as u64)
    }

    /// How far a world at `now` is behind its target, in virtual time; zero if it is ahead.
    pub fn behind(&self, elapsed: Duration, now: Instant) -> Duration {
        self.target(elapsed) - now
    }

    /// The elapsed wall-clock time at which virtual time `at` is due: how long to sleep.
    /// `None` if that never comes.
    pub fn elapsed_at(&self, at: Instant) -> Option<Duration> {
        let nanos = at.nanos_since(self.origin);
        if self.speed == 1.0 {
            return Some(self.since + Duration::from_nanos(nanos));
        }
        (self.speed > 0.0).then(|| self.since + Duration::from_nanos((nanos as f64 / self.speed).ceil() as u64))
    }

    /// The pace that goes on from here: for a world that fell behind and shall not hurry to catch up, or was ahead and shall
    /// not wait.
    pub fn rebased(&self, elapsed: Duration, now: Instant) -> Self {
        Self { origin: now, since: elapsed, speed: self.speed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn real_time_is_exact_after_years() {
        let pace = Pace::real_time(Instant::from_secs(5));
        let elapsed = Duration::new(400_000_000, 1);
        assert_eq!(pace.target(elapsed).as_nanos(), 400_000_005_000_000_001);
        assert_eq!(pace.elapsed_at(pace.target(elapsed)), Some(elapsed));
    }

    #[test]
    fn shows_how_far_the_world_is_behind() {
        let pace = Pace::with_speed(Instant::ZERO, 10.0);
        let elapsed = Duration::from_millis(100);
        assert_eq!(pace.target(elapsed), Instant::from_secs(1));
        assert_eq!(pace.behind(elapsed, Instant::from_millis(400)), Duration::from_millis(600));
        assert_eq!(pace.behind(elapsed, Instant::from_secs(2)), Duration::ZERO);
        assert_eq!(pace.elapsed_at(Instant::from_secs(1)), Some(elapsed));
    }

    #[test]
    fn a_stopped_pace_never_arrives() {
        for speed in [0.0, -1.0, f64::NAN] {
            let pace = Pace::with_speed(Instant::ZERO, speed);
            assert_eq!(pace.target(Duration::from_secs(9)), Instant::ZERO);
            assert_eq!(pace.elapsed_at(Instant::from_secs(1)), None);
        }
    }

    #[test]
    fn rebasing_forgives_the_lag() {
        let pace = Pace::real_time(Instant::from_secs(10));
        let elapsed = Duration::from_secs(3);
        let rebased = pace.rebased(elapsed, Instant::from_secs(11));
        assert_eq!(rebased.target(elapsed), Instant::from_secs(11));
        assert_eq!(rebased.target(elapsed + Duration::from_secs(1)), Instant::from_secs(12));
        assert_eq!(rebased.elapsed_at(Instant::from_secs(12)), Some(Duration::from_secs(4)));
    }

    #[test]
    fn a_world_that_was_ahead_goes_on_from_where_it_is() {
        let rebased = Pace::with_speed(Instant::ZERO, 2.0).rebased(Duration::from_secs(3), Instant::from_secs(1000));
        assert_eq!(rebased.target(Duration::from_secs(3)), Instant::from_secs(1000));
        assert_eq!(rebased.target(Duration::from_secs(4)), Instant::from_secs(1002));
        assert_eq!(rebased.elapsed_at(Instant::from_secs(1004)), Some(Duration::from_secs(5)));
    }
}
