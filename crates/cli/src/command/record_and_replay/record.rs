//! `ferrodrive record`: objects of nodes over time, on any bus, into a file that `plot` and Foxglove read.

use std::path::{Path, PathBuf};
use std::time::Duration;

use can::Instant;
use canopen::NodeId;
use canopen::pdo::{Direction, PdoId, PdoNumber};
use host::capture::{Form, Quantity};
use master::core::Event;
use master::decode::{common_row, common_type};
use master::pdo::TimerUnits;
use master::units::parse_duration;
use master::{Drive, Node};
use recording::{Batch, Channels, Column, Kind, Mark, Severity, Subject};
use serde::Serialize;
use sim::Place;
use words::counted;
use words::node::node;
use words::object::{ObjectArg, object};

use console::command::object::resolve;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::{Report, is_stdout, refuse_json_beside, stdout_file};
use crate::recording::ViewerOptions;
use plot::Paint;
use serve::files::create_record;
use serve::messages::Messages;
use serve::writing::{Pace, RecordFile, RecordOutput};
use words::time::some_time;

/// Record objects of a node over time
///
/// Reads each object repeatedly, from the TPDOs that carry it where the node sends some, otherwise by SDO, and writes
/// the values in their units to a file that ferrodrive plot draws: .mcap (for Foxglove, PlotJuggler, Rerun; with the
/// frames of other nodes) or .csv. Nothing is written to the node. With SDO no other program may ask the same node
/// meanwhile: CiA 301 gives each node one channel, and each program would take the other's answers. Ends after --for,
/// or with Ctrl-C; everything older than a second is on the disk by then.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive record 4 velocity_actual_value 6064 -o run.mcap --for 10s\n  \
    ferrodrive --bus can0 record 4 606C 6077 --every 20ms -o run.csv\n  ferrodrive plot run.mcap")]
pub(crate) struct Record {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Objects: index, index:sub-index or name
    #[arg(value_name = "OBJECT", required = true, value_parser = object)]
    objects: Vec<ObjectArg>,
    /// Write to this file, NAME.mcap or NAME.csv: new, empty, or an earlier record, which is replaced; - writes CSV to
    /// standard output
    #[arg(long = "output", short = 'o', alias = "out", value_name = "FILE", value_parser = record_file)]
    out: (PathBuf, Kind),
    /// Time between two samples
    #[arg(long, value_name = "TIME", default_value = "10ms", value_parser = sample_time)]
    every: Duration,
    /// End after this time (default on an embedded virtual bus: 1s)
    #[arg(long = "for", value_name = "TIME", value_parser = some_time)]
    duration: Option<Duration>,
    #[command(flatten)]
    viewers: ViewerOptions,
}

fn record_file(text: &str) -> Result<(PathBuf, Kind), String> {
    if text == "-" {
        return Ok((text.into(), Kind::Csv));
    }
    let kind =
        Kind::of_name(text).ok_or("a record is called NAME.mcap or NAME.csv; for frames alone there is --log")?;
    Ok((text.into(), kind))
}

/// An SDO takes some hundred microseconds.
fn sample_time(text: &str) -> Result<Duration, String> {
    let time = parse_duration(text).map_err(|error| error.to_string())?;
    if time < Duration::from_millis(1) {
        Err("an SDO takes most of a millisecond; give 1ms or more".into())
    } else {
        Ok(time)
    }
}

/// Recorded of an embedded bus, whose time is virtual.
const EMBEDDED_DURATION: Duration = Duration::from_secs(1);

/// How often what was sampled is handed to the disk, and how long that may take at the end.
const HANDED_ON: Duration = Duration::from_millis(200);
const DISK_PATIENCE: Duration = Duration::from_secs(10);

/// A value that came by PDO is good for so long; then the node is asked.
const PDO_FRESH: Duration = Duration::from_secs(1);

/// TPDOs that are looked at for the objects: those of the predefined connection set.
const TPDOS: u16 = 4;

/// An object that is recorded.
struct RecordedObject {
    quantity: Quantity,
    /// Its type is known by a table.
    is_typed: bool,
    column: Column,
}

/// What was recorded.
#[derive(Debug, Serialize)]
pub(crate) struct RecordReport {
    file: String,
    node: u8,
    signals: Vec<String>,
    samples: u64,
    /// Values that came by PDO.
    by_pdo: u64,
    /// Values that were asked for by SDO.
    by_sdo: u64,
    /// Values that the node did not give.
    missing: u64,
    duration_s: f64,
}

impl Record {
    /// Records until the time is over.
    pub(crate) async fn run(&self, context: &Context) -> Result<RecordReport, Failure> {
        refuse_json_beside("a record", Some(&self.out.0), context.prints_json())?;
        if self.viewers.is_asked_for() && context.is_embedded() {
            return Err(Failure::usage("--foxglove has no meaning where virtual time does not follow the clock")
                .because("this record is over before anyone could look")
                .next("start the drives with ferrodrive sim --serve URL and record with --bus URL, or open the record afterwards"));
        }
        let drive = context.drive(self.node).await?;
        let sources =
            self.objects.iter().map(|object| RecordedObject::new(&drive, object)).collect::<Result<Vec<_>, _>>()?;
        let node = context.node(self.node);
        // Each has to answer once, before there is a file.
        for source in &sources {
            node.upload(source.quantity.object).await?;
        }
        for number in (1..=TPDOS).filter_map(PdoNumber::new) {
            // A TPDO that does not exist, or whose mapping cannot be read, does not matter: then by SDO.
            let _ = node.adopt_pdo(PdoId { direction: Direction::Tpdo, number }, TimerUnits::STANDARD).await;
        }
        let columns: Vec<Column> = sources.iter().map(|source| source.column.clone()).collect();
        let (path, kind) = &self.out;
        let cannot = |error: std::io::Error| Failure::of_writing("the record", path, &error);
        let file = if is_stdout(path) { stdout_file() } else { create_record(path, *kind) };
        let record = file.and_then(|file| recording::Record::exact(*kind, Box::new(file), &columns)).map_err(cannot)?;
        let viewers = self.viewers.start(Channels::exact(&columns), |note| context.note(note))?;
        let file = Some(RecordFile::start(record, Pace::RealTime, Messages::of_warnings()));
        let mut output = RecordOutput { file, viewers };
        let mut report = RecordReport {
            file: path.display().to_string(),
            node: self.node.raw(),
            signals: columns.iter().map(Column::name).collect(),
            samples: 0,
            by_pdo: 0,
            by_sdo: 0,
            missing: 0,
            duration_s: 0.0,
        };
        self.sample(context, &node, &sources, &mut output, &mut report).await;
        output.finish(DISK_PATIENCE)?;
        if is_stdout(path) {
            context.progress.clear();
            context.note(&report.summary(Paint::OFF));
        }
        Ok(report)
    }

