//! A virtual drive, a host and the bus between them: the table that the tests of every drive work at.
//!
//! The host speaks CANopen by the bytes, with the widths and signs of the manual's object table, so that nothing of the
//! drive's own tables judges the drive. A [`Subject`] says which drive it is; `bench::DRIVE` has that drive's own handles.

pub mod mjoint;
pub mod zlac8030l;
pub mod zlim42c;

use std::collections::HashMap;
use std::marker::PhantomData;
use std::time::Duration;

use can::{Bitrate, CanId, Frame, Instant};
use canopen::NodeId;
use devices::variant::Preset;
use sim::machine::{Order, order};
use sim::{Component, Report, StationId, VirtualDrive, World};

use crate::manual::ObjectRow;

/// A drive answers within about 1 ms; its users wait for 20 ms.
const ANSWER_WITHIN: Duration = Duration::from_millis(20);

/// How long the host waits before it looks again, in bit times.
const LOOK_EVERY_BITS: u64 = 50;

/// Longer than any frame and its answer, in bit times.
const SEND_BITS: u64 = 500;

/// An abort code that a drive answered.
pub type Abort = u32;

/// Where an object stands: its index, or its index and its sub-index.
pub trait Place: Copy {
    /// Index and sub-index.
    fn place(self) -> (u16, u8);
}

impl Place for u16 {
    fn place(self) -> (u16, u8) {
        (self, 0)
    }
}

impl Place for (u16, u8) {
    fn place(self) -> (u16, u8) {
        self
    }
}

/// A drive that is tested, as it is delivered.
pub trait Subject: 'static {
    /// Firmware and physics.
    type Machine: VirtualDrive + Clone + 'static;

    /// Its model's name.
    const MODEL: &'static str;
    /// Its node, and its number in the world.
    const NODE: u8;
    /// Its bit rate.
    const BITRATE: Bitrate;

    /// One that is not switched on yet.
    fn machine() -> Self::Machine;

    /// The manual's object table.
    fn rows() -> &'static Rows;

    /// Its `refused.csv`.
    const REFUSED: &'static str;
    /// Its `at_rest.csv`.
    const AT_REST: &'static str;
}

/// A manual's object table with an index.
#[derive(Debug)]
pub struct Rows {
    rows: Vec<ObjectRow>,
    places: HashMap<(u16, u8), usize>,
}

impl Rows {
    /// The table of these rows.
    pub fn new(rows: Vec<ObjectRow>) -> Self {
        let places = rows.iter().enumerate().map(|(place, row)| ((row.index, row.sub), place)).collect();
        Self { rows, places }
    }

    /// All rows, in the table's order.
    pub fn all(&self) -> &[ObjectRow] {
        &self.rows
    }

    /// The row of an object; `None` for one that the manual does not have.
    pub fn find(&self, index: u16, sub: u8) -> Option<&ObjectRow> {
        self.places.get(&(index, sub)).map(|place| &self.rows[*place])
    }
}

/// Drives, a host and the bus between them.
pub struct Bench<S> {
    /// The world that they are in.
    pub world: World,
    /// The host.
    pub host: StationId,
    /// The node that the host talks to.
    pub node: u8,
    drive: StationId,
    bare: bool,
    heard: Vec<(Instant, Frame)>,
    subject: PhantomData<S>,
}

impl<S: Subject> Default for Bench<S> {
    fn default() -> Self {
        Self::new()
    }
}

/// What holds for any drive. Panics where a test is wrong, and where a drive does not do what a helper takes for granted.
impl<S: Subject> Bench<S> {
    /// A drive as delivered that has just booted.
    #[must_use]
    pub fn new() -> Self {
        Self::with(vec![Box::new(S::machine())])
    }

    /// These drives, the first of them at the subject's node, the others at those that follow; they have just booted.
    #[must_use]
    pub fn with(drives: Vec<Box<dyn VirtualDrive>>) -> Self {
        let mut world = World::new(S::BITRATE, 1);
        let host = world.add_tap();
        let stations: Vec<_> = (S::NODE..)
            .zip(drives)
            .map(|(number, drive)| world.add_drive(number, drive).expect("a free number"))
            .collect();
        Self::booted(world, host, stations[0], false)
    }

