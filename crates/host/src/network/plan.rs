//! Whether everything fits the bus, and how late each frame may come.

use std::fmt;
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use cia402::ModeOfOperation;
use master::Drive;
use master::plan::{NodeTraffic, Plan, PlannedFrame, Purpose, Settings, most_nodes, plan, shortest_cycle};
use master::units::Shown;
use serde::Serialize;

use machine::file::{CyclePlan, Machine, TOLERANCE, too_full};
use words::failure::Failure;

/// Period of SYNC where nothing says it.
pub const CYCLE: Duration = Duration::from_millis(10);

/// A cycle that is shorter has no room for two frames at 1 Mbit/s.
pub const SHORTEST_CYCLE: Duration = Duration::from_micros(250);

/// A plan. Times in µs.
#[derive(Debug, Serialize)]
pub struct PlanReport {
    /// The command ends with status 0.
    pub ok: bool,
    /// Everything is there in time.
    pub fits: bool,
    /// What of the machine file is planned: a group or the base.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moved: Option<String>,
    /// Bit rate of the bus in bit/s.
    pub bitrate: u32,
    /// From one SYNC to the next.
    pub cycle_us: f64,
    /// Share of its time that the bus is taken, at most.
    pub load: f64,
    /// The same without SDO and EMCY.
    pub cycle_load: f64,
    /// A row each, the most urgent first.
    pub frames: Vec<PlanRow>,
    /// How many drives like these fit, over and over in their order.
    pub most_drives: usize,
    /// The same without SDO and EMCY.
    pub most_drives_in_cycle: usize,
    /// How many drives there are.
    pub drives: usize,
    /// What else is to be known.
    pub notes: Vec<String>,
}

/// A frame of the plan. Times in µs.
#[derive(Debug, Serialize)]
pub struct PlanRow {
    /// What it is.
    pub frame: String,
    /// Whose it is; `None` for one of the host.
    pub node: Option<u8>,
    /// Its identifier, hexadecimal.
    pub id: String,
    /// Its data bytes.
    pub bytes: u8,
    /// Shortest time between two.
    pub every_us: f64,
    /// Its time on the wire.
    pub wire_us: f64,
    /// With everything that there may be; null: no bound.
    pub worst_us: Option<f64>,
    /// While there is no SDO and no EMCY; null too for a frame that there is not then.
    pub cycle_worst_us: Option<f64>,
    /// By when it has to be there.
    pub deadline_us: f64,
    /// It is.
    pub in_time: bool,
}

impl PlanReport {
    /// The plan of these nodes; `moved` is what of a machine file is moved in its cycles.
    pub fn new(nodes: &[NodeTraffic], settings: &Settings, bitrate: Bitrate, moved: Option<CyclePlan>) -> Self {
        let all = plan(nodes, settings, bitrate);
        let cycle = plan(nodes, &settings.cycle_alone(), bitrate);
        let mut notes: Vec<String> = all.remarks.iter().map(ToString::to_string).collect();
        if !nodes.iter().any(|node| node.pdos.iter().any(|(config, id)| id.is_valid() && !config.map.0.is_empty())) {
            notes.push("no PDO carries anything: plan for a mode of operation, with the PDOs that it needs".into());
        }
        let fits = all.fits();
        // What is late in the moment of a fault alone does not keep a motion from beginning.
        let ok = fits || moved.is_some() && cycle.fits();
        if ok && !fits && !all.is_tolerable(&cycle, TOLERANCE) {
            notes.push(format!(
                "SDO requests and EMCY beside the cycle may keep a PDO away for more than the {TOLERANCE} cycles that are tolerated, and so \
                 stop the motion: take a longer period, or ask nothing meanwhile (a plan without SDO requests shows what that gives)"
            ));
        }
        match too_full(nodes, settings, bitrate, &cycle) {
            Some(full) => notes.extend([full.what, full.next]),
            None => notes.extend(late_below_full(&all, &cycle, settings)),
        }
        if !fits {
            notes.extend(shortest_cycle(nodes, settings, bitrate).filter(|shortest| *shortest > settings.cycle).map(
                |shortest| format!("from a cycle of {} ms on nothing is late", Shown(shortest.as_secs_f64() * 1e3)),
            ));
        }
        Self {
            ok,
            fits,
            moved: moved.map(|moved| moved.what),
            bitrate: bitrate.bits_per_second(),
            cycle_us: us(settings.cycle),
            load: rounded(all.load, 1e4),
            cycle_load: rounded(cycle.load, 1e4),
            frames: all.frames.iter().map(|frame| PlanRow::new(frame, &cycle)).collect(),
            most_drives: most_nodes(nodes, settings, bitrate),
            most_drives_in_cycle: most_nodes(nodes, &settings.cycle_alone(), bitrate),
            drives: nodes.len(),
            notes,
        }
    }
}

