//! The file of `ferrodrive record`: values of objects of nodes on any bus, and the frames of others.

use std::fs::File;
use std::io;
use std::time::Duration;

use can::{Frame, Instant};
use recording::{Column, Kind, Mark, Record};

use super::background::{Background, Output, Pace, WaitingRules};
use crate::messages::Messages;
use words::failure::Failure;

/// What came since the batch before, each kind in the order of its times.
#[derive(Default)]
pub struct ObjectBatch {
    /// The values of all columns.
    pub rows: Vec<(Instant, Vec<f64>)>,
    /// What others sent.
    pub frames: Vec<(Instant, Frame)>,
    /// What happened.
    pub marks: Vec<Mark>,
}

/// A record that a thread of its own writes.
pub struct ObjectRecord(Background<ObjectBatch>);

impl ObjectRecord {
    /// Writes to `file` from now on. Later errors are reported to `messages`.
    ///
    /// # Errors
    /// That of writing the begin.
    pub fn start(kind: Kind, file: File, columns: &[Column], messages: Messages) -> io::Result<Self> {
        let record = Record::begin(kind, Box::new(file), columns)?;
        Ok(Self(Background::start(record, WaitingRules::of(Pace::RealTime), Some(messages))))
    }

    /// Takes a batch; one that the disk has no time for is left out and reported.
    pub fn write(&mut self, batch: ObjectBatch) {
        let samples = batch.rows.len() as u64;
        self.0.write(batch, samples);
    }

    /// Waits until everything is written, at most for `patience`.
    ///
    /// # Errors
    /// The file is not whole.
    pub fn finish(self, patience: Duration) -> Result<(), Failure> {
        self.0.finish(patience)
    }
}

impl Output<ObjectBatch> for Record {
    const FILE: &'static str = "the record";
    const PIECES: &'static str = "samples";

    /// Writes samples, frames and marks in the order of their times, and hands them to the system.
    fn write(&mut self, batch: ObjectBatch) -> io::Result<()> {
        let mut frames = batch.frames.iter().peekable();
        let mut marks = batch.marks.iter().peekable();
        for (at, values) in &batch.rows {
            while let Some((came, frame)) = frames.next_if(|(came, _)| came <= at) {
                self.frame(*came, frame)?;
            }
            while let Some(mark) = marks.next_if(|mark| mark.at <= *at) {
                self.mark(mark)?;
            }
            self.row(*at, values)?;
        }
        frames.try_for_each(|(came, frame)| self.frame(*came, frame))?;
        marks.try_for_each(|mark| self.mark(mark))?;
        self.flush()
    }

    fn end(self) -> io::Result<()> {
        self.finish()
    }
}
