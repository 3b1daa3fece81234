//! `ferrodrive plan`: whether everything fits the bus, and how late each frame may come.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use cia402::ModeOfOperation;
use master::plan::{ErrorRate, HostQueue, NodeTraffic, Plan as BusPlan, PlannedFrame, Settings, most_nodes, plan};
use master::units::parse_duration;
use serde::Serialize;
use testbench::machine_file::{CyclePlan, Machine, TOLERANCE, too_full};
use testbench::words::mode::mode;
use testbench::words::node::node;
use transport::BusSpec;

use crate::context::Context;
use crate::failure::Failure;
use crate::global::Global;
use crate::output::{Format, Report};
use crate::session;
use plot::Paint;
use plot::Table;

/// Plan a bus: its load, the longest time of every frame, and how many such drives it carries
///
/// Takes the frames from how the PDOs of the nodes are set up, of virtual drives of a machine file or of those on a real bus, which
/// is only read. The [[group]] or the [base] of the file is planned as it will run: its period, its modes, its PDOs; of several the one that
/// fills the bus most. The times are bounds: whatever comes together with whatever, no frame of a bus without errors is later (CAN
/// schedulability analysis of Davis, Burns, Bril and Lukkien, 2007). Each RPDO is sent once in a cycle; a frame has to be there
/// before the next of its kind is due, and a PDO before the next SYNC. Ends with status 1 if something is late; of a group and a base,
/// which tolerate two cycles without a PDO, if something is late in a cycle alone, without SDO and EMCY.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive plan machine.toml                             # the [[group]] or [base] of the file\n  \
    ferrodrive plan machine.toml --cycle 5ms --mode pv       # as `Drive::configure_cyclic` maps the PDOs for that mode\n  \
    ferrodrive --bus can0 plan --cycle 10ms --bitrate 500k   # as they are mapped now")]
pub(crate) struct Plan {
    /// Machine file whose drives are looked at (default: those on --bus)
    #[arg(value_name = "FILE.toml")]
    file: Option<PathBuf>,
    /// Period of SYNC (default: that of the file's group or base, or 10ms)
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    cycle: Option<Duration>,
    /// Plan with the PDOs that this mode of operation needs for a set-point with each SYNC, in place of those that are mapped
    ///
    /// By its number (6060h), abbreviation or name. For one node: NODE=MODE; may be repeated.
    #[arg(long = "mode", value_name = "[NODE=]MODE", value_parser = node_mode)]
    modes: Vec<(Option<NodeId>, ModeOfOperation)>,
    /// Bit rate of the bus (default on a virtual one: its own)
    #[arg(long, value_name = "RATE")]
    bitrate: Option<Bitrate>,
    /// How late the host may be with SYNC and RPDOs; `ferrodrive latency` measures it
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "0us")]
    jitter: Duration,
    /// Shortest time between two SDO requests of the host; 0 for none
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "10ms")]
    sdo: Duration,
    /// Shortest time between two EMCY of one node; 0 for none
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "100ms")]
    emcy: Duration,
    /// Heartbeat of the host, with node-ID 127; 0 for none
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "0s")]
    heartbeat: Duration,
    /// The bus destroys a frame at most once in this time; 0 for never
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "0s")]
    errors: Duration,
    /// The host's controller sends the most urgent frame first, not in the order given
    #[arg(long)]
    by_priority: bool,
}

/// Period of SYNC where nothing says it.
const CYCLE: Duration = Duration::from_millis(10);

/// A cycle that is shorter holds no two frames at 1 Mbit/s.
const SHORTEST_CYCLE: Duration = Duration::from_micros(250);

fn node_mode(text: &str) -> Result<(Option<NodeId>, ModeOfOperation), String> {
    match text.split_once('=') {
        Some((id, name)) => Ok((Some(node(id)?), mode(name)?)),
        None => Ok((None, mode(text)?)),
    }
}

