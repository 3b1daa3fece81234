//! The boot-up of a described bus, predicted: virtual drives of its models in virtual time, the master's own boot
//! process on them, and the plan of what is sent afterwards.

use std::time::Duration;

use can::Bitrate;
use canopen::pdo::PdoId;
use canopen::{Mux, NmtState, NodeId};
use master::boot::{BootReport, ErrorStatus, NodeReport, Verdict};
use master::pdo::PdoConfig;
use master::plan::{NodeTraffic, Plan, PlannedFrame, Purpose, Remark, Settings, plan};
use master::{Drive, Network};
use serde::Serialize;
use sim::machine::{Order, TimingMode, order};
use sim::{World, block_on_for};

use super::finding::{Place, Reporter, Severity};
use super::intended::{Intended, IntendedNode, MovedAt};
use crate::file::{Machine, TOLERANCE, too_full_at};
use words::counted;

/// What a bus will do.
#[derive(Clone, Debug, Serialize)]
pub struct Prediction {
    /// Bit rate, bit/s.
    pub bitrate: u32,
    /// Period of SYNC, us.
    pub cycle_us: u64,
    /// Each node, by its node-ID.
    pub nodes: Vec<PredictedNode>,
    /// What is sent, most urgent first.
    pub frames: Vec<PredictedFrame>,
    /// Share of its time that the bus is taken, at most.
    pub load: f64,
    /// Everything is there in time.
    pub fits: bool,
}

/// The outcome for a node.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PredictedNode {
    /// Its node-ID.
    pub node: u8,
    /// Its name in the file.
    pub name: String,
    /// The standard's error status (CiA 302-2), A to O; `None`: it boots.
    pub letter: Option<char>,
    /// What that means.
    pub meaning: Option<&'static str>,
    /// The state in which it ends.
    pub state: Option<String>,
    /// How many values are written to it.
    pub writes: usize,
}

/// A frame that is sent.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PredictedFrame {
    /// What it is for: `TPDO1`, `heartbeat`.
    pub frame: String,
    /// The node that it is of or to.
    pub node: Option<u8>,
    /// Its identifier, `184`.
    pub id: String,
    /// Its bytes.
    pub bytes: u8,
    /// Shortest time between two, us.
    pub every_us: f64,
    /// When it is there at the latest, us; `None`: no bound.
    pub worst_us: Option<f64>,
    /// In time.
    pub in_time: bool,
    /// What a PDO carries.
    pub carries: Vec<String>,
}

/// The machine has been switched on for so long when the master starts.
const SWITCHED_ON: Duration = Duration::from_secs(3);

/// Longer than any boot-up that its plan bounds.
const LIMIT: Duration = Duration::from_secs(600);

/// Cycle of a plan where no SYNC is sent, as `ferrodrive plan` has it.
pub(super) const CYCLE: Duration = Duration::from_millis(10);

/// The world of a bus that is described by data sheets, without its master.
///
/// # Errors
/// Why a drive cannot be had.
pub(super) fn world(intended: &Intended) -> Result<World, String> {
    let mut world = World::new(intended.bitrate, 1);
    for (node, place) in &intended.nodes {
        let wanted = Order::new(place.description, *node, intended.bitrate);
        let drive = order(place.description, &wanted).map_err(|error| error.to_string())?;
        world.set_timing(TimingMode::Device);
        world.add_drive(node.raw(), drive).map_err(|error| error.to_string())?;
    }
    Ok(world)
}

/// Boots a bus in this world. What prevents it is reported.
///
/// # Errors
/// Why nothing can be predicted.
pub(super) fn predict(
    intended: &Intended,
    machine: Option<&Machine>,
    mut world: World,
    report: &mut Reporter<'_>,
) -> Result<Prediction, String> {
    let network = Network::new();
    world.add_station(network.clone());
    world.run_for(SWITCHED_ON);
    let mut boot = intended.plan.clone();
    for expectation in boot.nodes.values_mut() {
        // The number of a device that is not there is not a trap.
        expectation.serial_number = None;
    }
    let booted = block_on_for(&mut world, LIMIT, network.boot(&boot)).map_err(|error| error.to_string())?;
    let reading = async {
        let mut traffic = Vec::new();
        for (node, place) in &intended.nodes {
            let drive = Drive::new(network.node(*node), place.description);
            if let Ok(read) = NodeTraffic::of(&drive).await {
                traffic.push((drive, read));
            }
        }
        traffic
    };
    let mut read = block_on_for(&mut world, LIMIT, reading).map_err(|error| error.to_string())?;
    // What was refused at the boot-up, or not written to a node that was operational, is meant all the same.
    if let Some(machine) = machine {
        read.iter_mut().for_each(|(_, traffic)| *traffic = machine.set_up(traffic.clone()));
    }
    of_boot(intended, &booted, report);
    let mut traffic: Vec<_> = read.iter().map(|(_, traffic)| traffic.clone()).collect();
    for moved in intended.moved.iter().rev() {
        traffic = in_cycles(moved, &read, report);
        of_cycle(moved, &traffic, intended.bitrate, report);
    }
    let cycle = intended.cycle.unwrap_or(CYCLE);
    let settings = Settings { host_heartbeat: intended.host_heartbeat, ..Settings::new(cycle) };
    let planned = plan(&traffic, &settings, intended.bitrate);
    of_plan(intended, &planned, &traffic, &settings, report);
    without_sync(intended, &traffic, report);
    let nodes = booted.nodes.iter().filter_map(|node| predicted(intended, node)).collect();
    let frames = planned.frames.iter().map(|frame| of_frame(intended, frame, &traffic)).collect();
    Ok(Prediction {
        bitrate: intended.bitrate.bits_per_second(),
        cycle_us: u64::try_from(cycle.as_micros()).unwrap_or(u64::MAX),
        nodes,
        frames,
        load: (planned.load * 1e4).round() / 1e4,
        fits: planned.fits(),
    })
}

