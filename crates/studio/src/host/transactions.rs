//! What is under way with the parameters of drives, and how to go back.

use std::collections::{BTreeMap, BTreeSet};

use canopen::NodeId;
use master::parameters::Parameters;
use serde_json::Value;

/// Transactions of one node that can be rolled back.
pub(super) const MOST_KEPT: usize = 20;

/// Why something was not done: a word for programs, and words for people.
pub(super) type Refusal = (&'static str, String);

/// What is under way, and what was.
#[derive(Debug, Default)]
pub(super) struct Transactions {
    /// Requests for values.
    pub(super) reading: usize,
    /// Nodes whose parameters are being written.
    pub(super) writing: BTreeSet<NodeId>,
    /// What the objects of each transaction had before it, oldest first.
    pub(super) before: BTreeMap<NodeId, Vec<Parameters>>,
}

impl Transactions {
    /// Parameters of this node are being written.
    pub(super) fn is_writing(&self, node: NodeId) -> bool {
        self.writing.contains(&node)
    }
}

/// A transaction that has ended.
pub(super) struct Written {
    pub(super) node: NodeId,
    pub(super) outcome: Result<Value, Refusal>,
    /// What the objects had that may have others now.
    pub(super) before: Option<Parameters>,
    /// It was a way back.
    pub(super) is_back: bool,
}
