//! `ferrodrive capture`: quantities of a drive at the rate that it and the bus have, into a file that `plot` reads.

use std::path::{Path, PathBuf};
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use canopen::pdo::PdoId;
use host::capture::{CapturePlan, Measurand, Running, SeenBy, Span, Taken, Trigger, Wanted, Way};
use machine::file::tpdo_id;
use master::Drive;
use master::units::parse_duration;
use recording::{Capture as Captured, Kind, Trace};
use serde::Serialize;
use serve::files::{check_record, create_record};
use words::counted;
use words::node::node;

use crate::command::configure::params::journal::{default_path, note_kept};
use crate::command::repeat::period;
use crate::context::{Context, Restorer};
use crate::failure::Failure;
use crate::output::{Report, file_path, is_stdout, refuse_json_beside, stdout_file};
use crate::plain::plain;
use console::numbers::whole;
use plot::{Paint, Table};
use words::time::some_time;

/// How long a trigger is waited for where no other program can bring it about.
const ARMED: Duration = Duration::from_secs(60);

/// Capture quantities of a drive, fast
///
/// Maps what is asked for into spare TPDOs, which the drive then sends by their event timer or with SYNC, and puts
/// everything back at the end: mapping, timers and NMT state, after a kill by `ferrodrive params rollback`. Nothing is
/// moved. QUANTITY is position, velocity, current, their demands (target_position, position_demand, following_error,
/// target_velocity, velocity_demand, target_current, current_demand), supply, motor_temperature, driver_temperature, or
/// an object by its name or number; on --bus sim also what is true of the virtual drive, by the names of --record:
/// true_velocity, true_shaft_angle, true_winding.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive capture 4 velocity current --for 2s --rate 1ms -o x.mcap\n  \
    ferrodrive --bus can0 capture 4 velocity --trigger 'velocity > 10' --pre 50ms")]
pub(crate) struct Capture {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Quantities: velocity, target_velocity, current, .., or objects
    #[arg(value_name = "QUANTITY", required = true)]
    quantities: Vec<String>,
    #[command(flatten)]
    how: CaptureArgs,
    /// Length of the capture, from its begin or its trigger
    #[arg(long = "for", value_name = "TIME", value_parser = some_time, default_value = "1s")]
    duration: Duration,
    /// Begin when a quantity passes a value: 'velocity > 10' rising, 'velocity < 10' falling
    #[arg(long, value_name = "QUANTITY > NUMBER")]
    trigger: Option<Trigger>,
    /// Keep this much of before the trigger
    #[arg(long = "pre", value_name = "TIME", value_parser = parse_duration, default_value = "0s", requires = "trigger")]
    pre_trigger: Duration,
    /// Captures to take, one after the other; each has a file of its own, NAME-2 and on
    #[arg(long, value_name = "N", value_parser = |text: &str| whole(text, 1..=999_u32), default_value = "1")]
    count: u32,
    /// Write to this file, NAME.mcap or NAME.csv: new, empty, or an earlier record, which is replaced; - writes CSV to
    /// standard output
    #[arg(long, short, value_name = "FILE", value_parser = capture_output)]
    output: Option<PathBuf>,
    /// Name of the capture (default: that of its file)
    #[arg(long, value_name = "TEXT")]
    name: Option<String>,
    /// Notes that are kept with it
    #[arg(long, value_name = "TEXT", default_value = "")]
    notes: String,
}

/// Time between two readings, where none is given.
pub(in crate::command) const USUAL_RATE: Duration = Duration::from_millis(1);

/// How it is captured.
#[derive(Debug, clap::Args)]
pub(in crate::command) struct CaptureArgs {
    /// Sampling period or rate: 1ms, 500Hz (default: 1ms; of points in cycles, their period)
    #[arg(long, value_name = "TIME", value_parser = rate)]
    rate: Option<Duration>,
    /// Use this TPDO too, although it is in use: tpdo1; its listeners miss it meanwhile
    #[arg(long, value_name = "TPDO", value_parser = tpdo_id, hide_short_help = true)]
    take: Vec<PdoId>,
    /// Read by SDO what cannot come by TPDO
    #[arg(long)]
    sdo: bool,
    /// Bit rate of the bus, for its load
    #[arg(long, value_name = "RATE", default_value = "500k", hide_short_help = true)]
    bitrate: Bitrate,
    /// File for the journal of what is to be put back
    #[arg(long, value_name = "FILE", value_parser = file_path, hide_short_help = true)]
    journal: Option<PathBuf>,
}

pub(in crate::command) fn capture_file(text: &str) -> Result<PathBuf, String> {
    Kind::of_name(text).map(|_| text.into()).ok_or_else(|| "a capture is called NAME.mcap or NAME.csv".to_owned())
}

