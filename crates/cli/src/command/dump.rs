//! `ferrodrive dump`: the bus in words, line by line, and into a candump log.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use can::{Frame, Instant};
use canopen::NodeId;
use master::decode::Decoder;
use serde::Serialize;
use sim::wire::WireEvent;
use transport::log::LogWriter;
use transport::{AnyBus, AsyncBus, BusError, BusSpec, Note, Received, TornRecord, WallClock};

use crate::failure::Failure;
use crate::frames::counts::Counts;
use crate::frames::decoder;
use crate::frames::filter::Filter;
use crate::frames::stamp::{Stamps, TimeForm};
use crate::global::Global;
use crate::output::{Format, Report};
use crate::paint::Paint;
use crate::session::{bus_failure, enter_real_time, exit_on_signal, runtime, virtual_world};
use crate::signals::asked_to_end;
use testbench::machine_file::Machine;

/// Show the bus decoded: SDO with object names and values, PDOs by their mapping, statuswords in words
///
/// Only listens. On a real bus it runs until Ctrl-C; on a log until its end; on an embedded virtual bus it shows how the
/// drives boot. Names of a model's own objects need the model: --model NODE=MODEL, or --machine FILE.toml.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus socketcand://HOST:29536/can0 --model 4=zlac8030l dump\n  \
    ferrodrive --bus slcan:///dev/ttyACM0?bitrate=500k dump --log trace.log\n  \
    ferrodrive --bus log:trace.log --model 4=zlac8030l dump\n  \
    ferrodrive --bus slcan://HOST:3000 dump --node 4 --service sdo,emcy --time delta\n  \
    ferrodrive --bus slcan://HOST:3000 dump --object 6041,target_velocity --time absolute")]
pub(crate) struct Dump {
    /// Also write the frames to this file, in candump format, those too that are not shown
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// End after this time (default on an embedded virtual bus: 2s)
    #[arg(long = "for", value_name = "TIME", value_parser = master::units::parse_duration)]
    duration: Option<Duration>,
    /// The time before each line (`t` of --json stays as it is)
    #[arg(long, value_name = "FORM", value_enum, default_value_t)]
    time: TimeForm,
    #[command(flatten)]
    filter: Filter,
}

/// Shown of an embedded bus, on which nothing happens after the drives have booted.
const EMBEDDED_DURATION: Duration = Duration::from_secs(2);

/// A frame in words.
#[derive(Debug, Serialize)]
struct Line {
    t: f64,
    frame: String,
    text: String,
    service: &'static str,
    node: Option<u8>,
    /// The objects that it carries, or is part of a transfer of.
    objects: Vec<String>,
    #[serde(skip)]
    stamp: String,
}

impl Report for Line {
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

/// A line of a log that is no frame, and was passed over.
#[derive(Debug, Serialize)]
struct Skipped {
    /// Counted from 1.
    line: usize,
    /// The line, shortened.
    skipped: String,
    reason: String,
}

/// What came of a log with lines that are no frames.
#[derive(Debug, Serialize)]
struct Summary {
    frames: u64,
    lines_skipped: u64,
}

/// Lines that are no frames are shown one by one up to this many, then only counted: a file that is no log has thousands.
const SKIPPED_SHOWN: u64 = 20;

/// Where decoded lines and logged frames go.
struct Sink {
    decoder: Decoder,
    filter: Filter,
    stamps: Stamps,
    counts: Counts,
    format: Format,
    log: Option<LogWriter<BufWriter<File>>>,
    path: Option<PathBuf>,
    /// Lines of a log that were no frames.
    lines_skipped: u64,
    /// Unix time of the time axis's zero, for the log; a recorded bus has Unix times already.
    unix_zero: Duration,
}

impl Dump {
    /// Shows frames until there are no more, the time is over, or Ctrl-C.
    pub(crate) fn run(&self, global: &Global, format: Format) -> Result<(), Failure> {
        let mut sink = Sink::new(self, global, format)?;
        match &global.bus {
            BusSpec::Sim { file } => self.embedded(file.as_deref(), &mut sink)?,
            _ => runtime()?.block_on(self.listen(global, &mut sink))?,
        }
        sink.finish()
    }

    fn embedded(&self, file: Option<&Path>, sink: &mut Sink) -> Result<(), Failure> {
        exit_on_signal();
        let (mut world, drives) = virtual_world(file)?;
        for (node, model) in drives {
            sink.decoder.set_model(node, model);
        }
        world.log_mut().set_limit(usize::MAX);
        // Somebody has to acknowledge what a single drive sends.
        world.add_probe();
        world.run_for(self.duration.unwrap_or(EMBEDDED_DURATION));
        while let Some(event) = world.log_mut().pull() {
            if let WireEvent::Frame { end, frame, .. } = event {
                sink.take(end, &frame)?;
            }
        }
        Ok(())
    }

