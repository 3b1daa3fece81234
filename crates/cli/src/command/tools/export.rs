//! `ferrodrive export`: what is on a bus, in other programs' forms.

use std::path::PathBuf;

use canopen::NodeId;
use machine::dbc::{self, DbcNode, DbcPdo};
use master::Drive;
use serde::Serialize;
use words::counted;
use words::node::node;

use crate::command::configure::dcf::{keep, new_file};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;

/// Export the description of the bus for other programs
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 export dbc -o bus.dbc\n  \
    ferrodrive --bus sim:base.toml export dbc     # as delivered")]
pub(crate) struct Export {
    #[command(subcommand)]
    form: ExportForm,
}

#[derive(Debug, clap::Subcommand)]
enum ExportForm {
    Dbc(Dbc),
}

/// Write the messages of the bus as a DBC file: PDOs as they are mapped now, NMT, SYNC, EMCY and heartbeats
///
/// Reads the PDO parameters and mappings of each node by SDO (CiA 301, 1400h to 1BFFh) and writes nothing to it. Place,
/// sign, factor and unit of the signals come from the model's table; for a node of unknown model, from the standard as
/// far as it defines them.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 export dbc -o bus.dbc\n  \
    ferrodrive --bus can0 --model 4=zlac8030l export dbc 4 -o wheel.dbc\n  \
    ferrodrive --bus sim:base.toml export dbc     # as delivered")]
struct Dbc {
    /// Nodes (default: every node that answers)
    #[arg(value_name = "NODE", value_parser = node)]
    nodes: Vec<NodeId>,
    /// Write to this file and report what it has (default, and -: write to standard output)
    #[arg(long, short, value_name = "FILE.dbc", value_parser = dbc_path)]
    output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, requires = "output")]
    force: bool,
}

fn dbc_path(text: &str) -> Result<PathBuf, String> {
    if text == "-" || text.to_ascii_lowercase().ends_with(".dbc") {
        Ok(text.into())
    } else {
        Err("expected FILE.dbc, or - for standard output".into())
    }
}

/// A DBC file.
#[derive(Debug, Serialize)]
pub(crate) struct ExportReport {
    /// Where the file is; absent if it is [`dbc`](Self::dbc).
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    /// The file itself, if it was not written anywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    dbc: Option<String>,
    nodes: Vec<u8>,
    /// PDOs that are switched on.
    pdos: usize,
}

impl Report for ExportReport {
    fn text(&self, _: Paint) -> String {
        match (&self.dbc, &self.file) {
            (Some(dbc), _) => dbc.trim_end().to_owned(),
            (None, file) => {
                let (file, nodes) = (plain(file.as_deref().unwrap_or_default()), self.nodes.len());
                format!("{file}: {} of {}", counted(self.pdos, "PDO"), counted(nodes, "node"))
            }
        }
    }
}

impl Export {
    /// Reads what there is.
    pub(crate) async fn run(&self, context: &Context) -> Result<ExportReport, Failure> {
        let ExportForm::Dbc(dbc) = &self.form;
        let output = new_file(dbc.output.as_deref(), dbc.force)?;
        let mut ids = dbc.nodes.clone();
        if ids.is_empty() {
            let asked = |count| context.progress.count(format!("asked {count} of 127"));
            ids = context.network.scan(context.timeout(), asked).await.iter().map(|found| found.node).collect();
        }
        if ids.is_empty() {
            return Err(Failure::new("no node answers on the bus")
                .of_kind("no_node")
                .next("ferrodrive scan shows more"));
        }
        ids.sort_unstable();
        ids.dedup();
        let mut nodes = Vec::new();
        for id in ids {
            let drive = context.drive(id).await?;
            nodes.push(DbcNode { id, model: drive.description(), pdos: pdos_of(&drive).await? });
        }
        let pdos = nodes.iter().map(|node| node.pdos.len()).sum();
        let text = dbc::print(&nodes);
        let nodes = nodes.iter().map(|node| node.id.raw()).collect();
        let Some(path) = output else { return Ok(ExportReport { file: None, dbc: Some(text), nodes, pdos }) };
        keep(path, text.as_bytes(), dbc.force)?;
        Ok(ExportReport { file: Some(path.display().to_string()), dbc: None, nodes, pdos })
    }
}

/// The PDOs of a node that are switched on, with what they carry: RPDOs, then TPDOs. Those with identifiers of 29 bits are left out.
async fn pdos_of(drive: &Drive) -> Result<Vec<DbcPdo>, Failure> {
    let mut all = drive.pdos().await?;
    all.sort_by_key(|(config, _)| config.pdo);
    let pdos = all.into_iter().filter_map(|(config, cob_id)| {
        let id = cob_id.can_id().as_standard().filter(|_| cob_id.is_valid())?;
        Some(DbcPdo { pdo: config.pdo, id, map: config.map })
    });
    Ok(pdos.collect())
}
