//! A node alone on a bus, spoken to in candump notation, in virtual time.

use std::collections::VecDeque;
use std::time::Duration;

use can::{Frame, Instant, Station};
use canopen::node::Node;
use canopen::od::Fixed;
use canopen::od::Slot;
use canopen::{Mux, NodeEvent, NodeId, NodeProfile};

use crate::node::device::{CELLS, STANDARD};

/// The node, the time, and the frames that it sent and that no test has looked at yet.
#[derive(Clone)]
pub(crate) struct Bench {
    pub(crate) node: Node<Fixed<CELLS>>,
    pub(crate) now: Instant,
    pub(crate) sent: VecDeque<(Instant, Frame)>,
}

impl Bench {
    /// Node 4, booted at time zero; the boot-up message is taken away.
    pub(crate) fn new(profile: &'static NodeProfile) -> Self {
        let mut bench = Self::off(profile);
        bench.boot();
        bench.talk("< 704#00");
        while bench.node.poll_event().is_some() {}
        bench
    }

    /// Node 4 before boot.
    pub(crate) fn off(profile: &'static NodeProfile) -> Self {
        let node = Node::new(profile, NodeId::new(4).unwrap());
        Self { node, now: Instant::ZERO, sent: VecDeque::new() }
    }

    /// A node of the standard profile in operational, its first TPDO taken away.
    pub(crate) fn operational() -> Self {
        let mut bench = Self::new(&STANDARD);
        bench.talk("> 000#0104\n < 184#0000");
        while bench.node.poll_event().is_some() {}
        bench
    }

    pub(crate) fn boot(&mut self) {
        self.node.boot(self.now);
        self.drain();
    }

    /// Plays a conversation. Lines:
    /// `> frame` to the node, `< frame` the next frame from it, `12.5ms < frame` that it sends at that time since
    /// zero, `wait 10ms` lets time pass, `silence 10ms` lets it pass without a frame. Afterwards nothing may be left.
    #[track_caller]
    pub(crate) fn talk(&mut self, script: &str) {
        for line in script.lines().map(str::trim).filter(|line| !line.is_empty()) {
            self.line(line);
        }
        assert!(self.sent.is_empty(), "unexpected frames {:?} after\n{script}", self.sent);
    }

    #[track_caller]
    fn line(&mut self, line: &str) {
        match line.split_once(char::is_whitespace).expect(line) {
            (">", frame) => {
                assert!(self.sent.is_empty(), "before `{line}` the node sent {:?}", self.sent);
                self.send(frame);
            }
            ("<", frame) => {
                let (_, sent) = self.sent.pop_front().unwrap_or_else(|| panic!("nothing sent, expected {frame}"));
                assert_eq!(sent, parse(frame), "expected `{frame}`");
            }
            ("wait", time) => self.wait(duration(time)),
            ("silence", time) => {
                self.wait(duration(time));
                assert!(self.sent.is_empty(), "not silent: {:?}", self.sent);
            }
            (time, rest) => {
                let at = Instant::ZERO + duration(time);
                let frame = parse(rest.trim().strip_prefix('<').expect(line));
                self.run_until(at);
                assert_eq!(self.sent.pop_front(), Some((at, frame)), "expected `{line}`");
            }
        }
    }

    /// A frame to the node.
    pub(crate) fn send(&mut self, frame: &str) {
        self.send_frame(&parse(frame));
    }

    pub(crate) fn send_frame(&mut self, frame: &Frame) {
        self.node.handle_frame(frame, self.now);
        self.drain();
    }

    pub(crate) fn wait(&mut self, time: Duration) {
        self.run_until(self.now + time);
    }

    fn run_until(&mut self, end: Instant) {
        while let Some(deadline) = self.node.poll_timeout().filter(|deadline| *deadline <= end) {
            assert!(deadline > self.now, "a deadline that does not move: {deadline}");
            self.now = deadline;
            self.node.handle_timeout(deadline);
            self.drain();
        }
        self.now = end;
        self.node.handle_timeout(end);
        self.drain();
    }

    /// The wire is free: whatever is offered is sent at once.
    fn drain(&mut self) {
        while let Some(frame) = self.node.poll_transmit() {
            self.node.handle_transmitted(&frame, self.now);
            self.sent.push_back((self.now, frame));
        }
    }

    /// The application sets a value.
    pub(crate) fn set(&mut self, index: u16, value: i64) {
        let slot = self.slot(index);
        let data_type = self.node.table().row(slot).data_type;
        self.node.dictionary_mut().set_raw(slot, data_type.raw(value));
        self.node.notice_changes(self.now);
        self.drain();
    }

    pub(crate) fn value(&self, index: u16) -> i64 {
        self.node.dictionary().value(self.slot(index))
    }

    pub(crate) fn slot(&self, index: u16) -> Slot {
        self.node.table().find(Mux::new(index, 0)).unwrap()
    }

    pub(crate) fn events(&mut self) -> Vec<NodeEvent> {
        std::iter::from_fn(|| self.node.poll_event()).collect()
    }
}

#[track_caller]
fn parse(frame: &str) -> Frame {
    frame.trim().parse().unwrap_or_else(|error| panic!("{frame}: {error}"))
}

#[track_caller]
fn duration(text: &str) -> Duration {
    can::parse_duration(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}