/// A capture that is written.
pub(in crate::command) fn capture_output(text: &str) -> Result<PathBuf, String> {
    if text == "-" {
        return Ok(text.into());
    }
    capture_file(text).map_err(|error| format!("{error}, or - for standard output"))
}

/// `1ms`, or `500Hz`.
fn rate(text: &str) -> Result<Duration, String> {
    let lower = text.trim().to_ascii_lowercase();
    let hertz = match (lower.strip_suffix("khz"), lower.strip_suffix("hz")) {
        (Some(number), _) => number.trim().parse().ok().map(|khz: f64| khz * 1e3),
        (None, Some(number)) => number.trim().parse().ok(),
        (None, None) => return period(text),
    };
    let seconds = hertz.filter(|hertz| *hertz > 0.0).and_then(|hertz| Duration::try_from_secs_f64(1.0 / hertz).ok());
    let time = seconds.ok_or_else(|| format!("expected a rate such as 1ms or 500Hz, got '{text}'"))?;
    period(&format!("{}ns", time.as_nanos()))
}

/// What was captured.
#[derive(Debug, Serialize)]
pub(crate) struct CaptureReport {
    node: u8,
    model: String,
    /// What makes the TPDOs come; null where all was read by SDO.
    pace: Option<String>,
    /// Share of the bus's time that this node's TPDOs and SYNC take at most.
    load: Option<f64>,
    /// By what the node was seen to be pre-operational again (`heartbeat`, `no more frames`, `nothing`); null where it was operational before.
    nmt_back: Option<&'static str>,
    #[serde(skip)]
    left_operational: Option<SeenBy>,
    captures: Vec<CaptureRow>,
}

/// One of them.
#[derive(Debug, Serialize)]
pub(crate) struct CaptureRow {
    name: String,
    /// Null where none was asked for.
    pub(in crate::command) file: Option<String>,
    rows: usize,
    duration_s: f64,
    trigger_s: Option<f64>,
    cut_off: bool,
    traces: Vec<TraceRow>,
}

/// What was had of a quantity.
#[derive(Debug, Serialize)]
pub(crate) struct TraceRow {
    quantity: String,
    unit: String,
    /// `TPDO1`, or `SDO`.
    by: String,
    readings: usize,
    /// Null with fewer than two readings.
    period_s: Option<f64>,
    jitter_s: Option<f64>,
    gaps: usize,
    least: Option<f64>,
    most: Option<f64>,
}

impl CaptureArgs {
    /// What a host captures by these.
    pub(in crate::command) async fn wanted(
        &self,
        context: &Context,
        drive: &Drive,
        names: &[String],
        usual: Duration,
    ) -> Result<Wanted, Failure> {
        let mut quantities = Vec::new();
        for name in names {
            let quantity = Measurand::named(drive, context.true_values.as_ref(), name).await?;
            if !quantities.contains(&quantity) {
                quantities.push(quantity);
            }
        }
        let journal = self.journal.clone().unwrap_or_else(|| default_path(drive.node().id()));
        Ok(Wanted {
            quantities,
            period: self.rate.unwrap_or(usual),
            bitrate: self.bitrate,
            take: self.take.clone(),
            by_sdo: self.sdo,
            // A virtual bus of this command ends with it, and nothing is left to go back to.
            journal: (!context.is_embedded()).then_some(journal),
            on_kept: note_kept,
        })
    }
}

impl Capture {
    /// Captures, saves, and puts everything back.
    pub(crate) async fn run(&self, context: &Context) -> Result<CaptureReport, Failure> {
        let drive = context.known_drive(self.node).await?;
        let wanted = self.how.wanted(context, &drive, &self.quantities, USUAL_RATE).await?;
        let (trigger, pre_trigger) = (self.trigger.clone(), self.pre_trigger);
        let span = Span { duration: self.duration, trigger, pre_trigger };
        wanted.check(&span)?;
        check_place(context, self.output.as_deref(), self.count)?;
        context.progress.show(format!("node {}: setting its TPDOs up", self.node));
        let restorer = host::capture::Restorer::of(&drive);
        context.restore_at_end(Restorer::Capture(restorer.clone()));
        let mut running = wanted.begin(&drive, &restorer).await?;
        let captured = self.take(context, &mut running, &span).await;
        let mut report = CaptureReport::new(&drive, running.plan());
        // Whatever came of it, the drive is as it was before anything is reported.
        let left = context.restore().await.unwrap_or_default();
        let (rows, failure) = captured;
        report.captures = rows;
        report.left_operational = restorer.left_operational();
        report.nmt_back = report.left_operational.map(SeenBy::word);
        let failure = match failure.or(not_put_back(self.node, &left)) {
            None => {
                beside_stdout(context, self.output.as_deref(), || report.shown(Paint::OFF));
                return Ok(report);
            }
            Some(failure) => failure,
        };
        let failure = left.iter().fold(failure, |failure, left| failure.because(format!("not put back: {left}")));
        let saved = report.captures.iter().filter_map(|row| row.file.as_deref());
        Err(saved.fold(failure, |failure, file| failure.because(format!("saved: {file}"))))
    }

