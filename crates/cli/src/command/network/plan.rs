//! `ferrodrive plan`: whether everything fits the bus, and how late each frame may come.

use std::path::PathBuf;
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use cia402::ModeOfOperation;
use host::network::plan::{CYCLE, PlanReport, SHORTEST_CYCLE, traffic};
use machine::file::{CyclePlan, Machine};
use master::plan::{ErrorRate, HostQueue, NodeTraffic, Settings};
use master::units::parse_duration;
use transport::BusSpec;
use words::mode::mode;
use words::node::node;

use crate::context::Context;
use crate::failure::Failure;
use crate::global::Global;
use crate::output::{Format, Report};
use crate::session;
use plot::Paint;
use plot::Table;

/// Plan a bus: bus load, worst-case delay of every frame, how many such drives fit
///
/// Takes the frames from the PDO configuration of the nodes: of virtual drives of a machine file, or of those on a real
/// bus, which is only read. The [[group]] or the [base] of the file is planned as it will run, with its period, its
/// modes and its PDOs; of several, the one that fills the bus most. The times are upper bounds: whatever coincides, no
/// frame of a bus without errors is later (CAN schedulability analysis of Davis, Burns, Bril and Lukkien, 2007). Each
/// RPDO is sent once in a cycle; a frame has to arrive before the next of its kind is due, and a PDO before the next
/// SYNC. Ends with status 1 if a frame is late; with a group or base, which tolerates two cycles without a PDO, if one
/// is late in a cycle alone, without SDO and EMCY.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive plan machine.toml                            # its group or base\n  \
    ferrodrive plan machine.toml --cycle 5ms --mode pv      # the PDOs of pv\n  \
    ferrodrive --bus can0 plan --cycle 10ms --bitrate 500k  # as mapped now")]
pub(crate) struct Plan {
    /// Machine file whose drives are planned (default: those on --bus)
    #[arg(value_name = "FILE.toml")]
    file: Option<PathBuf>,
    /// Period of SYNC (default: that of the file's group or base, or 10ms)
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    cycle: Option<Duration>,
    /// Plan with the PDOs that this mode of operation needs for a set-point with each SYNC, instead of those that are
    /// mapped
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
    /// Shortest time between two frames that the bus destroys; 0 for never
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "0s")]
    errors: Duration,
    /// Assume that the host's controller sends the most urgent frame first, not in the order given
    #[arg(long)]
    by_priority: bool,
}

fn node_mode(text: &str) -> Result<(Option<NodeId>, ModeOfOperation), String> {
    match text.split_once('=') {
        Some((id, name)) => Ok((Some(node(id)?), mode(name)?)),
        None => Ok((None, mode(text)?)),
    }
}

impl Plan {
    /// Plans, and fails if something is late.
    pub(crate) fn run(&self, global: &Global, format: Format) -> Result<(), Failure> {
        if self.cycle.is_some_and(|cycle| cycle < SHORTEST_CYCLE) {
            return Err(Failure::usage("--cycle is too short")
                .because("expected 250us or more")
                .next("give the period of SYNC, e.g. --cycle 10ms"));
        }
        let mut global = global.clone();
        if let Some(file) = &self.file {
            global.refuse_another(file)?;
            global.bus = BusSpec::Sim { file: Some(file.clone()) };
        }
        let bitrate = self.bitrate_of(&global.bus)?;
        let report = session::run(&global, async |context| self.plan(context, bitrate).await)?;
        let failure = (!report.ok).then(|| {
            let failure = Failure::new("some frames are late").of_kind("bus_load");
            let failure = failure
                .next("take a longer --cycle, a higher --bitrate or fewer drives; the notes say why they are late");
            failure.next(
                "--sdo 0s and --emcy 0s plan the cycle alone, as it runs while nothing is asked and nothing fails",
            )
        });
        format.print_judged(&report, failure)
    }

    fn bitrate_of(&self, bus: &BusSpec) -> Result<Bitrate, Failure> {
        match (self.bitrate, bus) {
            (Some(bitrate), _) => Ok(bitrate),
            (None, BusSpec::Sim { file }) => Ok(session::virtual_world(file.as_deref())?.0.bitrate()),
            (None, _) => {
                Err(Failure::usage("the bit rate of the bus is not known").next("give --bitrate, e.g. --bitrate 500k"))
            }
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
        Ok(PlanReport::new(&nodes, &settings, bitrate, moved))
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
            return Err(Failure::new(format!("--mode names node {missing}, which does not answer"))
                .of_kind("no_answer")
                .at_node(missing)
                .next("ferrodrive scan shows which nodes answer"));
        }
        let mut nodes = Vec::new();
        for id in found {
            context.progress.show(format!("node {id}: reading its PDOs"));
            let drive = context.drive(id).await?;
            // Real drives have been set up, or not.
            let file = context.machine.as_ref().filter(|_| context.is_embedded());
            let own = self.modes.iter().rev().find(|(node, _)| *node == Some(id));
            let asked = own.or_else(|| self.modes.iter().rev().find(|(node, _)| node.is_none()));
            nodes.push(traffic(&drive, file, asked.map(|(_, mode)| *mode), moved).await?);
        }
        if nodes.is_empty() {
            return Err(Failure::new("no node answers on the bus")
                .of_kind("no_node")
                .next("ferrodrive scan shows more"));
        }
        Ok(nodes)
    }
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
            (true, _) => paint.good("no frame is late"),
            (false, true) => format!(
                "{}, and beside SDO and EMCY the marked frames are late",
                paint.good("in a cycle alone no frame is late")
            ),
            (false, false) => paint.bad("some frames are late"),
        };
        let moved = self.moved.iter().map(|moved| format!(", {moved} of the machine file")).collect::<String>();
        lines.push(format!("{} {verdict} at a cycle of {cycle}{moved}", paint.strong("verdict")));
        lines.push(format!(
            "{} {} such drives at this cycle ({} without SDO and EMCY); {} are planned",
            paint.strong("room for"),
            self.most_drives,
            self.most_drives_in_cycle,
            self.drives
        ));
        lines.extend(self.notes.iter().map(|note| format!("note: {note}")));
        lines.join("\n")
    }
}
