//! A CAN bus between other people's nodes: arbitration, bit-exact length of frames, errors and bus-off as on our own wire.

use can::{Bitrate, Instant};
use sim::Prng;
use sim::fault::Corruption;
use sim::wire::{Bus, ControllerOptions, ErrorCause, ErrorState, Role, WireEvent};

use crate::config::{BusConfig, ConfigError, MAX_NODES, bitrate};
use crate::operation::{BusError, ErrorCode, LostFrame, NodeStatus, Operation};
use crate::variable::{Causality, Reference, Terminal, Value, Variable};

/// Frames of one node that the bus keeps until it is their turn.
const BUFFERED: usize = 64;

const SEED: Reference = 2;
const CORRUPTED: Reference = 3;
const FRAMES: Reference = 10;
const ERRORS: Reference = 11;
const LOAD: Reference = 12;
const OVERFLOWS: Reference = 13;
const TERMINALS: Reference = 1000;
/// Value references of one terminal.
const TERMINAL_SIZE: Reference = 5;

/// The wire, and a controller for each terminal.
#[derive(Clone)]
pub struct BusUnit {
    bus: Bus,
    bitrate: Bitrate,
    seed: u64,
    corrupted: f64,
    now: Instant,
    begin: Instant,
    nodes: Vec<BusNode>,
    overflows: u64,
}

/// What the bus knows of a node.
#[derive(Clone, Default)]
struct BusNode {
    lost: LostFrame,
    /// It has said that it takes no part.
    is_off: bool,
    /// It sends the frame that ends now.
    is_sending: bool,
    bitrate: Option<Bitrate>,
    outbox: Vec<u8>,
}

impl BusUnit {
    /// A bus that nothing has happened on.
    ///
    /// # Errors
    /// A number of nodes or a bit rate that cannot be.
    pub fn new(config: &BusConfig) -> Result<Self, ConfigError> {
        if !(2..=MAX_NODES).contains(&config.nodes) {
            return Err(ConfigError::Nodes(config.nodes));
        }
        let bitrate = bitrate(config.bitrate)?;
        Ok(Self {
            bus: Bus::new(bitrate, 0),
            bitrate,
            seed: 1,
            corrupted: 0.0,
            now: Instant::ZERO,
            begin: Instant::ZERO,
            nodes: vec![BusNode::default(); config.nodes.into()],
            overflows: 0,
        })
    }

    /// The networks of its nodes, `Node1` first.
    pub fn terminals(&self) -> Vec<Terminal> {
        let first = (TERMINALS..).step_by(TERMINAL_SIZE as usize);
        (1..=self.nodes.len()).zip(first).map(|(node, first)| Terminal::new(format!("Node{node}"), first)).collect()
    }

    /// Its variables, but for those of the terminals.
    pub fn variables(&self) -> Vec<Variable> {
        use Causality::{Output, Parameter};
        let corrupted = "probability that a frame is destroyed, 0 to 1";
        let mut rows = vec![
            Variable::new(SEED, "seed", Parameter, Value::UInt64(1), "decides which frames are destroyed"),
            Variable::new(CORRUPTED, "corrupted", Parameter, Value::Float64(0.0), corrupted),
            Variable::new(FRAMES, "frames", Output, Value::UInt64(0), "frames that got through"),
            Variable::new(ERRORS, "errors", Output, Value::UInt64(0), "attempts that failed"),
            Variable::new(LOAD, "load", Output, Value::Float64(0.0), "share of the time in which the bus was taken"),
            Variable::new(OVERFLOWS, "overflows", Output, Value::UInt64(0), "frames for which there was no buffer"),
        ];
        // One for each terminal: by the layered standard a variable belongs to one.
        rows.extend(self.terminals().iter().map(|terminal| {
            let name = format!("{}.BusNotifications", terminal.name);
            let what = "the node is notified of what becomes of its frames";
            Variable::new(terminal.notifications, &name, Output, Value::Boolean(true), what)
        }));
        rows
    }

