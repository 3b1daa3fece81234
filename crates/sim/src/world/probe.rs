//! The built-in station for tests and for programs outside.

use std::collections::VecDeque;

use can::{Frame, Instant, Station};

/// Frames a probe holds for sending, and heard frames it keeps: as much as a busy bus brings in a second.
const QUEUE: usize = 8192;

/// A CAN adapter: queues between the bus and a program outside.
#[derive(Clone, Debug, Default)]
pub(super) struct Probe {
    outgoing: VecDeque<Frame>,
    received: VecDeque<(Instant, Frame)>,
    sent: u64,
}

impl Probe {
    pub(super) fn send(&mut self, frame: Frame) -> Result<(), Frame> {
        if self.outgoing.len() >= QUEUE {
            return Err(frame);
        }
        self.outgoing.push_back(frame);
        Ok(())
    }

    pub(super) fn has_received(&self) -> bool {
        !self.received.is_empty()
    }

    pub(super) const fn sent(&self) -> u64 {
        self.sent
    }

    pub(super) fn poll_received(&mut self) -> Option<(Instant, Frame)> {
        self.received.pop_front()
    }
}

impl Station for Probe {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        if self.received.len() >= QUEUE {
            self.received.pop_front();
        }
        self.received.push_back((now, *frame));
    }

    fn handle_timeout(&mut self, _: Instant) {}

    fn handle_transmitted(&mut self, _: &Frame, _: Instant) {
        self.sent += 1;
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.outgoing.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}
