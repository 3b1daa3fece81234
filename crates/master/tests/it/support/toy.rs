//! A CANopen node in a few lines, written from CiA 301 by hand and not with the crate under test.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use can::{CanId, Frame, Instant, Station};

use super::toy_drive::ToyDrive;

/// An SDO server with a heartbeat byte, and ways to misbehave.
#[derive(Clone, Default)]
pub(crate) struct Toy {
    pub(crate) id: u8,
    pub(crate) objects: BTreeMap<(u16, u8), Vec<u8>>,
    /// Objects that are refused with an abort code.
    pub(crate) aborts: BTreeMap<(u16, u8), u32>,
    /// Writes that are acknowledged and change nothing.
    pub(crate) ignores: Vec<(u16, u8)>,
    /// SDO answers given before it falls silent.
    pub(crate) answers_left: Option<u32>,
    /// Added to the index in every answer.
    pub(crate) wrong_index: u16,
    /// Frames received by this node's SDO server.
    pub(crate) requests: Vec<[u8; 8]>,
    pub(crate) aborted_by_client: Vec<u32>,
    pub(crate) state: u8,
    /// How long after a request it answers.
    pub(crate) late: Duration,
    /// Each SDO answer comes twice.
    pub(crate) repeats: bool,
    /// What makes it a drive.
    pub(crate) drive: Option<ToyDrive>,
    upload: Option<(Vec<u8>, usize)>,
    download: Option<((u16, u8), Vec<u8>)>,
    now: Instant,
    out: VecDeque<(Instant, Frame)>,
    clock: Instant,
}

impl Toy {
    pub(crate) fn new(id: u8) -> Self {
        Self { id, state: 0x7F, ..Self::default() }
    }

    pub(crate) fn with(mut self, index: u16, sub_index: u8, bytes: &[u8]) -> Self {
        self.objects.insert((index, sub_index), bytes.to_vec());
        self
    }

    pub(crate) fn u8(self, index: u16, sub_index: u8, value: u8) -> Self {
        self.with(index, sub_index, &[value])
    }

    pub(crate) fn u16(self, index: u16, sub_index: u8, value: u16) -> Self {
        self.with(index, sub_index, &value.to_le_bytes())
    }

    pub(crate) fn u32(self, index: u16, sub_index: u8, value: u32) -> Self {
        self.with(index, sub_index, &value.to_le_bytes())
    }

    pub(crate) fn send(&mut self, base: u16, bytes: &[u8]) {
        let due = self.clock.plus_nanos(self.late.as_nanos() as u64);
        self.out.push_back((due, Frame::new(CanId::standard(base + u16::from(self.id)), bytes)));
    }

    fn answer(&mut self, bytes: [u8; 8]) {
        match &mut self.answers_left {
            Some(0) => return,
            Some(left) => *left -= 1,
            None => {}
        }
        self.send(0x580, &bytes);
        if self.repeats {
            self.send(0x580, &bytes);
        }
    }

    fn sdo(&mut self, request: [u8; 8]) {
        self.requests.push(request);
        let [command, low, high, sub_index, ..] = request;
        let index = u16::from_le_bytes([low, high]);
        let key = (index, sub_index);
        if command == 0x80 {
            self.upload = None;
            self.download = None;
            self.aborted_by_client.push(u32::from_le_bytes(request[4..].try_into().unwrap()));
            return;
        }
        let is_initiate = matches!(command >> 5, 1 | 2);
        if let Some(code) = self.aborts.get(&key).copied().filter(|_| is_initiate) {
            return self.abort(key, code);
        }
        match command >> 5 {
            2 => self.begin_upload(key),
            3 => self.upload_segment(command),
            1 => self.begin_download(key, request),
            0 => self.download_segment(request),
            _ => self.abort(key, 0x0504_0001),
        }
    }

    fn abort(&mut self, (index, sub_index): (u16, u8), code: u32) {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = code.to_le_bytes();
        self.answer([0x80, low, high, sub_index, a, b, c, d]);
    }

    fn begin_upload(&mut self, key: (u16, u8)) {
        let Some(bytes) = self.objects.get(&key).cloned() else { return self.abort(key, 0x0602_0000) };
        let [low, high] = (key.0 + self.wrong_index).to_le_bytes();
        if bytes.len() <= 4 {
            let mut reply = [0x43 | (4 - bytes.len() as u8) << 2, low, high, key.1, 0, 0, 0, 0];
            reply[4..4 + bytes.len()].copy_from_slice(&bytes);
            return self.answer(reply);
        }
        let [a, b, c, d] = (bytes.len() as u32).to_le_bytes();
        self.upload = Some((bytes, 0));
        self.answer([0x41, low, high, key.1, a, b, c, d]);
    }

    fn upload_segment(&mut self, command: u8) {
        let Some((bytes, at)) = &mut self.upload else { return self.abort((0, 0), 0x0504_0001) };
        let part = &bytes[*at..(*at + 7).min(bytes.len())];
        let last = *at + part.len() == bytes.len();
        let mut reply = [0; 8];
        reply[0] = command & 0x10 | (7 - part.len() as u8) << 1 | u8::from(last);
        reply[1..1 + part.len()].copy_from_slice(part);
        *at += part.len();
        self.answer(reply);
    }

    fn begin_download(&mut self, key: (u16, u8), request: [u8; 8]) {
        let [command, low, high, sub_index, data @ ..] = request;
        if !self.objects.contains_key(&key) {
            return self.abort(key, 0x0602_0000);
        }
        if command & 2 != 0 {
            let length = 4 - usize::from(command >> 2 & 3);
            self.store(key, data[..length].to_vec());
        } else {
            self.download = Some((key, Vec::new()));
        }
        self.answer([0x60, low, high, sub_index, 0, 0, 0, 0]);
    }

    fn download_segment(&mut self, request: [u8; 8]) {
        let [command, data @ ..] = request;
        let Some((key, bytes)) = &mut self.download else { return self.abort((0, 0), 0x0504_0001) };
        bytes.extend(&data[..7 - usize::from(command >> 1 & 7)]);
        if command & 1 != 0 {
            let (key, bytes) = (*key, bytes.clone());
            self.download = None;
            self.store(key, bytes);
        }
        self.answer([0x20 | command & 0x10, 0, 0, 0, 0, 0, 0, 0]);
    }

    fn store(&mut self, key: (u16, u8), bytes: Vec<u8>) {
        if !self.ignores.contains(&key) {
            self.objects.insert(key, bytes);
        }
        if let Some(drive) = &mut self.drive {
            drive.written(key, &mut self.objects, self.now);
        }
    }
}

impl Station for Toy {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        self.clock = now;
        let Some(id) = frame.standard_data_id() else { return };
        if id == 0x600 + u16::from(self.id) {
            if let Some(drive) = &mut self.drive
                && !drive.update(&mut self.objects, now)
            {
                return;
            }
            self.now = now;
            self.sdo(*frame.padded());
        }
        if let (0, [command, target]) = (id, frame.data())
            && (*target == 0 || *target == self.id)
        {
            match command {
                1 => self.state = 5,
                2 => self.state = 4,
                0x80 => self.state = 0x7F,
                _ => {
                    self.state = 0x7F;
                    self.send(0x700, &[0]);
                }
            }
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.clock = now;
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        let (due, _) = self.out.front()?;
        if *due > self.clock { None } else { self.out.pop_front().map(|(_, frame)| frame) }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.out.front().map(|(due, _)| *due)
    }
}
