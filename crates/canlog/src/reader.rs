//! Reads a log of any known form, one entry at a time.

use std::fmt;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use can::Instant;

use crate::blf::BlfReader;
use crate::finding::{Finding, Place};
use crate::format::{ENOUGH_TO_TELL, Format};
use crate::lines::Lines;
use crate::pcap::PcapReader;
use crate::pcapng::PcapngReader;
use crate::record::{Entry, Record};
use crate::text;
use crate::{asc, candump, trc};

/// Reads a log: records, and findings where something is passed over. After a finding reading goes on; memory is bounded
/// whatever the file says.
pub struct LogReader<R> {
    form: FormReader<R>,
    format: Format,
    last: Instant,
}

impl<R> fmt::Debug for LogReader<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LogReader").field("format", &self.format).finish_non_exhaustive()
    }
}

enum FormReader<R> {
    Candump(Lines<R>),
    Asc(Lines<R>, asc::Parser),
    Trc(Lines<R>, trc::Parser),
    Blf(BlfReader<R>),
    Pcap(PcapReader<R>),
    Pcapng(PcapngReader<R>),
}

/// A log of any place.
pub type AnyLogReader = LogReader<Box<dyn BufRead + Send>>;

impl AnyLogReader {
    /// The log `path`, or standard input for `-`. Its form is that of its first bytes, where they show one, else that of its
    /// extension, else candump's.
    ///
    /// # Errors
    /// That of opening the file, or of reading its first bytes; [`io::ErrorKind::InvalidInput`] for one that is not a regular file,
    /// [`io::ErrorKind::InvalidData`] for one that they show to be no log.
    pub fn open(path: &Path) -> io::Result<Self> {
        let mut input: Box<dyn BufRead + Send> = match path.to_str() {
            Some("-") => Box::new(BufReader::new(io::stdin())),
            _ => Box::new(BufReader::with_capacity(1 << 16, open_regular(path)?)),
        };
        let begin = input.fill_buf()?;
        let begin = &begin[..begin.len().min(ENOUGH_TO_TELL)];
        let by_name = Format::of_name(path);
        let format = match Format::of_content(begin) {
            Some(format) => format,
            None => match Format::foreign(begin, by_name) {
                Some(what) => return Err(io::Error::new(io::ErrorKind::InvalidData, what)),
                None => by_name.unwrap_or(Format::Candump),
            },
        };
        Ok(Self::new(input, format))
    }
}

/// A pipe would be waited for where it is opened, and a device may never end: those come by standard input.
fn open_regular(path: &Path) -> io::Result<File> {
    if std::fs::metadata(path)?.is_file() {
        return File::open(path);
    }
    Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file; - reads standard input"))
}

impl<R: BufRead> LogReader<R> {
    /// A reader of `input`, which has this form.
    pub fn new(input: R, format: Format) -> Self {
        let form = match format {
            Format::Candump => FormReader::Candump(Lines::new(input)),
            Format::Asc => FormReader::Asc(Lines::new(input), asc::Parser::default()),
            Format::Trc => FormReader::Trc(Lines::new(input), trc::Parser::default()),
            Format::Blf => FormReader::Blf(BlfReader::new(input)),
            Format::Pcap => FormReader::Pcap(PcapReader::new(input)),
            Format::Pcapng => FormReader::Pcapng(PcapngReader::new(input)),
        };
        Self { form, format, last: Instant::ZERO }
    }

    /// The form that is read.
    pub const fn format(&self) -> Format {
        self.format
    }

    /// The time of the record read last; zero before the first.
    pub const fn last_time(&self) -> Instant {
        self.last
    }

    /// What comes next; `None` at the end. A record without a time gets that of the record before.
    ///
    /// # Errors
    /// That of reading the file.
    pub fn next_entry(&mut self) -> io::Result<Option<Entry>> {
        let entry = match &mut self.form {
            FormReader::Candump(lines) => {
                next_of_lines(lines, |line| candump::parse_line(line).map_err(|error| error.to_string()))
            }
            FormReader::Asc(lines, parser) => next_of_lines(lines, |line| parser.line(line).map_err(str::to_owned)),
            FormReader::Trc(lines, parser) => next_of_lines(lines, |line| parser.line(line).map_err(str::to_owned)),
            FormReader::Blf(reader) => reader.next_entry(),
            FormReader::Pcap(reader) => reader.next_entry(),
            FormReader::Pcapng(reader) => reader.next_entry(),
        };
        let mut entry = entry?;
        if let Some(Entry::Record(record)) = &mut entry {
            self.last = *record.at.get_or_insert(self.last);
        }
        Ok(entry)
    }
}

impl<R: BufRead> Iterator for LogReader<R> {
    type Item = io::Result<Entry>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_entry().transpose()
    }
}

fn next_of_lines<R: BufRead>(
    lines: &mut Lines<R>,
    mut parse: impl FnMut(&str) -> Result<Option<Record>, String>,
) -> io::Result<Option<Entry>> {
    while let Some((line, text)) = lines.next()? {
        match parse(&text) {
            Ok(None) => {}
            Ok(Some(record)) => return Ok(Some(Entry::Record(record))),
            Err(reason) => {
                let finding = Finding { place: Place::Line(line), text: text::shown(&text), reason };
                return Ok(Some(Entry::Finding(finding)));
            }
        }
    }
    Ok(None)
}

/// Bytes that are read for what they are: see [`LogReader`].
impl<R: Read> LogReader<BufReader<R>> {
    /// [`new`](Self::new) over a reader without a buffer.
    pub fn buffered(input: R, format: Format) -> Self {
        Self::new(BufReader::new(input), format)
    }
}
