use std::collections::BTreeMap;

use canopen::NodeId;

use crate::identify::Model;

/// The description of each node whose model is known, or one that all models it may be read alike.
#[derive(Clone, Debug, Default)]
pub(super) struct NodeModels(pub(super) BTreeMap<u8, Model>);

impl NodeModels {
    pub(super) fn get(&self, node: NodeId) -> Option<Model> {
        self.0.get(&node.raw()).copied()
    }
}
