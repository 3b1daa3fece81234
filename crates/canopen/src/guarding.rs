//! Node guarding and life guarding (CiA 301, 7.2.8.2.1 and 7.2.8.3.1), both sides. [`Guarding`] is the device's: the answer to
//! the master's remote frames, and the watch over the master by them (100Ch, 100Dh). [`Guard`] is the master's: the remote
//! frames, and which answer counts.
//!
//! A device that produces heartbeats (1017h) does not guard: that is for its owner to see to.

use can::{Frame, Instant};

use crate::{NmtState, NodeId, connection_set};

const NANOS_PER_MILLI: u64 = 1_000_000;
/// Bit 7 of an answer, which alternates.
const TOGGLE: u8 = 1 << 7;

/// The guarded side. Armed by the first remote frame.
#[derive(Clone, Copy, Debug)]
pub struct Guarding {
    life_ns: u64,
    toggle: bool,
    until: Instant,
    lost: bool,
}

impl Guarding {
    /// With the guard time 100Ch in ms and the life time factor 100Dh; with a life time of 0 it answers, and the master is not supervised.
    pub const fn new(guard_time_ms: u16, life_time_factor: u8) -> Self {
        let life_ns = guard_time_ms as u64 * life_time_factor as u64 * NANOS_PER_MILLI;
        Self { life_ns, toggle: false, until: Instant::FAR_FUTURE, lost: false }
    }

    /// True for the master's remote frame to this node.
    pub fn is_request(frame: &Frame, node: NodeId) -> bool {
        frame.is_remote() && frame.id() == connection_set::heartbeat(node)
    }

    /// The master asked: the answer of a node in this state. The toggle bit of the first one is 0.
    pub fn answer(&mut self, node: NodeId, state: NmtState, now: Instant) -> Frame {
        if self.life_ns > 0 {
            self.until = now.plus_nanos(self.life_ns);
        }
        let toggle = if self.toggle { TOGGLE } else { 0 };
        self.toggle = !self.toggle;
        Frame::new(connection_set::heartbeat(node), &[state.heartbeat_byte() | toggle])
    }

    /// Time has reached `now`. True if the master has not asked within the life time, which is reported once.
    pub fn handle_timeout(&mut self, now: Instant) -> bool {
        let lost = now >= self.until;
        if lost {
            self.until = Instant::FAR_FUTURE;
            self.lost = true;
        }
        lost
    }

    /// The master has gone.
    pub const fn is_lost(&self) -> bool {
        self.lost
    }

    /// True once if the master had gone and asks again: for a look after [`answer`](Self::answer).
    pub fn take_return(&mut self) -> bool {
        core::mem::take(&mut self.lost)
    }

    /// When [`handle_timeout`](Self::handle_timeout) should next be called.
    pub fn poll_timeout(&self) -> Option<Instant> {
        (self.until != Instant::FAR_FUTURE).then_some(self.until)
    }
}

/// The guarding side: asks a node each guard time, on a grid from the start.
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    node: NodeId,
    period_ns: u64,
    next: Instant,
    /// The toggle bit that the next answer has to have; `None` before the first.
    toggle: Option<bool>,
}

impl Guard {
    /// Asks `node` from `now` on, each `period_ns`; 0 asks once.
    pub const fn new(node: NodeId, period_ns: u64, now: Instant) -> Self {
        Self { node, period_ns, next: now, toggle: None }
    }

    /// Whom it asks.
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// When the next request is due; [`Instant::FAR_FUTURE`] for never.
    pub const fn deadline(&self) -> Instant {
        self.next
    }

    /// True if a request is due at `now`; those that were missed are not made up for.
    pub fn handle_timeout(&mut self, now: Instant) -> bool {
        if now < self.next {
            return false;
        }
        self.next = match now.nanos_since(self.next).checked_div(self.period_ns) {
            Some(missed) => self.next.plus_nanos((missed + 1).saturating_mul(self.period_ns)),
            None => Instant::FAR_FUTURE,
        };
        true
    }

