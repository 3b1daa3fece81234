//! When something that is sent again and again is next due, as heartbeats and SYNC are.

use can::Instant;

/// A grid of instants. One that is served late skips what it missed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Period {
    /// 0 for never.
    period_ns: u64,
    next: Instant,
}

impl Period {
    /// Never.
    pub(crate) const OFF: Self = Self { period_ns: 0, next: Instant::FAR_FUTURE };

    /// At rest.
    pub(crate) const fn new(period_ns: u64) -> Self {
        Self { period_ns, next: Instant::FAR_FUTURE }
    }

    /// Due at `now`, and each period from then on.
    pub(crate) const fn due(self, now: Instant) -> Self {
        if self.period_ns == 0 { self } else { Self { next: now, ..self } }
    }

    /// Due one period after `now`, and each period from then on.
    pub(crate) const fn after(self, now: Instant) -> Self {
        self.due(now.plus_nanos(self.period_ns))
    }

    /// At rest again.
    pub(crate) const fn stop(&mut self) {
        self.next = Instant::FAR_FUTURE;
    }

    /// When it is next due; [`Instant::FAR_FUTURE`] for never.
    pub(crate) const fn deadline(&self) -> Instant {
        self.next
    }

    /// True if it is due at `now`; the next time is then set on the grid of the period.
    pub(crate) fn handle_timeout(&mut self, now: Instant) -> bool {
        if now < self.next || self.period_ns == 0 {
            return false;
        }
        let missed = now.nanos_since(self.next) / self.period_ns;
        self.next = self.next.plus_nanos((missed + 1).saturating_mul(self.period_ns));
        true
    }
}
