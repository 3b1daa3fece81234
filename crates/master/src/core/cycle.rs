use std::time::Duration;

use can::{Frame, Instant};
use canopen::connection_set;
use canopen::sync::Sync;

/// One period of SYNC. Source: CiA 301, 7.2.5.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cycle {
    /// Counts periods from the first SYNC on, which is number 1. A period without a SYNC has its number too.
    pub number: u64,
    /// When its SYNC was produced or came.
    pub at: Instant,
    /// Periods without a SYNC directly before it.
    pub missed: u32,
}

impl Cycle {
    /// Periods between an earlier cycle and this one that a program did not see: those without a SYNC, and those in which it
    /// did not wait for one.
    pub const fn missed_since(&self, before: &Self) -> u64 {
        self.number.saturating_sub(before.number).saturating_sub(1)
    }
}

/// Whose SYNC counts the cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SyncSource {
    Off,
    This,
    Another,
}

/// After how many periods without a SYNC one of another producer counts as lost.
const LOST_AFTER_PERIODS: u64 = 3;

/// Counts the cycles of SYNC, and produces it where no other node does, with the counter of 1019h where one is wanted.
///
/// Ticks lie on a grid from the start, so that a late call does not shift the ones after it. Ticks that were
/// missed altogether are not made up for; they are counted.
#[derive(Clone, Debug)]
pub(super) struct SyncClock {
    source: SyncSource,
    period_ns: u64,
    /// When the next SYNC is due, or counts as lost.
    due: Option<Instant>,
    pending: bool,
    /// As 1019h: the counter goes from 1 to this; 0 for a SYNC without.
    overflow: u8,
    /// Of the SYNC to come. One that is not sent has none.
    counter: u8,
    cycle: Option<Cycle>,
    /// No SYNC has come since the source was chosen.
    first: bool,
    lost: bool,
    missed: u64,
}

impl Default for SyncClock {
    fn default() -> Self {
        let source = SyncSource::Off;
        Self {
            source,
            period_ns: 0,
            due: None,
            pending: false,
            overflow: 0,
            counter: 1,
            cycle: None,
            first: true,
            lost: false,
            missed: 0,
        }
    }
}

/// What time or a frame has brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tick {
    /// A new cycle has begun.
    Begun(Cycle),
    /// A new cycle has begun after the SYNC of another producer had been lost.
    Back(Cycle),
    /// The SYNC of another producer stays away.
    Lost,
}

impl SyncClock {
    /// Produces SYNC from now on, the first one at once, or stops (`None` or a zero period). Numbers go on.
    pub(super) fn produce(&mut self, period: Option<Duration>, now: Instant) {
        self.begin(SyncSource::This, period);
        self.due = (self.period_ns > 0).then_some(now);
    }

    /// Each SYNC carries a counter from 1 to `overflow` from now on; 0 for none.
    pub(super) const fn set_overflow(&mut self, overflow: u8) {
        (self.overflow, self.counter) = (overflow, 1);
    }

    /// Counts the SYNCs of another producer, which come with this period.
    pub(super) fn follow(&mut self, period: Option<Duration>, now: Instant) {
        self.begin(SyncSource::Another, period);
        self.due = (self.period_ns > 0).then(|| now.plus_nanos(self.patience_ns()));
    }

    fn begin(&mut self, source: SyncSource, period: Option<Duration>) {
        self.period_ns = period.map_or(0, |period| u64::try_from(period.as_nanos()).unwrap_or(u64::MAX));
        self.source = if self.period_ns > 0 { source } else { SyncSource::Off };
        (self.due, self.pending, self.first, self.lost) = (None, false, true, false);
        self.counter = 1;
    }

    const fn patience_ns(&self) -> u64 {
        self.period_ns.saturating_mul(LOST_AFTER_PERIODS)
    }

    /// Time has come to `now`.
    pub(super) fn handle_timeout(&mut self, now: Instant) -> Option<Tick> {
        let due = self.due.filter(|due| *due <= now)?;
        if self.source == SyncSource::Another {
            self.due = None;
            self.lost = true;
            return Some(Tick::Lost);
        }
        let missed = now.nanos_since(due) / self.period_ns;
        self.due = Some(due.plus_nanos((missed + 1).saturating_mul(self.period_ns)));
        self.pending = true;
        Some(Tick::Begun(self.count(missed, now)))
    }

    /// A SYNC of another producer has come.
    pub(super) fn handle_sync(&mut self, now: Instant) -> Option<Tick> {
        if self.source != SyncSource::Another {
            return None;
        }
        self.due = Some(now.plus_nanos(self.patience_ns()));
        let since = self.cycle.map_or(0, |cycle| now.nanos_since(cycle.at));
        let periods = since.saturating_add(self.period_ns / 2) / self.period_ns;
        let cycle = self.count(periods.saturating_sub(1), now);
        Some(if core::mem::take(&mut self.lost) { Tick::Back(cycle) } else { Tick::Begun(cycle) })
    }

    fn count(&mut self, missed: u64, at: Instant) -> Cycle {
        let before = self.cycle.map_or(0, |cycle| cycle.number);
        // Before the first SYNC there is no cycle to be missed.
        let missed = if core::mem::take(&mut self.first) { 0 } else { missed };
        self.missed = self.missed.saturating_add(missed);
        let number = before.saturating_add(missed).saturating_add(1);
        let cycle = Cycle { number, at, missed: u32::try_from(missed).unwrap_or(u32::MAX) };
        self.cycle = Some(cycle);
        cycle
    }

    pub(super) fn poll_transmit(&mut self) -> Option<Frame> {
        if !core::mem::take(&mut self.pending) {
            return None;
        }
        let counter = (self.overflow > 0).then_some(self.counter);
        self.counter = if self.counter >= self.overflow { 1 } else { self.counter + 1 };
        Some(Sync { counter }.emit(connection_set::SYNC))
    }

