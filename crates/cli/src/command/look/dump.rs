//! `ferrodrive dump` and `ferrodrive decode`: a bus or a log in words, line by line.

use std::cell::Cell;
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

use can::{BusFrame, CanId, Frame, Instant};
use canlog::{AnyLogReader, Content, Direction, Entry, Finding, Format as LogFormat, Place, Record};
use canopen::NodeId;
use host::trace::{ByIdentifier, Identifier};
use master::decode::{Decoder, ServiceKind};
use serde::Serialize;
use sim::wire::WireEvent;
use transport::{AnyBus, AsyncBus, BusError, BusSpec, Note, Received, WallClock};

use crate::failure::Failure;
use crate::frames::counts::Counts;
use crate::frames::decoder;
use crate::frames::filter::Filter;
use crate::frames::stamp::{Stamps, TimeForm};
use crate::global::Global;
use crate::output::{Format, Report};
use crate::plain::plain;
use crate::recording::{LogPath, interface_of};
use crate::session::{bus_failure, enter_real_time, exit_on_signal, runtime, virtual_world};
use crate::signals::asked_to_end;
use machine::file::Machine;
use plot::{Paint, Table};
use serve::writing::{CommandLog, Pace};
use words::counted;
use words::time::some_time;

/// Show the traffic of the bus decoded: SDO, PDOs, statuswords in words
///
/// Only listens. On a real bus it runs until Ctrl-C; on a log until its end; on an embedded virtual bus it shows how
/// the drives boot. PDOs are decoded by their mapping. The names of a model's own objects need the model: --model
/// NODE=MODEL, or --machine FILE.toml.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus socketcand://HOST:29536/can0 --model 4=zlac8030l dump\n  \
    ferrodrive --bus slcan:///dev/ttyACM0?bitrate=500k dump --log trace.log\n  \
    ferrodrive --bus log:trace.log --model 4=zlac8030l dump\n  \
    ferrodrive --bus can0 dump --node 4 --service sdo,emcy --time delta\n  \
    ferrodrive --bus can0 dump --identifiers --for 5s\n  \
    ferrodrive --bus can0 dump --object 6041,target_velocity --time absolute")]
pub(crate) struct Dump {
    /// End after this time; with a log, after this time of the log (default on an embedded virtual bus: 2s)
    #[arg(long = "for", value_name = "TIME", value_parser = some_time)]
    duration: Option<Duration>,
    /// Form of the time before each line (`t` of --json does not change)
    #[arg(long, value_name = "FORM", value_enum, default_value_t)]
    time: TimeForm,
    /// One row for each COB-ID at the end: frames, the times between them, the last one
    #[arg(long)]
    identifiers: bool,
    #[command(flatten)]
    filter: Filter,
}

/// Shown of an embedded bus, on which nothing happens after the drives have booted.
const EMBEDDED_DURATION: Duration = Duration::from_secs(2);

/// A frame in words.
#[derive(Debug, Serialize)]
struct FrameLine {
    t: f64,
    frame: String,
    text: String,
    service: &'static str,
    node: Option<u8>,
    /// The objects that it carries, or is part of a transfer of.
    objects: Vec<String>,
    #[serde(skip)]
    stamp: String,
    /// On which bus, in a log that has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    interface: Option<String>,
    /// Whether the program that wrote the log sent it, in a log that has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    sent: Option<bool>,
}

impl Report for FrameLine {
    fn text(&self, paint: Paint) -> String {
        format!("{} {:<20}  {}", paint.dim(&self.stamp), self.frame, self.text)
    }
}

/// What the bus says beside frames.
#[derive(Debug, Serialize)]
struct Noted {
    t: f64,
    /// Its kind.
    note: &'static str,
    text: String,
    #[serde(skip)]
    stamp: String,
}

impl Report for Noted {
    fn text(&self, paint: Paint) -> String {
        format!("{} {:<20}  {}", paint.dim(&self.stamp), "-", paint.bad(&self.text))
    }
}

/// A part of a log that is not read, and was passed over.
#[derive(Debug, Serialize)]
struct Skipped {
    /// Of a text, counted from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<u64>,
    /// Of a binary file, counted from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    byte: Option<u64>,
    /// What stands there, shortened.
    skipped: String,
    reason: String,
}

/// What there was of each identifier.
#[derive(Debug, Serialize)]
struct IdentifierTable(Vec<Identifier>);

impl Report for IdentifierTable {
    fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["COB-ID", "frames", "least ms", "most ms", "service", "last"]);
        self.0.iter().for_each(|row| table.row(row.cells()));
        table.plain(paint)
    }
}