    /// Reads a variable as of now.
    pub fn get(&self, reference: Reference) -> Option<Value> {
        let statistics = self.bus.statistics(self.now);
        Some(match reference {
            SEED => Value::UInt64(self.seed),
            CORRUPTED => Value::Float64(self.corrupted),
            FRAMES => Value::UInt64(statistics.frames),
            ERRORS => Value::UInt64(statistics.errors),
            LOAD => {
                let span = self.now.nanos_since(self.begin);
                Value::Float64(if span == 0 { 0.0 } else { statistics.busy_ns as f64 / span as f64 })
            }
            OVERFLOWS => Value::UInt64(self.overflows),
            TERMINALS.. if self.terminals().iter().any(|terminal| terminal.notifications == reference) => {
                Value::Boolean(true)
            }
            _ => return None,
        })
    }

    /// Whether [`set`](Self::set) would take it.
    ///
    /// # Errors
    /// As there.
    pub fn check(reference: Reference, value: &Value) -> Result<(), String> {
        match (reference, value) {
            (CORRUPTED, Value::Float64(share)) if !(0.0..=1.0).contains(share) => {
                Err(format!("corrupted is a probability, from 0 to 1, not {share}"))
            }
            _ => Ok(()),
        }
    }

    /// Writes a parameter.
    ///
    /// # Errors
    /// A probability that is not 0 to 1.
    pub fn set(&mut self, reference: Reference, value: &Value) -> Result<(), String> {
        Self::check(reference, value)?;
        match (reference, value) {
            (SEED, Value::UInt64(seed)) => self.seed = *seed,
            (CORRUPTED, Value::Float64(share)) => self.corrupted = *share,
            _ => {}
        }
        Ok(())
    }

    /// Time begins: every node is at the bus's bit rate until it says otherwise.
    pub fn begin(&mut self) {
        self.begin = self.now;
        // As a world of this seed has it.
        self.bus = Bus::new(self.bitrate, Prng::new(self.seed).next_u64());
        if self.corrupted > 0.0 {
            self.bus.set_corruption(Corruption::with_probability(self.corrupted));
        }
        for node in &mut self.nodes {
            let i = self.bus.add(ControllerOptions { mailboxes: BUFFERED });
            node.bitrate = Some(self.bitrate);
            self.bus.restart(i, node.bitrate, self.now);
        }
    }

    /// When a frame next ends, or there is something to deliver now. What starts now if no node offers anything else is
    /// counted as started.
    pub fn next_event(&self) -> Option<Instant> {
        if self.nodes.iter().any(|node| !node.outbox.is_empty()) {
            return Some(self.now);
        }
        let next = self.bus.next_event()?;
        if next > self.now {
            return Some(next);
        }
        let mut ahead = self.bus.clone();
        ahead.arbitrate(self.now);
        ahead.next_event().map(|at| at.max(self.now))
    }

    /// Lets time pass up to `to`. All that nodes offered at the present instant is in; frames that end at `to` are delivered, and
    /// what they leave room for starts when this is called again.
    pub fn advance(&mut self, to: Instant) {
        self.arbitrate();
        while let Some(at) = self.bus.next_event().filter(|at| *at <= to) {
            self.now = self.now.max(at);
            self.deliver();
            if self.now < to {
                self.arbitrate();
            } else {
                break;
            }
        }
        self.now = to;
    }

