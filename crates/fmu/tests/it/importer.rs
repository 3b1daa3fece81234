//! An importer: nodes joined to a bus, stepped from event to event (FMI 3.0, 4.2; fmi-ls-bus, "Time-based Tx Clocks").

use can::{Frame, Instant};
use ferrodrive_fmu::config::{BusConfig, Config, DriveConfig, TxClock};
use ferrodrive_fmu::instance::{Instance, Interval};
use ferrodrive_fmu::operation::{Operation, operations};
use ferrodrive_fmu::variable::{Terminal, Value};

pub(crate) fn drive(spec: &str, clock: TxClock) -> Config {
    Config::Drive(DriveConfig { clock, ..DriveConfig::new(spec) })
}

/// The reference of a variable.
pub(crate) fn named(instance: &Instance, name: &str) -> u32 {
    instance.variables().iter().find(|it| it.name == name).unwrap_or_else(|| panic!("{name}")).reference
}

pub(crate) fn bus(nodes: u8, clock: TxClock) -> Config {
    Config::Bus(BusConfig { nodes, bitrate: 500_000, clock })
}

/// An instance in initialization mode, with event mode.
pub(crate) fn instance(config: Config) -> Instance {
    let mut instance = Instance::of(config, ".".as_ref(), true).unwrap();
    instance.enter_initialization(0.0).unwrap();
    instance
}

/// A node of the test's own: it sends frames at given instants and keeps what it receives.
pub(crate) struct Script {
    pub(crate) frames: Vec<(u64, Frame)>,
    pub(crate) heard: Vec<(u64, Frame)>,
}

/// Drives at the first terminals of a bus, a script at the last.
pub(crate) struct Importer {
    pub(crate) bus: Instance,
    pub(crate) drives: Vec<Instance>,
    pub(crate) script: Script,
    terminals: Vec<Terminal>,
    now_ns: u64,
}

const DRIVE: [u32; 4] = [1, 2, 3, 4];

impl Importer {
    pub(crate) fn new(specs: &[&str], frames: Vec<(u64, Frame)>) -> Self {
        Self::of(&specs.iter().map(|spec| DriveConfig::new(*spec)).collect::<Vec<_>>(), frames)
    }

    /// With the drives of these configurations, but for their clocks.
    pub(crate) fn of(configs: &[DriveConfig], frames: Vec<(u64, Frame)>) -> Self {
        let mut bus = instance(bus(configs.len() as u8 + 1, TxClock::Countdown));
        let drive = |config: &DriveConfig| Config::Drive(DriveConfig { clock: TxClock::Countdown, ..config.clone() });
        let mut drives: Vec<_> = configs.iter().map(|config| instance(drive(config))).collect();
        for drive in &mut drives {
            drive.set(5, Value::Boolean(true)).unwrap();
            drive.exit_initialization().unwrap();
        }
        bus.exit_initialization().unwrap();
        let terminals = (0..=configs.len()).map(|node| Terminal::new("", 1000 + 5 * node as u32)).collect();
        Self { bus, drives, script: Script { frames, heard: Vec::new() }, terminals, now_ns: 0 }
    }

    /// Lets time pass up to `until`, events there included.
    pub(crate) fn run(&mut self, until: Instant) {
        self.run_with(until, u64::MAX, |_, _| {});
    }

    /// The same in steps of at most `most_ns`; `model` is what else the importer steps, after the drives, by as many ns.
    pub(crate) fn run_with(&mut self, until: Instant, most_ns: u64, mut model: impl FnMut(&mut [Instance], u64)) {
        while self.now_ns < until.as_nanos() {
            let next = self.event().min(until.as_nanos()).min(self.now_ns.saturating_add(most_ns));
            let (from_s, to_s) = (self.now_ns as f64 / 1e9, next as f64 / 1e9);
            for instance in self.drives.iter_mut().chain([&mut self.bus]) {
                instance.enter_step().unwrap();
                instance.step(from_s, to_s - from_s).unwrap();
                instance.enter_event().unwrap();
            }
            model(&mut self.drives, next - self.now_ns);
            self.now_ns = next;
        }
    }

    /// All rounds of the event at this instant; when the next one is.
    fn event(&mut self) -> u64 {
        let [_, rx_data, tx_clock, tx_data] = DRIVE;
        loop {
            let mut next = u64::MAX;
            let mut has_ticked = false;
            let mut sent = vec![Vec::new(); self.terminals.len()];
            for (drive, sent) in self.drives.iter_mut().zip(&mut sent) {
                if due(drive, tx_clock, self.now_ns, &mut next) {
                    has_ticked = true;
                    *sent = binary(drive, tx_data);
                }
            }
            let due_frames = self.script.frames.iter().filter(|(at, _)| *at == self.now_ns);
            for (_, frame) in due_frames {
                Operation::Transmit(*frame).write(sent.last_mut().unwrap());
            }
            self.script.frames.retain(|(at, _)| *at > self.now_ns);
            next = self.script.frames.iter().map(|(at, _)| *at).fold(next, u64::min);
            let mut received = vec![Vec::new(); self.terminals.len()];
            for (terminal, received) in self.terminals.iter().zip(&mut received) {
                if due(&mut self.bus, terminal.tx_clock, self.now_ns, &mut next) {
                    has_ticked = true;
                    *received = binary(&mut self.bus, terminal.tx_data);
                }
            }
            if !has_ticked && sent.iter().all(Vec::is_empty) {
                return next;
            }
            for (terminal, sent) in self.terminals.iter().zip(sent) {
                self.bus.set(terminal.rx_data, Value::Binary(sent)).unwrap();
            }
            for operation in operations(received.last().unwrap()) {
                if let Ok(Operation::Transmit(frame)) = operation {
                    self.script.heard.push((self.now_ns, frame));
                }
            }
            for (drive, received) in self.drives.iter_mut().zip(received) {
                drive.set(rx_data, Value::Binary(received)).unwrap();
            }
            for instance in self.drives.iter_mut().chain([&mut self.bus]) {
                instance.update().unwrap();
            }
        }
    }
}

/// Has a clock tick that is due, and keeps the earliest of the others.
fn due(instance: &mut Instance, clock: u32, now_ns: u64, next: &mut u64) -> bool {
    let ticks = match instance.interval(clock).unwrap() {
        Interval::In(0) => true,
        Interval::In(nanos) => {
            *next = (*next).min(now_ns + nanos);
            false
        }
        Interval::NotKnown => false,
    };
    if ticks {
        instance.set_clock(clock, true).unwrap();
    }
    ticks
}

pub(crate) fn binary(instance: &mut Instance, reference: u32) -> Vec<u8> {
    match instance.get(reference).unwrap() {
        Value::Binary(bytes) => bytes,
        other => panic!("{other:?}"),
    }
}
