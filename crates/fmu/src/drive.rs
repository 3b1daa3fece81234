//! A drive as a node of another simulator's network: frames come and go as operations, torque and voltages as variables.

use std::path::Path;

use can::{Bitrate, Frame, Instant};
use sim::machine::{TimingMode, order};
use sim::wire::{BUS_OFF_SEQUENCES, ErrorCounters, ErrorState};
use sim::{Brake, Report, VirtualDrive, seeds};
use words::drive::DriveSpec;

use crate::config::{ConfigError, DriveConfig, bitrate};
use crate::operation::{BusError, NodeStatus, Operation};
use crate::variable::{Causality, Reference, Terminal, Value, Variable};

/// Transmit mailboxes of its controller: as many frames wait for a bus that confirms them.
const MAILBOXES: usize = 3;
/// Bits of a sequence that a controller waits for that is bus-off.
const SEQUENCE_BITS: u64 = 11;
/// A drive that leaves its deadline in the past is asked again after this time.
const OVERDUE_RETRY_NS: u64 = 1_000;

const TERMINAL: Reference = 1;
/// The fifth of the terminal.
const NOTIFICATIONS: Reference = 5;
const SEED: Reference = 6;
const LOAD_TORQUE: Reference = 10;
const SUPPLY: Reference = 11;
const SUPPLY_ON: Reference = 12;
const INPUTS: Reference = 100;
const OUTPUTS: Reference = 200;
const LEVELS: Reference = 300;

