//! Why parameters were not written, and how the node stands now.

use std::fmt;

use canopen::{Mux, NodeId};
use cia402::PowerState;
use devices::AxisId;

use super::order::Purpose;
use super::undone::Undone;
use super::values::hex;
use crate::error::Error;
use crate::identify::Identity;
use crate::limits::Limits;

/// Why nothing can be written. Nothing was.
#[derive(Clone, Debug, thiserror::Error)]
pub enum PlanError {
    /// The node is another device.
    #[error("node {node} is not the device of these parameters: they are for {wanted}; its identity is {found}")]
    OtherDevice {
        /// The node.
        node: NodeId,
        /// The device that they are of.
        wanted: Identity,
        /// What the node says.
        found: Identity,
    },
    /// The drive is at work.
    #[error("axis {} of node {node} is in {}: parameters are written to a drive at rest only", axis.0 + 1, state.name())]
    AtWork {
        /// The node.
        node: NodeId,
        /// Which axis.
        axis: AxisId,
        /// Its state.
        state: PowerState,
    },
    /// Objects that cannot have their values.
    #[error("node {node} cannot have {}", all(unfit))]
    Unfit {
        /// The node.
        node: NodeId,
        /// Which, and why; one at least.
        unfit: Vec<Unfit>,
    },
    /// The node did not answer, or its model is a guess.
    #[error(transparent)]
    Node(#[from] Error),
}

/// An object that cannot have its value.
#[derive(Clone, Debug, thiserror::Error)]
pub enum Unfit {
    /// It cannot be read, so that it could not be put back.
    #[error("{object}: {cause}")]
    Unreadable {
        /// The object.
        object: Mux,
        /// What the node says.
        cause: Error,
    },
    /// It cannot be written, and has another value.
    #[error("{object} {name}: it can only be read, and has {}", hex(has))]
    ReadOnly {
        /// The object.
        object: Mux,
        /// Its name.
        name: &'static str,
        /// What it has.
        has: Vec<u8>,
    },
    /// The value has another length.
    #[error("{object}: {given} bytes are given, and it has {expected}")]
    Length {
        /// The object.
        object: Mux,
        /// Bytes that it has.
        expected: usize,
        /// Bytes of the value.
        given: usize,
    },
    /// The value is beyond its limits.
    #[error("{} {}: {asked} is beyond its limits, it takes {limits}", limits.object, limits.name)]
    OutOfLimits {
        /// What was asked for.
        asked: i64,
        /// What it takes, and why.
        limits: Box<Limits>,
    },
}

impl Unfit {
    /// The object that it is about.
    pub fn object(&self) -> Mux {
        match self {
            Self::Unreadable { object, .. } | Self::ReadOnly { object, .. } | Self::Length { object, .. } => *object,
            Self::OutOfLimits { limits, .. } => limits.object,
        }
    }
}

/// What went wrong at a step.
#[derive(Clone, Debug, thiserror::Error)]
pub enum Why {
    /// The node refused, or did not answer.
    #[error("{0}")]
    Failed(Error),
    /// It took a value of its communication and has another one.
    #[error("it was taken and reads back {}: the device does not take this setting", hex(found))]
    ReadsBack {
        /// What it has.
        found: Vec<u8>,
    },
}

/// A transaction that was broken off. What it wrote has been put back as far as [`undone`](Self::undone) says.
#[derive(Clone, Debug)]
pub struct ApplyError {
    /// The node.
    pub node: NodeId,
    /// Where it was broken off.
    pub object: Mux,
    /// The value that was to be written.
    pub value: Vec<u8>,
    /// What the write was for.
    pub purpose: Purpose,
    /// Which write it was, from 1.
    pub step: usize,
    /// How many there were to be.
    pub of: usize,
    /// What went wrong with it.
    pub why: Why,
    /// What the object takes now, where its model has that.
    pub limits: Option<Limits>,
    /// How the way back went.
    pub undone: Undone,
}

impl fmt::Display for ApplyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { node, object, purpose, step, of, why, .. } = self;
        write!(f, "node {node}: write {step} of {of}, {} to {object} ({purpose}), failed: {why}", hex(&self.value))?;
        if let Some(limits) = &self.limits {
            write!(f, ". {object} {} takes {limits}", limits.name)?;
        }
        write!(f, ". {}", self.undone)
    }
}

impl std::error::Error for ApplyError {}

fn all(unfit: &[Unfit]) -> String {
    unfit.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}
