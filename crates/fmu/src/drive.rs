//! A drive as a node of another simulator's network: frames come and go as operations, torque and voltages as variables.

use std::path::Path;

use can::{Bitrate, Frame, Instant};
use sim::machine::{TimingMode, order};
use sim::wire::{BUS_OFF_SEQUENCES, ErrorCounters, ErrorState};
use sim::{Given, LoneShaft, Report, VirtualDrive, seeds};
use words::drive::DriveSpec;

use crate::config::{ConfigError, DriveConfig, bitrate};
use crate::joint;
use crate::operation::{BusError, NodeStatus, Operation};
use crate::surroundings::{Surroundings, measured};
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

/// A drive, its inputs and its controller.
#[derive(Clone)]
pub struct DriveUnit {
    spec: DriveSpec,
    drive: Box<dyn VirtualDrive>,
    /// Its shaft, where the importer moves it.
    shaft: Option<LoneShaft>,
    /// When the drive wants to be called, as of the last call.
    due: Option<Instant>,
    report: Report,
    /// When the report was taken, to be taken again when it is asked for later.
    looked_at: Option<Instant>,
    now: Instant,
    /// A deadline that stays in the past is not asked again before this.
    not_before: Instant,
    has_begun: bool,
    surroundings: Surroundings,
    /// The bus tells what becomes of a frame (`BusNotifications`).
    notified: bool,
    /// At the first start.
    first_rate: Bitrate,
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
        let first_rate = bitrate(config.bitrate)?;
        let ordered = order(spec.model, &spec.order(first_rate));
        let drive = ordered.map_err(|error| ConfigError::Drive(error.to_string()))?;
        let surroundings =
            Surroundings::of(&*drive, config.rule).map_err(|error| ConfigError::Drive(error.to_string()))?;
        let report = drive.report();
        Ok(Self {
            spec,
            drive,
            shaft: None,
            due: None,
            report,
            looked_at: None,
            now: Instant::ZERO,
            not_before: Instant::ZERO,
            has_begun: false,
            surroundings,
            notified: false,
            first_rate,
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
        let notified = "the bus confirms frames and tells of errors; false where nodes are joined directly";
        let (name, value) = ("CAN.BusNotifications", Value::Boolean(false));
        let mut rows = vec![Variable::new(NOTIFICATIONS, name, Causality::Parameter, value, notified)];
        rows.extend(self.surroundings.variables(&*self.drive, &self.report));
        rows
    }

    /// Reads a variable as of now.
    pub fn get(&mut self, reference: Reference) -> Option<Value> {
        match reference {
            NOTIFICATIONS => Some(Value::Boolean(self.notified)),
            joint::TORQUE if self.surroundings.joint.is_some() => {
                Some(Value::Float64(self.shaft.as_ref().map_or(0.0, LoneShaft::torque_nm)))
            }
            _ => match self.surroundings.get(reference, &self.report) {
                None => measured(reference, self.seen()),
                known => known,
            },
        }
    }

    /// Whether [`set`](Self::set) would take it.
    ///
    /// # Errors
    /// As there.
    pub fn check(&self, reference: Reference, value: &Value) -> Result<(), String> {
        self.surroundings.check((reference, value))
    }

    /// Writes a parameter or an input; an input acts from the present instant on.
    ///
    /// # Errors
    /// What the drive does not take.
    pub fn set(&mut self, reference: Reference, value: &Value) -> Result<(), String> {
        self.looked_at = None;
        if let (NOTIFICATIONS, Value::Boolean(notified)) = (reference, value) {
            self.notified = *notified;
        }
        self.settle();
        self.surroundings.set((reference, value), &mut *self.drive, self.has_begun, self.now)?;
        if self.has_begun {
            self.not_before = Instant::ZERO;
            self.after_call();
        }
        Ok(())
    }

    /// Time begins: the drive gets its power.
    ///
    /// # Errors
    /// Its shaft cannot be taken over, as is known before.
    pub fn begin(&mut self) -> Result<(), String> {
        (self.has_begun, self.looked_at) = (true, None);
        if self.spec.timing.unwrap_or(TimingMode::Device) == TimingMode::Device {
            let seed = seeds::timing_seed(self.surroundings.seed, self.spec.node.raw());
            self.drive.set_timing(TimingMode::Device, seed, self.now);
        }
        if self.surroundings.supply_on {
            self.drive.set_power(true, self.now);
        }
        if let Some(joint) = &mut self.surroundings.joint {
            let shaft = LoneShaft::couple(&mut *self.drive, joint.model(), self.now);
            let shaft = shaft.map_err(|error| error.to_string())?;
            joint.begin(shaft.next_period());
            self.shaft = Some(shaft);
        }
        // Before any frame, as the standard advises ("Configuration of Bus Simulation"): a bus may wait for the rates of all its nodes.
        Operation::Baudrate(self.first_rate.bits_per_second()).write(&mut self.outbox);
        // A controller without power takes no part.
        self.say_status(NodeStatus::BusOff);
        self.after_call();
        Ok(())
    }

    pub(crate) const fn counts_steps(&self) -> bool {
        self.surroundings.joint.is_some()
    }

    /// When it next has something to do.
    pub fn next_event(&self) -> Option<Instant> {
        if self.outbox.is_empty() { self.next_deadline() } else { Some(self.now) }
    }

    /// When it next has something to do but to send.
    fn next_deadline(&self) -> Option<Instant> {
        let next = self.back_at.into_iter().chain(self.due).min()?;
        Some(next.max(self.not_before).max(self.now))
    }

    /// Whether time may pass up to `to` in one step.
    ///
    /// # Errors
    /// The importer moves the joint, and it cannot be where it was said to be; or the step is too long for that.
    pub fn check_step(&self, to: Instant) -> Result<(), String> {
        let (Some(shaft), Some(joint)) = (&self.shaft, &self.surroundings.joint) else { return Ok(()) };
        let Some((dt, angle, velocity)) = joint.exchange(self.now, to) else { return Ok(()) };
        shaft.check_exchange(dt, Given::Motion(&angle, &velocity)).map_err(|error| error.to_string())
    }

    /// Lets time pass up to `to`: what is due before is done, what is due then is left to [`serve`](Self::serve).
    ///
    /// # Errors
    /// As of [`check_step`](Self::check_step); no time passes then.
    pub fn advance(&mut self, to: Instant) -> Result<(), String> {
        if let (Some(shaft), Some(joint)) = (&mut self.shaft, &self.surroundings.joint)
            && let Some((dt, angle, velocity)) = joint.exchange(self.now, to)
        {
            let begun = shaft.begin_exchange(dt, Given::Motion(&angle, &velocity));
            begun.map_err(|error| error.to_string())?;
        }
        while let Some(at) = self.next_deadline().filter(|at| *at < to) {
            self.now = at;
            self.serve();
        }
        self.now = to;
        self.settle();
        Ok(())
    }

    /// Brings a shaft that the importer moves up to now, before anything is let into the drive.
    fn settle(&mut self) {
        if let Some(shaft) = &mut self.shaft {
            shaft.settle(&mut *self.drive, self.now);
        }
    }

    /// Does what is due now; nothing if nothing is.
    pub fn serve(&mut self) {
        if self.next_deadline().is_none_or(|at| at > self.now) {
            return;
        }
        self.looked_at = None;
        self.settle();
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
        self.settle();
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
            self.settle();
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
            let Some(frame) = self.drive.poll_transmit() else { break };
            self.offer(frame);
        }
        self.due = self.drive.poll_timeout();
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