/// The letter with which a master says how it ended. A node that starts on its own ends with L.
fn status(place: &IntendedNode, node: &NodeReport) -> Option<ErrorStatus> {
    let by_itself = place.description.nmt.start_state == NmtState::Operational;
    node.status.or(by_itself.then_some(ErrorStatus::InitiallyOperational))
}

fn predicted(intended: &Intended, node: &NodeReport) -> Option<PredictedNode> {
    let place = intended.nodes.get(&node.node)?;
    let status = status(place, node);
    Some(PredictedNode {
        node: node.node.raw(),
        name: place.name.clone(),
        letter: status.map(ErrorStatus::letter),
        meaning: status.map(ErrorStatus::meaning),
        state: node.state.map(|state| state.to_string()),
        // What is operational is left as it is.
        writes: if node.status == Some(ErrorStatus::InitiallyOperational) { 0 } else { place.writes.len() },
    })
}

/// Each node that fails, at the line that asks for what it refuses.
fn of_boot(intended: &Intended, booted: &BootReport, report: &mut Reporter<'_>) {
    report.rule = "boot";
    for node in &booted.nodes {
        let Some(place) = intended.nodes.get(&node.node) else { continue };
        let failed = node.steps.iter().find(|step| matches!(step.verdict, Verdict::Failed(_)));
        if let (Some(step), Some(status)) = (failed, node.status) {
            report.node = Some(node.node);
            let what = format!(
                "it will not boot, letter {status}: {}",
                step.to_string().split(';').next().unwrap_or_default()
            );
            report.say(Severity::Error, place.place_of(step.object), what, status.advice());
        }
        if let (Some(ErrorStatus::InitiallyOperational), Some(first)) = (node.status, place.writes.first()) {
            report.node = Some(node.node);
            let what = "it becomes operational on its own, and a boot-up leaves it so: its settings in the file are not written";
            let next = "boot it with `ferrodrive boot FILE --reset`, which ends with status 1 and lists what is missing otherwise";
            report.say(Severity::Warning, first.at, what, next);
        }
    }
    report.node = None;
}

/// What each node sends while something is moved in cycles; a drive that cannot be moved so is reported.
fn in_cycles(moved: &MovedAt, read: &[(Drive, NodeTraffic)], report: &mut Reporter<'_>) -> Vec<NodeTraffic> {
    report.rule = "cycle-mode";
    let traffic = read.iter().map(|(drive, traffic)| {
        moved.cycle.traffic(drive, traffic.clone()).unwrap_or_else(|error| {
            report.node = Some(traffic.node);
            let what = format!("{} cannot be moved: {error}", moved.cycle.what);
            report.say(Severity::Error, moved.at, what, "give the axis another `mode`");
            traffic.clone()
        })
    });
    let traffic = traffic.collect();
    report.node = None;
    traffic
}

/// Whether the bus carries the cycle of a group or a base, and those who move it will begin.
fn of_cycle(moved: &MovedAt, traffic: &[NodeTraffic], bitrate: Bitrate, report: &mut Reporter<'_>) {
    report.rule = "cycle-load";
    if let Some(full) = too_full_at(traffic, moved.cycle.period, bitrate) {
        report.say(Severity::Error, moved.at, format!("{}: {}", moved.cycle.what, full.what), full.next);
    }
}