/// What came of a log with parts that are not read.
#[derive(Debug, Serialize)]
struct LogSummary {
    frames: u64,
    lines_skipped: u64,
    fd_frames: u64,
}

/// What is not read is shown one by one up to this many, then only counted: a file that is not a log has thousands.
const SKIPPED_SHOWN: u64 = 20;

/// Where decoded lines and logged frames go.
struct Sink {
    decoder: Decoder,
    filter: Filter,
    stamps: Stamps,
    counts: Counts,
    format: Format,
    /// Where `--log` goes.
    log: CommandLog,
    /// Places of a log that were not read.
    lines_skipped: u64,
    /// The first of them for programs, until a frame shows that the file is a log.
    unsaid: Vec<Skipped>,
    fd_frames: u64,
    /// The form of the log that is shown, if it is one.
    of: Option<LogFormat>,
    /// Every frame is kept, shown or not.
    keeps_all: bool,
    /// An SDO transfer may have set a further identifier of a node that is shown.
    may_have_learned: bool,
    /// Frames by identifier, in place of lines.
    identifiers: Option<ByIdentifier>,
    /// The bus passes on the frames of some identifiers only.
    is_filtered: bool,
    /// A line went to standard output.
    has_printed: Cell<bool>,
}

impl Dump {
    /// Shows frames until there are no more, the time is over, or Ctrl-C.
    pub(crate) fn run(&self, global: &Global, format: Format) -> Result<(), Failure> {
        let file = global.log.as_ref().map(LogPath::create).transpose()?;
        // A log has Unix times already, and a virtual bus begins with time.
        let (zero, pace) = match &global.bus {
            BusSpec::Sim { .. } | BusSpec::Log { .. } => (None, Pace::Free),
            _ => (Some(WallClock::start()), Pace::RealTime),
        };
        let unix_zero = zero.as_ref().map_or(Duration::ZERO, WallClock::unix_zero);
        let (log, writing) = CommandLog::start(file, interface_of(&global.bus), unix_zero, pace);
        let mut sink = Sink::new(self, global, format, log)?;
        let shown = match (&global.bus, &zero) {
            (BusSpec::Sim { file }, _) => self.embedded(file.as_deref(), &mut sink),
            (BusSpec::Log { path }, _) => self.of_log(path, &mut sink),
            (_, Some(clock)) => runtime()?.block_on(self.listen(global, clock, &mut sink)),
            (_, None) => Ok(()),
        };
        let summarised = shown.and_then(|()| sink.show_identifiers()).and_then(|()| sink.summarise());
        // A bus has no end; of a log there would be more.
        let partial = matches!(global.bus, BusSpec::Log { .. }) && sink.has_printed.get();
        let summarised = summarised.map_err(|failure| Failure { partial, ..failure });
        let written = writing.finish();
        summarised.and(written.map_err(Failure::from))
    }

    /// Shows what a log has, as fast as it can be read.
    fn of_log(&self, path: &Path, sink: &mut Sink) -> Result<(), Failure> {
        exit_on_signal();
        let mut reader = open_log(path)?;
        sink.of = Some(reader.format());
        let mut first = None;
        while let Some(entry) = reader.next_entry().map_err(|error| unreadable(path, &error))? {
            match entry {
                Entry::Record(record) => {
                    let at = record.at.unwrap_or(Instant::ZERO);
                    let began = *first.get_or_insert(at);
                    if self.duration.is_some_and(|duration| at > began + duration) {
                        return Ok(());
                    }
                    sink.record(record)?;
                }
                Entry::Finding(finding) => sink.skip(finding)?,
            }
        }
        Ok(())
    }

    fn embedded(&self, file: Option<&Path>, sink: &mut Sink) -> Result<(), Failure> {
        exit_on_signal();
        let (mut world, drives) = virtual_world(file)?;
        for (node, model) in drives {
            sink.decoder.set_model(node, model);
        }
        world.log_mut().set_limit(usize::MAX);
        // The frames of a single drive need a node that acknowledges them.
        world.add_probe();
        world.run_for(self.duration.unwrap_or(EMBEDDED_DURATION));
        while let Some(event) = world.log_mut().pull() {
            if let WireEvent::Frame { end, frame, .. } = event {
                sink.take(end, &frame)?;
            }
        }
        Ok(())
    }