    /// Takes them; those before a failure are there.
    async fn take(&self, context: &Context, running: &mut Running, span: &Span) -> (Vec<CaptureRow>, Option<Failure>) {
        let mut rows = Vec::new();
        for number in 1..=self.count {
            let waits = if span.trigger.is_some() { "armed" } else { "capturing" };
            context.progress.show(format!("node {}: {waits}, {number} of {}", self.node, self.count));
            let until = context.network.now() + ARMED + span.pre_trigger + span.duration;
            // No other program acts on a bus of its own, whose time passes as fast as it can be computed.
            let is_over = || context.is_embedded() && context.network.now() >= until;
            let Taken { mut capture, cut_off, .. } = match running.next_until(span, is_over).await {
                Ok(taken) => taken,
                Err(failure) => return (rows, Some(failure.into())),
            };
            if span.trigger.is_some() && cut_off.is_none() && capture.time_s.is_empty() {
                let failure = Failure::new(format!("node {}: the trigger has not come within {ARMED:?}", self.node));
                let failure = failure.of_kind("no_trigger").at_node(self.node);
                let why = "the bus of this command is its own: no other program moves its drives";
                return (rows, Some(failure.because(why).next("name a bus that others are on, as --bus can0")));
            }
            let file = self.output.as_deref().map(|path| numbered(path, number));
            let of_file = file
                .as_deref()
                .filter(|path| !is_stdout(path))
                .and_then(Path::file_stem)
                .map(|stem| stem.to_string_lossy().into_owned());
            capture.name = self.name.clone().or(of_file).unwrap_or_default();
            capture.notes.clone_from(&self.notes);
            if let Some(Err(failure)) = file.as_deref().map(|path| save(&capture, path)) {
                return (rows, Some(failure));
            }
            rows.push(CaptureRow::new(&capture, file, running.ways()));
            if let Some(failure) = cut_off {
                return (rows, Some(failure.into()));
            }
        }
        (rows, None)
    }
}

