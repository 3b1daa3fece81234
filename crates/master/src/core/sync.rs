use std::time::Duration;

use can::{Frame, Instant};
use canopen::cob;
use canopen::sync::Sync;

/// SYNC producer without a counter. Source: CiA 301, 7.2.5.
///
/// Ticks lie on a grid from the start, so that a late call does not shift the ones after it. Ticks that were
/// missed altogether are not made up for.
#[derive(Clone, Debug, Default)]
pub(super) struct SyncProducer {
    period_ns: u64,
    due: Option<Instant>,
    pending: bool,
}

impl SyncProducer {
    /// Starts with a first SYNC due at once, or stops (`None` or a zero period).
    pub(super) fn set_period(&mut self, period: Option<Duration>, now: Instant) {
        self.period_ns = period.map_or(0, |period| u64::try_from(period.as_nanos()).unwrap_or(u64::MAX));
        self.due = (self.period_ns > 0).then_some(now);
        self.pending = false;
    }

    /// True when a tick has come.
    pub(super) fn handle_timeout(&mut self, now: Instant) -> bool {
        let Some(due) = self.due.filter(|due| *due <= now) else { return false };
        let missed = now.nanos_since(due) / self.period_ns;
        self.due = Some(due.plus_nanos((missed + 1).saturating_mul(self.period_ns)));
        self.pending = true;
        true
    }

    pub(super) fn poll_transmit(&mut self) -> Option<Frame> {
        core::mem::take(&mut self.pending).then(|| Sync { counter: None }.emit(cob::SYNC))
    }

    pub(super) const fn next(&self) -> Option<Instant> {
        self.due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_call_does_not_shift_the_grid() {
        let mut sync = SyncProducer::default();
        sync.set_period(Some(Duration::from_millis(20)), Instant::from_millis(100));
        assert!(sync.handle_timeout(Instant::from_millis(100)));
        assert!(sync.poll_transmit().is_some() && sync.poll_transmit().is_none());
        assert!(sync.handle_timeout(Instant::from_millis(125)));
        assert_eq!(sync.next(), Some(Instant::from_millis(140)));
        assert!(sync.handle_timeout(Instant::from_millis(205)));
        assert_eq!(sync.next(), Some(Instant::from_millis(220)));
        assert!(sync.poll_transmit().is_some() && sync.poll_transmit().is_none());
        sync.set_period(None, Instant::from_millis(206));
        assert_eq!((sync.next(), sync.poll_transmit()), (None, None));
    }
}