    /// A drive that takes another choice at one point, as `ferrodrive readings` lists them (`L123`, `coast`).
    #[must_use]
    #[track_caller]
    pub fn choosing(key: &str, choice: &str) -> Self {
        Self::ordered(key, choice, &[])
    }

    /// The same with values of its own in its parameter store.
    #[must_use]
    #[track_caller]
    pub fn ordered(key: &str, choice: &str, presets: &[Preset]) -> Self {
        let model = devices::model(S::MODEL).expect("a model");
        let mut wanted = Order::new(model, NodeId::new(S::NODE).expect("a node-ID"), S::BITRATE);
        wanted.variant.choose(key, choice).expect("a choice of this model");
        wanted.presets = presets.to_vec();
        Self::with(vec![order(model, &wanted).expect("a drive that can be ordered")])
    }

    /// A drive as delivered that has just booted, with its [`machine`](Self::machine) open to the eye.
    #[must_use]
    pub fn open() -> Self {
        Self::open_with(S::machine())
    }

    /// The same with a machine of one's own.
    #[must_use]
    pub fn open_with(mut machine: S::Machine) -> Self {
        let mut world = World::new(S::BITRATE, 1);
        let host = world.add_tap();
        machine.set_power(true, world.now());
        let drive = world.add_station(machine);
        Self::booted(world, host, drive, true)
    }

    fn booted(world: World, host: StationId, drive: StationId, bare: bool) -> Self {
        let mut bench = Self { world, host, node: S::NODE, drive, bare, heard: Vec::new(), subject: PhantomData };
        bench.run_ms(10);
        bench
    }

    /// Lets time pass.
    pub fn run_ms(&mut self, ms: u64) -> &mut Self {
        self.run(Duration::from_millis(ms))
    }

    /// Lets time pass.
    pub fn run(&mut self, duration: Duration) -> &mut Self {
        self.world.run_for(duration);
        self.listen();
        self
    }

    /// Virtual time.
    pub fn seconds(&self) -> f64 {
        self.world.now().as_secs_f64()
    }

    fn listen(&mut self) {
        while let Some(heard) = self.world.poll_received(self.host) {
            self.heard.push(heard);
        }
    }

    /// Everything that the host heard since the last call, in candump notation.
    pub fn heard(&mut self) -> Vec<String> {
        self.heard_at().into_iter().map(|(_, frame)| frame.to_string()).collect()
    }

    /// Those of them that begin like this: `704#`, or `70n#` for the node that the host talks to.
    pub fn heard_of(&mut self, beginning: &str) -> Vec<String> {
        let beginning = self.named(beginning);
        self.heard().into_iter().filter(|frame| frame.starts_with(&beginning)).collect()
    }

    /// What was heard since the last call is of no interest.
    pub fn forget(&mut self) -> &mut Self {
        self.heard_at();
        self
    }

    /// Asserts that this and nothing else was heard since the last call; `n` stands for the node.
    #[track_caller]
    pub fn hears(&mut self, expected: &[&str]) -> &mut Self {
        self.hears_of("", expected)
    }

    /// Asserts that of what begins like this, this and nothing else was heard since the last call.
    #[track_caller]
    pub fn hears_of(&mut self, beginning: &str, expected: &[&str]) -> &mut Self {
        let expected: Vec<_> = expected.iter().map(|frame| self.named(frame)).collect();
        assert_eq!(self.heard_of(beginning), expected, "heard, and expected, at {} s", self.seconds());
        self
    }

    /// A frame's text in which `n` stands for the last digit of the node-ID.
    fn named(&self, text: &str) -> String {
        text.replace('n', &format!("{:X}", self.node & 0xF))
    }

    /// Everything that the host heard since the last call.
    pub fn heard_at(&mut self) -> Vec<(Instant, Frame)> {
        self.listen();
        std::mem::take(&mut self.heard)
    }

    /// Sends a frame in candump notation and lets it arrive; `n` stands for the node (below 16) that the host talks to.
    #[track_caller]
    pub fn send(&mut self, frame: &str) -> &mut Self {
        self.offer(frame).run(bits::<S>(SEND_BITS))
    }

