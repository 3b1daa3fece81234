//! A record that is being written.

use std::io;

use can::{Frame, Instant};

use super::column::Column;
use super::csv::Csv;
use super::mcap_file::Mcap;
use super::piece::{Kind, Mark, Target};

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

    /// As [`row`](Self::row), but in MCAP a subject of which no value is a number has no message.
    ///
    /// # Errors
    /// What the target says.
    pub fn sparse_row(&mut self, at: Instant, values: &[f64]) -> io::Result<()> {
        match &mut self.writer {
            Writer::Mcap(file) => file.sparse_row(at, values),
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
