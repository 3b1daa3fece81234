//! Input of the trace besides frames: models, and the mappings of PDOs.

use canopen::NodeId;
use master::Drive;
use master::plan::NodeTraffic;

use crate::state::Host;
use crate::work::Done;

impl Host {
    /// Makes the trace decode a found node by its model, and reads the configuration of its PDOs. The trace learns from the
    /// answers as they pass, as it does from those to other clients; the analysis of the bus uses them, too.
    pub(crate) fn learn_pdos(&mut self, id: NodeId) {
        let Some(node) = self.nodes.get(&id) else { return };
        if let Some(model) = node.drive.as_ref().and_then(Drive::description) {
            self.inbox.trace.set_model(id, model);
        }
        // A mapping that changes while it is being read has to be read again.
        if let Some(again) = self.learning.get_mut(&id) {
            *again = true;
            return;
        }
        self.learning.insert(id, false);
        let drive = self.drive_or_unknown(id);
        self.work.push(Box::pin(async move {
            // A node without PDOs, or one that has disappeared, has none.
            Done::Learned(id, NodeTraffic::of(&drive).await.ok().map(Box::new))
        }));
    }

    /// They were read.
    pub(crate) fn conclude_learning(&mut self, id: NodeId, traffic: Option<Box<NodeTraffic>>) {
        if let Some(traffic) = traffic {
            self.traffic.insert(id, *traffic);
        }
        if self.learning.remove(&id) == Some(true) {
            self.learn_pdos(id);
        }
    }

    /// A node that was found, as far as it is known.
    pub(crate) fn drive_or_unknown(&self, id: NodeId) -> Drive {
        let known = self.nodes.get(&id).and_then(|node| node.drive.clone());
        known.unwrap_or_else(|| Drive::of_unknown_model(self.network.node(id).with_timeout(self.setting.timeout)))
    }
}
