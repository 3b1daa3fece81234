//! An slcan adapter as a session of the hub.

use std::time::Duration;

use can::{Frame, Instant};
use slcan::Adapter;

use crate::hub::Session;

impl Session for Adapter {
    fn receive(&mut self, input: &mut &[u8]) -> Option<Frame> {
        Self::receive(self, input)
    }

    fn is_listening(&self) -> bool {
        self.is_open()
    }

    fn next_reply(&mut self, out: &mut Vec<u8>) -> Option<Duration> {
        Self::next_reply(self, out).then_some(Duration::ZERO)
    }

    fn deliver(&mut self, at: Instant, frame: &Frame, out: &mut Vec<u8>) {
        Self::deliver(self, at, frame, out);
    }

    fn deliver_error(&mut self, _: Instant, _: u32, _: &mut Vec<u8>) {
        Self::deliver_error(self);
    }

    fn is_over(&self) -> bool {
        false
    }
}
