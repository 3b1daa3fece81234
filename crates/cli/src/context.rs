//! What a command has in its hands: the network, what is known of its nodes, and how long to wait.

use std::collections::BTreeMap;
use std::time::Duration;

use canopen::{Mux, NodeId};
use cia402::PowerCommand;
use master::drive::Drive;
use master::{Error, Network, Node};

use crate::args::Global;
use crate::failure::Failure;
use crate::models::{self, DriveProfile};
use crate::progress::Progress;

/// Time for a frame without an answer (NMT) to get onto the bus before a command ends.
const SETTLING_TIME: Duration = Duration::from_millis(50);

const CONTROLWORD: Mux = Mux::new(0x6040, 0);

/// See the [module](self).
pub(crate) struct Context {
    /// The bus as the master sees it.
    pub(crate) network: Network,
    /// Where to show what is going on.
    pub(crate) progress: Progress,
    timeout: Duration,
    models: BTreeMap<NodeId, &'static DriveProfile>,
}

impl Context {
    /// A context for `network`. `embedded` are the drives of an embedded bus; the command line may overrule them.
    pub(crate) fn new(
        global: &Global,
        network: Network,
        embedded: Option<&[(NodeId, &'static DriveProfile)]>,
        progress: Progress,
    ) -> Self {
        let known = embedded.unwrap_or_default().iter().chain(&global.models);
        let models = known.map(|(node, model)| (*node, *model)).collect();
        Self { network, progress, timeout: global.timeout, models }
    }

    /// A node, to be waited for as long as the command line says.
    pub(crate) fn node(&self, id: NodeId) -> Node {
        self.network.node(id).with_timeout(self.timeout)
    }

    /// Which model a node is as the command line or the embedded bus says.
    pub(crate) fn told_model(&self, id: NodeId) -> Option<&'static DriveProfile> {
        self.models.get(&id).copied()
    }

    /// Which model a node is: as the command line says, else as its identity and objects say, if they fit one model only.
    pub(crate) async fn model_of(&self, id: NodeId) -> Result<Option<&'static DriveProfile>, Failure> {
        if let Some(model) = self.told_model(id) {
            return Ok(Some(model));
        }
        let models = master::identify::models(&self.node(id)).await?;
        Ok(if let [model] = models[..] { Some(model) } else { None })
    }

    /// As [`model_of`](Self::model_of), for commands that cannot do without.
    pub(crate) async fn known_model_of(&self, id: NodeId) -> Result<&'static DriveProfile, Failure> {
        self.model_of(id).await?.ok_or_else(|| {
            Failure::new(format!("the model of node {id} is not known"))
                .because("its identity (1018h) and objects fit no model, or more than one")
                .next(format!("say which it is with --model {id}=MODEL, where MODEL is one of: {}", models::names()))
        })
    }

    /// Longest wait for each answer.
    pub(crate) fn timeout(&self) -> Duration {
        self.timeout
    }

    /// A drive of a known model.
    pub(crate) async fn known_drive(&self, id: NodeId) -> Result<Drive, Failure> {
        Ok(Drive::new(self.node(id), self.known_model_of(id).await?))
    }

    /// A drive, of a known model or not.
    pub(crate) async fn drive(&self, id: NodeId) -> Result<Drive, Failure> {
        let model = self.model_of(id).await?;
        Ok(model.map_or_else(|| Drive::of_unknown_model(self.node(id)), |model| Drive::new(self.node(id), model)))
    }

    /// Quick stop, whatever the node is doing.
    pub(crate) async fn quick_stop(&self, id: NodeId) -> Result<(), Error> {
        self.node(id).write(CONTROLWORD, PowerCommand::QuickStop.controlword().0).await
    }

    /// Lets frames out that nobody answers.
    pub(crate) async fn settle(&self) {
        self.network.sleep(SETTLING_TIME).await;
    }
}
