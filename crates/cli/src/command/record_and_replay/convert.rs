//! `ferrodrive convert`: a log in another form.

use std::io::{self, Write};
use std::path::PathBuf;

use canlog::{Content, Entry};
use serde::Serialize;

use crate::command::look::dump::{no_log, open_log, unreadable};
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use crate::recording::{LogPath, log_path};
use plot::Paint;
use words::counted;

/// Convert a log file to another format
///
/// Reads candump, ASC, BLF, TRC, pcap and pcapng, recognised by their first bytes, then by their extension; - is
/// standard input. Writes the format of OUT's extension: .log (candump), .asc (Vector), .blf (Vector), .pcapng
/// (Wireshark). Time, direction, bus, remote frames and error frames are kept as far as the format allows; CAN FD
/// frames are counted and left out.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive convert trace.blf trace.pcapng     # for Wireshark\n  \
    ferrodrive convert trace.trc trace.log        # for can-utils")]
pub(crate) struct Convert {
    /// Log to read, or - for standard input
    #[arg(value_name = "IN")]
    from: PathBuf,
    /// Log to write: new, empty, or a log of that format, which is replaced
    #[arg(value_name = "OUT", value_parser = log_path)]
    to: LogPath,
}

/// Findings reported one by one; the rest are counted.
const SHOWN: u64 = 20;

/// What was converted.
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
    pub(crate) fn run(&self, quiet: bool) -> Result<ConvertReport, Failure> {
        let mut reader = open_log(&self.from)?;
        if same_file(&self.from, self.to.path()) {
            return Err(Failure::usage(format!("cannot convert {} to itself", self.from.display()))
                .next("give the new log another name"));
        }
        let mut writer = self.to.create()?;
        let not_written = |error: io::Error| Failure::of_writing("the log", self.to.path(), &error);
        let (from, to) = (self.from.display().to_string(), self.to.path().display().to_string());
        let mut report = ConvertReport {
            from,
            to,
            form: reader.format().name(),
            new_form: self.to.format().name(),
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

impl Report for ConvertReport {
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
