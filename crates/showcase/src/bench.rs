//! The test bench: virtual drives on a virtual bus, a CAN adapter that sends the manuals' datagrams as they are
//! printed, a recorder, and the table that grows from it.
//!
//! One drive at a time is talked to. What is asked of it, and what it answers, is a row of the table.

use std::rc::Rc;
use std::time::Duration;

use can::{Bitrate, CanId, Frame, Instant};
use canopen::od::Entry;
use canopen::{Mux, NodeId};
use devices::{Description, HostWatch};
use sim::machine::Order;
use sim::recorder::{Channel, Recorder, Signal};
use sim::{Place, Report, StationId, World};

use super::datagram::{Pattern, hex};
use super::error::Error;
use super::expect::Expect;
use super::row::Row;
use super::set_points::{Axis, SetPoints};
use plot::{EventKind, PlotEvent};

/// Called for each section as it begins.
pub(super) type Progress = Rc<dyn Fn(&str)>;

/// The seed of everything random on the bus: runs are repeatable.
const SEED: u64 = 1;

/// How often something is asked while a motor runs whose drive watches its host: the ZLAC8030L stops it when it hears
/// nothing for 2000h = 1000 ms.
const TALKING_INTERVAL: Duration = Duration::from_millis(100);

/// Longest wait for an answer; the drives answer within a millisecond or two.
const ANSWER_TIME: Duration = Duration::from_millis(50);

/// Identifiers of what is asked of an SDO server, and of its answers, without the node-ID (CiA 301, predefined connection set).
const REQUESTS: u16 = 0x600;
const ANSWERS: u16 = 0x580;

const SAMPLING_PERIOD: Duration = Duration::from_millis(5);

/// See the [module](self).
pub(super) struct Bench {
    drives: Vec<(&'static Description, u8)>,
    /// Which of them is talked to.
    subject: usize,
    world: World,
    adapter: StationId,
    heard: Vec<(Instant, Frame)>,
    /// How many of them were waited for, or came before the last request.
    listed: usize,
    section: String,
    progress: Progress,
    rows: Vec<Row>,
    sections: Vec<(Instant, String, String)>,
    events: Vec<PlotEvent>,
    set_points: SetPoints,
    starts: Vec<Start>,
    cuts: Vec<(Instant, Instant)>,
}

/// How axes start after SYNC.
#[derive(Clone, Debug)]
pub(super) struct Start {
    /// What was set.
    pub(super) setting: &'static str,
    /// How far an axis has turned once it counts as started, counts.
    pub(super) started_counts: f64,
    /// Microseconds since SYNC was sent, and counts turned since, of each axis.
    pub(super) axes: Vec<Vec<(f64, f64)>>,
}

impl Start {
    /// When each axis started, µs; not a number for one that did not.
    pub(super) fn times_us(&self) -> Vec<f64> {
        let is_started = |point: &&(f64, f64)| point.1.abs() > self.started_counts;
        self.axes.iter().map(|axis| axis.iter().find(is_started).map_or(f64::NAN, |point| point.0)).collect()
    }

