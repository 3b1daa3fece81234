//! `ferrodrive plot`: a record as a picture.

use std::io::Write;
use std::path::{Path, PathBuf};

use can::Instant;
use canlog::{Content, Entry, Record};
use host::capture::record_of_log;
use master::decode::Decoder;
use recording::{Capture, Kind, Recorded, overlay, read};
use serde::Serialize;
use words::counted;
use words::document::read_bytes;

use crate::command::look::dump::open_log;
use crate::failure::Failure;
use crate::frames::decoder;
use crate::global::Global;
use crate::output::{Report, is_stdout};
use plot::Paint;

/// Draw a record of --record: a figure for each node, a panel for each quantity
///
/// The picture is SVG (.svg), or a self-contained web page (.html) that shows the values under the pointer and the
/// differences between two points. A record whose writer was killed, or is still at work, is drawn as far as it goes.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive plot run.mcap -o run.svg\n  \
    ferrodrive plot trace.blf --machine base.toml\n  \
    ferrodrive plot run.csv --signals velocity --from 1.5s --to 3s -o run.html\n  \
    ferrodrive plot before.mcap after.mcap --align trigger -o both.html\n  \
    ferrodrive plot after.mcap before.mcap --subtract -o change.svg")]
pub(crate) struct Plot {
    /// Record, NAME.mcap or NAME.csv; or a log of frames (candump, BLF, ..), whose PDOs are decoded by --model or --machine
    ///
    /// Several are laid over each other.
    #[arg(value_name = "FILE", required = true)]
    records: Vec<PathBuf>,
    /// What several have in common at 0 s
    #[arg(long, value_enum, default_value = "begin")]
    align: Align,
    /// Draw the first less each of the others, instead of all
    #[arg(long)]
    subtract: bool,
    /// Signals, e.g. velocity,4.current_a,5.* (default: positions, velocities, currents and supplies)
    #[arg(long, value_name = "SIGNAL,..", value_delimiter = ',')]
    signals: Vec<String>,
    /// Start, e.g. 500ms (a bare number is s; default: that of the record)
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    from: Option<f64>,
    /// End (default: that of the record)
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    to: Option<f64>,
    /// Write the picture to this file, NAME.svg or NAME.html, or with - to standard output (default: NAME.svg beside
    /// the record)
    #[arg(long, short, alias = "svg", alias = "html", value_name = "FILE", value_parser = picture_path)]
    output: Vec<PathBuf>,
}

/// What is at 0 s.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Align {
    /// Where each record begins
    Begin,
    /// The trigger of each capture
    Trigger,
}

fn picture_path(text: &str) -> Result<PathBuf, String> {
    let is_known = text == "-" || [".svg", ".html"].iter().any(|ending| text.to_ascii_lowercase().ends_with(ending));
    if is_known {
        Ok(text.into())
    } else {
        Err("expected NAME.svg (a picture), NAME.html (a web page) or - (the picture to standard output)".into())
    }
}

/// Where a picture of a command that draws no web page goes.
pub(in crate::command) fn svg_path(text: &str) -> Result<PathBuf, String> {
    if text == "-" || text.to_ascii_lowercase().ends_with(".svg") {
        Ok(text.into())
    } else {
        Err("expected NAME.svg, or - for standard output".into())
    }
}

/// Largest record that is read: 4 GiB would be a day of three drives at 1 kHz.
const LARGEST: u64 = 4 << 30;

fn seconds(text: &str) -> Result<f64, String> {
    can::parse_duration_in("s", text).map(|time| time.as_secs_f64()).map_err(|error| error.to_string())
}

/// What was drawn.
#[derive(Debug, Serialize)]
pub(crate) struct Drawn {
    record: PathBuf,
    /// All that lie over each other, that one first.
    records: Vec<PathBuf>,
    /// How many signals and marks are in the picture.
    signals: usize,
    marks: usize,
    torn: bool,
    files: Vec<PathBuf>,
    /// The picture, if it goes to standard output.
    #[serde(skip_serializing_if = "Option::is_none")]
    picture: Option<String>,
}