    /// The remote frame: one byte is asked for.
    pub const fn request(&self) -> Frame {
        Frame::remote(connection_set::heartbeat(self.node), 1)
    }

    /// An answer with this byte: the state in it; `None` if its toggle bit is that of the one before, which then counts as if
    /// it had not come (CiA 301, 7.2.8.3.1). The first may have either: the node may have been asked before.
    pub fn answer(&mut self, byte: u8) -> Option<u8> {
        let toggle = byte & TOGGLE != 0;
        if self.toggle.is_some_and(|expected| expected != toggle) {
            return None;
        }
        self.toggle = Some(!toggle);
        Some(byte & !TOGGLE)
    }

    /// The node has booted: the toggle bit of its next answer is 0.
    pub const fn booted(&mut self) {
        self.toggle = Some(false);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;

    const NODE: NodeId = NodeId::MIN;

    fn at_ms(ms: u64) -> Instant {
        Instant::from_nanos(ms * NANOS_PER_MILLI)
    }

    #[test]
    fn answers_alternate_and_begin_with_0() {
        let mut guarding = Guarding::new(0, 0);
        let answers: std::vec::Vec<_> =
            (0..3).map(|n| guarding.answer(NODE, NmtState::Operational, at_ms(n)).to_string()).collect();
        assert_eq!(answers, ["701#05", "701#85", "701#05"]);
        assert_eq!(guarding.poll_timeout(), None, "with a life time of 0 the master is not supervised");
    }

    #[test]
    fn the_life_time_is_guard_time_times_factor_from_the_last_request_on() {
        let mut guarding = Guarding::new(100, 3);
        assert!(!guarding.handle_timeout(at_ms(10_000)), "the master has not asked yet");
        guarding.answer(NODE, NmtState::Operational, at_ms(10_000));
        assert_eq!(guarding.poll_timeout(), Some(at_ms(10_300)));
        assert!(!guarding.handle_timeout(at_ms(10_299)) && guarding.handle_timeout(at_ms(10_300)));
        assert!(!guarding.handle_timeout(at_ms(20_000)), "reported once");
        assert!(!Guarding::new(100, 3).take_return());
        guarding.answer(NODE, NmtState::Operational, at_ms(20_000));
        assert!(guarding.take_return() && !guarding.take_return());
    }

    #[test]
    fn a_guard_and_a_guarded_node_understand_each_other_and_a_repeated_toggle_bit_does_not_count() {
        let (mut guard, mut guarding) = (Guard::new(NODE, 100 * NANOS_PER_MILLI, at_ms(0)), Guarding::new(100, 3));
        for n in 0..10 {
            assert!(guard.handle_timeout(at_ms(n * 100)) && !guard.handle_timeout(at_ms(n * 100 + 99)));
            assert!(Guarding::is_request(&guard.request(), NODE));
            let answer = guarding.answer(NODE, NmtState::PreOperational, at_ms(n * 100));
            assert_eq!(guard.answer(answer.data()[0]), Some(0x7F));
            assert_eq!(guard.answer(answer.data()[0]), None, "the same again");
        }
        guard.booted();
        assert_eq!((guard.answer(0x85), guard.answer(0x05)), (None, Some(0x05)));
        assert_eq!(Guard::new(NODE, 1, at_ms(0)).answer(0x85), Some(0x05));
        // Late: one request, and the grid goes on.
        assert!(guard.handle_timeout(at_ms(1_350)) && !guard.handle_timeout(at_ms(1_350)));
        assert_eq!(guard.deadline(), at_ms(1_400));
        let mut once = Guard::new(NODE, 0, at_ms(5));
        assert!(once.handle_timeout(at_ms(5)) && !once.handle_timeout(at_ms(50_000)));
    }

    #[test]
    fn a_request_is_the_remote_frame_of_the_nodes_own_identifier() {
        for (text, is) in [("701#R", true), ("701#R1", true), ("702#R", false), ("701#05", false)] {
            assert_eq!(Guarding::is_request(&text.parse().unwrap(), NODE), is, "{text}");
        }
    }
}
