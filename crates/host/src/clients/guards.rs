//! Which drives are guarded for clients that share a network: each for as long as one of them is there that has moved it.

use std::collections::BTreeMap;

use canopen::NodeId;
use master::core::NodeSet;

/// See the [module](self).
#[derive(Debug, Default)]
pub(super) struct Guards {
    /// How many clients have asked for the guard of each.
    holders: BTreeMap<NodeId, u32>,
    /// The nodes whose guard is on.
    guarded: NodeSet,
}

impl Guards {
    /// A client is about to move these, and has not asked before: which of them have no guard yet.
    pub(super) fn take(&mut self, nodes: NodeSet) -> NodeSet {
        nodes.iter().for_each(|node| *self.holders.entry(node).or_default() += 1);
        nodes.iter().filter(|node| !self.guarded.contains(*node)).collect()
    }

    /// This one has its guard now.
    pub(super) const fn note(&mut self, node: NodeId) {
        self.guarded.insert(node);
    }

    /// A client has gone that had asked for these: those that no other client holds are given back.
    pub(super) fn give(&mut self, nodes: NodeSet) -> NodeSet {
        let mut free = NodeSet::EMPTY;
        for node in nodes.iter() {
            let Some(holders) = self.holders.get_mut(&node) else { continue };
            *holders -= 1;
            if *holders == 0 {
                self.holders.remove(&node);
                self.guarded.remove(node);
                free.insert(node);
            }
        }
        free
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(raw: &[u8]) -> NodeSet {
        raw.iter().map(|raw| NodeId::new(*raw).expect("a node-ID")).collect()
    }

    #[test]
    fn a_drive_is_guarded_until_the_last_client_has_gone_that_moved_it() {
        let mut guards = Guards::default();
        assert_eq!(guards.take(nodes(&[1, 4])), nodes(&[1, 4]));
        nodes(&[1, 4]).iter().for_each(|node| guards.note(node));
        assert_eq!(guards.take(nodes(&[4])), NodeSet::EMPTY, "it has one");
        assert_eq!(guards.give(nodes(&[1, 4])), nodes(&[1]), "another client moves 4");
        assert_eq!(guards.give(nodes(&[4])), nodes(&[4]));
        assert_eq!(guards.take(nodes(&[4])), nodes(&[4]), "anew");
        // A guard that could not be had is asked for by the next client, too.
        assert_eq!(guards.take(nodes(&[4])), nodes(&[4]));
        assert_eq!(guards.give(nodes(&[9])), NodeSet::EMPTY, "no client had asked");
    }
}
