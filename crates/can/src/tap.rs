//! The frames that pass a station, for others to see.

use crate::{Frame, Instant, Station};

/// A frame of a bus, with its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusFrame {
    /// Its bus time.
    pub at: Instant,
    /// The frame.
    pub frame: Frame,
    /// This program sent it.
    pub own: bool,
}

/// Takes the frames that pass a [`Tap`].
pub trait Listen {
    /// Takes a frame, before the station itself does.
    fn hear(&mut self, passed: BusFrame);
}

/// A station whose frames are heard by a listener too: those that it gets, and those of its own that the wire has taken. Times do not
/// go back there: a frame that came before the last one that was heard has the time of that.
#[derive(Clone, Debug)]
pub struct Tap<S, L> {
    station: S,
    listener: L,
    last: Instant,
}

impl<S: Station, L: Listen> Tap<S, L> {
    /// `station`, whose frames go to `listener` as well.
    pub const fn new(station: S, listener: L) -> Self {
        Self { station, listener, last: Instant::ZERO }
    }

    fn hear(&mut self, frame: &Frame, at: Instant, own: bool) {
        self.last = self.last.max(at);
        self.listener.hear(BusFrame { at: self.last, frame: *frame, own });
    }
}

impl<S: Station, L: Listen> Station for Tap<S, L> {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        self.handle_stamped(frame, now, now);
    }

    fn handle_stamped(&mut self, frame: &Frame, at: Instant, now: Instant) {
        self.hear(frame, at, false);
        self.station.handle_stamped(frame, at, now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.station.handle_timeout(now);
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.station.poll_transmit()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.station.poll_timeout()
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.hear(frame, now, true);
        self.station.handle_transmitted(frame, now);
    }

    fn handle_bus_off(&mut self, off: bool, now: Instant) {
        self.station.handle_bus_off(off, now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CanId;

    /// Counts its calls, and sends one frame.
    #[derive(Default)]
    struct Counter {
        calls: [u32; 4],
    }

    impl Station for Counter {
        fn ignores(&self, _: &Frame) -> bool {
            true
        }
        fn handle_frame(&mut self, _: &Frame, _: Instant) {
            self.calls[0] += 1;
        }
        fn handle_timeout(&mut self, _: Instant) {
            self.calls[1] += 1;
        }
        fn poll_transmit(&mut self) -> Option<Frame> {
            Some(frame())
        }
        fn poll_timeout(&self) -> Option<Instant> {
            Some(Instant::from_secs(9))
        }
        fn handle_transmitted(&mut self, _: &Frame, _: Instant) {
            self.calls[2] += 1;
        }
        fn handle_bus_off(&mut self, _: bool, _: Instant) {
            self.calls[3] += 1;
        }
    }

    #[derive(Default)]
    struct Last(Option<BusFrame>);

    impl Listen for Last {
        fn hear(&mut self, passed: BusFrame) {
            self.0 = Some(passed);
        }
    }

    fn frame() -> Frame {
        Frame::new(CanId::standard(0x80), &[])
    }

    #[test]
    fn a_listener_hears_both_directions_and_the_station_goes_on_as_without_it() {
        let mut tap = Tap::new(Counter::default(), Last::default());
        let (one, two) = (Instant::from_secs(1), Instant::from_secs(2));
        tap.handle_frame(&frame(), one);
        assert_eq!(tap.listener.0, Some(BusFrame { at: one, frame: frame(), own: false }));
        tap.handle_transmitted(&frame(), two);
        assert_eq!(tap.listener.0, Some(BusFrame { at: two, frame: frame(), own: true }));
        // Two that came in between, the second before the first, are taken later.
        let [half, third] = [1500, 1333].map(Instant::from_millis);
        let mut late = Tap::new(Counter::default(), Last::default());
        for at in [half, third] {
            late.handle_stamped(&frame(), at, two);
            assert_eq!(late.listener.0, Some(BusFrame { at: half, frame: frame(), own: false }));
        }
        assert_eq!(late.station.calls, [2, 0, 0, 0]);
        tap.handle_timeout(two);
        tap.handle_bus_off(true, two);
        assert_eq!(tap.station.calls, [1; 4]);
        assert_eq!((tap.poll_transmit(), tap.poll_timeout()), (Some(frame()), Some(Instant::from_secs(9))));
        assert!(!tap.ignores(&frame()), "a listener wants what the station does not");
    }
}
