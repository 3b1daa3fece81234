use crate::{Frame, Instant};

/// A thing on a bus: a drive, a master, a logger. A passive state machine.
///
/// # Contract
/// - `now` never goes back between calls.
/// - The runner calls [`handle_frame`](Self::handle_frame) for each frame that others sent, never for
///   the station's own.
/// - After every `handle_*` the runner drains [`poll_transmit`](Self::poll_transmit) as far as its
///   mailboxes allow and asks [`poll_timeout`](Self::poll_timeout) again.
/// - A frame from `poll_transmit` is offered, not sent: arbitration may delay it. The runner calls
///   [`handle_transmitted`](Self::handle_transmitted) when the wire has taken it; inhibit times count
///   from there.
/// - Spurious calls do nothing.
///
/// A station holds no clock, thread, random source or `static`; a test may hold 127 of them.
pub trait Station {
    /// True if [`handle_frame`](Self::handle_frame) would do nothing with this frame, as a controller's acceptance filter
    /// would decide it: the call may be left out. `false` is always right.
    fn ignores(&self, frame: &Frame) -> bool {
        let _ = frame;
        false
    }

    /// A frame arrived at `now`.
    fn handle_frame(&mut self, frame: &Frame, now: Instant);

    /// A frame that came at `at` is handed over at `now`, which is not before: a program that was held up takes it late. For a station
    /// that measures; deadlines count from `now`, and to most a frame arrives when they get it.
    fn handle_stamped(&mut self, frame: &Frame, at: Instant, now: Instant) {
        let _ = at;
        self.handle_frame(frame, now);
    }

    /// Time has reached `now`. Deadlines at or before `now` are served; extra calls do nothing.
    fn handle_timeout(&mut self, now: Instant);

    /// The next frame to send, most urgent first; `None` when there is nothing.
    fn poll_transmit(&mut self) -> Option<Frame>;

    /// When [`handle_timeout`](Self::handle_timeout) should next be called; `None` for never.
    fn poll_timeout(&self) -> Option<Instant>;

    /// The wire took `frame`, which came from [`poll_transmit`](Self::poll_transmit), at `now`.
    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        let _ = (frame, now);
    }

    /// The station's controller is bus-off from `now` on (ISO 11898-1: it neither sends nor hears), or takes part again
    /// (`off` is false, also when it never was).
    fn handle_bus_off(&mut self, off: bool, now: Instant) {
        let _ = (off, now);
    }
}