    async fn listen(&self, global: &Global, clock: &WallClock, sink: &mut Sink) -> Result<(), Failure> {
        enter_real_time(global)?;
        let mut bus = global.bus.open(clock).await.map_err(|error| bus_failure(global, &error))?;
        sink.stamps = Stamps::new(self.time, clock.unix_zero());
        let end = self.duration.map(|duration| clock.now() + duration);
        let over = async {
            tokio::select! {
                () = clock.sleep_until_due(end) => Ok(()),
                signal = asked_to_end() => Err(crate::failure::ended_by(signal)),
            }
        };
        tokio::select! {
            result = follow(&mut bus, sink) => result?.map_or(Ok(()), |error| Err(bus_failure(global, &error))),
            result = over => {
                if result.is_err() {
                    sink.show_identifiers()?;
                    sink.report_counts();
                }
                result
            }
        }
    }
}

/// Shows what comes; ends with the bus, with the reason unless it was a log that is over.
async fn follow(bus: &mut AnyBus, sink: &mut Sink) -> Result<Option<BusError>, Failure> {
    let mut asked = Vec::new();
    loop {
        if let Some(wanted) = sink.take_wanted().filter(|wanted| *wanted != asked) {
            match bus.hear_only(&wanted) {
                Ok(filtered) => sink.is_filtered = filtered,
                Err(error) => return Ok(Some(error)),
            }
            asked = wanted;
        }
        match bus.recv().await {
            Ok((at, Received::Frame(frame))) => sink.take(at, &frame)?,
            Ok((at, Received::Note(note))) => sink.note(at, &note)?,
            Err(BusError::EndOfLog { .. }) => return Ok(None),
            Err(error) => return Ok(Some(error)),
        }
    }
}

impl Sink {
    fn new(dump: &Dump, global: &Global, format: Format, log: CommandLog) -> Result<Self, Failure> {
        let stated = global
            .models
            .iter()
            .map(|(_, model)| *model)
            .chain(global.machine.iter().flat_map(Machine::models).map(|(_, model)| model));
        dump.filter.check(&devices::all().iter().chain(stated).collect::<Vec<_>>())?;
        Ok(Self {
            decoder: decoder(global, &[]),
            filter: dump.filter.clone(),
            stamps: Stamps::new(dump.time, Duration::ZERO),
            counts: Counts::default(),
            format,
            log,
            lines_skipped: 0,
            unsaid: Vec::new(),
            fd_frames: 0,
            of: None,
            keeps_all: global.log.is_some(),
            may_have_learned: true,
            identifiers: dump.identifiers.then(ByIdentifier::default),
            is_filtered: false,
            has_printed: Cell::new(false),
        })
    }

    /// The identifiers to ask the bus for, when they may have changed since the last call; none for all.
    fn take_wanted(&mut self) -> Option<Vec<CanId>> {
        let asks = std::mem::take(&mut self.may_have_learned) && !self.keeps_all;
        asks.then(|| self.filter.ids(&self.decoder))
    }

    /// Shows a record of a log, and copies it to the log of `--log`.
    fn record(&mut self, record: Record) -> Result<(), Failure> {
        for skipped in std::mem::take(&mut self.unsaid) {
            self.print_skipped(&skipped)?;
        }
        self.log.record(&record);
        let at = record.at.unwrap_or(Instant::ZERO);
        match &record.content {
            Content::Frame(frame) => {
                let interface = Some(record.interface.to_string());
                let sent = record.direction.map(|direction| direction == Direction::Transmitted);
                self.show(at, frame, interface, sent)
            }
            Content::Error(error) => Note::of_error(*error).try_for_each(|note| self.note(at, &note)),
            Content::FdFrame { id, length } => {
                self.fd_frames += 1;
                self.note(at, &Note::FdFrame { id: *id, length: *length })
            }
        }
    }

    fn take(&mut self, at: Instant, frame: &Frame) -> Result<(), Failure> {
        self.log.frame(frame, at, Direction::Received);
        self.show(at, frame, None, None)
    }

    fn show(
        &mut self,
        at: Instant,
        frame: &Frame,
        interface: Option<String>,
        sent: Option<bool>,
    ) -> Result<(), Failure> {
        let decoded = self.decoder.decode(frame);
        self.may_have_learned |= decoded.service() == ServiceKind::Sdo;
        let wanted = self.filter.takes(&self.decoder, &decoded);
        self.counts.note(at, &decoded, wanted);
        if !wanted {
            return Ok(());
        }
        if let Some(found) = &mut self.identifiers {
            found.take(self.counts.frames() - 1, &BusFrame { at, own: false, frame: *frame }, &decoded);
            return Ok(());
        }
        let line = FrameLine {
            t: at.as_secs_f64(),
            frame: frame.to_string(),
            text: decoded.to_string(),
            service: decoded.service().word(),
            node: decoded.node().map(NodeId::raw),
            objects: decoded.objects().map(|object| object.to_string()).collect(),
            stamp: self.stamps.text(at),
            interface,
            sent,
        };
        self.print(&line)
    }