    async fn sample(
        &self,
        context: &Context,
        node: &Node,
        sources: &[RecordedObject],
        output: &mut RecordOutput,
        report: &mut RecordReport,
    ) {
        let network = &context.network;
        let begin = network.now();
        let end = self.duration.or(context.is_embedded().then_some(EMBEDDED_DURATION)).map(|time| begin + time);
        let mut heard = context.traffic.of_others();
        let mut batch = Batch::default();
        let (mut due, mut handed) = (begin, begin);
        while end.is_none_or(|end| due < end) {
            let now = network.now();
            if due > now {
                network.sleep(due - now).await;
            }
            let at = network.now();
            let mut values = Vec::with_capacity(sources.len());
            for source in sources {
                values.push(source.value(node, at, report).await);
            }
            // Times count from the begin, as those of a simulator's record.
            let since = |at: Instant| Instant::ZERO + (at - begin);
            batch.rows.push((since(at), values));
            report.samples += 1;
            while let Ok(passed) = heard.try_recv() {
                batch.frames.push((since(passed.at), passed.frame));
            }
            while let Some((came, event)) = network.poll_event() {
                batch.marks.extend(mark(since(came), &event));
            }
            if at - handed >= HANDED_ON {
                handed = at;
                output.write(std::mem::take(&mut batch));
                context.progress.show(format!("{} samples", report.samples));
            }
            // What took longer than a period is not made up for.
            due = (due + self.every).max(network.now());
        }
        report.duration_s = (network.now() - begin).as_secs_f64();
        output.write(batch);
    }
}

impl RecordedObject {
    fn new(drive: &Drive, object: &ObjectArg) -> Result<Self, Failure> {
        let (mux, row) = resolve(drive, object)?;
        let quantity = Quantity::of_object(drive, mux, row)?;
        let subject = Subject::Axis(Place::node(drive.node().id().raw()));
        let column = Column { subject, signal: quantity.name.clone().into(), unit: quantity.unit.clone().into() };
        let is_typed = if drive.description().is_some() { row.is_some() } else { common_row(mux).is_some() };
        Ok(Self { quantity, is_typed, column })
    }

    /// The value in its unit; not a number where the node does not give one.
    async fn value(&self, node: &Node, now: Instant, report: &mut RecordReport) -> f64 {
        let Quantity { object, by_sdo, by_pdo, .. } = &self.quantity;
        let received = node.network().received(node.id(), *object);
        if let Some(received) = received.filter(|received| now - received.at < PDO_FRESH) {
            report.by_pdo += 1;
            return by_pdo.value(received.raw as u32);
        }
        match node.upload(*object).await {
            Ok(payload) => {
                report.by_sdo += 1;
                let by_length = common_type(*object, payload.as_bytes().len()).filter(|_| !self.is_typed);
                let data_type = by_length.unwrap_or(by_sdo.data_type);
                Form { data_type, ..*by_sdo }.value(payload.raw())
            }
            Err(_) => {
                report.missing += 1;
                f64::NAN
            }
        }
    }
}

/// What a person wants marked in a picture.
fn mark(at: Instant, event: &Event) -> Option<Mark> {
    let (node, severity) = match event {
        Event::BootUp(node) | Event::NmtState(node, _) => (node, Severity::Note),
        Event::Emcy(node, emcy) if emcy.code.0 != 0 => (node, Severity::Warning),
        Event::Emcy(node, _) => (node, Severity::Note),
        Event::HeartbeatLost(node, _) => (node, Severity::Fault),
        _ => return None,
    };
    let (of, text) = (format!("node {node}"), event.to_string());
    // The text of a mark names its node.
    let text = text.strip_prefix(&of).map_or(&*text, |rest| rest.trim_start_matches([':', ' '])).to_owned();
    Some(Mark { at, of: of.into(), kind: "".into(), severity, text })
}

impl Report for RecordReport {
    fn text(&self, paint: Paint) -> String {
        // The record is there already, and nothing else is to be in it.
        if is_stdout(Path::new(&self.file)) { String::new() } else { self.summary(paint) }
    }
}

impl RecordReport {
    fn summary(&self, paint: Paint) -> String {
        let Self { file, node, samples, by_pdo, by_sdo, missing, duration_s, .. } = self;
        let mut text = format!(
            "{}: {} of node {node} in {duration_s:.3} s, {} by PDO, {by_sdo} by SDO",
            paint.strong(file),
            counted(*samples, "sample"),
            counted(*by_pdo, "value")
        );
        if *missing > 0 {
            text.push_str(&format!("; {} did not come", counted(*missing, "value")));
        }
        text
    }
}
