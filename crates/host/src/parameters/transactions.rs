//! Reads and transactions of the parameters of drives under way, and the history for rollbacks.

use std::collections::{BTreeMap, BTreeSet};

use canopen::NodeId;
use canopen::pdo::PdoId;
use master::parameters::Parameters;
use serde_json::Value;

/// Most transactions of one node that can be rolled back.
const MOST_KEPT: usize = 20;

/// Why a command was refused: a word for programs, and a text for people.
pub(crate) type Refusal = (&'static str, String);

/// Most reads under way, of all pages together.
const MOST_UNDER_WAY: usize = 32;

/// Work under way, and its history.
#[derive(Debug, Default)]
pub(crate) struct Transactions {
    /// Reads under way.
    pub(crate) reading: usize,
    /// Nodes whose parameters are being written.
    pub(crate) writing: BTreeSet<NodeId>,
    /// The values before each transaction, oldest first.
    pub(crate) before: BTreeMap<NodeId, Vec<Parameters>>,
    /// How often each node has stored its parameters.
    stored: BTreeMap<NodeId, u32>,
    /// How often PDOs of each node were configured.
    mapped: BTreeMap<NodeId, u32>,
}

impl Transactions {
    /// Counts a read; false if too many are under way.
    pub(crate) const fn begin_reading(&mut self) -> bool {
        let is_free = self.reading < MOST_UNDER_WAY;
        if is_free {
            self.reading += 1;
        }
        is_free
    }

    /// Keeps the values before a transaction, for its rollback.
    pub(crate) fn keep(&mut self, node: NodeId, before: Parameters) {
        let kept = self.before.entry(node).or_default();
        if kept.len() == MOST_KEPT {
            kept.remove(0);
        }
        kept.push(before);
    }

    /// A node has stored its parameters.
    pub(crate) fn note_stored(&mut self, node: NodeId) {
        let stored = self.stored.entry(node).or_default();
        *stored = stored.saturating_add(1);
    }

    /// How often a node has stored its parameters since the studio started.
    pub(crate) fn stored(&self, node: NodeId) -> u32 {
        self.stored.get(&node).copied().unwrap_or_default()
    }

    /// PDOs of a node were configured.
    pub(crate) fn note_mapped(&mut self, node: NodeId) {
        let mapped = self.mapped.entry(node).or_default();
        *mapped = mapped.saturating_add(1);
    }

    /// How often PDOs of a node were configured since the studio started.
    pub(crate) fn mapped(&self, node: NodeId) -> u32 {
        self.mapped.get(&node).copied().unwrap_or_default()
    }

    /// The transaction that is rolled back next is about PDOs only.
    pub(crate) fn last_was_of_pdos(&self, node: NodeId) -> bool {
        let last = self.before.get(&node).and_then(|before| before.last());
        last.is_some_and(|before| before.values.keys().all(|object| PdoId::of_object(object.index).is_some()))
    }

    /// Transactions of a node that can be rolled back.
    pub(crate) fn can_roll_back(&self, node: NodeId) -> usize {
        self.before.get(&node).map_or(0, Vec::len)
    }

    /// Parameters of this node are being written.
    pub(crate) fn is_writing(&self, node: NodeId) -> bool {
        self.writing.contains(&node)
    }
}

/// The kind of a transaction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    /// Values of parameters.
    Values,
    /// PDOs.
    Pdos,
    /// The rollback of another.
    Back,
}

/// A transaction that has ended.
pub(crate) struct Written {
    pub(crate) node: NodeId,
    pub(crate) outcome: Result<Value, Refusal>,
    /// The values before, of objects that may have others now.
    pub(crate) before: Option<Parameters>,
    pub(crate) change: Change,
}
