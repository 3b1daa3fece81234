//! What the trace is told beside the frames: models, and the mappings of PDOs.

use canopen::NodeId;
use master::Drive;

use super::state::Host;
use super::work::Done;

impl Host {
    /// Puts what a node that was found says in its model's words, and reads how its PDOs are set up. Nothing is done with the
    /// answers: the trace learns from them as they pass, as it does when others ask.
    pub(super) fn learn_pdos(&mut self, id: NodeId) {
        let Some(node) = self.nodes.get(&id) else { return };
        if let Some(model) = node.drive.as_ref().and_then(Drive::description) {
            self.counter.trace.set_model(id, model);
        }
        if !self.learning.insert(id) {
            return;
        }
        let unknown = || Drive::of_unknown_model(self.network.node(id).with_timeout(self.setting.timeout));
        let drive = node.drive.clone().unwrap_or_else(unknown);
        self.work.push(Box::pin(async move {
            // A node without PDOs, or that is gone by now, has none to tell.
            let _ = drive.pdos().await;
            Done::Learned(id)
        }));
    }
}