impl Plot {
    /// Draws it.
    pub(crate) fn draw(&self, global: &Global) -> Result<Drawn, Failure> {
        let span = self.from.unwrap_or(f64::NEG_INFINITY)..=self.to.unwrap_or(f64::INFINITY);
        if span.is_empty() {
            return Err(Failure::usage("--to is before --from").next("give a later --to, or omit it"));
        }
        let mut records = Vec::new();
        for path in &self.records {
            let recorded = read_record(path, decoder(global, &[]))?;
            records.push((
                name_of(path),
                if self.align == Align::Trigger { triggered(path, recorded)? } else { recorded },
            ));
        }
        if self.subtract {
            records = differences(&records)?;
        }
        let named: Vec<_> = match records.as_slice() {
            [(_, only)] => vec![("", only)],
            all => all.iter().map(|(name, recorded)| (name.as_str(), recorded)).collect(),
        };
        let first = self.records.first().cloned().unwrap_or_default();
        let title = records.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
        let poster = overlay(&title, &named, &self.signals, span).map_err(|reason| {
            Failure::new(format!("cannot draw {title}"))
                .of_kind("record")
                .because(reason)
                .next("omit --signals, --from and --to to draw everything that can be plotted")
        })?;
        let mut files = self.output.clone();
        if files.is_empty() {
            files.push(first.with_extension("svg"));
        }
        let with_stdout = files.len();
        files.retain(|path| !is_stdout(path));
        let picture = (files.len() < with_stdout).then(|| poster.to_svg());
        for path in &files {
            let is_page = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("html"));
            let (text, begin): (_, &[u8]) =
                if is_page { (poster.to_html(), b"<!doctype html>") } else { (poster.to_svg(), b"<svg") };
            write(path, &text, begin)?;
        }
        let figures = || poster.rows.iter().flatten();
        let signals = figures().flat_map(|figure| &figure.panels).map(|panel| panel.traces.len()).sum();
        let marks = figures().map(|figure| figure.events.len()).max().unwrap_or(0);
        let torn = records.iter().any(|(_, recorded)| recorded.torn);
        Ok(Drawn { record: first, records: self.records.clone(), signals, marks, torn, files, picture })
    }
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The first of some records less each of the others, with what it is called.
fn differences(records: &[(String, Recorded)]) -> Result<Vec<(String, Recorded)>, Failure> {
    let ((name, first), others) = match records {
        [first, others @ ..] if !others.is_empty() => (first, others),
        _ => {
            return Err(Failure::usage("--subtract needs two records or more").next(
                "name those that the first is to be less, e.g. ferrodrive plot after.mcap before.mcap --subtract",
            ));
        }
    };
    let less = others.iter().map(|(other, recorded)| {
        let less = first.less(recorded);
        if less.series.iter().any(|series| !series.points.is_empty()) {
            return Ok((format!("{name} less {other}"), less));
        }
        let because =
            if less.series.is_empty() { "they have no signal in common" } else { "they have no time in common" };
        Err(Failure::bad_file(format!("cannot subtract {other} from {name}"))
            .because(because)
            .next("compare records of the same drive, aligned by --align begin or trigger"))
    });
    less.collect()
}

/// A capture with its trigger at 0 s.
fn triggered(path: &Path, mut recorded: Recorded) -> Result<Recorded, Failure> {
    let place = Capture::places(&recorded).first().copied();
    let trigger_s = Capture::of(&recorded, place).ok().and_then(|capture| capture.trigger_s);
    let at = trigger_s.ok_or_else(|| {
        Failure::bad_file(format!("{} has no trigger", path.display()))
            .because("it was not captured with --trigger")
            .next("lay them over each other from their begin: --align begin")
    })?;
    recorded.series.iter_mut().flat_map(|series| &mut series.points).for_each(|point| point.0 -= at);
    // What happened has no time before 0.
    recorded.marks.clear();
    Ok(recorded)
}

