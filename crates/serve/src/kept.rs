//! What the bus has carried since it was last written: the piece of a log or a record that waits for its writer.

use std::time::Duration;

use can::{Frame, Instant};

/// Bus time after which a piece is handed on before time goes on: so much waits in memory, however far time goes in one turn.
const LONGEST: Duration = Duration::from_secs(1);

/// See the [module](self).
pub(crate) struct Kept {
    frames: Vec<(Instant, Frame)>,
    since: Instant,
    /// Asks for the piece; false if the request was not taken, and has to be repeated.
    is_full: Box<dyn Fn() -> bool>,
    asked: bool,
}

impl Kept {
    /// Nothing yet, from the start of the bus on.
    pub(crate) fn new() -> Self {
        Self { frames: Vec::new(), since: Instant::ZERO, is_full: Box::new(|| true), asked: false }
    }

    /// Calls `is_full` when the piece has to be [taken](Self::take) before time goes on, until it returns true.
    pub(crate) fn on_full(&mut self, is_full: impl Fn() -> bool + 'static) {
        self.is_full = Box::new(is_full);
    }

    /// A frame was carried.
    pub(crate) fn push(&mut self, end: Instant, frame: Frame) {
        self.frames.push((end, frame));
    }

    /// How far time may go with this piece.
    pub(crate) fn full_at(&self) -> Instant {
        self.since + LONGEST
    }

    /// Asks for the piece if time has come to its end.
    pub(crate) fn reached(&mut self, now: Instant) {
        if self.full_at() <= now {
            self.asked = self.asked || (self.is_full)();
        }
    }

    /// The piece; the next begins `now`.
    pub(crate) fn take(&mut self, now: Instant) -> Vec<(Instant, Frame)> {
        (self.since, self.asked) = (now, false);
        std::mem::take(&mut self.frames)
    }
}
