//! What a scan of all node-IDs finds: who is there, what is known of each node, and what cannot be known.

use canopen::{NmtState, NodeId};
use devices::Description;
use master::core::Twins;
use master::identify::{Found, Knowledge};
use serde::Serialize;

use super::heard::Heard;
use words::failure::Failure;

/// All nodes that answered or were heard on a bus, by node-ID.
#[derive(Debug, Serialize)]
pub struct ScanReport {
    /// A row each.
    pub nodes: Vec<ScannedNode>,
    /// What others sent meanwhile, beside answers to the scan and the heartbeats of the nodes above.
    pub heard: Vec<Heard>,
}

/// A node that was found.
#[derive(Debug, Serialize)]
pub struct ScannedNode {
    /// Its node-ID.
    pub node: u8,
    /// The model, if it is known for sure.
    pub model: Option<&'static str>,
    /// Every model that answers this identity.
    pub models: Vec<&'static str>,
    /// The model whose objects it has, where those that answer so have other objects; of several the first.
    pub guess: Option<&'static str>,
    /// The object that speaks for the guess.
    pub evidence: Option<String>,
    /// As its last heartbeat said.
    pub nmt_state: Option<String>,
    /// How often it sends one by its own word (1017h), in ms; 0 for never.
    pub heartbeat_ms: Option<u64>,
    /// 1000h.
    pub device_type: Option<u32>,
    /// 1018h:01.
    pub vendor_id: Option<u32>,
    /// 1018h:02.
    pub product_code: Option<u32>,
    /// 1018h:03.
    pub revision_number: Option<u32>,
    /// What is not certain, and why.
    pub remark: Option<String>,
}

impl ScannedNode {
    /// A node that was found, and which model it is stated to be; `say` words how a person says which it is.
    pub fn new(known: Option<&'static Description>, found: &Found, say: impl Fn(NodeId, &[&str]) -> String) -> Self {
        let identity = found.identity.unwrap_or_default();
        let contradiction = known.and_then(|known| contradiction(known, found));
        let named = if let Knowledge::Named(model) = &found.knowledge { Some(model.0) } else { None };
        let model = known.filter(|_| contradiction.is_none()).or(named);
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
                .or_else(|| found.doubt().filter(|_| known.is_none()).map(|doubt| remark(found, doubt, say))),
        }
    }
}

/// The remark on a node-ID that two devices have.
fn two_devices(twins: Twins) -> String {
    format!(
        "{twins}: two devices have this node-ID, and what is listed here is of one or the other. Switch one off, and give the other \
         a node-ID of its own (its switches, or ferrodrive lss scan)"
    )
}

impl ScannedNode {
    /// The NMT state, or why it is not known.
    pub fn nmt_text(&self) -> String {
        match (&self.nmt_state, self.heartbeat_ms) {
            (Some(state), _) => state.clone(),
            (None, Some(0)) => "sends no heartbeat".into(),
            (None, Some(ms)) => format!("heartbeat every {ms} ms, not heard yet"),
            (None, None) => "no heartbeat heard".into(),
        }
    }
}

/// What contradicts the model that is stated for a node.
fn contradiction(known: &'static Description, found: &Found) -> Option<String> {
    let said = format!("the model given for it is {}", known.name);
    if !found.identity?.matches(&known.identity) {
        return Some(format!("{said}, but its identity is that of another model: give the right one"));
    }
    let guess = found.knowledge.guess()?;
    let evidence = guess.evidence().filter(|_| guess.fitting().all(|model| model.name != known.name))?;
    // A data sheet that has the object too is not spoken against.
    let evidence = known.row(evidence).is_none().then_some(evidence)?;
    let fitting = guess.description().name;
    Some(format!("{said}, but it has {evidence}, as a {fitting} has: give the right model"))
}

/// What is not certain, and what the user can do about it.
fn remark(found: &Found, doubt: String, say: impl Fn(NodeId, &[&str]) -> String) -> String {
    let candidates = match &found.knowledge {
        Knowledge::Named(_) => Vec::new(),
        Knowledge::Guessed(guess) => guess.fitting().map(|model| model.name).collect(),
        Knowledge::Unknown => found.models.iter().map(|model| model.name).collect(),
    };
    if candidates.is_empty() { doubt } else { format!("{doubt}. Name its model: {}", say(found.node, &candidates)) }
}

/// That no node is on the bus, with what was heard all the same.
pub fn no_node(heard: &[Heard]) -> Failure {
    let failure = Failure::new("no node answers on the bus")
        .of_kind("no_node")
        .because("no node answered SDO and no boot-up or heartbeat message was heard");
    let failure = heard.iter().fold(failure, |failure, heard| failure.because(heard.line()));
    failure.next("check supply, cable, termination (60 ohm between CAN_H and CAN_L) and the bit rate")
}
