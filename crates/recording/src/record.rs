//! A record that is being written.

use std::io;

use can::{Frame, Instant};

use super::channels::Channels;
use super::column::Column;
use super::csv::Csv;
use super::mcap_file::Mcap;
use super::piece::{Entry, Kind, Mark, Target};

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
    /// Begins a file of this kind with these columns. In MCAP simulated values are rounded: [`Channels::of`].
    ///
    /// # Errors
    /// What the target says.
    pub fn begin(kind: Kind, target: Box<dyn Target>, columns: &[Column]) -> io::Result<Self> {
        Self::with(kind, target, columns, Channels::of)
    }

    /// As [`begin`](Self::begin), of what was measured: every digit is kept.
    ///
    /// # Errors
    /// What the target says.
    pub fn exact(kind: Kind, target: Box<dyn Target>, columns: &[Column]) -> io::Result<Self> {
        Self::with(kind, target, columns, Channels::exact)
    }

    fn with(
        kind: Kind,
        target: Box<dyn Target>,
        columns: &[Column],
        channels: impl Fn(&[Column]) -> Channels,
    ) -> io::Result<Self> {
        let writer = match kind {
            Kind::Mcap => Writer::Mcap(Box::new(Mcap::begin(target, channels(columns))?)),
            Kind::Csv => Writer::Csv(Box::new(Csv::begin(target, columns)?)),
        };
        Ok(Self { writer })
    }

    /// Takes an entry. In MCAP a subject of which no value of a row is a number has no message; CSV has no place for frames.
    ///
    /// # Errors
    /// What the target says.
    pub fn put(&mut self, entry: Entry<'_>) -> io::Result<()> {
        match &mut self.writer {
            Writer::Mcap(file) => file.put(entry),
            Writer::Csv(file) => match entry {
                Entry::Row(at, values) => file.row(at, values),
                Entry::Frame(..) => Ok(()),
                Entry::Mark(mark) => file.mark(mark),
            },
        }
    }

    /// The values of all columns at `at`.
    ///
    /// # Errors
    /// What the target says.
    pub fn row(&mut self, at: Instant, values: &[f64]) -> io::Result<()> {
        self.put(Entry::Row(at, values))
    }

    /// A frame that the bus carried.
    ///
    /// # Errors
    /// What the target says.
    pub fn frame(&mut self, at: Instant, frame: &Frame) -> io::Result<()> {
        self.put(Entry::Frame(at, frame))
    }

    /// Something that happened.
    ///
    /// # Errors
    /// What the target says.
    pub fn mark(&mut self, mark: &Mark) -> io::Result<()> {
        self.put(Entry::Mark(mark))
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