    /// Sends a frame in candump notation and waits for nothing.
    #[track_caller]
    pub fn offer(&mut self, frame: &str) -> &mut Self {
        let frame = self.named(frame).parse().expect("a frame");
        self.world.send(self.host, frame).expect("room at the host");
        self
    }

    /// Sends a frame; the first frame heard with the identifier `answers` within the time of an answer.
    pub fn ask(&mut self, frame: Frame, answers: u16) -> Option<Frame> {
        self.world.send(self.host, frame).expect("room at the host");
        self.listen();
        let from = self.heard.len();
        let end = self.world.now() + ANSWER_WITHIN;
        while self.world.now() < end {
            self.run(bits::<S>(LOOK_EVERY_BITS));
            let answer = self.heard[from..].iter().find(|(_, frame)| frame.standard_data_id() == Some(answers));
            if let Some((_, frame)) = answer {
                return Some(*frame);
            }
        }
        None
    }

    /// Sends an SDO request; the eight bytes that answer it, or `None`.
    pub fn sdo(&mut self, request: &[u8]) -> Option<[u8; 8]> {
        let node = u16::from(self.node);
        let answer = self.ask(Frame::new(CanId::standard(0x600 + node), request), 0x580 + node)?;
        Some(answer.data().try_into().expect("an SDO answer has eight bytes"))
    }

    /// Writes `value` with the object's width; four bytes for one that the manual does not have.
    pub fn write(&mut self, object: impl Place, value: i64) -> Result<(), Abort> {
        let (index, sub) = object.place();
        let size = S::rows().find(index, sub).map_or(4, |row| row.size);
        let mut request = head(0x23 | (4 - size as u8) << 2, index, sub);
        request[4..4 + size].copy_from_slice(&value.to_le_bytes()[..size]);
        let answer = self.sdo(&request).unwrap_or_else(|| panic!("no answer to a write of {index:04X}h:{sub:02X}"));
        match answer[0] {
            0x60 => Ok(()),
            _ => Err(abort_of(&answer)),
        }
    }

    /// Writes a value that the drive must take.
    #[track_caller]
    pub fn set(&mut self, object: impl Place, value: i64) -> &mut Self {
        let (index, sub) = object.place();
        let done = self.write(object, value);
        assert_eq!(done, Ok(()), "{index:04X}h:{sub:02X} = {value} at {} s", self.seconds());
        self
    }

    /// The bytes of an object, as many as the drive sends.
    pub fn read(&mut self, object: impl Place) -> Result<Vec<u8>, Abort> {
        let (index, sub) = object.place();
        let answer = self.sdo(&head(0x40, index, sub));
        let answer = answer.unwrap_or_else(|| panic!("no answer to a read of {index:04X}h:{sub:02X}"));
        match answer[0] {
            0x43 | 0x47 | 0x4B | 0x4F => Ok(answer[4..8 - usize::from(answer[0] >> 2 & 3)].to_vec()),
            _ => Err(abort_of(&answer)),
        }
    }

    /// The value of an object, with the sign that its type has.
    #[track_caller]
    pub fn get(&mut self, object: impl Place) -> i64 {
        let (index, sub) = object.place();
        let bytes = self.read(object).unwrap_or_else(|abort| panic!("{index:04X}h:{sub:02X}: {abort:08X}h"));
        value_of(&bytes, S::rows().find(index, sub).is_some_and(|row| row.signed))
    }

    /// Asserts that an object reads this value now.
    #[track_caller]
    pub fn reads(&mut self, object: impl Place, expected: i64) -> &mut Self {
        let (value, (index, sub)) = (self.get(object), object.place());
        let at = self.seconds();
        assert_eq!(value, expected, "{index:04X}h:{sub:02X} is {value:X}h, expected {expected:X}h, at {at} s");
        self
    }

    /// Asserts that the statusword has these bits among those of `mask` now.
    #[track_caller]
    pub fn shows(&mut self, mask: u16, bits: u16) -> &mut Self {
        let (statusword, at) = (self.statusword(), self.seconds());
        assert_eq!(
            statusword & mask,
            bits,
            "6041h is {statusword:04X}h, expected {bits:04X}h of {mask:04X}h, at {at} s"
        );
        self
    }

