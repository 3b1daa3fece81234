//! `ferrodrive scan`: who is on the bus, what is known of each node, and what cannot be known.

use std::time::Duration;

use host::network::heard::{Counted, Heard};
use host::network::scan::{ScanReport, ScannedNode, no_node};
use master::identify::Found;
use plot::Paint;
use plot::Table;
use words::models::how_to_say;

use crate::context::Context;
use crate::failure::Failure;

/// How often the frames of others are taken meanwhile: a full bus has some hundred in that time.
const HEARING: Duration = Duration::from_millis(50);

/// Show the nodes on the bus
///
/// Asks all 127 node-IDs for their device type and identity. A node in the state stopped answers no SDO; it is listed if
/// it sends a heartbeat. Other traffic heard meanwhile is reported too: boot-ups, errors, PDOs, SYNC, another master's
/// requests.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Several models may answer the same. What tells them apart: --model NODE=MODEL, or a machine file.\n\
    Examples:\n  ferrodrive --bus can0 scan\n  ferrodrive --bus can0 scan --model 4=zlac8030l --json"
)]
pub struct Scan {}

impl Scan {
    /// Asks every node-ID.
    pub async fn run(&self, context: &Context) -> Result<ScanReport, Failure> {
        let (found, heard) = look(context).await?;
        let node = |found: &Found| ScannedNode::new(context.stated_model(found.node), found, how_to_say);
        Ok(ScanReport { nodes: found.iter().map(node).collect(), heard })
    }
}

/// Who is on the bus, and what others sent meanwhile.
///
/// # Errors
/// No node answers; an error of the master.
pub async fn look(context: &Context) -> Result<(Vec<Found>, Vec<Heard>), Failure> {
    let asked = |count| context.show(format!("asked {count} of 127"));
    let (mut counted, mut decoder) = (Counted::default(), context.decoder());
    let mut others = context.shell.others();
    let mut scanning = std::pin::pin!(context.network.scan(context.timeout(), asked));
    let found = loop {
        tokio::select! {
            found = &mut scanning => break found,
            () = context.network.sleep(HEARING) => others(&mut counted, &mut decoder),
        }
    };
    others(&mut counted, &mut decoder);
    let heard = counted.reported(|node| found.iter().any(|found| found.node == node));
    if found.is_empty() { Err(no_node(&heard).into()) } else { Ok((found, heard)) }
}

/// As lines for people.
pub fn text(report: &ScanReport, paint: Paint) -> String {
    let mut table = Table::new(&["node", "model", "nmt state", "device type", "vendor:product:revision"]);
    let hex = |number: Option<u32>| number.map_or_else(|| "-".into(), |number| format!("{number:X}h"));
    for node in &report.nodes {
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
        report.nodes.iter().filter_map(|node| Some(format!("\nnode {}: {}", node.node, node.remark.as_ref()?)));
    let heard = report.heard.iter().map(|heard| format!("\n{}", heard.line()));
    format!("{}{}", table.plain(paint), remarks.chain(heard).collect::<String>())
}
