//! `ferrodrive params backup` and `params diff` where there are no files: what a node has, and in what two nodes differ.

use canopen::NodeId;
use host::network::params::{BackupReport, DiffReport, Shown, diff_of_nodes, shown};
use plot::{Paint, Table};
use words::node::node;
use words::plain;

use crate::context::Context;
use crate::failure::Failure;

/// Show all parameters of a node's model, as a file of parameters has them (TOML)
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  ferrodrive params backup 4")]
pub struct ShowParameters {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
}

/// Show the differences between two nodes
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  ferrodrive params diff 4 5")]
pub struct DiffNodes {
    /// Node-ID
    #[arg(value_parser = node)]
    first: NodeId,
    /// Node-ID. What depends on it is compared as the first one's, and node-ID and bit rate are left out
    #[arg(value_parser = node)]
    second: NodeId,
}

impl ShowParameters {
    /// Reads them; what the node refuses to show is noted.
    ///
    /// # Errors
    /// The model is not known; those of SDO.
    pub async fn run(&self, context: &Context) -> Result<BackupReport, Failure> {
        let report = shown(&(), &context.known_drive(self.node).await?).await?;
        note_refused(&report, |note| context.shell.note(note));
        Ok(report)
    }
}

/// Notes what is not among the parameters.
pub fn note_refused(report: &BackupReport, note: impl Fn(&str)) {
    for refused in &report.refused {
        note(&format!("{} is not in the file: {}", refused.object, refused.why));
    }
}

impl DiffNodes {
    /// Reads both.
    ///
    /// # Errors
    /// See [`diff_of_nodes`].
    pub async fn run(&self, context: &Context) -> Result<DiffReport, Failure> {
        let first = context.drive(self.first).await?;
        Ok(diff_of_nodes(&first, &context.drive(self.second).await?).await?)
    }
}

/// What a node has, as lines for people: a file.
pub fn text_of_parameters(report: &BackupReport) -> &str {
    report.parameters.as_deref().unwrap_or_default().trim_end()
}

/// Differences as lines for people.
pub fn text_of_differences(report: &DiffReport, paint: Paint) -> String {
    let (first, second) = (plain(&report.first), plain(&report.second));
    if report.differences.is_empty() {
        return format!("{first} has the values of {second}");
    }
    let mut table = Table::new(&["object", "name", "first", "second"]);
    for row in &report.differences {
        let say = |shown: &Option<Shown>| shown.as_ref().map_or("-".to_owned(), |shown| plain(&shown.text));
        table.row([row.object.clone(), row.name.unwrap_or_default().to_owned(), say(&row.first), say(&row.second)]);
    }
    format!("first   {first}\nsecond  {second}\n\n{}", table.plain(paint))
}
