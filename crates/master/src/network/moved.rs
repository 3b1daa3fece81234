use canopen::{Mux, NodeId};

use crate::core::NodeSet;

/// What this program has set in motion: axes, each by its node and the place of its controlword. Has room for one axis of each
/// node, so that a cycle allocates nothing.
#[derive(Clone, Debug)]
pub(super) struct Moved(Vec<(NodeId, Mux)>);

impl Default for Moved {
    fn default() -> Self {
        Self(Vec::with_capacity(usize::from(NodeId::MAX.raw())))
    }
}

impl Moved {
    pub(super) fn insert(&mut self, node: NodeId, controlword: Mux) {
        if !self.0.contains(&(node, controlword)) {
            self.0.push((node, controlword));
        }
    }

    pub(super) fn remove(&mut self, node: NodeId, controlword: Mux) {
        self.0.retain(|known| *known != (node, controlword));
    }

    pub(super) fn nodes(&self) -> NodeSet {
        self.0.iter().map(|(node, _)| *node).collect()
    }

    /// Ascending by node, then by place.
    pub(super) fn axes(&self) -> Vec<(NodeId, Mux)> {
        let mut axes = self.0.clone();
        axes.sort_unstable();
        axes
    }
}
