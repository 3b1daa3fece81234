//! What an FMU computes: a drive or a bus, moved by a few operations, each of which can be written down and done again.
//!
//! The state of a drive is its firmware, its physics and its memory; to write it down they are not taken apart. What was done to
//! a unit since its begin is its state: the same operations give the same unit to the last bit.

use std::path::Path;

use can::Instant;
use serde::{Deserialize, Serialize};

use crate::axis::AxisUnit;
use crate::bus::BusUnit;
use crate::config::{Config, ConfigError};
use crate::drive::DriveUnit;
use crate::operation::operations;
use crate::variable::{Reference, Terminal, Value, Variable};

/// One thing that is done to a unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Action {
    /// Writes a parameter or an input.
    Set(Reference, Value),
    /// Time begins.
    Begin,
    /// Hands operations to the network of this number.
    Receive(usize, Vec<u8>),
    /// Does what is due now.
    Serve,
    /// Reads what can be measured now, where that changed when something is next to be done.
    Look,
    /// Takes what the network of this number has to send.
    Take(usize),
    /// Lets time pass up to so many nanoseconds after the begin.
    Advance(u64),
}

/// A drive or a bus.
pub enum Unit {
    /// A drive.
    Drive(Box<DriveUnit>),
    /// A bus.
    Bus(Box<BusUnit>),
    /// A drive with its master.
    Axis(Box<AxisUnit>),
}

impl Unit {
    /// What the configuration describes, before time begins.
    ///
    /// # Errors
    /// What of it is not possible.
    pub fn new(config: &Config, resources: &Path) -> Result<Self, ConfigError> {
        Ok(match config {
            Config::Drive(drive) => Self::Drive(Box::new(DriveUnit::new(drive, resources)?)),
            Config::Bus(bus) => Self::Bus(Box::new(BusUnit::new(bus)?)),
            Config::Axis(axis) => Self::Axis(Box::new(AxisUnit::new(axis, resources)?)),
        })
    }

    /// Its variables, but for those of its terminals.
    pub fn variables(&self) -> Vec<Variable> {
        match self {
            Self::Drive(drive) => drive.variables(),
            Self::Bus(bus) => bus.variables(),
            Self::Axis(axis) => axis.variables(),
        }
    }

    /// Its networks.
    pub fn terminals(&self) -> Vec<Terminal> {
        match self {
            Self::Drive(_) => vec![DriveUnit::terminal()],
            Self::Bus(bus) => bus.terminals(),
            Self::Axis(_) => Vec::new(),
        }
    }

    /// Before outputs are read. True if that changed when it next does something: then it belongs to what was done to it.
    pub fn look(&mut self) -> bool {
        match self {
            Self::Drive(drive) => drive.look(),
            Self::Bus(_) => false,
            Self::Axis(axis) => axis.look(),
        }
    }

    /// The value of a variable; `None` without one of this reference.
    pub fn get(&mut self, reference: Reference) -> Option<Value> {
        match self {
            Self::Drive(drive) => drive.get(reference),
            Self::Bus(bus) => bus.get(reference),
            Self::Axis(axis) => axis.get(reference),
        }
    }

    /// Whether [`Action::Set`] of this value would be taken now; nothing changes.
    ///
    /// # Errors
    /// As of the action.
    pub fn check(&self, reference: Reference, value: &Value) -> Result<(), String> {
        match self {
            Self::Drive(drive) => drive.check(reference, value),
            Self::Bus(_) => BusUnit::check(reference, value),
            Self::Axis(axis) => axis.check(reference, value),
        }
    }

    /// Whether time may pass up to `to` in one step.
    ///
    /// # Errors
    /// The importer moves a joint, and it cannot be where it was said to be; or the step is too long for that.
    pub fn check_step(&mut self, to: Instant) -> Result<(), String> {
        match self {
            Self::Drive(drive) => drive.check_step(to),
            Self::Axis(axis) => axis.check_step(to),
            Self::Bus(_) => Ok(()),
        }
    }

    /// Whether it makes a difference in how many steps the same time passes: each step is an exchange with the importer's joint.
    pub(crate) fn counts_steps(&self) -> bool {
        match self {
            Self::Drive(drive) => drive.counts_steps(),
            Self::Axis(axis) => axis.counts_steps(),
            Self::Bus(_) => false,
        }
    }

    /// Does an action. Operations that are taken come back.
    ///
    /// # Errors
    /// A value that is not taken, a network that it does not have, a step as of [`check_step`](Self::check_step).
    pub fn act(&mut self, action: &Action) -> Result<Vec<u8>, String> {
        if let Action::Receive(place, _) | Action::Take(place) = action
            && *place >= self.terminals().len()
        {
            return Err(format!("it has no network {place}"));
        }
        match (self, action) {
            (Self::Drive(drive), Action::Set(reference, value)) => drive.set(*reference, value)?,
            (Self::Bus(bus), Action::Set(reference, value)) => bus.set(*reference, value)?,
            (Self::Axis(axis), Action::Set(reference, value)) => axis.set(*reference, value)?,
            (Self::Axis(axis), Action::Begin) => axis.begin()?,
            (Self::Axis(axis), Action::Advance(nanos)) => axis.advance(Instant::from_nanos(*nanos))?,
            (Self::Axis(axis), Action::Look) => {
                axis.look();
            }
            // It has no network.
            (Self::Axis(_), Action::Serve | Action::Receive(..) | Action::Take(_)) => {}
            (Self::Drive(drive), Action::Begin) => drive.begin()?,
            (Self::Bus(bus), Action::Begin) => bus.begin(),
            (Self::Drive(drive), Action::Receive(_, bytes)) => {
                operations(bytes).for_each(|operation| drive.receive(operation));
            }
            (Self::Bus(bus), Action::Receive(node, bytes)) => {
                operations(bytes).for_each(|operation| bus.receive(*node, operation));
            }
            (Self::Drive(drive), Action::Serve) => drive.serve(),
            (Self::Drive(drive), Action::Take(_)) => return Ok(drive.take_outbox()),
            (Self::Bus(bus), Action::Take(node)) => return Ok(bus.take_outbox(*node)),
            (Self::Drive(drive), Action::Advance(nanos)) => drive.advance(Instant::from_nanos(*nanos))?,
            (Self::Bus(bus), Action::Advance(nanos)) => bus.advance(Instant::from_nanos(*nanos)),
            (Self::Drive(drive), Action::Look) => {
                drive.look();
            }
            // A bus does all that is due when time passes.
            (Self::Bus(_), Action::Serve | Action::Look) => {}
        }
        Ok(Vec::new())
    }

    /// When it next wants to send or to do something.
    pub fn next_event(&self) -> Option<Instant> {
        match self {
            Self::Drive(drive) => drive.next_event(),
            Self::Bus(bus) => bus.next_event(),
            // Nothing leaves it.
            Self::Axis(_) => None,
        }
    }
}
