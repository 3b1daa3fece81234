//! The effect of a change of PDOs on the bus: load and worst-case delay of each frame, with and without it, by the master's
//! analysis.

use std::collections::BTreeMap;
use std::time::Duration;

use can::Bitrate;
use canopen::{Mux, NodeId};
use devices::Description;
use master::plan::{NodeTraffic, Plan, PlannedFrame, Settings, plan};
use serde_json::{Value, json};

/// A planned change.
pub(crate) struct PlannedPdos {
    pub(crate) node: NodeId,
    pub(crate) model: &'static Description,
    /// The new values of objects.
    pub(crate) wanted: BTreeMap<Mux, Vec<u8>>,
    /// The writes, as sent to a page.
    pub(crate) plan: Value,
    pub(crate) cycle: Duration,
    pub(crate) bitrate: Option<Bitrate>,
}

/// Assumptions about the host, with which the page explains the figures.
const ASSUMED: &str = "a host that is always in time and sends every RPDO once in a cycle; SDO requests of the host are at least 10 ms apart, and EMCY of one node \
                       at least 100 ms";

/// The bus with and without a change.
pub(crate) fn compared(
    without: &BTreeMap<NodeId, NodeTraffic>,
    changed: NodeTraffic,
    cycle: Duration,
    bitrate: Bitrate,
) -> Value {
    let settings = Settings::new(cycle);
    let mut with = without.clone();
    with.insert(changed.node, changed);
    let planned = |nodes: &BTreeMap<NodeId, NodeTraffic>| {
        let nodes: Vec<NodeTraffic> = nodes.values().cloned().collect();
        (plan(&nodes, &settings, bitrate), plan(&nodes, &settings.cycle_alone(), bitrate).load)
    };
    let ((before, cycle_before), (after, cycle_after)) = (planned(without), planned(&with));
    json!({
        "bitrate": bitrate.bits_per_second(),
        "cycle_ms": ms(cycle),
        "nodes": with.len(),
        "assumed": ASSUMED,
        "load_percent": { "before": percent(before.load), "after": percent(after.load) },
        "cycle_load_percent": { "before": percent(cycle_before), "after": percent(cycle_after) },
        "fits": { "before": before.fits(), "after": after.fits() },
        "frames": frames(&before, &after),
        "notes": after.remarks.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}

/// Every frame from before or after, by the priorities after.
fn frames(before: &Plan, after: &Plan) -> Vec<Value> {
    let find = |plan: &'_ Plan, of: &PlannedFrame| {
        plan.frames.iter().find(|frame| frame.purpose == of.purpose && frame.node == of.node).cloned()
    };
    let row = |of: &PlannedFrame, before: Option<&PlannedFrame>, after: Option<&PlannedFrame>| {
        json!({
            "frame": of.purpose.to_string(),
            "node": of.node.map(NodeId::raw),
            "id": of.frame.id.to_string(),
            "before": before.map(timing),
            "after": after.map(timing),
        })
    };
    let kept = after.frames.iter().map(|frame| row(frame, find(before, frame).as_ref(), Some(frame)));
    let gone = before.frames.iter().filter(|frame| find(after, frame).is_none());
    kept.chain(gone.map(|frame| row(frame, Some(frame), None))).collect()
}

fn timing(planned: &PlannedFrame) -> Value {
    json!({
        "bytes": planned.frame.length,
        "every_ms": ms(planned.frame.period),
        // Null: no bound.
        "worst_ms": planned.bound.worst.map(ms),
        "deadline_ms": ms(planned.deadline),
        "in_time": planned.is_in_time(),
    })
}

fn ms(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e6).round() / 1e3
}

fn percent(share: f64) -> f64 {
    (share * 1e4).round() / 1e2
}
