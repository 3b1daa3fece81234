//! Who moves an axis: one group, or one base, at a time. Two that wrote the same RPDO would pull the shaft to and fro.

use canopen::{Mux, NodeId};

use super::handle::Network;

/// An axis that cannot be claimed again until this is dropped.
#[derive(Debug)]
pub(crate) struct Claim {
    network: Network,
    axis: (NodeId, Mux),
}

impl Network {
    /// Claims the axis with this controlword; `None` where it is claimed already.
    pub(crate) fn claim(&self, node: NodeId, controlword: Mux) -> Option<Claim> {
        let axis = (node, controlword);
        self.lock().claims.insert(axis).then(|| Claim { network: self.clone(), axis })
    }

    /// True while the axis with this controlword is claimed.
    pub(crate) fn is_claimed(&self, node: NodeId, controlword: Mux) -> bool {
        self.lock().claims.contains(&(node, controlword))
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        self.network.lock().claims.remove(&self.axis);
    }
}