/// A plan, as it is printed. Times in µs.
#[derive(Debug, Serialize)]
pub(crate) struct PlanReport {
    /// The command ends with status 0.
    ok: bool,
    /// Everything is there in time.
    fits: bool,
    /// What of the machine file is planned: a group or the base.
    #[serde(skip_serializing_if = "Option::is_none")]
    moved: Option<String>,
    bitrate: u32,
    cycle_us: f64,
    /// Share of its time that the bus is taken, at most.
    load: f64,
    /// The same without SDO and EMCY.
    cycle_load: f64,
    frames: Vec<Row>,
    /// How many drives like these fit, over and over in their order.
    most_drives: usize,
    /// The same without SDO and EMCY.
    most_drives_in_cycle: usize,
    drives: usize,
    notes: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Row {
    frame: String,
    node: Option<u8>,
    id: String,
    bytes: u8,
    every_us: f64,
    wire_us: f64,
    /// With everything that there may be; null: no bound.
    worst_us: Option<f64>,
    /// While there is no SDO and no EMCY; null too for a frame that there is not then.
    cycle_worst_us: Option<f64>,
    deadline_us: f64,
    in_time: bool,
}

impl Plan {
    /// Plans, and fails if something is late.
    pub(crate) fn run(&self, global: &Global, format: Format) -> Result<(), Failure> {
        if self.cycle.is_some_and(|cycle| cycle < SHORTEST_CYCLE) {
            return Err(Failure::usage("--cycle is too short").because("expected 250us or more"));
        }
        let mut global = global.clone();
        if let Some(file) = &self.file {
            global.bus = BusSpec::Sim { file: Some(file.clone()) };
        }
        let bitrate = self.bitrate_of(&global.bus)?;
        let report = session::run(&global, async |context| self.plan(context, bitrate).await)?;
        format.print(&report).map_err(Failure::of_stdout)?;
        if report.ok {
            return Ok(());
        }
        Err(Failure { told: true, ..Failure::new("not everything is there in time") })
    }

    fn bitrate_of(&self, bus: &BusSpec) -> Result<Bitrate, Failure> {
        match (self.bitrate, bus) {
            (Some(bitrate), _) => Ok(bitrate),
            (None, BusSpec::Sim { file }) => Ok(session::virtual_world(file.as_deref())?.0.bitrate()),
            (None, _) => Err(Failure::usage("which bit rate has the bus?").next("add --bitrate, as in --bitrate 500k")),
        }
    }

    async fn plan(&self, context: &Context, bitrate: Bitrate) -> Result<PlanReport, Failure> {
        let moved = context.machine.as_ref().filter(|_| self.modes.is_empty()).and_then(Machine::fullest_cycle);
        let cycle_time = self.cycle.or(moved.as_ref().map(|moved| moved.period)).unwrap_or(CYCLE);
        let nodes = self.nodes(context, moved.as_ref()).await?;
        let some = |time: Duration| (!time.is_zero()).then_some(time);
        let settings = Settings {
            jitter: self.jitter,
            queue: if self.by_priority { HostQueue::Priority } else { HostQueue::Fifo },
            sdo: some(self.sdo),
            emcy: some(self.emcy),
            host_heartbeat: some(self.heartbeat).map(|time| (NodeId::MAX, time)),
            errors: some(self.errors).map(ErrorRate),
            ..Settings::new(cycle_time)
        };
        let all = plan(&nodes, &settings, bitrate);
        let cycle = plan(&nodes, &settings.cycle_alone(), bitrate);
        let mut notes: Vec<String> = all.remarks.iter().map(ToString::to_string).collect();
        if !nodes.iter().any(|node| node.pdos.iter().any(|(config, id)| id.is_valid() && !config.map.0.is_empty())) {
            notes.push("no PDO carries anything: --mode plans with what a mode of operation needs".into());
        }
        let fits = all.fits();
        // What stops nothing but in the moment of a fault is no reason not to begin.
        let ok = fits || moved.is_some() && cycle.fits();
        if ok && !fits && !all.is_tolerable(&cycle, TOLERANCE) {
            notes.push(format!(
                "SDO requests and EMCY beside the cycle may keep a PDO away for more than the {TOLERANCE} cycles that are tolerated, and so \
                 stop the motion: take a longer period, or ask nothing meanwhile (--sdo 0s shows what that gives)"
            ));
        }
        if let Some(full) = too_full(&nodes, &settings, bitrate, &cycle) {
            notes.extend([full.what, full.next]);
        }
        Ok(PlanReport {
            ok,
            fits,
            moved: moved.map(|moved| moved.what),
            bitrate: bitrate.bits_per_second(),
            cycle_us: us(cycle_time),
            load: rounded(all.load, 1e4),
            cycle_load: rounded(cycle.load, 1e4),
            frames: all.frames.iter().map(|frame| Row::new(frame, &cycle)).collect(),
            most_drives: most_nodes(&nodes, &settings, bitrate),
            most_drives_in_cycle: most_nodes(&nodes, &settings.cycle_alone(), bitrate),
            drives: nodes.len(),
            notes,
        })
    }

