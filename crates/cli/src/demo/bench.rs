//! The demo's test bench: a virtual ZLAC8030L on a virtual bus, a CAN adapter that sends the manual's datagrams as they
//! are printed, a recorder, and the table that grows from it.

use std::time::Duration;

use can::{Bitrate, CanId, Frame, Instant};
use canopen::Mux;
use sim::recorder::{Channel, Recorder, Signal};
use sim::{Report, StationId, World};

use super::expect::Expect;
use super::row::Row;
use super::set_points::{Axis, SetPoints};
use crate::embedded::{self, SEED};
use crate::failure::Failure;
use crate::models::DriveProfile;
use crate::plot::{Event, EventKind};
use crate::progress::Progress;

/// Node-ID as delivered (3.1).
pub(super) const NODE: u8 = 4;

/// Counts in a turn of the shaft: 4 edges of 1024 encoder lines (200Bh).
pub(super) const COUNTS_PER_TURN: f64 = 4096.0;

/// How often something is asked while the motor runs: the drive stops it when it hears nothing for 2000h = 1000 ms.
const TALKING_INTERVAL: Duration = Duration::from_millis(100);

/// Longest wait for an answer; the drive answers within a millisecond or two.
const ANSWER_TIME: Duration = Duration::from_millis(50);

const SAMPLING_PERIOD: Duration = Duration::from_millis(5);

/// See the [module](self).
pub(super) struct Bench {
    model: &'static DriveProfile,
    world: World,
    adapter: StationId,
    heard: Vec<(Instant, Frame)>,
    section: &'static str,
    progress: Progress,
    rows: Vec<Row>,
    sections: Vec<(Instant, &'static str, &'static str)>,
    events: Vec<Event>,
    set_points: SetPoints,
}

/// What is left of a bench: the table, the recording, and the named spans and moments in it.
pub(super) struct Finished {
    pub(super) rows: Vec<Row>,
    pub(super) recorder: Recorder,
    /// Begin, number and name of each section.
    pub(super) sections: Vec<(Instant, &'static str, &'static str)>,
    pub(super) events: Vec<Event>,
    pub(super) set_points: SetPoints,
    pub(super) end: Instant,
}

/// What the bench records.
pub(super) const SIGNALS: [Signal; 6] = [
    Signal::Position,
    Signal::PositionDemand,
    Signal::Velocity,
    Signal::VelocityDemand,
    Signal::Current,
    Signal::CurrentDemand,
];

impl Bench {
    /// A bench with a factory-fresh drive that is being powered.
    pub(super) fn new(model: &'static DriveProfile, progress: Progress) -> Result<Self, Failure> {
        let node = canopen::NodeId::new(NODE).unwrap_or(canopen::NodeId::MIN);
        let mut world = World::new(Bitrate::K500, SEED);
        let adapter = world.add_tap();
        let drive = embedded::virtual_drive(model, node, world.bitrate())?;
        world.add_drive(NODE, drive).map_err(|error| Failure::new(error.to_string()))?;
        let channels = SIGNALS.map(|signal| Channel { drive: NODE, signal });
        world.start_recording(Recorder::new(SAMPLING_PERIOD, channels));
        Ok(Self {
            model,
            world,
            adapter,
            heard: Vec::new(),
            section: "",
            progress,
            rows: Vec::new(),
            sections: Vec::new(),
            events: Vec::new(),
            set_points: SetPoints::default(),
        })
    }

    /// Begins a section of the manual.
    pub(super) fn section(&mut self, number: &'static str, name: &'static str) {
        self.section = number;
        self.sections.push((self.world.now(), number, name));
        self.progress.show(format!("{number} {name}"));
    }

    /// Draws a set-point of the position, in counts.
    pub(super) fn aim_at(&mut self, counts: f64) {
        let now = self.world.now();
        self.set_points.set(Axis::Position, counts, now);
    }