/// Why frames are late on a bus that is not full: the load is an average, a bound is about the worst moment.
fn late_below_full(all: &Plan, cycle: &Plan, settings: &Settings) -> Option<String> {
    let lateness = |frame: &&PlannedFrame| frame.bound.worst.map(|worst| worst.saturating_sub(frame.deadline));
    let late = all.frames.iter().filter(|frame| !frame.is_in_time());
    // One without a bound is not later than all others: it has no last moment.
    let (late, after) = late.filter_map(|frame| Some((frame, lateness(&frame)?))).max_by_key(|(_, late)| *late)?;
    let ms = |time: Duration| Shown(time.as_secs_f64() * 1e3);
    let whose = late.node.map_or_else(String::new, |node| format!(" of node {node}"));
    let jitter = match settings.jitter {
        Duration::ZERO => String::new(),
        jitter => format!(", from a host that is up to {} ms late", ms(jitter)),
    };
    let has_emcy = all.frames.iter().any(|frame| frame.purpose == Purpose::Emcy);
    let beside = match (settings.sdo, settings.emcy.filter(|_| has_emcy)) {
        (None, None) => "",
        (Some(_), None) => ", and an SDO request with its answer may come just then",
        (None, Some(_)) => ", and an EMCY of each node may come just then",
        (Some(_), Some(_)) => ", and an SDO request with its answer and an EMCY of each node may come just then",
    };
    let alone = match cycle.fits() {
        true if beside.is_empty() => "",
        true => "; without SDO and EMCY nothing is late",
        false => "; it does not fit without SDO and EMCY either",
    };
    Some(format!(
        "the load of {:.1} % is an average over time, and a frame is late by its worst moment: the PDOs of all drives are sent at SYNC at \
         once{jitter}{beside}. Then {}{whose} is there up to {} ms after it was due{alone}",
        100.0 * all.load,
        late.purpose,
        ms(after)
    ))
}

/// What a drive sends: as it is set up, or as the machine file has it set up, and in the mode that is asked for or else in the cycles of
/// what is moved.
///
/// # Errors
/// Those of SDO, and that it cannot be moved so.
pub async fn traffic(
    drive: &Drive,
    file: Option<&Machine>,
    mode: Option<ModeOfOperation>,
    moved: Option<&CyclePlan>,
) -> Result<NodeTraffic, Failure> {
    let read = NodeTraffic::of(drive).await?;
    let set_up = file.map_or_else(|| read.clone(), |machine| machine.set_up(read.clone()));
    let wrong = |error: &dyn fmt::Display| {
        let failure = Failure::new(error.to_string()).at_node(drive.node().id());
        failure.next("choose a mode for speed, torque or positions that the model has, e.g. pv or csp")
    };
    match (mode, moved) {
        (Some(mode), _) => set_up.in_cycles(drive, mode, false).map_err(|error| wrong(&error)),
        (None, Some(moved)) => moved.traffic(drive, set_up).map_err(|error| wrong(&error)),
        (None, None) => Ok(set_up),
    }
}

impl PlanRow {
    fn new(frame: &PlannedFrame, cycle: &Plan) -> Self {
        let same = |other: &&PlannedFrame| other.purpose == frame.purpose && other.node == frame.node;
        let alone = cycle.frames.iter().find(same).and_then(|other| other.bound.worst);
        Self {
            frame: frame.purpose.to_string(),
            node: frame.node.map(NodeId::raw),
            id: frame.frame.id.to_string(),
            bytes: frame.frame.length,
            every_us: us(frame.frame.period),
            wire_us: us(frame.bound.transmission),
            worst_us: frame.bound.worst.map(us),
            cycle_worst_us: alone.map(us),
            deadline_us: us(frame.deadline),
            in_time: frame.is_in_time(),
        }
    }
}

fn us(time: Duration) -> f64 {
    rounded(time.as_secs_f64() * 1e6, 1e3)
}

fn rounded(value: f64, per: f64) -> f64 {
    (value * per).round() / per
}
