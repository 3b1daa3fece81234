//! The file of `ferrodrive record`: values of objects of nodes on any bus, and the frames of others.

use std::fs::File;
use std::io;
use std::time::Duration;

use can::{Frame, Instant};
use testbench::recording::{Column, Kind, Mark, Record};

use super::background::{Background, Pace, Words};
use crate::failure::Failure;
use crate::serve::messages::Messages;

/// What came since the batch before, each kind in the order of its times.
#[derive(Default)]
pub(crate) struct ObjectBatch {
    /// The values of all columns.
    pub(crate) rows: Vec<(Instant, Vec<f64>)>,
    /// What others sent.
    pub(crate) frames: Vec<(Instant, Frame)>,
    /// What happened.
    pub(crate) marks: Vec<Mark>,
}

/// A record that a thread of its own writes.
pub(crate) struct ObjectRecord(Background<ObjectBatch>);

impl ObjectRecord {
    /// Writes to `file` from now on. Later errors are reported to `messages`.
    ///
    /// # Errors
    /// That of writing the begin.
    pub(crate) fn start(kind: Kind, file: File, columns: &[Column], messages: Messages) -> io::Result<Self> {
        let words = Words { file: "the record", pieces: "samples" };
        let record = Record::begin(kind, Box::new(file), columns)?;
        Ok(Self(Background::start(words, record, write, Record::finish, Pace::RealTime, messages)))
    }

    /// Takes a batch; one that the disk has no time for is left out and reported.
    pub(crate) fn write(&mut self, batch: ObjectBatch) {
        let samples = batch.rows.len() as u64;
        self.0.write(batch, samples);
    }

    /// Waits until everything is written, at most for `patience`.
    ///
    /// # Errors
    /// The file is not whole.
    pub(crate) fn finish(self, patience: Duration) -> Result<(), Failure> {
        self.0.finish(patience)
    }
}

/// Writes samples, frames and marks in the order of their times, and hands them to the system.
fn write(record: &mut Record, batch: ObjectBatch) -> io::Result<()> {
    let mut frames = batch.frames.iter().peekable();
    let mut marks = batch.marks.iter().peekable();
    for (at, values) in &batch.rows {
        while let Some((came, frame)) = frames.next_if(|(came, _)| came <= at) {
            record.frame(*came, frame)?;
        }
        while let Some(mark) = marks.next_if(|mark| mark.at <= *at) {
            record.mark(mark)?;
        }
        record.row(*at, values)?;
    }
    frames.try_for_each(|(came, frame)| record.frame(*came, frame))?;
    marks.try_for_each(|mark| record.mark(mark))?;
    record.flush()
}
