//! `ferrodrive export`: what is on a bus, in other programs' forms.

use canopen::NodeId;
use master::Drive;
use serde::Serialize;
use testbench::dbc::{self, DbcNode, DbcPdo};
use testbench::words::node::node;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use plot::Paint;

/// Export the description of the bus for other programs
#[derive(Debug, clap::Args)]
pub(crate) struct Export {
    #[command(subcommand)]
    form: Form,
}

#[derive(Debug, clap::Subcommand)]
enum Form {
    Dbc(Dbc),
}

/// Write the messages of the bus as a DBC file: PDOs as they are mapped now, NMT, SYNC, EMCY and heartbeats
///
/// Reads the PDO parameters and mappings of each node by SDO (CiA 301, 1400h to 1BFFh) and writes nothing to it. Place,
/// sign, factor and unit of the signals come from the model's table; for a node of unknown model, from the standard as
/// far as it defines them.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 export dbc > bus.dbc\n  \
    ferrodrive --bus can0 --model 4=zlac8030l export dbc 4 > wheel.dbc\n  \
    ferrodrive --bus sim:base.toml export dbc     # the drives of a machine file, as delivered")]
struct Dbc {
    /// Nodes (default: every node that answers)
    #[arg(value_name = "NODE", value_parser = node)]
    nodes: Vec<NodeId>,
}

/// A DBC file.
#[derive(Debug, Serialize)]
pub(crate) struct ExportReport {
    dbc: String,
    nodes: Vec<u8>,
    /// PDOs that are switched on.
    pdos: usize,
}

impl Report for ExportReport {
    fn text(&self, _: Paint) -> String {
        self.dbc.trim_end().to_owned()
    }
}

impl Export {
    /// Reads what there is.
    pub(crate) async fn run(&self, context: &Context) -> Result<ExportReport, Failure> {
        let Form::Dbc(dbc) = &self.form;
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
        Ok(ExportReport { dbc: dbc::print(&nodes), nodes: nodes.iter().map(|node| node.id.raw()).collect(), pdos })
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
