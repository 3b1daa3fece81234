//! A described servo alone on a bench: a host that speaks SDO, PDO and SYNC to it, and a person at its switches.

use std::collections::VecDeque;

use can::{Bitrate, Frame, Instant, Station};
use canopen::od::{Entry, FREE_PLACES, RowFacts, Table};
use canopen::{AbortCode, Mux, NodeId};
use devices::Description;
use devices::servo::CIA402;
use devices::variant::Preset;
use sim::machine::{Order, OrderError, ServoMachine, servo};
use sim::{SwitchRange, VirtualDrive};

/// Increments in a turn of the motor, which are the position units as delivered.
pub const TURN: i64 = 131_072;

/// Between two looks at the drive, ns.
const STEP_NS: u64 = 500_000;

/// The standard's servo with some rows changed, for the life of the test.
pub fn changed(change: impl Fn(Entry) -> Entry) -> &'static Description {
    of_rows(CIA402.dictionary.rows().iter().map(|row| change(*row)).collect())
}

/// The standard's servo with these rows, for the life of the test.
pub fn of_rows(mut rows: Vec<Entry>) -> &'static Description {
    rows.sort_by_key(|row| row.mux().key());
    let rows: &'static [Entry] = rows.leak();
    let (facts, places) = (vec![RowFacts::NONE; rows.len()].leak(), vec![FREE_PLACES; rows.len()].leak());
    let table = Table::at_run_time(rows, facts, places).expect("no object twice");
    Box::leak(Box::new(Description { dictionary: Box::leak(Box::new(table)), ..CIA402 }))
}

pub struct Bench {
    pub machine: ServoMachine,
    pub now: Instant,
    /// What the drive has sent, SDO answers apart.
    pub sent: Vec<Frame>,
    answers: VecDeque<Frame>,
    node: u32,
}

impl Bench {
    /// The standard's own servo as node 5, switched on and operational.
    pub fn new() -> Self {
        Self::of(&CIA402)
    }

    pub fn of(description: &'static Description) -> Self {
        Self::ordered(description, &[]).unwrap()
    }

    /// One with values of its own: of its store, or of its maker.
    pub fn ordered(description: &'static Description, presets: &[Preset]) -> Result<Self, OrderError> {
        let node = NodeId::new(5).unwrap();
        let order = Order { presets: presets.to_vec(), ..Order::new(description, node, Bitrate::K500) };
        let machine = servo(description, &order)?;
        let mut bench = Self { machine, now: Instant::ZERO, sent: Vec::new(), answers: VecDeque::new(), node: 5 };
        bench.machine.set_power(true, bench.now);
        bench.run_ms(300);
        bench.frame("000#0105");
        Ok(bench)
    }

    pub fn frame(&mut self, text: &str) {
        let frame: Frame = text.parse().unwrap();
        self.machine.handle_frame(&frame, self.now);
        self.drain();
    }

    pub fn sync(&mut self) {
        self.frame("080#");
    }

    fn drain(&mut self) {
        while let Some(frame) = self.machine.poll_transmit() {
            self.machine.handle_transmitted(&frame, self.now);
            if frame.id().raw() == 0x580 + self.node { self.answers.push_back(frame) } else { self.sent.push(frame) }
        }
    }

    pub fn run_ms(&mut self, ms: u64) {
        self.run_until(ms, |_| false);
    }

    /// Runs until something is so, at most this long; how long it took, in ms.
    pub fn run_until(&mut self, ms: u64, mut so: impl FnMut(&mut Self) -> bool) -> Option<f64> {
        let begin = self.now;
        let end = self.now.plus_nanos(ms * 1_000_000);
        while self.now < end {
            self.now = self.now.plus_nanos(STEP_NS);
            self.machine.handle_timeout(self.now);
            self.drain();
            if so(self) {
                return Some(self.now.nanos_since(begin) as f64 * 1e-6);
            }
        }
        None
    }

