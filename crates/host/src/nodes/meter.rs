//! Frames and load of the bus, over the last half second.

use std::time::Duration;

use can::{Bitrate, Frame, INTERFRAME_SPACE_BITS, Instant, frame_bits};

/// The averaging time of a rate.
const INTERVAL: Duration = Duration::from_millis(500);

/// See the [module](self).
#[derive(Debug)]
pub(crate) struct Meter {
    bitrate: Option<Bitrate>,
    since: Instant,
    frames: u32,
    bits: u64,
    frames_per_s: u32,
    load: f64,
}

impl Meter {
    pub(crate) fn new(now: Instant, bitrate: Option<Bitrate>) -> Self {
        Self { bitrate, since: now, frames: 0, bits: 0, frames_per_s: 0, load: 0.0 }
    }

    /// Counts a frame. Lengths are exact, except that error frames are not reported.
    pub(crate) fn note(&mut self, frame: &Frame) {
        self.frames = self.frames.saturating_add(1);
        self.bits += u64::from(frame_bits(frame) + INTERFRAME_SPACE_BITS);
    }

    /// Updates the rates when they are due.
    pub(crate) fn look(&mut self, now: Instant) {
        let passed = (now - self.since).as_secs_f64();
        if now - self.since < INTERVAL {
            return;
        }
        self.frames_per_s = (f64::from(self.frames) / passed).round() as u32;
        let room = self.bitrate.map_or(0.0, |rate| f64::from(rate.bits_per_second()) * passed);
        self.load = if room > 0.0 { self.bits as f64 / room * 100.0 } else { 0.0 };
        (self.since, self.frames, self.bits) = (now, 0, 0);
    }

    pub(crate) const fn frames_per_s(&self) -> u32 {
        self.frames_per_s
    }

    /// Bus load in per cent; `None` where the bit rate is unknown.
    pub(crate) fn load_percent(&self) -> Option<f64> {
        self.bitrate.map(|_| self.load)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_bus_is_a_load_of_a_hundred_percent() {
        let mut meter = Meter::new(Instant::ZERO, Some(Bitrate::K500));
        // 8 data bytes of AAh have no run of equal bits; stuff bits elsewhere are counted by frame_bits.
        let frame: Frame = "181#AAAAAAAAAAAAAAAA".parse().expect("a frame");
        let bits = frame_bits(&frame) + INTERFRAME_SPACE_BITS;
        let frames = 500_000 / bits;
        (0..frames).for_each(|_| meter.note(&frame));
        meter.look(Instant::from_millis(499));
        assert_eq!(meter.frames_per_s(), 0, "not yet");
        meter.look(Instant::from_secs(1));
        assert_eq!(meter.frames_per_s(), frames);
        let load = meter.load_percent().expect("the bit rate is known");
        assert!((99.0..=100.0).contains(&load), "{load}");
        meter.look(Instant::from_secs(2));
        assert_eq!((meter.frames_per_s(), meter.load_percent()), (0, Some(0.0)));
    }
}
