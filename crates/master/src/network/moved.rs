use canopen::{Mux, NodeId};
use devices::{AxisId, Description};

use crate::core::NodeSet;

/// An axis that this program has set in motion, and what is known of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MovedAxis {
    pub(crate) node: NodeId,
    /// The place of its controlword, which distinguishes the axes of a node.
    pub(crate) controlword: Mux,
    pub(crate) axis: AxisId,
    /// `None` where only the place of the controlword is known.
    pub(crate) description: Option<&'static Description>,
}

impl MovedAxis {
    const fn is(&self, node: NodeId, controlword: Mux) -> bool {
        self.node.raw() == node.raw()
            && self.controlword.index == controlword.index
            && self.controlword.sub_index == controlword.sub_index
    }
}

/// What this program has set in motion and not seen to stand since. Has room for one axis of each node, so that a cycle
/// allocates nothing.
#[derive(Clone, Debug)]
pub(super) struct Moved(Vec<MovedAxis>);

impl Default for Moved {
    fn default() -> Self {
        Self(Vec::with_capacity(usize::from(NodeId::MAX.raw())))
    }
}

impl Moved {
    /// Notes an axis, and returns its place; what is known of it stays known.
    pub(super) fn insert(&mut self, axis: &MovedAxis) -> usize {
        let place = self.0.iter().position(|known| known.is(axis.node, axis.controlword));
        match place.and_then(|place| self.0.get_mut(place)) {
            Some(known) if known.description.is_none() => *known = *axis,
            Some(_) => {}
            None => self.0.push(*axis),
        }
        place.unwrap_or(self.0.len() - 1)
    }

    /// The same for an axis of a known model that may still be where it was: no cycle looks through all of them.
    #[inline]
    pub(super) fn insert_at(&mut self, axis: &MovedAxis, place: usize) -> usize {
        let is_there = |known: &MovedAxis| known.is(axis.node, axis.controlword) && known.description.is_some();
        if self.0.get(place).is_some_and(is_there) { place } else { self.insert(axis) }
    }

    pub(super) fn remove(&mut self, node: NodeId, controlword: Mux) {
        self.0.retain(|known| !known.is(node, controlword));
    }

    pub(super) fn nodes(&self) -> NodeSet {
        self.0.iter().map(|axis| axis.node).collect()
    }

    /// Ascending by node, then by place.
    pub(super) fn axes(&self) -> Vec<MovedAxis> {
        let mut axes = self.0.clone();
        axes.sort_unstable_by_key(|axis| (axis.node, axis.controlword));
        axes
    }
}
