//! SYNC (CiA 301, 7.2.5): the frame that starts a synchronous cycle, and its producer (1005h bit 30, 1006h, 1019h).

use can::{CanId, Frame, Instant};

use crate::AbortCode;
use crate::period::Period;

const NANOS_PER_MICRO: u64 = 1_000;
/// The largest value of the counter (CiA 301, 7.5.2.22).
pub const MAX_COUNTER: u8 = 240;

/// Whether 1019h may take this counter overflow value: 0 is off, else 2 to 240, and none but the present one while the
/// communication cycle period (1006h) is not 0 (CiA 301, 7.5.2.22).
///
/// # Errors
/// 0609 0030h for 1 and for 241 and above, 0800 0022h while SYNC may be running.
pub const fn check_overflow(present: u8, new: u8, period_us: u32) -> Result<(), AbortCode> {
    match new {
        1 | 241.. => Err(AbortCode::INVALID_VALUE),
        _ if period_us != 0 && new != present => Err(AbortCode::DEVICE_STATE),
        _ => Ok(()),
    }
}

/// A SYNC frame; its identifier is that of 1005h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sync {
    /// The counter, 1 to 240, if the producer counts (1019h).
    pub counter: Option<u8>,
}

impl Sync {
    /// Reads the payload of a SYNC frame. Any length is a SYNC: a counter may be there whether or not it is expected.
    pub fn parse(frame: &Frame) -> Self {
        Self { counter: frame.data().first().copied() }
    }

    /// The frame on `id`.
    pub fn emit(self, id: CanId) -> Frame {
        match self.counter {
            Some(counter) => Frame::new(id, &[counter]),
            None => Frame::new(id, &[]),
        }
    }
}

/// When the next SYNC is due, and its counter. A producer that is served late skips what it missed.
#[derive(Clone, Copy, Debug)]
pub struct Producer {
    period: Period,
    overflow: u8,
    counter: u8,
}

impl Producer {
    /// A producer that never sends.
    pub const OFF: Self = Self { period: Period::OFF, overflow: 0, counter: 1 };

    /// At rest, with the period of 1006h and the counter overflow value of 1019h. A period of 0 is off.
    pub const fn new(period_us: u32, overflow: u8) -> Self {
        Self { period: Period::new(period_us as u64 * NANOS_PER_MICRO), overflow, ..Self::OFF }
    }

    /// SYNC is sent from now on, the first one after a period: no later than CiA 301 allows (7.5.2.5, 7.5.2.6).
    pub const fn start(&mut self, now: Instant) {
        self.period = self.period.after(now);
    }

    /// Nothing is sent from now on, and the counter begins at 1 again (CiA 301, 7.2.5.1: on leaving NMT stopped).
    pub const fn stop(&mut self) {
        self.period.stop();
        self.counter = 1;
    }

    /// When a SYNC is next due; [`Instant::FAR_FUTURE`] for never.
    pub const fn deadline(&self) -> Instant {
        self.period.deadline()
    }

    /// True if a SYNC is due at `now`; the next one is then set on the grid of the period.
    pub fn handle_timeout(&mut self, now: Instant) -> bool {
        self.period.handle_timeout(now)
    }

    /// The SYNC to send, and the counter goes on: 1 follows the overflow value.
    pub const fn take(&mut self) -> Sync {
        if self.overflow == 0 {
            return Sync { counter: None };
        }
        let counter = self.counter;
        self.counter = if counter >= self.overflow { 1 } else { counter + 1 };
        Sync { counter: Some(counter) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connection_set;

    #[test]
    fn the_counter_runs_from_1_to_the_overflow_value() {
        let mut producer = Producer::new(1000, 3);
        let counters = [(); 7].map(|()| producer.take().counter);
        assert_eq!(counters, [1, 2, 3, 1, 2, 3, 1].map(Some));
        producer.stop();
        assert_eq!(producer.take().counter, Some(1));
        assert_eq!(Producer::new(1000, 0).take().counter, None);
        assert!((0..500).map(|_| Producer::new(1000, 240).take()).all(|sync| sync.counter == Some(1)));
    }

    #[test]
    fn a_producer_keeps_its_grid_and_skips_what_it_missed() {
        let at = Instant::from_millis;
        let mut producer = Producer::new(2000, 0);
        assert!(!producer.handle_timeout(at(1000)), "it is not started");
        producer.start(at(10));
        assert_eq!(producer.deadline(), at(12));
        assert!(
            !producer.handle_timeout(at(11)) && producer.handle_timeout(at(12)) && !producer.handle_timeout(at(12))
        );
        assert!(producer.handle_timeout(at(19)));
        assert_eq!(producer.deadline(), at(20));
        let mut off = Producer::new(0, 0);
        off.start(at(10));
        assert_eq!(off.deadline(), Instant::FAR_FUTURE);
    }

    #[test]
    fn a_counter_overflow_value_is_0_or_2_to_240_and_stays_while_sync_runs() {
        for value in 0..=255 {
            let expected = if matches!(value, 1 | 241..) { Err(AbortCode::INVALID_VALUE) } else { Ok(()) };
            assert_eq!(check_overflow(0, value, 0), expected, "{value}");
        }
        assert_eq!(check_overflow(0, 4, 1000), Err(AbortCode::DEVICE_STATE));
        assert_eq!((check_overflow(4, 4, 1000), check_overflow(4, 0, 1000)), (Ok(()), Err(AbortCode::DEVICE_STATE)));
    }

    #[test]
    fn every_payload_is_read_and_one_that_was_read_is_emitted_again() {
        for length in 0..=8_u8 {
            for first in 0..=u8::MAX {
                let frame = Frame::of_bits(connection_set::SYNC, first.into(), length);
                let sync = Sync::parse(&frame);
                assert_eq!(sync.counter, (length > 0).then_some(first));
                assert_eq!(Sync::parse(&sync.emit(connection_set::SYNC)), sync);
            }
        }
    }

    #[test]
    fn what_is_emitted_is_parsed_back() {
        for sync in [Sync { counter: None }, Sync { counter: Some(1) }, Sync { counter: Some(240) }] {
            assert_eq!(Sync::parse(&sync.emit(connection_set::SYNC)), sync);
        }
    }
}