    /// Asserts that the motor turns with a speed between these, r/min.
    #[track_caller]
    pub fn turns_at(&mut self, low_rpm: f64, high_rpm: f64) -> &mut Self {
        assert_within("speed in r/min", self.report().velocity_rpm, low_rpm, high_rpm);
        self
    }

    /// Asserts that a write is refused with this code.
    #[track_caller]
    pub fn refuses(&mut self, object: impl Place, value: i64, code: Abort) -> &mut Self {
        let (answer, (index, sub)) = (self.write(object, value), object.place());
        assert_eq!(answer, Err(code), "{index:04X}h:{sub:02X} = {value:X}h: {answer:08X?}, expected {code:08X}h");
        self
    }

    /// Asserts that an SDO request gets this answer.
    #[track_caller]
    pub fn answers(&mut self, request: [u8; 8], answer: [u8; 8]) -> &mut Self {
        assert_eq!(self.sdo(&request), Some(answer), "to {request:02X?}");
        self
    }

    /// Asserts that nobody answers an SDO request.
    #[track_caller]
    pub fn is_silent(&mut self) -> &mut Self {
        assert_eq!(self.sdo(&head(0x40, 0x6041, 0)), None, "at {} s", self.seconds());
        self
    }

    /// Asserts that the motor turns at this speed, r/min, give or take.
    #[track_caller]
    pub fn turns_about(&mut self, rpm: f64, tolerance_rpm: f64) -> &mut Self {
        self.turns_at(rpm - tolerance_rpm, rpm + tolerance_rpm)
    }

    /// Asserts that 6064h reads this, give or take.
    #[track_caller]
    pub fn is_at(&mut self, position: i64, tolerance: i64) -> &mut Self {
        let (read, at) = (self.get(0x6064), self.seconds());
        assert!((read - position).abs() <= tolerance, "6064h is {read}, expected {position} ± {tolerance}, at {at} s");
        self
    }

    /// Maps objects into a PDO, as CiA 301 wants it: none, then each, then how many. `record` is 1600h or 1A00h and on.
    #[track_caller]
    pub fn map(&mut self, record: u16, objects: &[i64]) -> &mut Self {
        self.set(record, 0);
        for (sub, object) in (1..).zip(objects) {
            self.set((record, sub), *object);
        }
        self.set(record, objects.len() as i64)
    }

    /// 6041h.
    pub fn statusword(&mut self) -> u16 {
        self.get(0x6041) as u16
    }

    /// The controlwords of CiA 402: shutdown, switch on, enable operation.
    pub fn enable(&mut self) -> &mut Self {
        self.set(0x6040, 0x06).set(0x6040, 0x07).set(0x6040, 0x0F)
    }

    /// Does something to the drive, as a person beside the machine.
    pub fn operate<T>(&mut self, act: impl FnOnce(&mut dyn VirtualDrive, Instant) -> T) -> T {
        if !self.bare {
            return self.world.with_drive(S::NODE, act).expect("the drive is there");
        }
        let now = self.world.now();
        let machine = self.world.station_mut::<S::Machine>(self.drive).expect("the drive is there");
        let result = act(machine, now);
        self.world.refresh();
        result
    }

    /// A torque on the shaft, N m: a positive one opposes positive motion.
    #[track_caller]
    pub fn set_load_torque(&mut self, torque_nm: f64) -> &mut Self {
        self.operate(|drive, now| drive.set_load_torque(torque_nm, now)).expect("a shaft");
        self
    }

    /// Inertia on the shaft, kg m².
    #[track_caller]
    pub fn set_load_inertia(&mut self, inertia_kg_m2: f64) -> &mut Self {
        self.operate(|drive, now| drive.set_load_inertia(inertia_kg_m2, now)).expect("a shaft");
        self
    }

    /// The shaft is held fast, or not.
    #[track_caller]
    pub fn set_rotor_locked(&mut self, locked: bool) -> &mut Self {
        self.operate(|drive, now| drive.set_rotor_locked(locked, now)).expect("a rotor");
        self
    }

    /// Voltage of the supply.
    #[track_caller]
    pub fn set_supply(&mut self, supply_v: f64) -> &mut Self {
        self.operate(|drive, now| drive.set_supply(supply_v, now)).expect("a supply");
        self
    }