    /// Takes an operation of a node in.
    pub fn receive(&mut self, node: usize, operation: Result<Operation, &[u8]>) {
        match operation {
            Ok(Operation::Transmit(frame)) => {
                if self.bus.has_room(node) {
                    self.bus.offer(node, frame, self.now);
                } else {
                    self.overflows += 1;
                }
            }
            Ok(Operation::Baudrate(rate)) => match Bitrate::new(rate) {
                Some(rate) => {
                    self.nodes[node].bitrate = Some(rate);
                    self.restart(node);
                }
                None => self.refuse(node, &Operation::Baudrate(rate)),
            },
            Ok(Operation::ArbitrationLostBehavior(lost)) => self.nodes[node].lost = lost,
            Ok(Operation::Status(status)) => {
                let is_off = status == NodeStatus::BusOff;
                // Bus-off by errors is what the wire has counted as well, and ends by itself.
                let is_counted = self.bus.counters(node).state() == ErrorState::BusOff;
                if is_off != self.nodes[node].is_off && !(is_off && is_counted) {
                    self.nodes[node].is_off = is_off;
                    self.restart(node);
                }
            }
            Ok(Operation::Wakeup) => {
                for (_, other) in self.nodes.iter_mut().enumerate().filter(|(i, _)| *i != node) {
                    Operation::Wakeup.write(&mut other.outbox);
                }
            }
            Ok(_) => {}
            Err(bytes) => {
                let bytes = bytes[..bytes.len().min(usize::from(u16::MAX))].to_vec();
                Operation::FormatError(bytes).write(&mut self.nodes[node].outbox);
            }
        }
    }

    /// What there is for a node, once.
    pub fn take_outbox(&mut self, node: usize) -> Vec<u8> {
        std::mem::take(&mut self.nodes[node].outbox)
    }

    fn refuse(&mut self, node: usize, operation: &Operation) {
        let mut bytes = Vec::new();
        operation.write(&mut bytes);
        Operation::FormatError(bytes).write(&mut self.nodes[node].outbox);
    }

    fn restart(&mut self, node: usize) {
        let rate = self.nodes[node].bitrate.filter(|_| !self.nodes[node].is_off);
        if rate != self.bus.bitrate_of(node) {
            self.bus.restart(node, rate, self.now);
        }
    }

    /// Starts what can start now, and notifies those that lost and do not want their frame kept.
    fn arbitrate(&mut self) {
        self.bus.arbitrate(self.now);
        for (i, node) in self.nodes.iter_mut().enumerate().filter(|(_, node)| node.lost == LostFrame::Discard) {
            for frame in self.bus.withdraw(i) {
                Operation::ArbitrationLost(frame.id().raw()).write(&mut node.outbox);
            }
        }
    }

    /// Ends what is due now: who receives it, who is confirmed, who is notified of an error.
    fn deliver(&mut self) {
        for (i, node) in self.nodes.iter_mut().enumerate() {
            node.is_sending = self.bus.is_sending(i);
        }
        if let Some(passed) = self.bus.advance(self.now) {
            for (i, node) in self.nodes.iter_mut().enumerate() {
                match self.bus.conclude(i, &passed) {
                    Role::Transmitted(frame) => Operation::Confirm(frame.id().raw()).write(&mut node.outbox),
                    Role::Received => Operation::Transmit(passed.frame).write(&mut node.outbox),
                    Role::Nothing => {}
                }
            }
        }
        while let Some(event) = self.bus.poll_event() {
            let WireEvent::Error { source, frame, cause, .. } = event else { continue };
            for (i, node) in self.nodes.iter_mut().enumerate().filter(|(_, node)| !node.is_off) {
                let error = BusError {
                    id: frame.id().raw(),
                    code: code_of(cause),
                    // The wire does not say which receivers saw it first, and one node alone has this flag.
                    is_primary: i == source,
                    is_sender: i == source || node.is_sending,
                };
                Operation::BusError(error).write(&mut node.outbox);
            }
        }
    }
}

/// What a receiver makes of it.
const fn code_of(cause: ErrorCause) -> ErrorCode {
    match cause {
        ErrorCause::Disturbed | ErrorCause::Collision => ErrorCode::Bit,
        ErrorCause::NotAcknowledged => ErrorCode::Acknowledge,
        // Bits of another length, and a wire that falls silent in the middle, are six equal bits first.
        ErrorCause::BitRate | ErrorCause::Abandoned => ErrorCode::Stuff,
    }
}
