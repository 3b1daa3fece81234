//! The results of a boot-up.

use core::fmt;

use canopen::{NmtState, NodeId};

use super::error_status::ErrorStatus;
use super::step::{Step, Verdict};

/// The result of the boot-up of a network.
#[derive(Clone, Debug)]
pub struct BootReport {
    /// Each node, by its node-ID.
    pub nodes: Vec<NodeReport>,
    /// What else was noticed: of the network, not of a node.
    pub notes: Vec<String>,
}

/// The result of the boot-up of one node.
#[derive(Clone, Debug)]
pub struct NodeReport {
    /// The node.
    pub node: NodeId,
    /// Without it the network does not start.
    pub mandatory: bool,
    /// What was done and found, in that order.
    pub steps: Vec<Step>,
    /// The standard's error status; `None`: booted.
    pub status: Option<ErrorStatus>,
    /// The state that it is in by what it said last.
    pub state: Option<NmtState>,
}

impl BootReport {
    /// True unless a mandatory node has failed.
    pub fn is_whole(&self) -> bool {
        !self.nodes.iter().any(|node| node.mandatory && node.has_failed())
    }
}

impl NodeReport {
    /// Of a node with which nothing was done.
    pub(crate) const fn of_nothing(node: NodeId) -> Self {
        Self { node, mandatory: false, steps: Vec::new(), status: None, state: None }
    }

    /// True if its boot-up ended before its end.
    pub fn has_failed(&self) -> bool {
        self.status.is_some_and(ErrorStatus::is_failure)
    }

    /// The steps that did not go as expected.
    pub fn remarks(&self) -> impl Iterator<Item = &Step> {
        self.steps.iter().filter(|step| step.verdict != Verdict::Passed)
    }
}

/// `node 4: booted, operational`, and a line for each step that was not as expected.
impl fmt::Display for NodeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "node {}: ", self.node)?;
        match self.status {
            Some(status) => write!(f, "{status}")?,
            None => f.write_str("booted")?,
        }
        if let Some(state) = self.state.filter(|_| !self.has_failed()) {
            write!(f, "; it is {state}")?;
        }
        self.remarks().try_for_each(|step| write!(f, "\n  node {}: {step}", self.node))
    }
}
