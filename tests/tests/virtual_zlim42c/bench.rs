//! A drive, a host and the bus between them.

use std::collections::HashMap;
use std::sync::LazyLock;
use std::time::Duration;

use can::{Bitrate, CanId, Frame, Instant};
use ferrodrive_tests::manual::ObjectRow;
use ferrodrive_tests::zlim42c::objects;
use sim::machine::{Zlim42cMachine, zlim42c, zlim42c_82};
use sim::{Report, StationId, VirtualDrive, World};

/// The node of a drive as delivered, and its number in the world.
pub(crate) const NODE: u8 = 1;

/// Value of 2009h for 500 kbit/s.
pub(crate) const RATE_500K: u16 = 1;

/// The drive answers within about 1 ms; its users wait for 20 ms.
const ANSWER_WITHIN_MS: u64 = 20;

/// How long the host waits before it looks again.
const LOOK_EVERY: Duration = Duration::from_micros(100);

pub(crate) struct Bench {
    pub(crate) world: World,
    pub(crate) host: StationId,
    /// The node that the host talks to.
    pub(crate) node: u8,
    drive: StationId,
    bare: bool,
    heard: Vec<(Instant, Frame)>,
}

/// An abort code that the drive answered.
pub(crate) type Abort = u32;

impl Bench {
    /// A drive as delivered that has just booted.
    pub(crate) fn new() -> Self {
        Self::with(Box::new(zlim42c(NODE, RATE_500K)))
    }

    /// The same with the longer motor.
    pub(crate) fn long() -> Self {
        Self::with(Box::new(zlim42c_82(NODE, RATE_500K)))
    }

    fn with(machine: Box<dyn VirtualDrive>) -> Self {
        let mut world = World::new(Bitrate::K500, 1);
        let host = world.add_tap();
        let drive = world.add_drive(NODE, machine).expect("the first drive");
        Self { world, host, node: NODE, drive, bare: false, heard: Vec::new() }.booted()
    }

    /// A drive as delivered that has just booted, with its [`machine`](Self::machine) open to the eye.
    pub(crate) fn open() -> Self {
        let mut world = World::new(Bitrate::K500, 1);
        let host = world.add_tap();
        let mut machine = zlim42c(NODE, RATE_500K);
        machine.set_power(true, world.now());
        let drive = world.add_station(machine);
        Self { world, host, node: NODE, drive, bare: true, heard: Vec::new() }.booted()
    }

    fn booted(mut self) -> Self {
        self.run_ms(10);
        self
    }

    // ---- time and frames ----

    pub(crate) fn run_ms(&mut self, ms: u64) {
        self.run(Duration::from_millis(ms));
    }

    pub(crate) fn run(&mut self, duration: Duration) {
        self.world.run_for(duration);
        self.listen();
    }

    pub(crate) fn seconds(&self) -> f64 {
        self.world.now().as_secs_f64()
    }

    fn listen(&mut self) {
        while let Some(heard) = self.world.poll_received(self.host) {
            self.heard.push(heard);
        }
    }

    /// Everything that the host heard since the last call, in candump notation.
    pub(crate) fn heard(&mut self) -> Vec<String> {
        self.heard_at().into_iter().map(|(_, frame)| frame.to_string()).collect()
    }

    /// Everything that the host heard since the last call.
    pub(crate) fn heard_at(&mut self) -> Vec<(Instant, Frame)> {
        self.listen();
        std::mem::take(&mut self.heard)
    }

    /// Sends a frame in candump notation and lets it arrive.
    pub(crate) fn send(&mut self, frame: &str) {
        self.world.send(self.host, frame.parse().expect("a frame")).expect("room at the host");
        self.run_ms(1);
    }

    /// Sends an SDO request; the eight bytes that answer it, or `None`.
    pub(crate) fn sdo(&mut self, request: &[u8]) -> Option<[u8; 8]> {
        let frame = Frame::new(CanId::standard(0x600 + u16::from(self.node)), request);
        self.world.send(self.host, frame).expect("room at the host");
        self.listen();
        let from = self.heard.len();
        let answers = 0x580 + u16::from(self.node);
        let end = self.world.now() + Duration::from_millis(ANSWER_WITHIN_MS);
        while self.world.now() < end {
            self.run(LOOK_EVERY);
            let answer = self.heard[from..].iter().find(|(_, frame)| frame.standard_data_id() == Some(answers));
            if let Some((_, frame)) = answer {
                return Some(frame.data().try_into().expect("an SDO answer has eight bytes"));
            }
        }
        None
    }

    // ---- objects ----

