//! A record that is being written.

use std::borrow::Cow;
use std::io::{self, Seek, Write};

use can::{Frame, Instant};

use super::column::Column;
use super::csv::Csv;
use super::mcap_file::Mcap;

/// The kinds of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// MCAP: samples, frames and events.
    Mcap,
    /// CSV: samples and events.
    Csv,
}

impl Kind {
    /// The kind that a file's name ends with; `None` for another ending.
    pub fn of_name(name: &str) -> Option<Self> {
        let (_, ending) = name.rsplit_once('.')?;
        match ending.to_ascii_lowercase().as_str() {
            "mcap" => Some(Self::Mcap),
            "csv" => Some(Self::Csv),
            _ => None,
        }
    }
}

/// How much something that happened matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth a mark.
    Note,
    /// Something is not as it should be.
    Warning,
    /// A fault.
    Fault,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mark {
    /// When.
    pub at: Instant,
    /// To what: `node 4`; empty for the whole.
    pub of: Cow<'static, str>,
    /// How much it matters.
    pub severity: Severity,
    /// What, in words.
    pub text: String,
}

impl Mark {
    /// In one line: `node 4: over-voltage`.
    pub(super) fn line(&self) -> Cow<'_, str> {
        if self.of.is_empty() { self.text.as_str().into() } else { format!("{}: {}", self.of, self.text).into() }
    }
}

/// What a file may be written to: a file, or memory.
pub trait Target: Write + Seek + Send {}

impl<T: Write + Seek + Send> Target for T {}

/// A file that is being written.
///
/// What was given before a [`flush`](Self::flush) can be read from the file, whatever happens to the program afterwards. Rows,
/// frames and marks are given in the order of their times; a mark that comes later than its time stands where it came.
pub struct Record {
    writer: Writer,
}

enum Writer {
    Mcap(Box<Mcap>),
    Csv(Box<Csv>),
}

impl Record {
    /// Begins a file of this kind with these columns.
    ///
    /// # Errors
    /// What the target says.
    pub fn begin(kind: Kind, target: Box<dyn Target>, columns: &[Column]) -> io::Result<Self> {
        let writer = match kind {
            Kind::Mcap => Writer::Mcap(Box::new(Mcap::begin(target, columns)?)),
            Kind::Csv => Writer::Csv(Box::new(Csv::begin(target, columns)?)),
        };
        Ok(Self { writer })
    }

    /// The values of all columns at `at`, in their order; one that is not a number is left out.
    ///
    /// # Errors
    /// What the target says.
    pub fn row(&mut self, at: Instant, values: &[f64]) -> io::Result<()> {
        match &mut self.writer {
            Writer::Mcap(file) => file.row(at, values),
            Writer::Csv(file) => file.row(at, values),
        }
    }

    /// A frame that the bus carried, with the time of its last bit; CSV has no place for it.
    ///
    /// # Errors
    /// What the target says.
    pub fn frame(&mut self, at: Instant, frame: &Frame) -> io::Result<()> {
        match &mut self.writer {
            Writer::Mcap(file) => file.frame(at, frame),
            Writer::Csv(_) => Ok(()),
        }
    }

    /// Something that happened.
    ///
    /// # Errors
    /// What the target says.
    pub fn mark(&mut self, mark: &Mark) -> io::Result<()> {
        match &mut self.writer {
            Writer::Mcap(file) => file.mark(mark),
            Writer::Csv(file) => file.mark(mark),
        }
    }

    /// Hands everything given so far to the target. Call it once a second: so much is lost at most.
    ///
    /// # Errors
    /// What the target says.
    pub fn flush(&mut self) -> io::Result<()> {
        match &mut self.writer {
            Writer::Mcap(file) => file.flush(),
            Writer::Csv(file) => file.flush(),
        }
    }

    /// Ends the file.
    ///
    /// # Errors
    /// What the target says.
    pub fn finish(self) -> io::Result<()> {
        match self.writer {
            Writer::Mcap(file) => file.finish(),
            Writer::Csv(file) => file.finish(),
        }
    }
}