/// What a file that --record has written holds, or what the PDOs of a log carry, which this decoder puts into words.
pub(in crate::command) fn read_record(path: &Path, decoder: Decoder) -> Result<Recorded, Failure> {
    let unreadable = |reason: String| {
        Failure::bad_file(format!("cannot read the record {}", path.display()))
            .because(reason)
            .next("give a file that --record of this program has written, or a log of frames")
    };
    if let Some(kind) = Kind::of_name(&path.to_string_lossy()) {
        let bytes = read_bytes(path, LARGEST).map_err(unreadable)?;
        return read(kind, &bytes).map_err(|reason| unreadable(reason).of_kind("record"));
    }
    if canlog::Format::of_name(path).is_none() {
        return Err(Failure::usage(format!("{} is not a record", path.display()))
            .because("a record is called NAME.mcap or NAME.csv, a log of frames NAME.log, .blf, .asc, .trc, .pcap or .pcapng")
            .next("make one, e.g. ferrodrive sim --drive zlac8030l@4 --record run.mcap"));
    }
    let mut log = open_log(path)?;
    let mut torn = None;
    let frames = std::iter::from_fn(|| {
        loop {
            match log.next_entry() {
                Ok(Some(Entry::Record(Record { at: Some(at), content: Content::Frame(frame), .. }))) => {
                    return Some((at, frame));
                }
                Ok(Some(_)) => {}
                Ok(None) => return None,
                Err(error) => {
                    torn = Some(error);
                    return None;
                }
            }
        }
    });
    let mut first = None;
    let since = frames.map(|(at, frame)| {
        let first = *first.get_or_insert(at);
        (Instant::from_nanos(at.nanos_since(first)), frame)
    });
    let recorded = record_of_log(decoder, since).map_err(|reason| unreadable(reason).of_kind("record"))?;
    Ok(Recorded { torn: torn.is_some(), ..recorded })
}

/// Writes a picture where it is asked for; the text of it, if that is standard output.
pub(in crate::command) fn write_svg(path: &Path, svg: String) -> Result<Option<String>, Failure> {
    if is_stdout(path) {
        return Ok(Some(svg));
    }
    write(path, &svg, b"<svg").map(|()| None)
}

/// Writes a picture to a new file, or over an earlier picture, and over nothing else.
fn write(path: &Path, text: &str, begin: &[u8]) -> Result<(), Failure> {
    let written = serve::files::create_picture(path, begin).and_then(|mut file| file.write_all(text.as_bytes()));
    written.map_err(|error| Failure::of_writing("the picture", path, &error))
}

impl Report for Drawn {
    fn text(&self, _: Paint) -> String {
        if let Some(picture) = &self.picture {
            return picture.trim_end().to_owned();
        }
        let files: Vec<String> = self.files.iter().map(|path| path.display().to_string()).collect();
        let drawn =
            format!("{}: {} and {}", files.join(" and "), counted(self.signals, "signal"), counted(self.marks, "mark"));
        let torn = "the end of the record is missing: its writer was killed, or is still running";
        if self.torn { format!("{drawn}\n{torn}") } else { drawn }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capture_that_is_aligned_has_its_trigger_at_0() {
        let of = |about: &str| {
            let text = format!("t_s,4.velocity_rpm,mark\n0,1,\"capture {{{about}}}\"\n0.25,2,\n1,3,\n");
            triggered(Path::new("run.csv"), read(Kind::Csv, text.as_bytes()).expect("a record"))
        };
        let aligned = of(r#"""trigger_s"":0.25"#).expect("it has one");
        assert_eq!(aligned.series[0].points, [(-0.25, 1.0), (0.0, 2.0), (0.75, 3.0)]);
        assert!(of("").is_err_and(|failure| failure.what.contains("has no trigger")));
    }

    #[test]
    fn a_bare_number_is_in_seconds_and_a_wrong_unit_is_refused() {
        assert_eq!(seconds("1.5"), Ok(1.5));
        assert_eq!(seconds("1.5s"), Ok(1.5));
        assert_eq!(seconds("500ms"), Ok(0.5));
        assert_eq!(seconds("0.5min"), Ok(30.0));
        for text in ["1.5sss", "-1", "nan", "inf", "", "s"] {
            assert!(seconds(text).is_err(), "{text}");
        }
    }
}
