//! A right node with something wrong between it and the wire.

use std::collections::VecDeque;

use can::{CanId, Frame, Instant, Station};
use sim::VirtualDrive;

use super::drawn::Change;

/// What the wrapper knows of the traffic.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Memory {
    /// The last SDO request.
    pub(crate) request: [u8; 8],
    /// The NMT state that the node has been commanded into, as a heartbeat says it.
    pub(crate) state: u8,
    /// The heartbeat time, and the guard time, that were written last.
    pub(crate) heartbeat: u16,
    pub(crate) guard_time: u16,
    /// Transmission type and event timer of the transmit PDO that were written last, and whether it is valid.
    pub(crate) pdo_type: u8,
    pub(crate) pdo_timer: u16,
    pub(crate) pdo_valid: bool,
    /// For the defect.
    pub(crate) count: u32,
    /// For the defect.
    pub(crate) bytes: [u8; 8],
    /// For the defect.
    pub(crate) flag: bool,
}

/// Where something is wrong.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    /// Nowhere.
    Right,
    /// SDO requests that are answered here; the node does not hear of them.
    Answer(fn(&mut Memory, [u8; 8]) -> Option<[u8; 8]>),
    /// SDO requests that the node hears otherwise.
    Ask(fn(&mut Memory, [u8; 8]) -> [u8; 8]),
    /// Answers of the server that go out otherwise; `request` is in the memory.
    Alter(fn(&mut Memory, [u8; 8]) -> [u8; 8]),
    /// Frames as the node hears them.
    Hear(fn(&mut Memory, Frame) -> Vec<Frame>),
    /// Frames of the node as they go out.
    Say(fn(&mut Memory, Frame) -> Vec<Frame>),
    /// Frames in whose place these go out; the node does not hear of them.
    Replace(fn(&mut Memory, Frame) -> Option<Vec<Frame>>),
    /// The same, and frames that go out every so many milliseconds.
    Every(u64, fn(&mut Memory, Frame) -> Option<Vec<Frame>>, fn(&mut Memory) -> Vec<Frame>),
    /// Frames that go out in addition when the node hears one.
    Add(fn(&mut Memory, Frame) -> Vec<Frame>),
    /// What was drawn by chance: an answer in place of the node's, or the node's with something changed.
    Drawn(Change),
}

/// A drive behind its defect. It has power from the beginning.
#[derive(Clone)]
pub(crate) struct Wrong {
    drive: Box<dyn VirtualDrive>,
    kind: Kind,
    memory: Memory,
    out: VecDeque<Frame>,
    tick: Instant,
}

pub(crate) const NODE: u16 = 5;

impl Wrong {
    pub(crate) fn new(mut drive: Box<dyn VirtualDrive>, kind: Kind) -> Self {
        drive.set_power(true, Instant::ZERO);
        Self {
            drive,
            kind,
            memory: Memory { state: 0x7F, ..Memory::default() },
            out: VecDeque::new(),
            tick: Instant::ZERO,
        }
    }

    fn note(&mut self, frame: &Frame) {
        let raw = frame.id().raw();
        if let (0, [command, node]) = (raw, frame.data())
            && [0, NODE as u8].contains(node)
        {
            self.memory.state = match command {
                1 => 0x05,
                2 => 0x04,
                _ => 0x7F,
            };
        }
        if raw == u32::from(0x600 + NODE) && !frame.is_remote() {
            let asked = *frame.padded();
            let memory = &mut self.memory;
            memory.request = asked;
            match (asked[0] >> 5, index(&asked), asked[3]) {
                (1, 0x1017, 0) if asked[0] == 0x2B => memory.heartbeat = written(&asked) as u16,
                (1, 0x100C, 0) => memory.guard_time = written(&asked) as u16,
                (1, 0x1800, 1) => memory.pdo_valid = written(&asked) >> 31 == 0,
                (1, 0x1800, 2) => memory.pdo_type = asked[4],
                (1, 0x1800, 5) => memory.pdo_timer = written(&asked) as u16,
                _ => {}
            }
        }
    }
}

pub(crate) fn request(frame: &Frame) -> Option<[u8; 8]> {
    (frame.standard_data_id() == Some(0x600 + NODE) && frame.dlc() == 8).then(|| *frame.padded())
}

pub(crate) fn reply(data: [u8; 8]) -> Frame {
    Frame::full(CanId::standard(0x580 + NODE), data)
}