    /// Writes `value` with the object's width.
    pub(crate) fn write(&mut self, index: u16, sub: u8, value: i64) -> Result<(), Abort> {
        let size = row(index, sub).size;
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
    pub(crate) fn set(&mut self, index: u16, sub: u8, value: i64) {
        let done = self.write(index, sub, value);
        assert_eq!(done, Ok(()), "{index:04X}h:{sub:02X} = {value} at {} s", self.seconds());
    }

    /// The bytes of an object, as many as the drive sends.
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, Abort> {
        let answer = self.sdo(&head(0x40, index, sub));
        let answer = answer.unwrap_or_else(|| panic!("no answer to a read of {index:04X}h:{sub:02X}"));
        match answer[0] {
            0x43 | 0x47 | 0x4B | 0x4F => Ok(answer[4..8 - usize::from(answer[0] >> 2 & 3)].to_vec()),
            _ => Err(abort_of(&answer)),
        }
    }

    /// The value of an object, with the sign that its type has.
    #[track_caller]
    pub(crate) fn get(&mut self, index: u16, sub: u8) -> i64 {
        let bytes = self.read(index, sub).unwrap_or_else(|abort| panic!("{index:04X}h:{sub:02X}: {abort:08X}h"));
        value_of(&bytes, row(index, sub).signed)
    }

    pub(crate) fn statusword(&mut self) -> u16 {
        self.get(0x6041, 0) as u16
    }

    // ---- the drive ----

    /// The controlwords of section 5.3.2: shutdown, switch on, enable operation.
    pub(crate) fn enable(&mut self) {
        for controlword in [0x06, 0x07, 0x0F] {
            self.set(0x6040, 0, controlword);
        }
    }

    /// Selects a mode and enables operation.
    pub(crate) fn enable_in(&mut self, mode: i64) {
        self.set(0x6060, 0, mode);
        self.enable();
    }

    pub(crate) fn operate<T>(&mut self, act: impl FnOnce(&mut dyn VirtualDrive, Instant) -> T) -> T {
        if !self.bare {
            return self.world.with_drive(NODE, act).expect("the drive is there");
        }
        let now = self.world.now();
        let machine = self.world.station_mut::<Zlim42cMachine>(self.drive).expect("the drive is there");
        let result = act(machine, now);
        self.world.refresh();
        result
    }

    /// What a person beside the machine could measure now.
    pub(crate) fn report(&mut self) -> Report {
        self.operate(|drive, now| {
            drive.advance(now);
            drive.report()
        })
    }

    /// Level of a digital input, held long enough to pass its filter.
    pub(crate) fn input(&mut self, input: usize, level: bool) {
        self.operate(|drive, now| drive.set_input(input, level, now)).expect("X0 to X3");
        self.run_ms(15);
    }

    /// Relative move of profile position.
    pub(crate) fn move_by(&mut self, pulses: i64) {
        self.set(0x607A, 0, pulses);
        self.set(0x6040, 0, 0x4F);
        self.set(0x6040, 0, 0x5F);
    }

    /// Off for 0.1 s, and on again until it has booted.
    pub(crate) fn power_cycle(&mut self) {
        self.operate(|drive, now| drive.set_power(false, now));
        self.run_ms(100);
        self.operate(|drive, now| drive.set_power(true, now));
        self.run_ms(10);
    }

    /// Time for the EEPROM to take what was written.
    pub(crate) fn let_store(&mut self) {
        self.run_ms(5);
    }

    /// The machine of an [`open`](Self::open) bench, as it is now.
    pub(crate) fn machine(&mut self) -> &mut Zlim42cMachine {
        assert!(self.bare, "only an open bench shows its machine");
        let now = self.world.now();
        let machine = self.world.station_mut::<Zlim42cMachine>(self.drive).expect("the drive is there");
        machine.advance(now);
        machine
    }

    /// Runs until `done`, looking every `step`; the seconds that it took.
    #[track_caller]
    pub(crate) fn seconds_until(&mut self, limit_s: f64, step: Duration, mut done: impl FnMut(&Report) -> bool) -> f64 {
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
}

/// The row of the manual's object table.
pub(crate) fn row(index: u16, sub: u8) -> &'static ObjectRow {
    static ROWS: LazyLock<HashMap<(u16, u8), ObjectRow>> =
        LazyLock::new(|| objects().into_iter().map(|row| ((row.index, row.sub), row)).collect());
    ROWS.get(&(index, sub)).unwrap_or_else(|| panic!("{index:04X}h:{sub:02X} is not in the manual"))
}

/// Asserts that a value lies within bounds on both sides.
#[track_caller]
pub(crate) fn assert_within(what: &str, value: f64, low: f64, high: f64) {
    assert!((low..=high).contains(&value), "{what} is {value}, expected {low} to {high}");
}

fn head(command: u8, index: u16, sub: u8) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    [command, low, high, sub, 0, 0, 0, 0]
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