    /// From the first to the last start, µs; not a number unless all started.
    pub(super) fn spread_us(&self) -> f64 {
        let times = self.times_us();
        if times.iter().any(|time| time.is_nan()) {
            return f64::NAN;
        }
        let (first, last) =
            (times.iter().copied().fold(f64::NAN, f64::min), times.iter().copied().fold(f64::NAN, f64::max));
        last - first
    }
}

/// What is left of a bench: the table, the recording, and the named spans and moments in it.
pub(super) struct Finished {
    pub(super) rows: Vec<Row>,
    pub(super) recorder: Recorder,
    /// Begin, number and name of each section.
    pub(super) sections: Vec<(Instant, String, String)>,
    pub(super) events: Vec<PlotEvent>,
    pub(super) set_points: SetPoints,
    pub(super) starts: Vec<Start>,
    /// Spans in which there is nothing to see.
    pub(super) cuts: Vec<(Instant, Instant)>,
    pub(super) end: Instant,
}

/// What the bench records of each drive.
pub(super) const SIGNALS: [Signal; 6] = [
    Signal::Position,
    Signal::PositionDemand,
    Signal::VelocityDemand,
    Signal::Current,
    Signal::CurrentDemand,
    Signal::ShaftAngle,
];

impl Bench {
    /// A bench with factory-fresh drives that are being powered. The first one is talked to.
    pub(super) fn new(
        drives: &[(&'static Description, u8)],
        bitrate: Bitrate,
        progress: Progress,
    ) -> Result<Self, Error> {
        let mut world = World::new(bitrate, SEED);
        let adapter = world.add_probe();
        for (model, number) in drives.iter().copied() {
            let node = NodeId::new(number).unwrap_or(NodeId::MIN);
            let drive = sim::machine::order(model, &Order::new(model, node, bitrate))?;
            world.add_drive(number, drive)?;
        }
        let channels =
            drives.iter().flat_map(|(_, number)| SIGNALS.map(|signal| Channel { place: Place::node(*number), signal }));
        world.start_recording(Recorder::new(SAMPLING_PERIOD, channels));
        Ok(Self {
            drives: drives.to_vec(),
            subject: 0,
            world,
            adapter,
            heard: Vec::new(),
            listed: 0,
            section: String::new(),
            progress,
            rows: Vec::new(),
            sections: Vec::new(),
            events: Vec::new(),
            set_points: SetPoints::default(),
            starts: Vec::new(),
            cuts: Vec::new(),
        })
    }

    /// Talks to the drive at this node from here on.
    pub(super) fn talk_to(&mut self, node: u8) {
        self.subject = self.drives.iter().position(|(_, number)| *number == node).unwrap_or(0);
    }

    /// The drives and their node-IDs.
    pub(super) fn drives(&self) -> &[(&'static Description, u8)] {
        &self.drives
    }

    /// The node-ID that is talked to.
    pub(super) fn node(&self) -> u8 {
        self.drives[self.subject].1
    }

    /// What is known of the drive that is talked to.
    pub(super) fn model(&self) -> &'static Description {
        self.drives[self.subject].0
    }

    /// Begins a section of the manual.
    pub(super) fn section(&mut self, number: &str, name: &str) {
        number.clone_into(&mut self.section);
        self.sections.push((self.world.now(), number.into(), name.into()));
        (self.progress)(&format!("{}: {number} {name}", self.model().title));
    }

    /// Draws a set-point of the position, in counts.
    pub(super) fn aim_at(&mut self, counts: f64) {
        let now = self.world.now();
        self.set_points.set(Axis::Position, counts, now);
    }

    /// No set-point is drawn from here on.
    pub(super) fn aim_at_nothing(&mut self) {
        let now = self.world.now();
        self.set_points.end(now);
    }

    /// Counts of 60FFh in 1 r/min from here on.
    pub(super) fn resolve(&mut self, counts_per_rpm: f64) {
        self.set_points.counts_per_rpm = counts_per_rpm;
    }

    /// Marks the present moment in the picture.
    pub(super) fn mark(&mut self, label: impl Into<String>, kind: EventKind) {
        let at_s = self.world.now().as_secs_f64();
        self.events.push(PlotEvent { at_s, label: label.into(), kind });
    }

    /// Begins a row without a datagram.
    pub(super) fn step(&mut self, step: impl Into<String>) {
        self.rows.push(Row::new(self.section.as_str(), step));
    }

    /// Begins a row without a datagram that belongs to another section.
    pub(super) fn step_in(&mut self, section: &str, step: impl Into<String>) {
        self.rows.push(Row::new(section, step));
    }

    /// Begins a row: sends a frame, and gives it and what it does some time: zero where an answer is waited for.
    pub(super) fn request(&mut self, step: impl Into<String>, frame: Frame, time: Duration) {
        self.step(step);
        self.row().asked = self.shown(&frame);
        self.ask(frame);
        if !time.is_zero() {
            self.run_silently(time);
        }
    }

    /// Waits for the frame that answers, and compares it in the row. `strict`: it is the next one that is heard, not the
    /// next one with its identifier.
    pub(super) fn hear(&mut self, expected: &Pattern, strict: bool) -> Option<Frame> {
        let answered = self.next_heard((!strict).then_some(expected.id));
        let is_sdo = !strict && expected.id == ANSWERS + u16::from(self.node());
        let whole = format!("{:03X}#{}", expected.id, expected.data());
        let shown = |frame: Frame| if strict { frame.to_string() } else { self.shown(&frame) };
        let seen = answered.map_or_else(|| "nothing".into(), shown);
        let ok = answered.is_some_and(|frame| expected.fits(&frame));
        let row = self.row();
        row.answered.clone_from(&seen);
        match (is_sdo, ok) {
            (true, true) => row.compare(expected.meaning(), "same", true),
            (true, false) => row.compare(expected.data(), seen, false),
            (false, true) => row.compare(whole, "same", true),
            (false, false) => row.compare(whole, seen, false),
        }
        answered
    }

    /// Begins a row: a request and its answer.
    pub(super) fn exchange(&mut self, step: impl Into<String>, request: &str, reply: &str) {
        match (request.parse(), Pattern::parse(reply)) {
            (Ok(request), Some(reply)) => {
                self.request(step, request, Duration::ZERO);
                self.hear(&reply, false);
            }
            _ => self.compare("two frames", format!("{request}, {reply}"), false),
        }
    }

    /// Begins a row: writes an object, with the length that it has, and expects that the drive takes the value.
    pub(super) fn write(&mut self, step: impl Into<String>, index: u16, sub_index: u8, value: i64) {
        let size = self.object(index, sub_index).map_or(4, |row| row.data_type.size()).clamp(1, 4);
        let [low, high] = index.to_le_bytes();
        let mut request = [0x23 | (4 - size as u8) << 2, low, high, sub_index, 0, 0, 0, 0];
        request[4..4 + size].copy_from_slice(&value.to_le_bytes()[..size]);
        self.request(step, self.sdo(&request), Duration::ZERO);
        let answered = self.next_heard(Some(ANSWERS + u16::from(self.node())));
        let seen = answered.map_or_else(|| "nothing".into(), |frame| self.shown(&frame));
        let ok = answered.is_some_and(|frame| *frame.padded() == [0x60, low, high, sub_index, 0, 0, 0, 0]);
        let row = self.row();
        row.answered.clone_from(&seen);
        row.compare(
            if ok { "written".into() } else { hex(&[0x60, low, high, sub_index, 0, 0, 0, 0]) },
            if ok { "same" } else { &seen },
            ok,
        );
    }

    /// Sends a request to the drive's SDO server within a row that speaks of something else.
    pub(super) fn send_within(&mut self, request: Frame) {
        self.ask(request);
        let answered = self.next_heard(Some(ANSWERS + u16::from(self.node())));
        if answered.is_none_or(|reply| reply.padded()[0] == 0x80) {
            self.row().compare("an answer", "refused, or none", false);
        }
    }

    /// Says in the row what was asked.
    pub(super) fn asked(&mut self, text: impl Into<String>) {
        self.row().asked = text.into();
    }

    /// Says in the row what answered.
    pub(super) fn answered_with(&mut self, text: impl Into<String>) {
        self.row().answered = text.into();
    }

    /// Keeps how three axes started, for the picture.
    pub(super) fn starts(&mut self, start: Start) {
        self.starts.push(start);
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

    /// Reads an object and adds an expectation of it to the row.
    pub(super) fn expect_object(&mut self, index: u16, sub_index: u8, expect: Expect, unit: &str) {
        let seen = self.read_f64(index, sub_index);
        let what = if sub_index == 0 { format!("{index:04X}h") } else { Mux::new(index, sub_index).to_string() };
        self.expect(&what, expect, unit, seen);
    }

    /// Reads the statusword and adds an expectation of some of its bits to the row.
    pub(super) fn expect_status(&mut self, what: &str, mask: u16, bits: u16) {
        let word = self.statusword().map_or(f64::NAN, |word| f64::from(word & mask));
        self.expect(what, Expect::Bits(bits.into()), "", word);
    }

    /// Does something that is not worth room in the picture.
    pub(super) fn unseen<T>(&mut self, act: impl FnOnce(&mut Self) -> T) -> T {
        let from = self.world.now();
        let done = act(self);
        let to = self.world.now();
        match self.cuts.last_mut() {
            Some(last) if last.1 == from => last.1 = to,
            _ => self.cuts.push((from, to)),
        }
        done
    }

    /// Lets time pass, talking all the while to a drive that stops because its host is silent.
    pub(super) fn run(&mut self, duration: Duration) {
        if !matches!(self.model().host_watch, HostWatch::Silence { .. }) {
            return self.run_silently(duration);
        }
        let end = self.world.now() + duration;
        while self.world.now() < end {
            self.world.run_until(end.min(self.world.now() + TALKING_INTERVAL));
            if self.world.now() < end {
                self.statusword();
            }
        }
        self.listen();
    }

    /// Lets milliseconds pass.
    pub(super) fn run_ms(&mut self, ms: u64) {
        self.run(Duration::from_millis(ms));
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
        self.ask(self.sdo(&[0x40, low, high, sub_index, 0, 0, 0, 0]));
        let reply = *self.next_heard(Some(ANSWERS + u16::from(self.node())))?.padded();
        let row = self.object(index, sub_index)?;
        let is_upload = reply[0] >> 5 == 2 && reply[1..4] == [low, high, sub_index];
        let raw = u32::from_le_bytes([reply[4], reply[5], reply[6], reply[7]]);
        is_upload.then(|| row.data_type.value(raw))
    }

    /// Reads a number to compare; NaN if there was no answer.
    pub(super) fn read_f64(&mut self, index: u16, sub_index: u8) -> f64 {
        self.read(index, sub_index).map_or(f64::NAN, |value| value as f64)
    }

    /// The statusword.
    pub(super) fn statusword(&mut self) -> Option<u16> {
        self.read(0x6041, 0).map(|value| value as u16)
    }

    /// What can be measured at the drive.
    pub(super) fn report(&mut self) -> Report {
        let node = self.node();
        self.report_of(node)
    }

    /// What can be measured at one of the drives.
    pub(super) fn report_of(&mut self, node: u8) -> Report {
        self.world.report(node).unwrap_or_default()
    }

    /// The level of one of the drive's outputs.
    pub(super) fn output(&mut self, name: &str) -> bool {
        self.report().outputs.iter().any(|(output, on)| output == name && on)
    }

    /// Does something to the machine around a drive: a command of `ferrodrive sim`.
    pub(super) fn machine(&mut self, command: &str) {
        let refused =
            sim::command::answer(&mut self.world, command).filter(|answer| !answer.json.contains("\"ok\":true"));
        if let Some(answer) = refused {
            self.row().compare(format!("the machine takes '{command}'"), answer.json, false);
        }
    }

    /// Reads one Modbus register as a number, or two as one of 32 bits with the low word first; not a number if refused.
    pub(super) fn read_registers(&mut self, address: u16, count: usize) -> f64 {
        let (node, mut words) = (self.node(), [0; 2]);
        let count = count.min(words.len());
        let read = self.world.with_drive(node, |drive, now| drive.read_registers(address, &mut words[..count], now));
        match read {
            Ok(Ok(())) if count == 1 => f64::from(words[0] as i16),
            Ok(Ok(())) => f64::from((u32::from(words[1]) << 16 | u32::from(words[0])) as i32),
            _ => f64::NAN,
        }
    }

    /// Writes Modbus registers within the row.
    pub(super) fn write_registers(&mut self, address: u16, words: &[u16]) {
        let node = self.node();
        let written = self.world.with_drive(node, |drive, now| drive.write_registers(address, words, now));
        if !matches!(written, Ok(Ok(()))) {
            self.row().compare("written", "refused", false);
        }
    }

    /// The present.
    pub(super) fn now(&self) -> Instant {
        self.world.now()
    }

    /// The world, for a station of its own.
    pub(super) fn world(&mut self) -> &mut World {
        &mut self.world
    }

    /// Queues a frame without letting time pass.
    pub(super) fn transmit(&mut self, frame: Frame) {
        // The adapter's queue holds thousands; the bench sends a few frames at a time.
        let _ = self.world.send(self.adapter, frame);
    }

    /// Frames heard from `begin` on with this identifier.
    pub(super) fn heard_since(&self, begin: Instant, id: u16) -> Vec<(Instant, Frame)> {
        let wanted = |(at, frame): &&(Instant, Frame)| *at >= begin && frame.standard_data_id() == Some(id);
        self.heard.iter().filter(wanted).copied().collect()
    }

    /// The first frame that no line has waited for since the last request.
    pub(super) fn unlisted(&self) -> Option<Frame> {
        self.heard.get(self.listed).map(|(_, frame)| *frame)
    }

    /// Nothing that was heard until now is waited for.
    pub(super) fn forget(&mut self) {
        self.listed = self.heard.len();
    }

    /// What was seen instead, if something in the last row is not as expected.
    pub(super) fn difference(&self) -> Option<String> {
        let differing = self.rows.last()?.checks.iter().find(|check| !check.ok)?;
        Some(differing.seen.clone())
    }

    /// When the first frame with this identifier was heard from `begin` on; `None` if none was.
    pub(super) fn heard_after(&self, begin: Instant, id: u16) -> Option<Instant> {
        let latest = self.heard.iter().rev().take_while(|(at, _)| *at >= begin);
        latest.filter(|(_, frame)| frame.standard_data_id() == Some(id)).last().map(|(at, _)| *at)
    }

    /// Ends it: what is left to show.
    pub(super) fn finish(mut self) -> Finished {
        let recorder = self.world.stop_recording().unwrap_or_else(|| Recorder::new(SAMPLING_PERIOD, []));
        let end = self.world.now();
        self.set_points.end(end);
        let Self { rows, sections, events, set_points, starts, cuts, .. } = self;
        Finished { rows, recorder, sections, events, set_points, starts, cuts, end }
    }

    fn object(&self, index: u16, sub_index: u8) -> Option<&'static Entry> {
        let table = self.model().dictionary;
        Some(table.row(table.find(Mux::new(index, sub_index)).ok()?))
    }

    fn row(&mut self) -> &mut Row {
        if self.rows.is_empty() {
            self.rows.push(Row::new(self.section.as_str(), ""));
        }
        let last = self.rows.len() - 1;
        &mut self.rows[last]
    }

    /// A request to the SDO server of the drive.
    fn sdo(&self, request: &[u8]) -> Frame {
        Frame::new(CanId::standard(REQUESTS + u16::from(self.node())), request)
    }

    /// As the table shows it: what is said to the drive's SDO server, and by it, by its bytes alone.
    fn shown(&self, frame: &Frame) -> String {
        let node = u16::from(self.node());
        match frame.standard_data_id() {
            Some(id) if id == REQUESTS + node => hex(frame.data()),
            Some(id) if id == ANSWERS + node => hex(frame.padded()),
            _ => frame.to_string(),
        }
    }

    /// Sends a frame; what was heard before does not answer it.
    fn ask(&mut self, request: Frame) {
        if request.standard_data_id() == Some(REQUESTS + u16::from(self.node())) {
            self.set_points.note(request.data(), self.world.now());
        }
        self.listen();
        self.listed = self.heard.len();
        self.transmit(request);
    }

    /// The next frame that was not listed yet, or the next one with an identifier.
    fn next_heard(&mut self, id: Option<u16>) -> Option<Frame> {
        let limit = self.world.now() + ANSWER_TIME;
        loop {
            let wanted = |(_, frame): &(Instant, Frame)| id.is_none_or(|id| frame.standard_data_id() == Some(id));
            if let Some(place) = self.heard[self.listed..].iter().position(wanted) {
                self.listed += place + 1;
                return Some(self.heard[self.listed - 1].1);
            }
            if self.world.now() >= limit || self.world.next_event().is_none_or(|at| at > limit) {
                return None;
            }
            self.world.step();
            self.listen();
        }
    }

    fn listen(&mut self) {
        while let Some(heard) = self.world.poll_received(self.adapter) {
            self.heard.push(heard);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_of_a_start_needs_all_axes() {
        let axis = |begin_us: f64| {
            (0..10).map(|n| (f64::from(n) * 100.0, (f64::from(n) * 100.0 - begin_us).max(0.0))).collect()
        };
        let mut start = Start { setting: "", started_counts: 2.0, axes: vec![axis(100.0), axis(450.0), axis(0.0)] };
        assert_eq!(start.times_us(), [200.0, 500.0, 100.0]);
        assert_eq!(start.spread_us(), 400.0);
        start.axes.push(vec![(0.0, 0.0), (900.0, 1.0)]);
        assert!(start.spread_us().is_nan());
    }
}