    /// Counts of 60FFh in 1 r/min from here on (5.3).
    pub(super) fn resolve(&mut self, counts_per_rpm: f64) {
        self.set_points.counts_per_rpm = counts_per_rpm;
    }

    /// Marks the present moment in the picture.
    pub(super) fn mark(&mut self, label: impl Into<String>, kind: EventKind) {
        let at_s = self.world.now().as_secs_f64();
        self.events.push(Event { at_s, label: label.into(), kind });
    }

    /// Begins a row without a datagram.
    pub(super) fn step(&mut self, step: impl Into<String>) {
        self.rows.push(Row::new(self.section, step));
    }

    /// Begins a row without a datagram that belongs to another section.
    pub(super) fn step_in(&mut self, section: &'static str, step: impl Into<String>) {
        self.rows.push(Row::new(section, step));
    }

    /// Begins a row: sends a datagram to the drive's SDO server, and compares the answer with the manual's.
    pub(super) fn ask(&mut self, step: impl Into<String>, request: &str, reply: &str) {
        self.step(step);
        let answered = self.exchange(bytes(request));
        let text = answered.map_or_else(|| "nothing".into(), |data| hex(&data));
        let expected = hex(&bytes(reply));
        let row = self.row();
        row.asked = hex(&bytes(request));
        row.answered = text.clone();
        if text == expected {
            row.compare("as printed", "same", true);
        } else {
            row.compare(&expected, text, false);
        }
    }

    /// Sends a datagram to the drive's SDO server within a row that speaks of something else.
    pub(super) fn tell(&mut self, request: &str) {
        let answered = self.exchange(bytes(request));
        if answered.is_none_or(|reply| reply[0] == 0x80) {
            self.row().compare("an answer", "refused, or none", false);
        }
    }

    /// Sends a frame that nobody answers, within the row.
    pub(super) fn send(&mut self, frame: Frame) {
        self.row().asked = frame.to_string();
        self.transmit(frame);
        self.world.run_for(Duration::from_millis(2));
        self.listen();
    }

    /// Says in the row what the shaft did.
    pub(super) fn moved(&mut self, text: impl Into<String>) {
        self.row().moved = text.into();
    }

    /// Adds an expectation to the row.
    pub(super) fn expect(&mut self, what: &str, expect: Expect, unit: &str, seen: f64) {
        self.row().expect(what, expect, unit, seen);
    }

    /// Adds an expectation in words to the row.
    pub(super) fn compare(&mut self, expected: impl AsRef<str>, seen: impl Into<String>, ok: bool) {
        self.row().compare(expected, seen, ok);
    }

    /// Lets time pass, talking to the drive all the while, so that it does not stop because its host is silent.
    pub(super) fn run(&mut self, duration: Duration) {
        let end = self.world.now() + duration;
        while self.world.now() < end {
            self.world.run_until(end.min(self.world.now() + TALKING_INTERVAL));
            if self.world.now() < end {
                self.statusword();
            }
        }
        self.listen();
    }

    /// Lets time pass in silence.
    pub(super) fn run_silently(&mut self, duration: Duration) {
        self.world.run_for(duration);
        self.listen();
    }

    /// Lets time pass until `condition` holds of the statusword; the time it took, or `None` after `limit`.
    pub(super) fn run_until(&mut self, limit: Duration, condition: impl Fn(u16) -> bool) -> Option<Duration> {
        const STEP: Duration = Duration::from_millis(2);
        let begin = self.world.now();
        while self.world.now() - begin < limit {
            if self.statusword().is_some_and(&condition) {
                return Some(self.world.now() - begin);
            }
            self.run_silently(STEP);
        }
        None
    }