    async fn listen(&self, global: &Global, sink: &mut Sink) -> Result<(), Failure> {
        enter_real_time(global)?;
        let clock = WallClock::start();
        let mut bus = global.bus.open(&clock).await.map_err(|error| bus_failure(global, &error))?;
        if !matches!(global.bus, BusSpec::Log { .. }) {
            sink.unix_zero = clock.unix_zero();
            sink.stamps = Stamps::new(self.time, sink.unix_zero);
        }
        let end = self.duration.map(|duration| clock.now() + duration);
        let over = async {
            tokio::select! {
                () = clock.sleep_until_due(end) => Ok(()),
                signal = asked_to_end() => Err(Failure::ended_by(signal)),
            }
        };
        tokio::select! {
            result = follow(&mut bus, sink) => result?.map_or(Ok(()), |error| Err(bus_failure(global, &error))),
            result = over => {
                if result.is_err() {
                    sink.tell_counts();
                }
                sink.flush().and(result)
            }
        }
    }
}

/// Shows what comes; ends with the bus, with the reason unless it was a log that is over.
async fn follow(bus: &mut AnyBus, sink: &mut Sink) -> Result<Option<BusError>, Failure> {
    loop {
        match bus.recv().await {
            Ok((at, Received::Frame(frame))) => sink.take(at, &frame)?,
            Ok((_, Received::Note(Note::TornRecord(torn)))) => sink.skip(torn)?,
            Ok((at, Received::Note(note))) => sink.note(at, &note)?,
            Err(BusError::EndOfLog { .. }) => return Ok(None),
            Err(error) => return Ok(Some(error)),
        }
    }
}

impl Sink {
    fn new(dump: &Dump, global: &Global, format: Format) -> Result<Self, Failure> {
        let path = dump.log.as_deref();
        let told = global
            .models
            .iter()
            .map(|(_, model)| *model)
            .chain(global.machine.iter().flat_map(Machine::models).map(|(_, model)| model));
        dump.filter.check(&devices::all().iter().chain(told).collect::<Vec<_>>())?;
        let log = path.map(File::create).transpose().map_err(|error| log_failure(path, &error))?;
        Ok(Self {
            decoder: decoder(global, &[]),
            filter: dump.filter.clone(),
            stamps: Stamps::new(dump.time, Duration::ZERO),
            counts: Counts::default(),
            format,
            log: log.map(|file| LogWriter::new(BufWriter::new(file), "can0")),
            path: path.map(Into::into),
            lines_skipped: 0,
            unix_zero: Duration::ZERO,
        })
    }

    fn take(&mut self, at: Instant, frame: &Frame) -> Result<(), Failure> {
        if let Some(log) = &mut self.log {
            log.write(at + self.unix_zero, frame).map_err(|error| log_failure(self.path.as_deref(), &error))?;
        }
        let decoded = self.decoder.decode(frame);
        let wanted = self.filter.takes(&self.decoder, &decoded);
        self.counts.note(at, &decoded, wanted);
        if !wanted {
            return Ok(());
        }
        let line = Line {
            t: at.as_secs_f64(),
            frame: frame.to_string(),
            text: decoded.to_string(),
            service: decoded.service().word(),
            node: decoded.node().map(NodeId::raw),
            objects: decoded.objects().map(|object| object.to_string()).collect(),
            stamp: self.stamps.text(at),
        };
        self.format.print(&line).map_err(|error| not_printed(&error))
    }

    /// Tells among the frames what the bus says beside them.
    fn note(&mut self, at: Instant, note: &Note) -> Result<(), Failure> {
        let stamp = self.stamps.text(at);
        let line = Noted { t: at.as_secs_f64(), note: note.kind(), text: note.to_string(), stamp };
        self.format.print(&line).map_err(|error| not_printed(&error))
    }

    /// Tells of a line that is passed over: among the frames to programs, beside them to people.
    fn skip(&mut self, torn: TornRecord) -> Result<(), Failure> {
        self.lines_skipped += 1;
        if self.lines_skipped > SKIPPED_SHOWN {
            return Ok(());
        }
        if self.format.json {
            let line = Skipped { line: torn.place, skipped: torn.text, reason: torn.reason };
            return self.format.print_json(&line).map_err(|error| not_printed(&error));
        }
        // Nobody may be listening any more.
        let _ = writeln!(io::stderr(), "warning: {torn}");
        Ok(())
    }

    /// Tells how many lines were passed over, if any were. A log without a single frame is none.
    fn summarise(&self) -> Result<(), Failure> {
        let (frames, lines_skipped) = (self.counts.frames(), self.lines_skipped);
        self.tell_counts();
        if lines_skipped == 0 {
            return Ok(());
        }
        if frames == 0 {
            return Err(Failure::new(format!("no frame in {lines_skipped} lines: this is no candump log"))
                .of_kind("no_log")
                .next("candump -L can0 writes one"));
        }
        if self.format.json {
            let summary = Summary { frames, lines_skipped };
            return self.format.print_json(&summary).map_err(|error| not_printed(&error));
        }
        let _ = writeln!(io::stderr(), "warning: {lines_skipped} lines were passed over; {frames} frames read");
        Ok(())
    }

    /// How many frames of what there were, for people. Programs count the lines.
    fn tell_counts(&self) {
        if !self.format.json {
            // Nobody may be listening any more.
            let _ = writeln!(io::stderr(), "{}", self.counts);
        }
    }

    fn flush(&mut self) -> Result<(), Failure> {
        let Some(log) = &mut self.log else { return Ok(()) };
        log.flush().map_err(|error| log_failure(self.path.as_deref(), &error))
    }

    fn finish(mut self) -> Result<(), Failure> {
        self.flush()?;
        self.summarise()
    }
}

fn not_printed(error: &io::Error) -> Failure {
    Failure::new("cannot write to standard output").because(error)
}

fn log_failure(path: Option<&Path>, error: &std::io::Error) -> Failure {
    Failure::new(format!("cannot write the log {}", path.unwrap_or(Path::new("")).display())).because(error)
}