/// `x.mcap`, `x-2.mcap`, ..
pub(in crate::command) fn numbered(path: &Path, number: u32) -> PathBuf {
    if number == 1 {
        return path.to_owned();
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{number}.{ending}"))
}

/// Refuses files that [`save`] could not write, as they are at present, before anything is captured for them.
pub(in crate::command) fn check_place(context: &Context, path: Option<&Path>, count: u32) -> Result<(), Failure> {
    refuse_json_beside("a capture", path, context.prints_json())?;
    if path.is_some_and(is_stdout) {
        return match count {
            1 => Ok(()),
            _ => Err(Failure::usage("standard output takes one capture, and --count asks for several")
                .next("give --output a file: further captures are NAME-2, NAME-3")),
        };
    }
    for path in path.iter().flat_map(|path| (1..=count).map(|number| numbered(path, number))) {
        check_record(&path, kind_of(&path)).map_err(|error| Failure::of_writing("the capture", &path, &error))?;
    }
    Ok(())
}

/// That not everything of a node was put back, and what to do; `None` if nothing is left.
pub(in crate::command) fn not_put_back(node: NodeId, left: &[String]) -> Option<Failure> {
    let next = format!("when it answers again: ferrodrive params rollback {node}");
    host::capture::not_put_back(node, left).map(|failure| Failure::from(failure).next(next))
}

/// What is reported beside a capture on standard output, where nothing else is to be: a note for people.
pub(in crate::command) fn beside_stdout(context: &Context, path: Option<&Path>, text: impl FnOnce() -> String) {
    if path.is_some_and(is_stdout) {
        context.progress.clear();
        context.note(&text());
    }
}

/// By the name, which [`capture_file`] has looked at.
fn kind_of(path: &Path) -> Kind {
    Kind::of_name(&path.to_string_lossy()).unwrap_or(Kind::Csv)
}

/// Writes a capture to its file.
pub(in crate::command) fn save(capture: &Captured, path: &Path) -> Result<(), Failure> {
    let kind = kind_of(path);
    let file = if is_stdout(path) { stdout_file() } else { create_record(path, kind) };
    let written = file.and_then(|file| capture.write(kind, Box::new(file)));
    written.map_err(|error| Failure::of_writing("the capture", path, &error))
}

impl CaptureReport {
    fn new(drive: &Drive, plan: Option<&CapturePlan>) -> Self {
        Self {
            node: drive.node().id().raw(),
            model: drive.description().map_or_else(String::new, |model| model.name.to_owned()),
            pace: plan.map(|plan| plan.pace.words()),
            load: plan.map(|plan| (plan.load * 1e4).round() / 1e4),
            nmt_back: None,
            left_operational: None,
            captures: Vec::new(),
        }
    }
}

impl CaptureRow {
    pub(in crate::command) fn new(capture: &Captured, file: Option<PathBuf>, ways: &[Way]) -> Self {
        let traces = capture.traces.iter().zip(ways).map(|(trace, way)| TraceRow::new(trace, way));
        Self {
            name: capture.name.clone(),
            file: file.map(|path| path.display().to_string()),
            rows: capture.time_s.len(),
            duration_s: capture.time_s.last().copied().unwrap_or_default(),
            trigger_s: capture.trigger_s,
            cut_off: capture.is_cut_off,
            traces: traces.collect(),
        }
    }
}

impl TraceRow {
    fn new(trace: &Trace, way: &Way) -> Self {
        let values = || trace.values.iter().copied().filter(|value| value.is_finite());
        let known = |value: f64| value.is_finite().then_some(value);
        Self {
            quantity: trace.quantity.clone(),
            unit: trace.unit.clone(),
            by: way.to_string(),
            readings: values().count(),
            // To a tenth of a microsecond: what a bus has between two frames is longer.
            period_s: known((trace.period_s * 1e7).round() / 1e7),
            jitter_s: known((trace.jitter_s * 1e7).round() / 1e7),
            gaps: trace.gaps,
            least: values().reduce(f64::min),
            most: values().reduce(f64::max),
        }
    }
}

impl Report for CaptureReport {
    fn text(&self, paint: Paint) -> String {
        // The capture is there already, and nothing else is to be in it.
        let on_stdout = self.captures.iter().any(CaptureRow::is_on_stdout);
        if on_stdout { String::new() } else { self.shown(paint) }
    }
}

impl CaptureReport {
    fn shown(&self, paint: Paint) -> String {
        let mut parts = Vec::new();
        for row in &self.captures {
            parts.push(row.text(paint));
        }
        let how = match (&self.pace, self.load) {
            (Some(pace), Some(load)) => {
                format!("by {pace}; this node's TPDOs and SYNC took {:.0} % of the bus at most; ", 100.0 * load)
            }
            _ => String::new(),
        };
        let nmt = self.left_operational.map_or_else(String::new, |seen| format!("; {}", seen.words()));
        parts.push(format!("{how}the PDOs of node {} are set up as they were before{nmt}", self.node));
        parts.join("\n")
    }
}

impl CaptureRow {
    pub(in crate::command) fn is_on_stdout(&self) -> bool {
        self.file.as_deref().is_some_and(|file| is_stdout(Path::new(file)))
    }

    pub(in crate::command) fn text(&self, paint: Paint) -> String {
        let name = self.file.as_deref().unwrap_or("not saved (-o FILE)");
        let trigger = self.trigger_s.map_or_else(String::new, |at| format!(", trigger at {at:.4} s"));
        let rows = counted(self.rows, "row");
        let head = format!("{}: {rows} in {:.4} s{trigger}", paint.strong(&plain(name)), self.duration_s);
        let mut table = Table::new(&["quantity", "by", "readings", "every", "jitter", "gaps", "least", "most"]);
        for trace in &self.traces {
            let ms = |time: Option<f64>| time.map_or_else(|| "-".to_owned(), |time| format!("{:.4} ms", time * 1e3));
            let value =
                |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3} {}", trace.unit));
            table.row([
                trace.quantity.clone(),
                trace.by.clone(),
                trace.readings.to_string(),
                ms(trace.period_s),
                ms(trace.jitter_s),
                trace.gaps.to_string(),
                value(trace.least),
                value(trace.most),
            ]);
        }
        format!("{head}\n{}", table.plain(paint))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_a_time_or_a_frequency() {
        assert_eq!(rate("1ms"), Ok(Duration::from_millis(1)));
        assert_eq!(rate("500Hz"), Ok(Duration::from_millis(2)));
        assert_eq!(rate("2 kHz"), Ok(Duration::from_micros(500)));
        for text in ["0Hz", "-1Hz", "NaNHz", "fastHz", "1us", "1", "infHz"] {
            assert!(rate(text).is_err(), "{text}");
        }
    }

    #[test]
    fn further_captures_have_names_of_their_own() {
        let named = |number| numbered(Path::new("runs/step.mcap"), number).display().to_string();
        assert_eq!((named(1), named(2)), ("runs/step.mcap".to_owned(), "runs/step-2.mcap".to_owned()));
    }
}