/// The row of an output: reference, name, unit, what it is, and where it is in a report. What a drive does not have reads 0.
type OutputRow = (Reference, &'static str, &'static str, &'static str, fn(&Report) -> Value);

/// What is read of every drive.
const READ: [OutputRow; 15] = [
    (OUTPUTS, "angle", "rad", "angle of the motor shaft, many turns", |it| Value::Float64(it.shaft_angle_rad)),
    (OUTPUTS + 1, "velocity", "rad/s", "speed of the motor shaft", |it| {
        Value::Float64(it.velocity_rpm * std::f64::consts::PI / 30.0)
    }),
    (OUTPUTS + 2, "torque", "N.m", "torque of the motor on its rotor", |it| {
        Value::Float64(it.physics.as_ref().map_or(0.0, |physics| physics.motor_torque_nm))
    }),
    (OUTPUTS + 3, "load_angle", "rad", "angle of the load, behind a gear if there is one", |it| {
        Value::Float64(it.physics.as_ref().map_or(0.0, |physics| physics.load_angle_rad))
    }),
    (OUTPUTS + 4, "current", "A", "signed motor current", |it| Value::Float64(it.current_a)),
    (OUTPUTS + 5, "bus_voltage", "V", "voltage at the supply terminals", |it| Value::Float64(it.supply_v)),
    (OUTPUTS + 6, "winding_temperature", "degC", "true temperature of the winding", |it| {
        Value::Float64(it.physics.as_ref().map_or(0.0, |physics| physics.winding_c))
    }),
    (OUTPUTS + 7, "heat_sink_temperature", "degC", "true temperature of the power stage", |it| {
        Value::Float64(it.physics.as_ref().map_or(0.0, |physics| physics.heat_sink_c))
    }),
    (OUTPUTS + 8, "statusword", "", "6041h; 0 without power", |it| Value::UInt16(it.statusword.unwrap_or(0))),
    (OUTPUTS + 9, "error_code", "", "present fault in the drive's own numbering; 0 for none", |it| {
        Value::UInt32(it.error_code)
    }),
    (OUTPUTS + 10, "position", "", "actual position in the drive's counts", |it| Value::Int64(it.position)),
    (OUTPUTS + 11, "node_id", "", "node-ID in use", |it| Value::UInt8(it.node)),
    (OUTPUTS + 12, "powered", "", "there is enough voltage for the firmware", |it| Value::Boolean(it.powered)),
    (OUTPUTS + 13, "brake_engaged", "", "the holding brake holds the shaft", |it| {
        Value::Boolean(it.brake == Some(Brake::Engaged))
    }),
    (OUTPUTS + 14, "damaged", "", "something was destroyed", |it| Value::Boolean(it.damage.is_some())),
];

/// A drive, its inputs and its controller.
#[derive(Clone)]
pub struct DriveUnit {
    spec: DriveSpec,
    drive: Box<dyn VirtualDrive>,
    report: Report,
    /// When the report was taken, to be taken again when it is asked for later.
    looked_at: Option<Instant>,
    now: Instant,
    /// A deadline that stays in the past is not asked again before this.
    not_before: Instant,
    has_begun: bool,
    seed: u64,
    load_torque_nm: f64,
    supply_v: Option<f64>,
    supply_on: bool,
    inputs: Vec<bool>,
    /// The bus tells what becomes of a frame (`BusNotifications`).
    notified: bool,
    bitrate: Option<Bitrate>,
    counters: ErrorCounters,
    status: NodeStatus,
    /// When a controller that is bus-off takes part again.
    back_at: Option<Instant>,
    /// Frames that the bus has not confirmed.
    offered: Vec<Frame>,
    outbox: Vec<u8>,
}

impl DriveUnit {
    /// The drive without power.
    ///
    /// # Errors
    /// What of it is not known.
    pub fn new(config: &DriveConfig, resources: &Path) -> Result<Self, ConfigError> {
        let spec = config.spec(resources)?;
        let ordered = order(spec.model, &spec.order(bitrate(config.bitrate)?));
        let drive = ordered.map_err(|error| ConfigError::Drive(error.to_string()))?;
        let inputs = vec![false; drive.inputs().len()];
        let report = drive.report();
        Ok(Self {
            spec,
            drive,
            report,
            looked_at: None,
            now: Instant::ZERO,
            not_before: Instant::ZERO,
            has_begun: false,
            seed: 1,
            load_torque_nm: 0.0,
            supply_v: None,
            supply_on: true,
            inputs,
            notified: false,
            bitrate: None,
            counters: ErrorCounters::default(),
            status: NodeStatus::Active,
            back_at: None,
            offered: Vec::new(),
            outbox: Vec::new(),
        })
    }

    /// Its only network.
    pub fn terminal() -> Terminal {
        Terminal::new("CAN", TERMINAL)
    }

    /// Its variables, but for those of the terminal.
    pub fn variables(&self) -> Vec<Variable> {
        use Causality::{Input, Output, Parameter};
        let supply_v = self.report.physics.as_ref().map_or(0.0, |physics| physics.source_v);
        let mut rows = vec![
            Variable::new(
                NOTIFICATIONS,
                "CAN.BusNotifications",
                Parameter,
                Value::Boolean(false),
                "the bus confirms frames and tells of errors; false where nodes are joined directly",
            ),
            Variable::new(SEED, "seed", Parameter, Value::UInt64(1), "decides the jitter of the drive's own times"),
            Variable::new(
                LOAD_TORQUE,
                "load_torque",
                Input,
                Value::Float64(0.0),
                "torque of the load at the output shaft; positive opposes positive motion",
            )
            .in_unit("N.m"),
            Variable::new(
                SUPPLY,
                "supply_voltage",
                Input,
                Value::Float64(supply_v),
                "open-circuit voltage of the supply",
            )
            .in_unit("V"),
            Variable::new(SUPPLY_ON, "supply_on", Input, Value::Boolean(true), "the switch between supply and drive"),
        ];
        for (place, name) in (INPUTS..).zip(self.drive.inputs()) {
            rows.push(Variable::new(place, &format!("input.{name}"), Input, Value::Boolean(false), "digital input"));
        }
        for (reference, name, unit, what, read) in READ {
            rows.push(Variable::new(reference, name, Output, read(&self.report), what).in_unit(unit));
        }
        for (place, name) in (LEVELS..).zip(self.report.outputs.names) {
            rows.push(Variable::new(place, &format!("output.{name}"), Output, Value::Boolean(false), "digital output"));
        }
        rows
    }

    /// Reads a variable as of now.
    pub fn get(&mut self, reference: Reference) -> Option<Value> {
        let place = |base: Reference| reference.checked_sub(base).map(|place| place as usize);
        Some(match reference {
            NOTIFICATIONS => Value::Boolean(self.notified),
            SEED => Value::UInt64(self.seed),
            LOAD_TORQUE => Value::Float64(self.load_torque_nm),
            SUPPLY => {
                Value::Float64(self.supply_v.or(self.report.physics.as_ref().map(|it| it.source_v)).unwrap_or(0.0))
            }
            SUPPLY_ON => Value::Boolean(self.supply_on),
            LEVELS.. => Value::Boolean(self.seen().outputs.iter().nth(place(LEVELS)?)?.1),
            OUTPUTS.. => READ.get(place(OUTPUTS)?)?.4(self.seen()),
            INPUTS.. => Value::Boolean(*self.inputs.get(place(INPUTS)?)?),
            _ => return None,
        })
    }

    /// Writes a parameter or an input; an input acts from the present instant on.
    ///
    /// # Errors
    /// What the drive does not take.
    pub fn set(&mut self, reference: Reference, value: &Value) -> Result<(), String> {
        self.looked_at = None;
        match (reference, value) {
            (NOTIFICATIONS, Value::Boolean(notified)) => self.notified = *notified,
            (SEED, Value::UInt64(seed)) => self.seed = *seed,
            (LOAD_TORQUE, Value::Float64(torque_nm)) if *torque_nm != self.load_torque_nm => {
                self.drive.set_load_torque(*torque_nm, self.now).map_err(|refused| refused.to_string())?;
                self.load_torque_nm = *torque_nm;
            }
            (SUPPLY, Value::Float64(volt)) if Some(*volt) != self.supply_v => {
                self.drive.set_supply(*volt, self.now).map_err(|refused| refused.to_string())?;
                self.supply_v = Some(*volt);
            }
            (SUPPLY_ON, Value::Boolean(on)) if *on != self.supply_on => {
                self.supply_on = *on;
                if self.has_begun {
                    self.drive.set_power(*on, self.now);
                }
            }
            // What acts at once is seen at once.
            (INPUTS..OUTPUTS, Value::Boolean(level)) => {
                let input = (reference - INPUTS) as usize;
                let before = *self.inputs.get(input).ok_or("the drive has no such input")?;
                if before != *level {
                    self.drive.set_input(input, *level, self.now).map_err(|refused| refused.to_string())?;
                    self.inputs[input] = *level;
                }
            }
            _ => {}
        }
        if self.has_begun {
            self.not_before = Instant::ZERO;
            self.after_call();
        }
        Ok(())
    }

    /// Time begins: the drive gets its power.
    pub fn begin(&mut self) {
        (self.has_begun, self.looked_at) = (true, None);
        if self.spec.timing.unwrap_or(TimingMode::Device) == TimingMode::Device {
            let seed = seeds::timing_seed(self.seed, self.spec.node.raw());
            self.drive.set_timing(TimingMode::Device, seed, self.now);
        }
        if self.supply_on {
            self.drive.set_power(true, self.now);
        }
        // A controller without power takes no part.
        self.say_status(NodeStatus::BusOff);
        self.after_call();
    }

    /// When it next has something to do.
    pub fn next_event(&self) -> Option<Instant> {
        if self.outbox.is_empty() { self.next_deadline() } else { Some(self.now) }
    }

    /// When it next has something to do but to send.
    fn next_deadline(&self) -> Option<Instant> {
        let next = self.back_at.into_iter().chain(self.drive.poll_timeout()).min()?;
        Some(next.max(self.not_before).max(self.now))
    }

    /// Lets time pass up to `to`: what is due before is done, what is due then is left to [`serve`](Self::serve).
    pub fn advance(&mut self, to: Instant) {
        while let Some(at) = self.next_deadline().filter(|at| *at < to) {
            self.now = at;
            self.serve();
        }
        self.now = to;
    }

    /// Does what is due now; nothing if nothing is.
    pub fn serve(&mut self) {
        if self.next_deadline().is_none_or(|at| at > self.now) {
            return;
        }
        self.looked_at = None;
        if self.back_at.is_some_and(|at| at <= self.now) {
            self.back_at = None;
            self.counters = ErrorCounters::default();
            self.say_status(NodeStatus::Active);
            self.drive.handle_bus_off(false, self.now);
        }
        self.drive.handle_timeout(self.now);
        self.after_call();
        // As in a world: a drive that leaves its deadline in the past cannot hold the time.
        if self.next_deadline() == Some(self.now) {
            self.not_before = self.now.plus_nanos(OVERDUE_RETRY_NS);
        }
    }

    /// Takes operations in.
    pub fn receive(&mut self, operation: Result<Operation, &[u8]>) {
        let now = self.now;
        (self.not_before, self.looked_at) = (Instant::ZERO, None);
        match operation {
            Ok(Operation::Transmit(frame)) if self.is_on_bus() => {
                self.counters.receive_success();
                self.say_counted();
                if !self.drive.ignores(&frame) {
                    self.drive.handle_frame(&frame, now);
                }
            }
            Ok(Operation::Confirm(id)) if self.notified => {
                if let Some(frame) = self.take_offered(id) {
                    self.counters.transmit_success();
                    self.say_counted();
                    self.drive.handle_transmitted(&frame, now);
                }
            }
            Ok(Operation::ArbitrationLost(id)) if self.notified => {
                if let Some(frame) = self.take_offered(id) {
                    self.offer(frame);
                }
            }
            Ok(Operation::BusError(error)) if self.notified => self.count(error),
            Err(bytes) => {
                let bytes = bytes[..bytes.len().min(usize::from(u16::MAX))].to_vec();
                Operation::FormatError(bytes).write(&mut self.outbox);
            }
            // Statuses and settings of others, and what it does not wait for, concern it not.
            Ok(_) => {}
        }
        self.after_call();
    }

    /// What it has to send, once.
    pub fn take_outbox(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outbox)
    }

    /// Looks at it now. True if that changed what it sends or when it next does something.
    pub fn look(&mut self) -> bool {
        let before = (self.outbox.len(), self.next_deadline());
        self.seen();
        before != (self.outbox.len(), self.next_deadline())
    }

    /// What can be measured now.
    fn seen(&mut self) -> &Report {
        if self.looked_at != Some(self.now) && self.has_begun {
            self.looked_at = Some(self.now);
            self.drive.advance(self.now);
            self.report = self.drive.report();
            // It may have finished booting in this period: that is seen now, and not at its next deadline.
            self.after_call();
        }
        &self.report
    }

    fn is_on_bus(&self) -> bool {
        self.bitrate.is_some() && self.status != NodeStatus::BusOff
    }

    fn take_offered(&mut self, id: u32) -> Option<Frame> {
        let place = self.offered.iter().position(|frame| frame.id().raw() == id)?;
        Some(self.offered.remove(place))
    }

    /// After any call into the drive: its bit rate, and its frames as far as there is room.
    fn after_call(&mut self) {
        let bitrate = self.drive.bitrate();
        if bitrate != self.bitrate {
            self.bitrate = bitrate;
            self.counters = ErrorCounters::default();
            self.offered.clear();
            self.back_at = None;
            match bitrate {
                None => self.say_status(NodeStatus::BusOff),
                Some(rate) => {
                    Operation::Baudrate(rate.bits_per_second()).write(&mut self.outbox);
                    self.say_status(NodeStatus::Active);
                }
            }
        }
        while self.is_on_bus() && self.offered.len() < MAILBOXES {
            let Some(frame) = self.drive.poll_transmit() else { return };
            self.offer(frame);
        }
    }

    fn offer(&mut self, frame: Frame) {
        Operation::Transmit(frame).write(&mut self.outbox);
        if self.notified {
            self.offered.push(frame);
        } else {
            self.drive.handle_transmitted(&frame, self.now);
        }
    }

    /// Fault confinement: what an error does to its counters, and what it says of that.
    fn count(&mut self, error: BusError) {
        match (error.is_sender, error.is_primary, error.code) {
            (true, _, crate::operation::ErrorCode::Acknowledge) => self.counters.acknowledge_error(),
            (true, ..) => self.counters.transmit_error(),
            (false, true, _) => self.counters.first_receive_error(),
            (false, false, _) => self.counters.receive_error(),
        }
        if self.counters.state() == ErrorState::BusOff && self.status != NodeStatus::BusOff {
            let bit_ns = self.bitrate.map_or(0, Bitrate::bit_nanos);
            self.back_at = Some(self.now.plus_nanos(u64::from(BUS_OFF_SEQUENCES) * SEQUENCE_BITS * bit_ns));
            self.offered.clear();
            self.drive.handle_bus_off(true, self.now);
        }
        self.say_counted();
    }

    /// Says the status that belongs to the counters, if it is another one.
    fn say_counted(&mut self) {
        self.say_status(match self.counters.state() {
            ErrorState::ErrorActive => NodeStatus::Active,
            ErrorState::ErrorPassive => NodeStatus::Passive,
            ErrorState::BusOff => NodeStatus::BusOff,
        });
    }

    fn say_status(&mut self, status: NodeStatus) {
        if status != self.status {
            self.status = status;
            Operation::Status(status).write(&mut self.outbox);
        }
    }
}
