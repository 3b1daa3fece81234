//! `ferrodrive convert`: a log or a record in another form.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use canlog::{Content, Entry};
use recording::{Kind, csv_of_mcap, mcap_of_csv};
use serde::Serialize;

use crate::command::look::dump::{no_log, open_log, unreadable};
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use crate::recording::{LogPath, log_path};
use plot::Paint;
use words::counted;
use words::document::read_bytes;

/// Convert a log of frames, or a record of quantities, to another format
///
/// Reads candump, ASC, BLF, TRC, pcap and pcapng, recognised by their first bytes, then by their extension; - is
/// standard input. Writes the format of OUT's extension: .log (candump), .asc (Vector), .blf (Vector), .pcapng
/// (Wireshark). Time, direction, bus, remote frames and error frames are kept as far as the format allows; CAN FD
/// frames are counted and left out. A record is CSV or MCAP, and becomes the other one.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive convert trace.blf trace.pcapng     # for Wireshark\n  \
    ferrodrive convert trace.trc trace.log        # for can-utils\n  \
    ferrodrive convert wheel.mcap wheel.csv       # a record, for a spreadsheet")]
pub(crate) struct Convert {
    /// Log to read, or - for standard input
    #[arg(value_name = "IN")]
    from: PathBuf,
    /// Log to write: new, empty, or a log of that format, which is replaced; or a record, NAME.csv or NAME.mcap, which must be new
    #[arg(value_name = "OUT", value_parser = converted_path)]
    to: ConvertedPath,
}

/// What is written.
#[derive(Clone, Debug)]
enum ConvertedPath {
    Log(LogPath),
    Record(PathBuf, Kind),
}

fn converted_path(text: &str) -> Result<ConvertedPath, String> {
    match Kind::of_name(text) {
        Some(kind) => Ok(ConvertedPath::Record(text.into(), kind)),
        None => log_path(text).map(ConvertedPath::Log).map_err(|reason| format!("{reason}; a record as .csv, .mcap")),
    }
}

/// The largest record that is read, in bytes: it is held in memory.
const LARGEST: u64 = 1 << 30;

/// Findings reported one by one; the rest are counted.
const SHOWN: u64 = 20;

/// What was converted.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub(crate) enum Converted {
    Log(ConvertReport),
    Record(ConvertedRecord),
}

/// A record that was written in the other form.
#[derive(Debug, Serialize)]
pub(crate) struct ConvertedRecord {
    from: String,
    to: String,
    bytes: usize,
}

/// A log that was written in another form.
#[derive(Debug, Default, Serialize)]
pub(crate) struct ConvertReport {
    from: String,
    to: String,
    /// Frames written.
    frames: u64,
    error_frames: u64,
    /// CAN FD frames, which are left out.
    fd_frames: u64,
    /// Places of the log that could not be read.
    passed_over: u64,
    #[serde(skip)]
    form: &'static str,
    #[serde(skip)]
    new_form: &'static str,
}

impl Convert {
    /// Reads one and writes the other, to the end.
    pub(crate) fn run(&self, quiet: bool) -> Result<Converted, Failure> {
        match &self.to {
            ConvertedPath::Log(to) => self.log(to, quiet).map(Converted::Log),
            ConvertedPath::Record(to, kind) => self.record(to, *kind).map(Converted::Record),
        }
    }

    fn record(&self, to: &Path, kind: Kind) -> Result<ConvertedRecord, Failure> {
        let from = self.from.display().to_string();
        let converted = match (Kind::of_name(&from), kind) {
            (Some(Kind::Mcap), Kind::Csv) => csv_of_mcap,
            (Some(Kind::Csv), Kind::Mcap) => mcap_of_csv,
            _ => {
                return Err(Failure::usage(format!("{} is made of a record of the other form alone", to.display()))
                    .because(format!("{from} is not one: a record is NAME.csv or NAME.mcap"))
                    .next("name both, or write a log: .log, .asc, .blf, .pcapng"));
            }
        };
        let bytes = read_bytes(&self.from, LARGEST)
            .map_err(|reason| Failure::bad_file(format!("cannot read {from}")).because(reason))?;
        let converted = converted(&bytes).map_err(|reason| {
            Failure::bad_file(format!("{from} is not a record")).because(reason).next("ferrodrive record makes one")
        })?;
        let not_written = |error: io::Error| Failure::of_writing("the record", to, &error);
        let mut file = File::options().write(true).create_new(true).open(to).map_err(not_written)?;
        file.write_all(&converted).and_then(|()| file.sync_all()).map_err(not_written)?;
        Ok(ConvertedRecord { from, to: to.display().to_string(), bytes: converted.len() })
    }

    fn log(&self, log: &LogPath, quiet: bool) -> Result<ConvertReport, Failure> {
        let mut reader = open_log(&self.from)?;
        if same_file(&self.from, log.path()) {
            return Err(Failure::usage(format!("cannot convert {} to itself", self.from.display()))
                .next("give the new log another name"));
        }
        let mut writer = log.create()?;
        let not_written = |error: io::Error| Failure::of_writing("the log", log.path(), &error);
        let (from, to) = (self.from.display().to_string(), log.path().display().to_string());
        let mut report = ConvertReport {
            from,
            to,
            form: reader.format().name(),
            new_form: log.format().name(),
            ..ConvertReport::default()
        };
        while let Some(entry) = reader.next_entry().map_err(|error| unreadable(&self.from, &error))? {
            match entry {
                Entry::Record(record) => {
                    match record.content {
                        Content::Frame(_) => report.frames += 1,
                        Content::Error(_) => report.error_frames += 1,
                        Content::FdFrame { .. } => report.fd_frames += 1,
                    }
                    writer.write(&record).map_err(not_written)?;
                }
                Entry::Finding(finding) => {
                    report.passed_over += 1;
                    if !quiet && report.passed_over <= SHOWN {
                        // The reader may have gone.
                        let _ = writeln!(io::stderr(), "warning: {}", plain(&finding.to_string()));
                    }
                }
            }
        }
        writer.finish().map_err(not_written)?;
        if report.frames + report.error_frames + report.fd_frames == 0 && report.passed_over > 0 {
            return Err(no_log(&self.from, reader.format()));
        }
        Ok(report)
    }
}

/// Whether two paths name one file that is there.
fn same_file(one: &std::path::Path, other: &std::path::Path) -> bool {
    matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
}

impl Report for Converted {
    fn text(&self, paint: Paint) -> String {
        match self {
            Self::Log(report) => report.text(paint),
            Self::Record(ConvertedRecord { from, to, bytes }) => {
                format!("{from} written as {}: {}", paint.strong(to), counted(*bytes, "byte"))
            }
        }
    }
}

impl ConvertReport {
    fn text(&self, paint: Paint) -> String {
        let Self { from, to, frames, error_frames, fd_frames, passed_over, form, new_form } = self;
        let (to, frames) = (paint.strong(to), counted(*frames, "frame"));
        let mut text = format!("{from} ({form}) written as {to} ({new_form}): {frames}");
        for (count, what, done) in [
            (error_frames, "error frame", ""),
            (fd_frames, "CAN FD frame", " left out"),
            (passed_over, "place", " skipped"),
        ] {
            if *count > 0 {
                text.push_str(&format!(", {}{done}", counted(*count, what)));
            }
        }
        text
    }
}
