//! `ferrodrive save`: a drive's own parameter memory, by its model's own command.

use canopen::NodeId;
use devices::{ParameterStorage, Write};
use master::{Drive, Error};
use plot::Paint;
use serde::Serialize;
use words::node::node;

use crate::context::Context;
use crate::failure::Failure;

/// Store a drive's parameters in its own memory
///
/// Shows which object the model has for it, and which values take effect only after the next start. What a model stores
/// without being asked is on its page of the handbook.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ferrodrive --bus can0 save 4\n  ferrodrive --bus can0 params backup 4 -o wheel.toml    # a copy in a file"
)]
pub struct Save {
    /// Node-ID
    #[arg(value_parser = node)]
    pub(super) node: NodeId,
}

/// What was done.
#[derive(Debug, Serialize)]
pub struct StoreReport {
    node: u8,
    done: &'static str,
    object: String,
    effective_after_restart: Vec<Named>,
}

/// An object by number and name.
#[derive(Debug, Serialize)]
struct Named {
    object: String,
    name: Option<&'static str>,
}

impl Save {
    /// Stores; in a page its host has done that before.
    ///
    /// # Errors
    /// Those of the master.
    pub async fn run(&self, context: &Context) -> Result<StoreReport, Failure> {
        let drive = context.drive_without_note(self.node).await?;
        if context.in_control().is_none() {
            drive.save().await?;
        }
        StoreReport::new(&drive, "stored", |storage| storage.save)
    }
}

impl StoreReport {
    /// What was done to a drive by the object that `write` has of its model.
    ///
    /// # Errors
    /// The model is not known.
    pub fn new(
        drive: &Drive,
        done: &'static str,
        write: impl Fn(&ParameterStorage) -> Option<Write>,
    ) -> Result<Self, Failure> {
        let (node, intent) = (drive.node().id(), "show what was stored");
        let model = drive.description().ok_or(Error::UnknownModel { node, intent })?;
        let after_restart = model.storage.effective_after_restart.iter();
        let after_restart =
            after_restart.map(|mux| Named { object: mux.to_string(), name: model.row(*mux).map(|row| row.name) });
        let intent = "name the object";
        let object = write(&model.storage).or(model.storage.save).ok_or(Error::UnknownModel { node, intent })?.object;
        Ok(Self {
            node: node.raw(),
            done,
            object: object.to_string(),
            effective_after_restart: after_restart.collect(),
        })
    }

    /// As lines for people.
    pub fn text(&self, _: Paint) -> String {
        let named = |row: &Named| format!("{} {}", row.object, row.name.unwrap_or_default()).trim_end().to_owned();
        let objects: Vec<String> = self.effective_after_restart.iter().map(named).collect();
        let after = match objects.as_slice() {
            [] => String::new(),
            objects => format!("\n  after a restart only: {}", objects.join(", ")),
        };
        format!("node {}: parameters {} (through {}){after}", self.node, self.done, self.object)
    }
}
