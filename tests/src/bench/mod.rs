//! A virtual drive, a host and the bus between them: the table that the tests of every drive work at.
//!
//! The host speaks CANopen by the bytes, with the widths and signs of the manual's object table, so that nothing of the
//! drive's own tables judges the drive. A [`BenchSubject`] says which drive it is; `bench::DRIVE` has that drive's own handles.

pub mod cia402;
mod expectations;
mod hands;
pub mod mjoint;
mod objects;
pub mod zlac8030l;
pub mod zlim42c;

use std::collections::HashMap;
use std::marker::PhantomData;
use std::time::Duration;

use can::{Bitrate, Frame, Instant};
use canopen::NodeId;
use devices::variant::Preset;
use sim::machine::{Order, order};
use sim::{StationId, VirtualDrive, World};

use crate::manual::ObjectRow;

pub use expectations::assert_within;
pub use objects::{Abort, ObjectAddress, head};

/// A drive answers within about 1 ms; its users wait for 20 ms.
const ANSWER_WITHIN: Duration = Duration::from_millis(20);

/// How long the host waits before it looks again, in bit times.
const LOOK_EVERY_BITS: u64 = 50;

/// Longer than any frame and its answer, in bit times.
const SEND_BITS: u64 = 500;

/// A drive that is tested, as it is delivered.
pub trait BenchSubject: 'static {
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
    /// Whether a PDO is mapped while it is valid, as makers do; CiA 301, 7.5.2.36 wants bit 31 of its COB-ID set first.
    const REMAPS_WHILE_VALID: bool = true;
    /// How long it takes from power on until it has booted and is ready, at the most.
    const BOOT_MS: u64 = 10;

    /// Has what was written kept over a power cycle. Here: time for the EEPROM to take it.
    fn store(bench: &mut Bench<Self>)
    where
        Self: Sized,
    {
        bench.run_ms(5);
    }
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

impl<S: BenchSubject> Default for Bench<S> {
    fn default() -> Self {
        Self::new()
    }
}

/// What holds for any drive. Panics where a test is wrong, and where a drive does not do what a helper takes for granted.
impl<S: BenchSubject> Bench<S> {
    /// A drive as delivered that has just booted.
    #[must_use]
    pub fn new() -> Self {
        Self::with(vec![Box::new(S::machine())])
    }

    /// These drives, the first of them at the subject's node, the others at those that follow; they have just booted.
    #[must_use]
    pub fn with(drives: Vec<Box<dyn VirtualDrive>>) -> Self {
        let mut world = World::new(S::BITRATE, 1);
        let host = world.add_probe();
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
        let host = world.add_probe();
        machine.set_power(true, world.now());
        let drive = world.add_station(machine);
        Self::booted(world, host, drive, true)
    }

    fn booted(world: World, host: StationId, drive: StationId, bare: bool) -> Self {
        let mut bench = Self { world, host, node: S::NODE, drive, bare, heard: Vec::new(), subject: PhantomData };
        bench.run_ms(S::BOOT_MS);
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

    /// Discards what was heard since the last call.
    pub fn forget(&mut self) -> &mut Self {
        self.heard_at();
        self
    }

    /// A frame's text in which `n` stands for the last digit of the node-ID.
    pub(crate) fn named(&self, text: &str) -> String {
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
}

/// The boot-up message of a drive that is switched on alone on a bus of this rate, if it can be heard.
pub fn boot_up_of(drive: impl VirtualDrive + 'static, bitrate: Bitrate) -> Option<String> {
    let mut world = World::new(bitrate, 1);
    let host = world.add_probe();
    world.add_drive(99, Box::new(drive)).expect("a free number");
    world.run_for(ANSWER_WITHIN);
    world.poll_received(host).map(|(_, frame)| frame.to_string())
}

/// The time of so many bits on the subject's bus.
fn bits<S: BenchSubject>(count: u64) -> Duration {
    Duration::from_nanos(count * S::BITRATE.bit_nanos())
}