fn of_plan(
    intended: &Intended,
    planned: &Plan,
    traffic: &[NodeTraffic],
    settings: &Settings,
    report: &mut Reporter<'_>,
) {
    report.rule = "bus-load";
    if !intended.moved.is_empty() {
        let alone = plan(traffic, &settings.cycle_alone(), intended.bitrate);
        // A cycle that does not fit has been reported.
        if alone.fits() && !planned.is_tolerable(&alone, TOLERANCE) {
            let what = format!(
                "SDO requests and EMCY beside the cycle may keep a PDO away for more than the {TOLERANCE} cycles that are tolerated, and so \
                 stop the motion"
            );
            let next =
                "take a longer period, or send no SDO requests while it moves; `ferrodrive plan` shows each frame";
            report.say(Severity::Warning, intended.at, what, next);
        }
        if alone.load > 1.0 || alone.fits() {
            return remarks(intended, planned, report);
        }
    }
    let (percent, rate) = (planned.load * 100.0, intended.bitrate.bits_per_second() / 1000);
    let late: Vec<&PlannedFrame> = planned.frames.iter().filter(|frame| !frame.is_in_time()).collect();
    let cycle = intended.cycle.unwrap_or(CYCLE).as_micros();
    let next =
        "fewer or slower PDOs, a longer cycle, inhibit times, or a higher bit rate; `ferrodrive plan` shows each frame";
    if planned.load > 1.0 {
        let what =
            format!("what is sent takes up to {percent:.0} % of the bus at {rate} kbit/s and a cycle of {cycle} us");
        report.say(Severity::Error, intended.at, what, next);
    } else if let Some(first) = late.first() {
        let node = first.node.map(|node| format!(" of node {node}")).unwrap_or_default();
        let what = format!(
            "{} may miss the period at {rate} kbit/s and a cycle of {cycle} us, {}{node} first (bus load {percent:.0} %)",
            counted(late.len(), "frame"),
            first.purpose
        );
        report.say(Severity::Warning, intended.at, what, next);
    }
    remarks(intended, planned, report);
}

/// What was taken or left out.
fn remarks(intended: &Intended, planned: &Plan, report: &mut Reporter<'_>) {
    for remark in &planned.remarks {
        let (Remark::Unbounded(node, pdo) | Remark::OnRequest(node, pdo) | Remark::Shared(node, pdo, _)) = *remark;
        let place = intended
            .nodes
            .get(&node)
            .map_or(intended.at, |place| place.place_of(Some(Mux::new(pdo.parameter_index(), 1))));
        report.node = Some(node);
        let said = remark.to_string();
        let said = said.split_once(": ").map_or(said.as_str(), |(_, said)| said);
        let (rule, severity, next) = match remark {
            Remark::Shared(..) => ("shared-cob-id", Severity::Error, "give each PDO an identifier of its own"),
            Remark::Unbounded(..) => ("unbounded", Severity::Note, "set an inhibit time, or a synchronous type"),
            Remark::OnRequest(..) => {
                ("on-request", Severity::Note, "choose another type: remote frames are no longer used")
            }
        };
        report.rule = rule;
        report.say(severity, place, format!("{pdo}: {said}"), next);
    }
    report.node = None;
}

/// Synchronous PDOs of a bus without SYNC are never sent, nor acted upon.
fn without_sync(intended: &Intended, traffic: &[NodeTraffic], report: &mut Reporter<'_>) {
    report.rule = "no-sync";
    for node in traffic.iter().filter(|_| intended.cycle.is_none()) {
        let waits = node
            .pdos
            .iter()
            .find(|(config, id)| id.is_valid() && !config.map.0.is_empty() && config.transmission.is_synchronous());
        if let (Some((config, _)), Some(place)) = (waits, intended.nodes.get(&node.node)) {
            report.node = Some(node.node);
            let at: Place = place.place_of(Some(Mux::new(config.pdo.parameter_index(), 2)));
            let what = format!("{} is of type {}, and the master sends no SYNC", config.pdo, config.transmission.0);
            report.say(Severity::Warning, at, what, "give the master a `sync_period`, or the PDO type 255");
        }
    }
    report.node = None;
}

fn of_frame(intended: &Intended, planned: &PlannedFrame, traffic: &[NodeTraffic]) -> PredictedFrame {
    let carries = match (planned.purpose, planned.node) {
        (Purpose::Pdo(pdo), Some(node)) => carries(intended, node, pdo, traffic),
        _ => Vec::new(),
    };
    let us = |time: Duration| (time.as_secs_f64() * 1e9).round() / 1e3;
    PredictedFrame {
        frame: planned.purpose.to_string(),
        node: planned.node.map(NodeId::raw),
        id: planned.frame.id.to_string(),
        bytes: planned.frame.length,
        every_us: us(planned.frame.period),
        worst_us: planned.bound.worst.map(us),
        in_time: planned.is_in_time(),
        carries,
    }
}

/// The names of what a PDO is mapped to.
fn carries(intended: &Intended, node: NodeId, pdo: PdoId, traffic: &[NodeTraffic]) -> Vec<String> {
    let config = traffic
        .iter()
        .find(|own| own.node == node)
        .and_then(|own| own.pdos.iter().map(|(config, _)| config).find(|config: &&PdoConfig| config.pdo == pdo));
    let description = intended.nodes.get(&node).map(|place| place.description);
    let name = |mux: Mux| {
        let row = description.and_then(|description| description.row(mux));
        row.map_or_else(|| mux.to_string(), |row| row.name.to_owned())
    };
    config.map(|config| config.map.0.iter().map(|record| name(record.mux)).collect()).unwrap_or_default()
}