impl Station for Wrong {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        self.note(frame);
        let stopped = self.memory.state == 0x04;
        match self.kind {
            Kind::Answer(answer) if !stopped => {
                if let Some(data) = request(frame).and_then(|asked| answer(&mut self.memory, asked)) {
                    // A zero command says nothing: the request is lost.
                    self.out.extend((data[0] != 0 || data != [0; 8]).then(|| reply(data)));
                    return;
                }
            }
            Kind::Ask(ask) => {
                if let Some(asked) = request(frame) {
                    let heard = Frame::full(frame.id(), ask(&mut self.memory, asked));
                    return self.drive.handle_frame(&heard, now);
                }
            }
            Kind::Hear(hear) => {
                let heard = hear(&mut self.memory, *frame);
                return heard.iter().for_each(|frame| self.drive.handle_frame(frame, now));
            }
            Kind::Replace(replace) | Kind::Every(_, replace, _) => {
                if let Some(frames) = replace(&mut self.memory, *frame) {
                    return self.out.extend(frames);
                }
            }
            Kind::Add(add) => self.out.extend(add(&mut self.memory, *frame)),
            Kind::Drawn(change) if !stopped => {
                if let Some(answers) = request(frame).and_then(|asked| change.answer(asked)) {
                    return self.out.extend(answers.map(reply));
                }
            }
            Kind::Right | Kind::Drawn(_) | Kind::Answer(_) | Kind::Alter(_) | Kind::Say(_) => {}
        }
        self.drive.handle_frame(frame, now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.drive.handle_timeout(now);
        if let Kind::Every(period_ms, _, tick) = self.kind
            && now >= self.tick
        {
            self.tick = now.plus_nanos(period_ms * 1_000_000);
            self.out.extend(tick(&mut self.memory));
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        while self.out.is_empty() {
            let frame = self.drive.poll_transmit()?;
            match self.kind {
                Kind::Alter(alter) if frame.standard_data_id() == Some(0x580 + NODE) => {
                    self.out.push_back(reply(alter(&mut self.memory, *frame.padded())));
                }
                Kind::Drawn(change) if frame.standard_data_id() == Some(0x580 + NODE) => {
                    self.out.push_back(reply(change.alter(&self.memory.request, *frame.padded())));
                }
                Kind::Say(say) => self.out.extend(say(&mut self.memory, frame)),
                _ => self.out.push_back(frame),
            }
        }
        self.out.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let tick = matches!(self.kind, Kind::Every(..)).then_some(self.tick);
        self.drive.poll_timeout().into_iter().chain(tick).min()
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.drive.handle_transmitted(frame, now);
    }
}

/// The object that a request or answer is about.
pub(crate) const fn index(data: &[u8; 8]) -> u16 {
    u16::from_le_bytes([data[1], data[2]])
}

/// A read of an object begins.
pub(crate) const fn reads(data: &[u8; 8], object: u16, sub_index: u8) -> bool {
    data[0] == 0x40 && index(data) == object && data[3] == sub_index
}

/// A write of an object begins.
pub(crate) const fn writes(data: &[u8; 8], object: u16, sub_index: u8) -> bool {
    data[0] >> 5 == 1 && index(data) == object && data[3] == sub_index
}

/// What an expedited request writes.
pub(crate) const fn written(data: &[u8; 8]) -> u32 {
    u32::from_le_bytes([data[4], data[5], data[6], data[7]])
}

/// The answer to a request, with another command and content.
pub(crate) const fn answer(request: &[u8; 8], command: u8, content: u32) -> [u8; 8] {
    let [a, b, c, d] = content.to_le_bytes();
    [command, request[1], request[2], request[3], a, b, c, d]
}

/// An abort of a request.
pub(crate) const fn abort(request: &[u8; 8], code: u32) -> [u8; 8] {
    answer(request, 0x80, code)
}

/// A write is confirmed.
pub(crate) const fn confirm(request: &[u8; 8]) -> [u8; 8] {
    answer(request, 0x60, 0)
}

/// An answer that refuses.
pub(crate) const fn is_abort(data: &[u8; 8]) -> bool {
    data[0] == 0x80
}

/// Another code in an answer that refuses a request of this kind.
pub(crate) fn code_if(data: [u8; 8], so: bool, code: u32) -> [u8; 8] {
    if so && is_abort(&data) { answer(&data, 0x80, code) } else { data }
}

/// A frame as candump prints it.
pub(crate) fn frame(text: &str) -> Frame {
    text.parse().unwrap()
}
