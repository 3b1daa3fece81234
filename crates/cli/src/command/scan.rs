//! `ferrodrive scan`: who is on the bus, what is known of each node, and what cannot be known.

use canopen::{Mux, NodeId};
use master::{Error, join_all};
use serde::Serialize;

use crate::context::{Context, candidates};
use crate::failure::Failure;
use crate::output::Report;
use crate::paint::Paint;
use crate::table::Table;

/// Show who is on the bus
///
/// Asks all 127 node-IDs at once for their device type and identity. A node in the state stopped answers no SDO; it is
/// listed if it sends a heartbeat.
#[derive(Debug, clap::Args)]
pub(crate) struct Scan {}

const DEVICE_TYPE: Mux = Mux::new(0x1000, 0);

/// Everybody found.
#[derive(Debug, Serialize)]
pub(crate) struct ScanReport {
    nodes: Vec<Found>,
}

#[derive(Debug, Serialize)]
struct Found {
    node: u8,
    /// As its last heartbeat said.
    nmt_state: Option<String>,
    device_type: Option<u32>,
    vendor_id: Option<u32>,
    product_code: Option<u32>,
    revision_number: Option<u32>,
    serial_number: Option<u32>,
    /// Every model that fits.
    models: Vec<&'static str>,
    remark: String,
}

impl Scan {
    /// Asks everybody.
    pub(crate) async fn run(&self, context: &Context) -> Result<ScanReport, Failure> {
        context.progress.show("asking nodes 1 to 127");
        let found = join_all(NodeId::all().map(|node| ask(context, node))).await;
        let nodes: Vec<Found> = found.into_iter().flatten().collect();
        if nodes.is_empty() {
            return Err(Failure::new("no node answered")
                .because("nobody answered SDO and no heartbeat was heard")
                .next("check supply, cable, termination (60 ohm between CAN_H and CAN_L) and the bit rate"));
        }
        Ok(ScanReport { nodes })
    }
}

async fn ask(context: &Context, id: NodeId) -> Option<Found> {
    let node = context.node(id);
    let device_type = node.read::<u32>(DEVICE_TYPE).await;
    if matches!(device_type, Err(Error::NoAnswer { .. } | Error::QueueFull { .. })) {
        let state = node.facts().heartbeat_at.and(node.facts().nmt_state)?;
        let remark = "sends heartbeats but answers no SDO".into();
        return Some(Found { remark, ..Found::silent(id, Some(state.to_string())) });
    }
    let identity = async |sub_index| node.read::<u32>(Mux::new(0x1018, sub_index)).await.ok();
    let (vendor_id, product_code) = (identity(1).await, identity(2).await);
    let (revision_number, serial_number) = (identity(3).await, identity(4).await);
    let fits = vendor_id.zip(product_code).map(candidates).unwrap_or_default();
    let told = context.told_model(id);
    let remark = remark(told.is_some(), vendor_id, fits.len());
    let models = told.map_or_else(|| fits.iter().map(|model| model.model).collect(), |model| vec![model.model]);
    let heartbeat = node.facts().heartbeat_at.is_some();
    let nmt_state = node.facts().nmt_state.filter(|_| heartbeat).map(|state| state.to_string());
    Some(Found {
        device_type: device_type.ok(),
        vendor_id,
        product_code,
        revision_number,
        serial_number,
        models,
        remark,
        ..Found::silent(id, nmt_state)
    })
}

fn remark(told: bool, vendor_id: Option<u32>, fits: usize) -> String {
    match (told, vendor_id, fits) {
        (true, ..) => "",
        (_, None, _) => "no identity object (1018h)",
        (_, _, 0) => "no model known here has this identity",
        (_, _, 1) => "",
        _ => "these models have the same identity; say which with --model",
    }
    .into()
}

impl Found {
    fn silent(node: NodeId, nmt_state: Option<String>) -> Self {
        Self {
            node: node.raw(),
            nmt_state,
            device_type: None,
            vendor_id: None,
            product_code: None,
            revision_number: None,
            serial_number: None,
            models: Vec::new(),
            remark: String::new(),
        }
    }
}

impl Report for ScanReport {
    fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["node", "model", "nmt state", "device type", "vendor:product:revision", "remark"]);
        let hex = |number: Option<u32>| number.map_or_else(|| "-".into(), |number| format!("{number:X}h"));
        for found in &self.nodes {
            let model = if found.models.is_empty() { "unknown".into() } else { found.models.join(" or ") };
            let identity = [found.vendor_id, found.product_code, found.revision_number].map(hex).join(":");
            table.row([
                found.node.to_string(),
                model,
                found.nmt_state.clone().unwrap_or_else(|| "no heartbeat to tell".into()),
                hex(found.device_type),
                identity,
                found.remark.clone(),
            ]);
        }
        table.plain(paint)
    }
}