    pub fn write(&mut self, index: u16, sub: u8, value: i64) -> Result<(), AbortCode> {
        let bits =
            self.machine.firmware().description().row(Mux::new(index, sub)).map_or(32, |row| row.data_type.bits());
        let bytes = (bits / 8).clamp(1, 4);
        let mut data = [0x23 | (4 - bytes) << 2, index as u8, (index >> 8) as u8, sub, 0, 0, 0, 0];
        data[4..8].copy_from_slice(&(value as u32).to_le_bytes());
        data[4 + usize::from(bytes)..].fill(0);
        let answer = self.request(data);
        if answer[0] == 0x60 { Ok(()) } else { Err(AbortCode(u32::from_le_bytes(answer[4..8].try_into().unwrap()))) }
    }

    pub fn read(&mut self, index: u16, sub: u8) -> i64 {
        self.try_read(index, sub).unwrap_or_else(|code| panic!("{index:04X}h:{sub:02X}: {code}"))
    }

    pub fn try_read(&mut self, index: u16, sub: u8) -> Result<i64, AbortCode> {
        let answer = self.request([0x40, index as u8, (index >> 8) as u8, sub, 0, 0, 0, 0]);
        let raw = u32::from_le_bytes(answer[4..8].try_into().unwrap());
        if answer[0] == 0x80 {
            return Err(AbortCode(raw));
        }
        let row = self.machine.firmware().description().row(Mux::new(index, sub)).expect("it has answered");
        Ok(row.data_type.value(raw))
    }

    /// SDO answers that nothing has looked at yet.
    pub fn take_answers(&mut self) -> Vec<String> {
        self.answers.drain(..).map(|frame| frame.to_string()).collect()
    }

    fn request(&mut self, data: [u8; 8]) -> [u8; 8] {
        self.answers.clear();
        let text: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
        self.frame(&format!("{:03X}#{text}", 0x600 + self.node));
        let answer = self.answers.pop_front().expect("the server answers at once");
        answer.data().try_into().unwrap()
    }

    /// Writes that all have to be taken.
    pub fn set(&mut self, objects: &[(u16, u8, i64)]) {
        for (index, sub, value) in objects {
            self.write(*index, *sub, *value).unwrap_or_else(|code| panic!("{index:04X}h:{sub:02X} = {value}: {code}"));
        }
    }

    pub fn control(&mut self, controlword: i64) {
        self.set(&[(0x6040, 0, controlword)]);
    }

    pub fn status(&mut self) -> u16 {
        self.read(0x6041, 0) as u16
    }

    pub fn has(&mut self, mask: u16) -> bool {
        self.status() & mask == mask
    }

    /// Into a mode, and to Operation enabled.
    pub fn enable(&mut self, mode: i64) {
        self.set(&[(0x6060, 0, mode), (0x6040, 0, 0x06), (0x6040, 0, 0x07), (0x6040, 0, 0x0F)]);
        self.run_ms(5);
        assert_eq!(self.status() & 0x6F, 0x27, "{:04X}", self.status());
        assert_eq!(self.read(0x6061, 0), mode);
    }

    /// Ties an input to a stretch of the position, in increments.
    pub fn switch(&mut self, input: &str, low: Option<i64>, high: Option<i64>) {
        let number = self.machine.inputs().iter().position(|name| *name == input).unwrap();
        self.machine.set_switch(number, SwitchRange { low, high }, self.now).unwrap();
    }

    pub fn position(&mut self) -> i64 {
        self.read(0x6064, 0)
    }

    /// Speed of the motor's shaft, r/min.
    pub fn rpm(&self) -> f64 {
        self.machine.report().velocity_rpm
    }

    /// EMCY messages sent so far, as their error codes.
    pub fn emcy(&self) -> Vec<u16> {
        let emcy = self.sent.iter().filter(|frame| frame.id().raw() == 0x80 + self.node);
        emcy.map(|frame| u16::from_le_bytes([frame.data()[0], frame.data()[1]])).collect()
    }
}
