//! `ferrodrive restore`: a drive's own parameter memory, by its model's own command. `save` is a command of consoles too.

use canopen::NodeId;
use console::command::store::StoreReport;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use plot::Paint;
use words::node::node;

/// Restore a drive's parameters to their factory values
///
/// Everything that was set is lost, perhaps node-ID and bit rate too: keep a copy first.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ferrodrive --bus can0 params backup 4 -o before.toml\n  ferrodrive --bus can0 restore 4"
)]
pub(crate) struct Restore {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
}

impl Restore {
    /// Restores.
    pub(crate) async fn run(&self, context: &Context) -> Result<StoreReport, Failure> {
        let drive = context.drive_without_note(self.node).await?;
        drive.restore().await?;
        StoreReport::new(&drive, "restored to factory values", |storage| storage.restore)
    }
}

impl Report for StoreReport {
    fn text(&self, paint: Paint) -> String {
        Self::text(self, paint)
    }
}