    /// Level of a digital input.
    #[track_caller]
    pub fn set_input(&mut self, input: usize, level: bool) -> &mut Self {
        self.operate(|drive, now| drive.set_input(input, level, now)).expect("an input");
        self
    }

    /// Breaks a component, or mends it.
    #[track_caller]
    pub fn set_fault(&mut self, component: Component, broken: bool) -> &mut Self {
        self.operate(|drive, now| drive.set_fault(component, broken, now)).expect("the drive has it");
        self
    }

    /// A line for the world, as a person at the machine types it; it must be taken.
    #[track_caller]
    pub fn tell(&mut self, line: &str) -> &mut Self {
        self.told(line);
        self
    }

    /// The answer to a line for the world, which must be taken.
    #[track_caller]
    pub fn told(&mut self, line: &str) -> String {
        let answer = sim::command::answer(&mut self.world, line).expect("a line is answered").json;
        assert!(answer.starts_with("{\"ok\":true"), "{line}: {answer}");
        answer
    }

    /// What a person beside the machine could measure now.
    pub fn report(&mut self) -> Report {
        self.operate(|drive, now| {
            drive.advance(now);
            drive.report()
        })
    }

    /// Off for 0.1 s, and on again until it has booted.
    pub fn power_cycle(&mut self) -> &mut Self {
        self.operate(|drive, now| drive.cut_power(now));
        self.run_ms(100);
        self.operate(|drive, now| drive.set_power(true, now));
        self.run_ms(10)
    }

    /// Time for the EEPROM to take what was written.
    pub fn let_store(&mut self) -> &mut Self {
        self.run_ms(5)
    }

    /// The machine of an [`open`](Self::open) bench, as it is now.
    pub fn machine(&mut self) -> &mut S::Machine {
        assert!(self.bare, "only an open bench shows its machine");
        let now = self.world.now();
        let machine = self.world.station_mut::<S::Machine>(self.drive).expect("the drive is there");
        machine.advance(now);
        machine
    }

    /// Runs until `done`, looking every `step`; the seconds that it took.
    #[track_caller]
    pub fn seconds_until(&mut self, limit_s: f64, step: Duration, mut done: impl FnMut(&Report) -> bool) -> f64 {
        let start = self.seconds();
        loop {
            let report = self.report();
            if done(&report) {
                return self.seconds() - start;
            }
            assert!(self.seconds() - start < limit_s, "not within {limit_s} s: {report:?}");
            self.run(step);
        }
    }

    /// Milliseconds until `done`, which may ask the drive; panics after `limit_ms`.
    #[track_caller]
    pub fn until(&mut self, limit_ms: u64, mut done: impl FnMut(&mut Self) -> bool) -> u64 {
        for ms in 0..limit_ms {
            if done(self) {
                return ms;
            }
            self.run_ms(1);
        }
        panic!("not within {limit_ms} ms: statusword {:04X}h, {:?}", self.statusword(), self.report());
    }
}

/// Asserts that a value lies within bounds on both sides.
#[track_caller]
pub fn assert_within(what: &str, value: f64, low: f64, high: f64) {
    assert!((low..=high).contains(&value), "{what} is {value}, expected {low} to {high}");
}

/// The first bytes of an SDO request; the data bytes are zero.
#[must_use]
pub fn head(command: u8, index: u16, sub: u8) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    [command, low, high, sub, 0, 0, 0, 0]
}

/// The time of so many bits on the subject's bus.
fn bits<S: Subject>(count: u64) -> Duration {
    Duration::from_nanos(count * S::BITRATE.bit_nanos())
}

fn abort_of(answer: &[u8; 8]) -> Abort {
    assert_eq!(answer[0], 0x80, "neither an answer nor an abort: {answer:02X?}");
    u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]])
}

fn value_of(bytes: &[u8], signed: bool) -> i64 {
    let negative = signed && bytes.last().is_some_and(|byte| byte & 0x80 != 0);
    let mut wide = [if negative { 0xFF } else { 0 }; 8];
    wide[..bytes.len()].copy_from_slice(bytes);
    i64::from_le_bytes(wide)
}
