//! `ferrodrive export`: what is on a bus, in other programs' forms.

use canopen::pdo::{Direction, MappingRecord, PdoId, PdoNumber};
use canopen::{CobId, Mux, NodeId};
use master::core::PdoMap;
use master::{Error, Node};
use serde::Serialize;
use testbench::dbc::{self, DbcNode, DbcPdo};
use testbench::models::Description;
use testbench::words::node::node;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use crate::paint::Paint;

/// Write what is on the bus in another program's form
#[derive(Debug, clap::Args)]
pub(crate) struct Export {
    #[command(subcommand)]
    form: Form,
}

#[derive(Debug, clap::Subcommand)]
enum Form {
    Dbc(Dbc),
}

/// The messages of the bus as a DBC file: PDOs as they are mapped now, NMT, SYNC, EMCY and heartbeats
///
/// Reads the PDO parameters and mappings of each node by SDO (CiA 301, 1400h to 1BFFh) and writes nothing. Signals have place,
/// sign, factor and unit by the model's table; of a node whose model is not known, as far as the standard tells.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 export dbc > bus.dbc\n  \
    ferrodrive --bus can0 --model 4=zlac8030l export dbc 4 > wheel.dbc\n  \
    ferrodrive --bus sim:base.toml export dbc     # the drives of a machine file, as they come")]
struct Dbc {
    /// Which nodes (default: everybody who answers)
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

/// PDOs that are looked for on a node whose model is not known: those of the predefined connection set.
const PREDEFINED: u16 = 4;

impl Export {
    /// Reads what there is.
    pub(crate) async fn run(&self, context: &Context) -> Result<ExportReport, Failure> {
        let Form::Dbc(dbc) = &self.form;
        let mut ids = dbc.nodes.clone();
        if ids.is_empty() {
            let asked = |count| context.progress.show(format!("asked {count} of 127"));
            ids = context.network.scan(context.timeout(), asked).await.iter().map(|found| found.node).collect();
        }
        if ids.is_empty() {
            return Err(Failure::new("nobody is on the bus").of_kind("nobody").next("ferrodrive scan says more"));
        }
        ids.sort_unstable();
        ids.dedup();
        let mut nodes = Vec::new();
        for id in ids {
            let model = context.drive(id).await?.description();
            nodes.push(DbcNode { id, model, pdos: read_pdos(&context.node(id), model).await? });
        }
        let pdos = nodes.iter().map(|node| node.pdos.len()).sum();
        Ok(ExportReport { dbc: dbc::print(&nodes), nodes: nodes.iter().map(|node| node.id.raw()).collect(), pdos })
    }
}

/// The PDOs of a node that are switched on, with what they carry.
async fn read_pdos(node: &Node, model: Option<&'static Description>) -> Result<Vec<DbcPdo>, Failure> {
    let mut pdos = Vec::new();
    for direction in [Direction::Rpdo, Direction::Tpdo] {
        for number in (1..=512).filter_map(PdoNumber::new) {
            let pdo = PdoId { direction, number };
            let exists = match model {
                Some(model) => model.row(Mux::new(pdo.parameter_index(), 1)).is_some(),
                None => number.position() < usize::from(PREDEFINED),
            };
            if exists && let Some(read) = read_pdo(node, pdo).await? {
                pdos.push(read);
            }
        }
    }
    Ok(pdos)
}

/// `None` for a PDO that is switched off, that there is not, or whose identifier has 29 bits.
async fn read_pdo(node: &Node, pdo: PdoId) -> Result<Option<DbcPdo>, Failure> {
    let cob_id = match node.read::<u32>(Mux::new(pdo.parameter_index(), 1)).await {
        Ok(raw) => CobId(raw),
        Err(Error::Aborted { .. }) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let Some(id) = cob_id.can_id().as_standard().filter(|_| cob_id.is_valid()) else { return Ok(None) };
    let count: u8 = match node.read(Mux::new(pdo.mapping_index(), 0)).await {
        Ok(count) => count,
        Err(Error::Aborted { .. }) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let mut records = Vec::new();
    for sub in 1..=count.min(canopen::pdo::MAX_OBJECTS as u8) {
        records.push(MappingRecord::from_raw(node.read(Mux::new(pdo.mapping_index(), sub)).await?));
    }
    Ok(Some(DbcPdo { pdo, id, map: PdoMap(records) }))
}