    /// Reads an object; `None` if the drive refuses or is silent.
    pub(super) fn read(&mut self, index: u16, sub_index: u8) -> Option<i64> {
        let [low, high] = index.to_le_bytes();
        let reply = self.exchange([0x40, low, high, sub_index, 0, 0, 0, 0])?;
        let table = self.model.table;
        let row = table.row(table.find(Mux::new(index, sub_index)).ok()?);
        let is_upload = reply[0] >> 5 == 2 && reply[1..4] == [low, high, sub_index];
        let raw = u32::from_le_bytes([reply[4], reply[5], reply[6], reply[7]]);
        is_upload.then(|| row.data_type.value(raw))
    }

    /// Reads a number to compare; not a number if there was no answer.
    pub(super) fn read_f64(&mut self, index: u16, sub_index: u8) -> f64 {
        self.read(index, sub_index).map_or(f64::NAN, |value| value as f64)
    }

    /// The statusword.
    pub(super) fn statusword(&mut self) -> Option<u16> {
        self.read(0x6041, 0).map(|value| value as u16)
    }

    /// What can be measured at the drive.
    pub(super) fn report(&mut self) -> Report {
        self.world.report(NODE).unwrap_or_default()
    }

    /// Does something to the machine around the drive, in the words of `ferrodrive sim`.
    pub(super) fn machine(&mut self, command: &str) {
        let line = format!("{NODE} {command}");
        let refused =
            sim::command::answer(&mut self.world, &line).filter(|answer| !answer.json.contains("\"ok\":true"));
        if let Some(answer) = refused {
            self.row().compare(format!("the machine takes '{command}'"), answer.json, false);
        }
    }

    /// The present.
    pub(super) fn now(&self) -> Instant {
        self.world.now()
    }

    /// Frames heard from `begin` on with this identifier.
    pub(super) fn heard_since(&self, begin: Instant, id: u16) -> Vec<(Instant, Frame)> {
        let wanted = |(at, frame): &&(Instant, Frame)| *at >= begin && frame.standard_data_id() == Some(id);
        self.heard.iter().filter(wanted).copied().collect()
    }

    /// Ends the demo.
    pub(super) fn finish(mut self) -> Finished {
        let recorder = self.world.stop_recording().unwrap_or_else(|| Recorder::new(SAMPLING_PERIOD, []));
        let end = self.world.now();
        self.set_points.end(end);
        let Self { rows, sections, events, set_points, .. } = self;
        Finished { rows, recorder, sections, events, set_points, end }
    }

    fn row(&mut self) -> &mut Row {
        if self.rows.is_empty() {
            self.rows.push(Row::new(self.section, ""));
        }
        let last = self.rows.len() - 1;
        &mut self.rows[last]
    }

    fn exchange(&mut self, request: [u8; 8]) -> Option<[u8; 8]> {
        self.set_points.note(&request, self.world.now());
        self.listen();
        let before = self.heard.len();
        self.transmit(Frame::full(CanId::standard(0x600 + u16::from(NODE)), request));
        let limit = self.world.now() + ANSWER_TIME;
        while self.world.now() < limit && self.world.next_event().is_some_and(|at| at <= limit) {
            self.world.step();
            self.listen();
            let reply = |(_, frame): &&(Instant, Frame)| frame.standard_data_id() == Some(0x580 + u16::from(NODE));
            if let Some((_, frame)) = self.heard[before..].iter().find(reply) {
                return Some(*frame.padded());
            }
        }
        None
    }

    fn transmit(&mut self, frame: Frame) {
        // The adapter's queue holds thousands; the bench sends one frame at a time.
        let _ = self.world.send(self.adapter, frame);
    }

    fn listen(&mut self) {
        while let Some(heard) = self.world.poll_received(self.adapter) {
            self.heard.push(heard);
        }
    }
}

/// A datagram as printed: `2F 60 60 00 03 00 00 00`.
fn bytes(text: &str) -> [u8; 8] {
    let mut bytes = [0; 8];
    for (byte, word) in bytes.iter_mut().zip(text.split_whitespace()) {
        *byte = u8::from_str_radix(word, 16).unwrap_or_default();
    }
    bytes
}

fn hex(bytes: &[u8; 8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect()
}
