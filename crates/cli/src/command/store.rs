//! `ferrodrive save` and `restore`: a drive's own parameter memory, by its model's own commands.

use canopen::{Mux, NodeId};
use serde::Serialize;

use crate::context::Context;
use crate::failure::Failure;
use crate::models::DriveProfile;
use crate::output::Report;
use crate::paint::Paint;
use crate::parse::node::node;

/// Store a drive's parameters in its own memory
#[derive(Debug, clap::Args)]
pub(crate) struct Save {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
}

/// Put a drive's parameters back to their factory values
#[derive(Debug, clap::Args)]
pub(crate) struct Restore {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
}

/// What was done.
#[derive(Debug, Serialize)]
pub(crate) struct StoreReport {
    node: u8,
    done: &'static str,
    object: String,
    effective_after_restart: Vec<String>,
}

impl Save {
    /// Stores.
    pub(crate) async fn run(&self, context: &Context) -> Result<StoreReport, Failure> {
        let drive = context.known_drive(self.node).await?;
        drive.save().await?;
        let model = context.known_model_of(self.node).await?;
        Ok(StoreReport::new(self.node, "stored", model.storage.save.object, model))
    }
}

impl Restore {
    /// Restores.
    pub(crate) async fn run(&self, context: &Context) -> Result<StoreReport, Failure> {
        let drive = context.known_drive(self.node).await?;
        drive.restore().await?;
        let model = context.known_model_of(self.node).await?;
        // It has been restored: the model has the command.
        let object = model.storage.restore.map_or(model.storage.save.object, |restore| restore.object);
        Ok(StoreReport::new(self.node, "restored to factory values", object, model))
    }
}

impl StoreReport {
    fn new(node: NodeId, done: &'static str, object: Mux, model: &DriveProfile) -> Self {
        let after_restart = model.storage.effective_after_restart.iter().map(|mux| match model.table.find(*mux) {
            Ok(slot) => format!("{mux} {}", model.table.row(slot).name),
            Err(_) => mux.to_string(),
        });
        Self { node: node.raw(), done, object: object.to_string(), effective_after_restart: after_restart.collect() }
    }
}

impl Report for StoreReport {
    fn text(&self, _: Paint) -> String {
        let after = match self.effective_after_restart.as_slice() {
            [] => String::new(),
            objects => format!("\n  after a restart only: {}", objects.join(", ")),
        };
        format!("node {}: parameters {} (through {}){after}", self.node, self.done, self.object)
    }
}