    pub(super) const fn next(&self) -> Option<Instant> {
        self.due
    }

    /// The newest cycle.
    pub(super) const fn cycle(&self) -> Option<Cycle> {
        self.cycle
    }

    /// All periods without a SYNC since the count began.
    pub(super) const fn missed(&self) -> u64 {
        self.missed
    }

    /// Time from one SYNC to the next; `None` while no producer's counts.
    pub(super) const fn period(&self) -> Option<Duration> {
        match self.source {
            SyncSource::Off => None,
            SyncSource::This | SyncSource::Another => Some(Duration::from_nanos(self.period_ns)),
        }
    }

    /// True while the SYNC of another producer stays away.
    pub(super) const fn is_lost(&self) -> bool {
        self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Option<Duration> = Some(Duration::from_millis(20));

    const fn ms(at: u64) -> Instant {
        Instant::from_millis(at)
    }

    #[test]
    fn a_late_call_does_not_shift_the_grid() {
        let mut sync = SyncClock::default();
        sync.produce(PERIOD, ms(100));
        assert!(sync.handle_timeout(ms(100)).is_some());
        assert!(sync.poll_transmit().is_some() && sync.poll_transmit().is_none());
        assert!(sync.handle_timeout(ms(125)).is_some());
        assert_eq!(sync.next(), Some(ms(140)));
        assert!(sync.handle_timeout(ms(205)).is_some());
        assert_eq!(sync.next(), Some(ms(220)));
        assert!(sync.poll_transmit().is_some() && sync.poll_transmit().is_none());
        sync.produce(None, ms(206));
        assert_eq!((sync.next(), sync.poll_transmit()), (None, None));
    }

    /// CiA 301, 7.2.5.1: from 1 to the value of 1019h, one more with each SYNC that is sent.
    #[test]
    fn the_counter_goes_with_the_frames_and_begins_anew_with_them() {
        let mut sync = SyncClock::default();
        let run = |sync: &mut SyncClock, at: &[u64]| -> Vec<Option<u8>> {
            let frame = |sync: &mut SyncClock, at| sync.handle_timeout(ms(at)).and_then(|_| sync.poll_transmit());
            at.iter().map(|at| Sync::parse(&frame(sync, *at).expect("one is due")).counter).collect()
        };
        sync.set_overflow(3);
        sync.produce(PERIOD, ms(100));
        // Three periods are missed before 200.
        assert_eq!(run(&mut sync, &[100, 120, 200, 220]), [Some(1), Some(2), Some(3), Some(1)]);
        sync.produce(PERIOD, ms(300));
        assert_eq!(run(&mut sync, &[300]), [Some(1)]);
        sync.set_overflow(0);
        assert_eq!(run(&mut sync, &[320]), [None]);
    }

    #[test]
    fn periods_without_a_sync_are_numbered_and_counted() {
        let mut sync = SyncClock::default();
        sync.produce(PERIOD, ms(100));
        let at = [100, 120, 145, 210, 220];
        let cycles = at.map(|at| match sync.handle_timeout(ms(at)) {
            Some(Tick::Begun(cycle)) => (cycle.number, cycle.missed),
            other => panic!("{other:?}"),
        });
        // 160 and 180 had none; 200 came at 210.
        assert_eq!(cycles, [(1, 0), (2, 0), (3, 0), (6, 2), (7, 0)]);
        assert_eq!(sync.missed(), 2);
        assert_eq!(sync.handle_timeout(ms(239)), None);
    }

    #[test]
    fn before_the_first_sync_of_a_source_no_cycle_can_be_missed() {
        let mut sync = SyncClock::default();
        sync.produce(PERIOD, ms(100));
        // Three ticks of the grid late; then the source is another, and 1900 is 86 periods later.
        let late = sync.handle_timeout(ms(165));
        assert!(matches!(late, Some(Tick::Begun(Cycle { number: 1, missed: 0, .. }))), "{late:?}");
        assert_eq!(sync.next(), Some(ms(180)));
        sync.follow(PERIOD, ms(1890));
        let other = sync.handle_sync(ms(1900));
        assert!(matches!(other, Some(Tick::Begun(Cycle { number: 2, missed: 0, .. }))), "{other:?}");
        assert_eq!(sync.missed(), 0);
    }

    #[test]
    fn the_sync_of_another_producer_is_counted_by_its_period() {
        let mut sync = SyncClock::default();
        assert_eq!(sync.handle_sync(ms(0)), None);
        sync.follow(PERIOD, ms(0));
        // Jitter of a quarter of a period moves no number; 90 to 150 is three periods.
        let numbers = [33, 55, 70, 90, 150].map(|at| match sync.handle_sync(ms(at)) {
            Some(Tick::Begun(cycle)) => cycle.number,
            other => panic!("{other:?}"),
        });
        assert_eq!((numbers, sync.missed()), ([1, 2, 3, 4, 7], 2));
        assert_eq!(sync.poll_transmit(), None);
        assert_eq!(sync.handle_timeout(ms(209)), None);
        assert_eq!(sync.handle_timeout(ms(210)), Some(Tick::Lost));
        assert!(sync.is_lost());
        assert!(matches!(sync.handle_sync(ms(250)), Some(Tick::Back(Cycle { number: 12, missed: 4, .. }))));
    }

    #[test]
    fn a_producer_that_never_comes_is_lost_too() {
        let mut sync = SyncClock::default();
        sync.follow(PERIOD, ms(0));
        assert_eq!(sync.handle_timeout(ms(60)), Some(Tick::Lost));
        assert_eq!(sync.handle_timeout(ms(600)), None);
    }
}
