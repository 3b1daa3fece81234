//! Frames that come again and again, as a plan knows them, and their times in ns.

use std::time::Duration;

use can::{CanId, INTERFRAME_SPACE_BITS, fewest_frame_bits, most_frame_bits};

/// A frame that comes again and again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Queued {
    /// Its identifier: its priority.
    pub id: CanId,
    /// Data bytes, 0 to 8.
    pub length: u8,
    /// Shortest time between two; not zero.
    pub period: Duration,
    /// How much later than its period it may be offered to the bus.
    pub jitter: Duration,
    /// What of the other frames, by number, may stand before it in the queue of its sender's controller.
    pub ahead: Vec<usize>,
    /// The frame at the beginning of whose period it is offered, period for period, as a host sends its set-points with SYNC.
    /// `None`: it comes when it likes.
    pub with: Option<usize>,
    /// The frame that it answers.
    pub trigger: Option<Trigger>,
}

/// Offered a while after another frame has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trigger {
    /// Which of the frames.
    pub by: usize,
    /// Shortest time from its last bit.
    pub least: Duration,
    /// Longest.
    pub most: Duration,
}

/// No frame of a machine waits that long; an analysis that gets there has no bound.
pub(super) const HORIZON_NS: u64 = 100_000_000_000;

/// When a triggered frame may be offered at the earliest, from the beginning of the trigger's period.
pub(super) fn after(trigger: &Trigger, frames: &[Queued], bit_ns: u64) -> u64 {
    let by = &frames[trigger.by];
    u64::from(fewest_frame_bits(by.id.is_extended(), by.length)) * bit_ns + nanos(trigger.least)
}

/// A time in ns, at most that of the horizon.
pub(super) fn nanos(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).map_or(HORIZON_NS, |ns| ns.min(HORIZON_NS))
}

/// Time on the wire with the most stuff bits, interframe space included.
pub(super) fn wire_ns(frame: &Queued, bit_ns: u64) -> u64 {
    u64::from(most_frame_bits(frame.id.is_extended(), frame.length) + INTERFRAME_SPACE_BITS) * bit_ns
}
