use canopen::NodeId;

/// A set of node-IDs as 128 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NodeSet(u128);

impl NodeSet {
    /// No node.
    pub const EMPTY: Self = Self(0);
    /// All 127 nodes.
    pub const ALL: Self = Self(!0 << 1);

    /// Adds a node; one that is in the set already stays.
    pub const fn insert(&mut self, node: NodeId) {
        self.0 |= 1 << node.raw();
    }

    /// The same set with this node in it.
    #[must_use]
    pub const fn with(mut self, node: NodeId) -> Self {
        self.insert(node);
        self
    }

    /// Takes a node out; nothing happens if it is not in the set.
    pub const fn remove(&mut self, node: NodeId) {
        self.0 &= !(1 << node.raw());
    }

    /// True if the node is in the set.
    pub const fn contains(self, node: NodeId) -> bool {
        self.0 & 1 << node.raw() != 0
    }

    /// True if no node is in the set.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Number of nodes in the set.
    pub const fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// The smallest node-ID of the set.
    pub fn first(self) -> Option<NodeId> {
        NodeId::new(self.0.trailing_zeros() as u8)
    }

    /// The next node-ID of the set above this one, or from the smallest on.
    pub fn next_after(self, node: NodeId) -> Option<NodeId> {
        let above = Self(self.0 & !1 << node.raw());
        above.first().or_else(|| self.first())
    }

    /// All nodes, ascending.
    pub fn iter(self) -> impl Iterator<Item = NodeId> {
        let mut rest = self;
        core::iter::from_fn(move || {
            let node = rest.first()?;
            rest.remove(node);
            Some(node)
        })
    }
}

impl FromIterator<NodeId> for NodeSet {
    fn from_iter<I: IntoIterator<Item = NodeId>>(nodes: I) -> Self {
        let mut set = Self::EMPTY;
        nodes.into_iter().for_each(|node| set.insert(node));
        set
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_every_node_once() {
        let set: NodeSet = NodeId::all().collect();
        assert_eq!((set, set.len()), (NodeSet::ALL, 127));
        assert!(set.iter().eq(NodeId::all()));
        assert_eq!(NodeSet::EMPTY.first(), None);
        let two: NodeSet = [3, 127].into_iter().filter_map(NodeId::new).collect();
        let after = [1, 3, 126, 127].map(|raw| two.next_after(NodeId::new(raw).unwrap()).unwrap().raw());
        assert_eq!(after, [3, 127, 127, 3]);
        assert_eq!(NodeSet::EMPTY.next_after(NodeId::MAX), None);
    }
}
