//! `ferrodrive scan`: who is on the bus, what is known of each node, and what cannot be known.

use canopen::NmtState;
use master::identify::Found;
use serde::Serialize;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use crate::paint::Paint;
use crate::table::Table;

/// Show who is on the bus
///
/// Asks all 127 node-IDs for their device type and identity. Models of one maker may say the same of themselves and have
/// the same objects: say which a node is with --model NODE=MODEL, or in a machine file. A node in the state stopped answers no SDO; it is listed if it
/// sends a heartbeat.
#[derive(Debug, clap::Args)]
pub(crate) struct Scan {}

/// Everybody found.
#[derive(Debug, Serialize)]
pub(crate) struct ScanReport {
    nodes: Vec<Node>,
}

#[derive(Debug, Serialize)]
struct Node {
    node: u8,
    /// The model, if it can be told.
    model: Option<&'static str>,
    /// Every model that answers so.
    models: Vec<&'static str>,
    /// As its last heartbeat said.
    nmt_state: Option<String>,
    device_type: Option<u32>,
    vendor_id: Option<u32>,
    product_code: Option<u32>,
    revision_number: Option<u32>,
    /// What cannot be told, and why.
    remark: Option<String>,
}

impl Scan {
    /// Asks everybody.
    pub(crate) async fn run(&self, context: &Context) -> Result<ScanReport, Failure> {
        let asked = |count| context.progress.show(format!("asked {count} of 127"));
        let found = context.network.scan(context.timeout(), asked).await;
        if found.is_empty() {
            return Err(Failure::new("nobody is on the bus")
                .because("no node answered SDO and no boot-up or heartbeat message was heard")
                .next("check supply, cable, termination (60 ohm between CAN_H and CAN_L) and the bit rate"));
        }
        Ok(ScanReport { nodes: found.iter().map(|found| Node::new(context, found)).collect() })
    }
}

impl Node {
    fn new(context: &Context, found: &Found) -> Self {
        let told = context.told_model(found.node);
        let identity = found.identity.unwrap_or_default();
        let model = told.or_else(|| found.model());
        Self {
            node: found.node.raw(),
            model: model.map(|model| model.model),
            models: found.models.iter().map(|model| model.model).collect(),
            // A boot-up message says only that the node has just left the state it names.
            nmt_state: found.nmt_state.filter(|state| *state != NmtState::Initialising).map(|state| state.to_string()),
            device_type: identity.device_type,
            vendor_id: identity.vendor_id,
            product_code: identity.product_code,
            revision_number: identity.revision_number,
            remark: found.doubt().filter(|_| told.is_none()).map(|doubt| remark(found, doubt)),
        }
    }
}

/// What cannot be told, and what the user can do about it.
fn remark(found: &Found, doubt: String) -> String {
    match found.models[..] {
        [first, _, ..] => format!("{doubt}, e.g. --model {}={}", found.node, first.model),
        _ => doubt,
    }
}

impl Report for ScanReport {
    fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["node", "model", "nmt state", "device type", "vendor:product:revision", "remark"]);
        let hex = |number: Option<u32>| number.map_or_else(|| "-".into(), |number| format!("{number:X}h"));
        for node in &self.nodes {
            let model = node.model.map_or_else(|| node.models.join(" or "), Into::into);
            let identity = [node.vendor_id, node.product_code, node.revision_number].map(hex).join(":");
            table.row([
                node.node.to_string(),
                if model.is_empty() { "unknown".into() } else { model },
                node.nmt_state.clone().unwrap_or_else(|| "no heartbeat".into()),
                hex(node.device_type),
                identity,
                node.remark.clone().unwrap_or_default(),
            ]);
        }
        table.plain(paint)
    }
}