    /// What each node sends: as it is set up, or on a virtual bus as the machine file has it set up, and in the cycles of what is moved or
    /// in the modes that were asked for.
    async fn nodes(&self, context: &Context, moved: Option<&CyclePlan>) -> Result<Vec<NodeTraffic>, Failure> {
        let asked = |count| context.progress.count(format!("asked {count} of 127"));
        let mut found: Vec<NodeId> =
            context.network.scan(context.timeout(), asked).await.iter().map(|found| found.node).collect();
        found.sort_unstable();
        let modes = self.modes.iter().filter_map(|(node, _)| *node);
        if let Some(missing) = modes.clone().find(|node| !found.contains(node)) {
            return Err(Failure::usage(format!("--mode names node {missing}, and nobody is there")).at_node(missing));
        }
        let mut nodes = Vec::new();
        for id in found {
            context.progress.show(format!("node {id}: reading its PDOs"));
            let drive = context.drive(id).await?;
            let read = NodeTraffic::of(&drive).await?;
            // Real drives have been set up, or not.
            let file = context.machine.as_ref().filter(|_| context.is_embedded());
            let set_up = file.map_or_else(|| read.clone(), |machine| machine.set_up(read.clone()));
            let own = self.modes.iter().rev().find(|(node, _)| *node == Some(id));
            let asked = own.or_else(|| self.modes.iter().rev().find(|(node, _)| node.is_none()));
            let wrong = |error: &dyn fmt::Display| Failure::new(error.to_string()).at_node(id);
            nodes.push(match (asked, moved) {
                (Some((_, mode)), _) => set_up.in_cycles(&drive, *mode, false).map_err(|error| wrong(&error))?,
                (None, Some(moved)) => moved.traffic(&drive, set_up).map_err(|error| wrong(&error))?,
                (None, None) => set_up,
            });
        }
        if nodes.is_empty() {
            return Err(Failure::new("nobody is on the bus").of_kind("nobody").next("ferrodrive scan says more"));
        }
        Ok(nodes)
    }
}

impl Row {
    fn new(frame: &PlannedFrame, cycle: &BusPlan) -> Self {
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

impl Report for PlanReport {
    fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&[
            "frame",
            "node",
            "id",
            "bytes",
            "every",
            "on the wire",
            "at most",
            "in a cycle alone",
            "until",
            "",
        ]);
        let time = |us: f64| if us >= 10_000.0 { format!("{:.1} ms", us / 1e3) } else { format!("{us:.0} us") };
        for row in &self.frames {
            let node = row.node.map_or_else(String::new, |node| node.to_string());
            let verdict = if row.in_time { "" } else { "late" };
            table.row([
                row.frame.clone(),
                node,
                format!("{}h", row.id),
                row.bytes.to_string(),
                time(row.every_us),
                time(row.wire_us),
                row.worst_us.map_or_else(|| "no bound".to_owned(), time),
                row.cycle_worst_us.map_or_else(|| "-".to_owned(), time),
                time(row.deadline_us),
                verdict.to_owned(),
            ]);
        }
        let mut lines =
            vec![table.text(paint, |_, column, cell| (column == 9 && !cell.is_empty()).then(|| paint.bad(cell)))];
        lines.push(String::new());
        lines.push(format!(
            "{} {:.1} % of {} kbit/s at most, {:.1} % in a cycle without SDO and EMCY",
            paint.strong("load"),
            100.0 * self.load,
            self.bitrate / 1_000,
            100.0 * self.cycle_load
        ));
        let cycle = time(self.cycle_us);
        let verdict = match (self.fits, self.ok) {
            (true, _) => paint.good("everything is there in time"),
            (false, true) => format!(
                "{}, and beside SDO and EMCY what is marked is late",
                paint.good("in a cycle alone everything is there in time")
            ),
            (false, false) => paint.bad("not everything is there in time"),
        };
        let moved = self.moved.iter().map(|moved| format!(", {moved} of the machine file")).collect::<String>();
        lines.push(format!("{} {verdict} at a cycle of {cycle}{moved}", paint.strong("verdict")));
        lines.push(format!(
            "{} {} like these at this cycle ({} while there is no SDO and no EMCY); here are {}",
            paint.strong("room for"),
            self.most_drives,
            self.most_drives_in_cycle,
            self.drives
        ));
        lines.extend(self.notes.iter().map(|note| format!("note: {note}")));
        lines.join("\n")
    }
}
