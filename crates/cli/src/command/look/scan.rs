//! `ferrodrive scan`: who is on the bus, what is known of each node, and what cannot be known.

use tokio::sync::broadcast::error::RecvError;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use host::network::heard::{Counted, Heard};
use host::network::scan::{ScanReport, ScannedNode, no_node};
use master::identify::Found;
use plot::Paint;
use plot::Table;
use words::models::how_to_say;

/// Show the nodes on the bus
///
/// Asks all 127 node-IDs for their device type and identity. Several models may answer the same: name the model of a
/// node with --model NODE=MODEL, or in a machine file (--machine FILE.toml). A node in the state stopped answers no
/// SDO; it is listed if it sends a heartbeat. Other traffic heard meanwhile is reported too: boot-ups, errors, PDOs,
/// SYNC, another master's requests.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ferrodrive --bus can0 scan\n  ferrodrive --bus can0 scan --model 4=zlac8030l --json"
)]
pub(crate) struct Scan {}

impl Scan {
    /// Asks every node-ID.
    pub(crate) async fn run(&self, context: &Context) -> Result<ScanReport, Failure> {
        let (found, heard) = look(context).await?;
        let node = |found: &Found| ScannedNode::new(context.stated_model(found.node), found, how_to_say);
        Ok(ScanReport { nodes: found.iter().map(node).collect(), heard })
    }
}

/// Who is on the bus, and what others sent meanwhile; a failure where there is no node.
pub(in crate::command) async fn look(context: &Context) -> Result<(Vec<Found>, Vec<Heard>), Failure> {
    let asked = |count| context.progress.count(format!("asked {count} of 127"));
    let (mut counted, mut decoder) = (Counted::default(), context.decoder());
    let mut others = context.traffic.of_others();
    let mut scanning = std::pin::pin!(context.network.scan(context.timeout(), asked));
    let found = loop {
        tokio::select! {
            found = &mut scanning => break found,
            passed = others.recv() => match passed {
                Ok(passed) => counted.note(&mut decoder, &passed.frame),
                // A busy bus is faster than this: what was missed is of the kinds that come again.
                Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => break scanning.await,
            },
        }
    };
    while let Ok(passed) = others.try_recv() {
        counted.note(&mut decoder, &passed.frame);
    }
    let heard = counted.reported(|node| found.iter().any(|found| found.node == node));
    if found.is_empty() { Err(no_node(&heard).into()) } else { Ok((found, heard)) }
}

impl Report for ScanReport {
    fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["node", "model", "nmt state", "device type", "vendor:product:revision"]);
        let hex = |number: Option<u32>| number.map_or_else(|| "-".into(), |number| format!("{number:X}h"));
        for node in &self.nodes {
            let identity = [node.vendor_id, node.product_code, node.revision_number].map(hex).join(":");
            table.row([
                node.node.to_string(),
                node.model.unwrap_or(if node.models.is_empty() { "unknown" } else { "ambiguous" }).into(),
                node.nmt_text(),
                hex(node.device_type),
                identity,
            ]);
        }
        let remarks =
            self.nodes.iter().filter_map(|node| Some(format!("\nnode {}: {}", node.node, node.remark.as_ref()?)));
        let heard = self.heard.iter().map(|heard| format!("\n{}", heard.line()));
        format!("{}{}", table.plain(paint), remarks.chain(heard).collect::<String>())
    }
}
