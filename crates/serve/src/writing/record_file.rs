//! A record: of a world (`--record`), or of objects of nodes on any bus (`ferrodrive record`).

use std::fs::File;
use std::io;
use std::time::Duration;

use can::{Frame, Instant};
use recording::{Column, Kind, Mark, Record};
use sim::events::Event;
use sim::recorder::Recorder;

use super::background::{Background, Output, Pace, WaitingRules};
use crate::messages::Messages;
use words::failure::Failure;

/// What happened since the batch before, each kind in the order of its times.
#[derive(Default)]
pub struct Batch {
    /// Samples of a world.
    pub recorded: Option<Recorder>,
    /// Samples of anything else: the values of all columns.
    pub rows: Vec<(Instant, Vec<f64>)>,
    /// What the bus carried.
    pub frames: Vec<(Instant, Frame)>,
    /// What happened.
    pub marks: Vec<Mark>,
}

impl Batch {
    /// Of a world.
    pub fn of_world(recorded: Option<Recorder>, frames: Vec<(Instant, Frame)>, events: &[Event]) -> Self {
        // A frame's event has the frame's time, which may be before that of an event that was found first.
        let mut marks: Vec<Mark> = events.iter().map(Mark::from).collect();
        marks.sort_by_key(|mark| mark.at);
        Self { recorded, rows: Vec::new(), frames, marks }
    }

    fn samples(&self) -> usize {
        self.rows.len() + self.recorded.as_ref().map_or(0, |recorded| recorded.times().len())
    }
}

/// A record that a thread of its own writes.
pub struct RecordFile(Background<Batch>);

impl RecordFile {
    /// Writes to `file` from now on. Later errors are reported to `messages`.
    ///
    /// # Errors
    /// That of writing the begin.
    pub fn start(kind: Kind, file: File, columns: &[Column], pace: Pace, messages: Messages) -> io::Result<Self> {
        let record = Record::begin(kind, Box::new(file), columns)?;
        Ok(Self(Background::start(record, WaitingRules::of(pace), Some(messages))))
    }

    /// Takes a batch; one that the disk has no time for is left out and reported, where the clock does not wait.
    pub fn write(&mut self, batch: Batch) {
        let samples = batch.samples() as u64;
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

impl Output<Batch> for Record {
    const FILE: &'static str = "the record";
    const PIECES: &'static str = "samples";

    /// Writes samples, frames and marks in the order of their times, and hands them to the system.
    fn write(&mut self, batch: Batch) -> io::Result<()> {
        let mut frames = batch.frames.iter().peekable();
        let mut marks = batch.marks.iter().peekable();
        let rows = batch.rows.iter().map(|(at, values)| (*at, values.as_slice()));
        for (at, values) in batch.recorded.iter().flat_map(Recorder::rows).chain(rows) {
            while let Some((ended, frame)) = frames.next_if(|(ended, _)| *ended <= at) {
                self.frame(*ended, frame)?;
            }
            while let Some(mark) = marks.next_if(|mark| mark.at <= at) {
                self.mark(mark)?;
            }
            self.row(at, values)?;
        }
        frames.try_for_each(|(ended, frame)| self.frame(*ended, frame))?;
        marks.try_for_each(|mark| self.mark(mark))?;
        self.flush()
    }

    fn end(self) -> io::Result<()> {
        self.finish()
    }
}