    /// Shows the notes of the bus among the frames.
    fn note(&mut self, at: Instant, note: &Note) -> Result<(), Failure> {
        let stamp = self.stamps.text(at);
        self.print(&Noted { t: at.as_secs_f64(), note: note.kind(), text: note.to_string(), stamp })
    }

    fn print(&self, line: &impl Report) -> Result<(), Failure> {
        self.has_printed.set(true);
        self.format.print(line).map_err(Failure::of_stdout)
    }

    /// Reports what is skipped: among the frames to programs, on standard error to people.
    fn skip(&mut self, finding: Finding) -> Result<(), Failure> {
        self.lines_skipped += 1;
        if self.lines_skipped > SKIPPED_SHOWN {
            return Ok(());
        }
        if self.format.json {
            let (line, byte) = match finding.place {
                Place::Line(line) => (Some(line), None),
                Place::Byte(byte) => (None, Some(byte)),
            };
            let skipped = Skipped { line, byte, skipped: finding.text, reason: finding.reason };
            if self.counts.frames() == 0 && self.fd_frames == 0 {
                self.unsaid.push(skipped);
                return Ok(());
            }
            return self.print_skipped(&skipped);
        }
        // The reader may have gone.
        let _ = writeln!(io::stderr(), "warning: {}", plain(&finding.to_string()));
        Ok(())
    }

    fn print_skipped(&self, skipped: &Skipped) -> Result<(), Failure> {
        self.has_printed.set(true);
        self.format.print_json(skipped).map_err(Failure::of_stdout)
    }

    /// Reports how much was skipped, if anything was. A file without a single frame is not a log.
    fn summarise(&self) -> Result<(), Failure> {
        let (frames, lines_skipped, fd_frames) = (self.counts.frames(), self.lines_skipped, self.fd_frames);
        self.report_counts();
        if lines_skipped == 0 && fd_frames == 0 {
            return Ok(());
        }
        if frames == 0 && fd_frames == 0 {
            let form = self.of.map_or("candump", LogFormat::name);
            return Err(without_frames(format!(
                "no frame, and {} skipped: this is not a {form} log",
                counted(lines_skipped, "place")
            )));
        }
        if self.format.json {
            let summary = LogSummary { frames, lines_skipped, fd_frames };
            return self.format.print_json(&summary).map_err(Failure::of_stdout);
        }
        let _ = writeln!(
            io::stderr(),
            "warning: {} read; {} skipped, and {} seen",
            counted(frames, "frame"),
            counted(lines_skipped, "place"),
            counted(fd_frames, "CAN FD frame")
        );
        Ok(())
    }

    /// Shows what there was of each identifier, if that was asked for.
    fn show_identifiers(&mut self) -> Result<(), Failure> {
        let Some(found) = self.identifiers.take() else { return Ok(()) };
        let rows = found.ended();
        self.has_printed.set(!rows.is_empty());
        if self.format.json {
            return rows.iter().try_for_each(|row| self.format.print_json(row).map_err(Failure::of_stdout));
        }
        self.format.print(&IdentifierTable(rows)).map_err(Failure::of_stdout)
    }

    /// How many frames of what there were, for people. Programs count the lines.
    fn report_counts(&self) {
        if !self.format.json {
            // The reader may have gone.
            let whose =
                if self.is_filtered { "; the kernel filtered out all but the identifiers of these nodes" } else { "" };
            let _ = writeln!(io::stderr(), "{}{whose}", self.counts);
        }
    }
}

/// Opens a log to be read.
pub(crate) fn open_log(path: &Path) -> Result<AnyLogReader, Failure> {
    AnyLogReader::open(path).map_err(|error| {
        Failure::bad_file(format!("cannot open the log {}", path.display()))
            .because(error)
            .next("give the path of a log: .log, .asc, .blf or .pcapng")
    })
}

/// A file without a frame that holds something else.
pub(crate) fn no_log(path: &Path, form: LogFormat) -> Failure {
    without_frames(format!("no frame in {}: it is not a {form} log", path.display()))
}

fn without_frames(what: String) -> Failure {
    Failure::new(what)
        .of_kind("no_log")
        .next("a log is recognised by its first bytes, then by its extension: .log (candump), .asc, .blf, .trc, .pcap, .pcapng")
        .next("candump -L can0 writes one")
}

/// A log that cannot be read on.
pub(crate) fn unreadable(path: &Path, error: &io::Error) -> Failure {
    Failure::bad_file(format!("cannot read the log {} to its end", path.display()))
        .because(error)
        .next("copy it to this machine's disk, and see whether it can be read there")
}
