//! `ferrodrive scan`: who is on the bus, what is known of each node, and what cannot be known.

mod heard;

use canopen::NmtState;
use master::core::Twins;
use master::identify::{Found, Knowledge};
use serde::Serialize;
use tokio::sync::broadcast::error::RecvError;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use heard::{Counted, Heard};
use plot::Paint;
use plot::Table;
use testbench::models::{Description, how_to_say};

/// Show who is on the bus
///
/// Asks all 127 node-IDs for their device type and identity. Several models may answer the same: say which a node is with
/// --model NODE=MODEL, or in a machine file (--machine FILE.toml). A node in the state stopped answers no SDO; it is listed
/// if it sends a heartbeat. What others sent meanwhile is told too: boot-ups, errors, PDOs, SYNC, another master's requests.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ferrodrive --bus can0 scan\n  ferrodrive --bus can0 scan --model 4=zlac8030l --json"
)]
pub(crate) struct Scan {}

/// Everybody found.
#[derive(Debug, Serialize)]
pub(crate) struct ScanReport {
    nodes: Vec<Node>,
    /// What others sent meanwhile, beside answers to the scan and the heartbeats of the nodes above.
    heard: Vec<Heard>,
}

#[derive(Debug, Serialize)]
struct Node {
    node: u8,
    /// The model, if it is known for sure.
    model: Option<&'static str>,
    /// Every model that answers this identity.
    models: Vec<&'static str>,
    /// The model whose objects it has, where those that answer so have other objects; of several the first.
    guess: Option<&'static str>,
    /// The object that speaks for the guess.
    evidence: Option<String>,
    /// As its last heartbeat said.
    nmt_state: Option<String>,
    /// How often it sends one by its own word (1017h), in ms; 0 for never.
    heartbeat_ms: Option<u64>,
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
        let asked = |count| context.progress.count(format!("asked {count} of 127"));
        let (mut counted, mut decoder) = (Counted::default(), context.decoder());
        let mut others = context.traffic.of_others();
        let mut scanning = std::pin::pin!(context.network.scan(context.timeout(), asked));
        let found = loop {
            tokio::select! {
                found = &mut scanning => break found,
                passed = others.recv() => match passed {
                    Ok((_, frame)) => counted.note(&mut decoder, &frame),
                    // A busy bus is faster than this: what was missed is of the kinds that come again.
                    Err(RecvError::Lagged(_)) => {}
                    Err(RecvError::Closed) => break scanning.await,
                },
            }
        };
        while let Ok((_, frame)) = others.try_recv() {
            counted.note(&mut decoder, &frame);
        }
        let heard = counted.told(|node| found.iter().any(|found| found.node == node));
        if found.is_empty() {
            let failure = Failure::new("nobody is on the bus")
                .of_kind("nobody")
                .because("no node answered SDO and no boot-up or heartbeat message was heard");
            let failure = heard.iter().fold(failure, |failure, heard| failure.because(heard.line()));
            return Err(
                failure.next("check supply, cable, termination (60 ohm between CAN_H and CAN_L) and the bit rate")
            );
        }
        Ok(ScanReport { nodes: found.iter().map(|found| Node::new(context, found)).collect(), heard })
    }
}

impl Node {
    fn new(context: &Context, found: &Found) -> Self {
        let told = context.told_model(found.node);
        let identity = found.identity.unwrap_or_default();
        let contradiction = told.and_then(|told| contradiction(told, found));
        let named = if let Knowledge::Named(model) = &found.knowledge { Some(model.0) } else { None };
        let model = told.filter(|_| contradiction.is_none()).or(named);
        let guess = found.knowledge.guess().filter(|_| model.is_none());
        let evidence = guess.as_ref().and_then(|guess| guess.evidence());
        Self {
            node: found.node.raw(),
            model: model.map(|model| model.name),
            models: found.models.iter().map(|model| model.name).collect(),
            guess: guess.filter(|_| evidence.is_some()).map(|guess| guess.description().name),
            evidence: evidence.map(|mux| mux.to_string()),
            // A boot-up message says only that the node has just left the state it names.
            nmt_state: found.nmt_state.filter(|state| *state != NmtState::Initialising).map(|state| state.to_string()),
            heartbeat_ms: found.heartbeat.map(|period| period.as_millis() as u64),
            device_type: identity.device_type,
            vendor_id: identity.vendor_id,
            product_code: identity.product_code,
            revision_number: identity.revision_number,
            remark: found
                .twins
                .map(two_devices)
                .or(contradiction)
                .or_else(|| found.doubt().filter(|_| told.is_none()).map(|doubt| remark(found, doubt))),
        }
    }
}

impl Node {
    /// The NMT state, or why it is not known.
    fn nmt_text(&self) -> String {
        match (&self.nmt_state, self.heartbeat_ms) {
            (Some(state), _) => state.clone(),
            (None, Some(0)) => "sends no heartbeat".into(),
            (None, Some(ms)) => format!("heartbeat each {ms} ms, not heard yet"),
            (None, None) => "no heartbeat heard".into(),
        }
    }
}

/// What is said of a node-ID that two devices have.
fn two_devices(twins: Twins) -> String {
    format!(
        "{twins}: two devices have this node-ID, and what is said here is of one or the other. Switch one off, and give the other \
         a node-ID of its own (its switches, or ferrodrive lss scan)"
    )
}

/// What speaks against the model that a node is said to be.
fn contradiction(told: &'static Description, found: &Found) -> Option<String> {
    let said = format!("it is said to be a {}", told.name);
    if !found.identity?.matches(&told.identity) {
        return Some(format!("{said}, but its identity is another one: say the right model"));
    }
    let guess = found.knowledge.guess()?;
    let evidence = guess.evidence().filter(|_| guess.fitting().all(|model| model.name != told.name))?;
    // A data sheet that has the object too is not spoken against.
    let evidence = told.row(evidence).is_none().then_some(evidence)?;
    let fitting = guess.description().name;
    Some(format!("{said}, but has {evidence} as a {fitting} has: say the right model"))
}

/// What cannot be told, and what the user can do about it.
fn remark(found: &Found, doubt: String) -> String {
    let candidates = match &found.knowledge {
        Knowledge::Named(_) => Vec::new(),
        Knowledge::Guessed(guess) => guess.fitting().map(|model| model.name).collect(),
        Knowledge::Unknown => found.models.iter().map(|model| model.name).collect(),
    };
    if candidates.is_empty() { doubt } else { format!("{doubt}. Say which: {}", how_to_say(found.node, &candidates)) }
}

impl Report for ScanReport {
    fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["node", "model", "nmt state", "device type", "vendor:product:revision"]);
        let hex = |number: Option<u32>| number.map_or_else(|| "-".into(), |number| format!("{number:X}h"));
        for node in &self.nodes {
            let identity = [node.vendor_id, node.product_code, node.revision_number].map(hex).join(":");
            table.row([
                node.node.to_string(),
                node.model.unwrap_or(if node.models.is_empty() { "unknown" } else { "cannot tell" }).into(),
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
