//! What is under way with the parameters of drives, and how to go back.

use std::collections::{BTreeMap, BTreeSet};

use canopen::NodeId;
use canopen::pdo::PdoId;
use master::parameters::Parameters;
use serde_json::Value;

/// Transactions of one node that can be rolled back.
pub(super) const MOST_KEPT: usize = 20;

/// Why something was not done: a word for programs, and words for people.
pub(super) type Refusal = (&'static str, String);

/// Requests for objects that may be under way, of all pages together.
const MOST_UNDER_WAY: usize = 32;

/// What is under way, and what was.
#[derive(Debug, Default)]
pub(super) struct Transactions {
    /// Requests for values.
    pub(super) reading: usize,
    /// Nodes whose parameters are being written.
    pub(super) writing: BTreeSet<NodeId>,
    /// What the objects of each transaction had before it, oldest first.
    pub(super) before: BTreeMap<NodeId, Vec<Parameters>>,
    /// How often each node has stored its parameters.
    stored: BTreeMap<NodeId, u32>,
    /// How often PDOs of each node were set up.
    mapped: BTreeMap<NodeId, u32>,
}

impl Transactions {
    /// Counts a request for values; false if too many are under way.
    pub(super) const fn begin_reading(&mut self) -> bool {
        let is_free = self.reading < MOST_UNDER_WAY;
        if is_free {
            self.reading += 1;
        }
        is_free
    }

    /// A node has stored its parameters.
    pub(super) fn note_stored(&mut self, node: NodeId) {
        let stored = self.stored.entry(node).or_default();
        *stored = stored.saturating_add(1);
    }

    /// How often a node has stored its parameters since the studio began.
    pub(super) fn stored(&self, node: NodeId) -> u32 {
        self.stored.get(&node).copied().unwrap_or_default()
    }

    /// PDOs of a node were set up.
    pub(super) fn note_mapped(&mut self, node: NodeId) {
        let mapped = self.mapped.entry(node).or_default();
        *mapped = mapped.saturating_add(1);
    }

    /// How often PDOs of a node were set up since the studio began.
    pub(super) fn mapped(&self, node: NodeId) -> u32 {
        self.mapped.get(&node).copied().unwrap_or_default()
    }

    /// The transaction that is rolled back next is of PDOs alone.
    pub(super) fn last_was_of_pdos(&self, node: NodeId) -> bool {
        let last = self.before.get(&node).and_then(|before| before.last());
        last.is_some_and(|before| before.values.keys().all(|object| PdoId::of_object(object.index).is_some()))
    }

    /// Transactions of a node that can be rolled back.
    pub(super) fn can_roll_back(&self, node: NodeId) -> usize {
        self.before.get(&node).map_or(0, Vec::len)
    }

    /// Parameters of this node are being written.
    pub(super) fn is_writing(&self, node: NodeId) -> bool {
        self.writing.contains(&node)
    }
}

/// What a transaction is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// Values of parameters.
    Values,
    /// PDOs.
    Pdos,
    /// The way back from another.
    Back,
}

/// A transaction that has ended.
pub(super) struct Written {
    pub(super) node: NodeId,
    pub(super) outcome: Result<Value, Refusal>,
    /// What the objects had that may have others now.
    pub(super) before: Option<Parameters>,
    pub(super) change: Change,
}
