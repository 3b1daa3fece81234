//! `ferrodrive pdo show`: how the PDOs of a node are set up (CiA 301, clauses 7.5.2.35 to 7.5.2.38), and why one stays away.

use std::time::Duration;

use canopen::pdo::EventTrigger;
use canopen::{CobId, NodeId};
use host::network::pdos::PdoSetup;
use master::Drive;
use master::explain::Overheard;
use master::pdo::{PdoConfig, Silence, Situation, why_silent};
use plot::{Paint, Table};
use serde::Serialize;
use words::node::node;

use crate::context::Context;
use crate::failure::Failure;

/// The identifier of SYNC as delivered (CiA 301, 7.3.5).
const SYNC: CobId = CobId(0x80);

/// Time to listen to others: no machine has slower cycles than this.
const LISTENED: Duration = Duration::from_millis(300);

/// Show identifier, transmission type, timers and mapping of each PDO, and why one is silent
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive pdo show 4\n  ferrodrive --bus can0 pdo show")]
pub struct ShowPdos {
    /// Node-IDs (default: every node on the bus)
    #[arg(value_parser = node)]
    nodes: Vec<NodeId>,
}

/// How the PDOs of nodes are configured.
#[derive(Debug, Serialize)]
pub struct PdoList {
    nodes: Vec<OfNode>,
}

#[derive(Debug, Serialize)]
struct OfNode {
    node: u8,
    pdos: Vec<PdoSetup>,
}

impl ShowPdos {
    /// Asks the nodes.
    ///
    /// # Errors
    /// No node answers; those of SDO.
    pub async fn run(&self, context: &Context) -> Result<PdoList, Failure> {
        let mut nodes = self.nodes.clone();
        if nodes.is_empty() {
            let asked = |count| context.show(format!("asked {count} of 127"));
            nodes.extend(context.network.scan(context.timeout(), asked).await.iter().map(|found| found.node));
        }
        let heard = context.shell.overhear(LISTENED).await;
        let mut list = Vec::new();
        for node in nodes {
            context.show(format!("node {node}: reading its PDOs"));
            let drive = context.drive(node).await?;
            let row = |(config, cob_id): &(PdoConfig, CobId)| {
                PdoSetup::new(drive.description(), config, *cob_id, &why(context, &heard, &drive, (config, *cob_id)))
            };
            list.push(OfNode { node: node.raw(), pdos: drive.pdos().await?.iter().map(row).collect() });
        }
        if list.is_empty() {
            return Err(Failure::new("no node answers on the bus").of_kind("no_node").next("ferrodrive scan"));
        }
        Ok(PdoList { nodes: list })
    }
}

/// What keeps a PDO of a node away.
fn why(context: &Context, heard: &Overheard, drive: &Drive, (config, cob_id): (&PdoConfig, CobId)) -> Vec<Silence> {
    let model = drive.description();
    let was_heard = |id: CobId| Some(id.can_id().as_standard().is_some_and(|id| heard.under(id).is_some()));
    let situation = Situation {
        nmt: context.network.facts(drive.node().id()).probable_state(model),
        event_trigger: model.map_or(EventTrigger::Change, |model| model.pdo.event_trigger),
        sync_heard: was_heard(SYNC),
        heard: was_heard(cob_id),
    };
    why_silent(config, cob_id, &situation)
}

impl PdoList {
    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["node", "pdo", "id", "type", "when", "inhibit", "timer", "carries"]);
        let ms = |time: Option<f64>| time.map_or_else(|| "-".into(), |time| format!("{time} ms"));
        for (of_node, row) in self.nodes.iter().flat_map(|of_node| of_node.pdos.iter().map(move |row| (of_node, row))) {
            table.row([
                of_node.node.to_string(),
                row.pdo.clone(),
                row.id_text(),
                row.transmission.to_string(),
                row.when.clone(),
                ms(row.inhibit_ms),
                ms(row.event_ms),
                row.carries(),
            ]);
        }
        let mut lines = vec![table.plain(paint)];
        lines.extend(self.nodes.iter().flat_map(OfNode::why_silent));
        lines.join("\n")
    }
}

impl OfNode {
    /// Each reason once, with the PDOs that it keeps away.
    fn why_silent(&self) -> Vec<String> {
        let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
        for row in &self.pdos {
            for reason in &row.silent {
                match reasons.iter_mut().find(|(known, _)| known == reason) {
                    Some((_, pdos)) => pdos.push(&row.pdo),
                    None => reasons.push((reason, vec![&row.pdo])),
                }
            }
        }
        let line = |(reason, pdos): (&str, Vec<&str>)| format!("node {} {}: {reason}", self.node, pdos.join(", "));
        reasons.into_iter().map(line).collect()
    }
}
