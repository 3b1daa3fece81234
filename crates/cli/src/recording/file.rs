//! The file of `--record`.

use std::fs::File;
use std::io;
use std::time::Duration;

use can::{Frame, Instant};
use sim::recorder::Recorder;
use testbench::recording::{Column, Kind, Mark, Record, Severity, Subject};

use super::background::{Background, Words};
use crate::serve::speaker::Speaker;

/// What happened since the batch before, each kind in the order of its times.
#[derive(Default)]
pub(crate) struct Batch {
    /// Samples, stimuli and marks.
    pub(crate) recorded: Option<Recorder>,
    /// What the bus carried.
    pub(crate) frames: Vec<(Instant, Frame)>,
    /// What else happened.
    pub(crate) marks: Vec<Mark>,
}

/// A record that a thread of its own writes.
pub(crate) struct RecordFile(Background<Batch>);

impl RecordFile {
    /// Writes to `file` from now on. What goes wrong later is told to `speaker`.
    ///
    /// # Errors
    /// That of writing the begin.
    pub(crate) fn start(kind: Kind, file: File, columns: &[Column], speaker: Speaker) -> io::Result<Self> {
        let words = Words { file: "the record", pieces: "samples" };
        let record = Record::begin(kind, Box::new(file), columns)?;
        Ok(Self(Background::start(words, record, write, Record::finish, speaker)))
    }

    /// Takes a batch; one that the disk has no time for is left out, and that is said.
    pub(crate) fn write(&mut self, batch: Batch) {
        let samples = batch.recorded.as_ref().map_or(0, |recorded| recorded.times().len());
        self.0.write(batch, samples as u64);
    }

    /// Waits until everything is written, at most for `patience`.
    pub(crate) fn finish(self, patience: Duration) {
        self.0.finish(patience);
    }
}

/// Writes samples, frames and marks in the order of their times, and hands them to the system.
fn write(record: &mut Record, batch: Batch) -> io::Result<()> {
    let mut frames = batch.frames.iter().peekable();
    let note = |at: &Instant, of: String, text: String| Mark { at: *at, of: of.into(), severity: Severity::Note, text };
    let recorded = batch.recorded.iter();
    let stimuli = recorded.clone().flat_map(|recorded| recorded.stimuli());
    let stimuli = stimuli.map(|(at, place, stimulus)| note(at, Subject::Axis(*place).title(), stimulus.to_string()));
    let noted = recorded.clone().flat_map(|recorded| recorded.marks());
    let noted = noted.map(|(at, text)| note(at, String::new(), text.clone()));
    let mut marks: Vec<Mark> = batch.marks.into_iter().chain(stimuli).chain(noted).collect();
    marks.sort_by_key(|mark| mark.at);
    let mut marks = marks.iter().peekable();
    for (at, values) in recorded.flat_map(Recorder::rows) {
        while let Some((ended, frame)) = frames.next_if(|(ended, _)| *ended <= at) {
            record.frame(*ended, frame)?;
        }
        while let Some(mark) = marks.next_if(|mark| mark.at <= at) {
            record.mark(mark)?;
        }
        record.row(at, values)?;
    }
    frames.try_for_each(|(ended, frame)| record.frame(*ended, frame))?;
    marks.try_for_each(|mark| record.mark(mark))?;
    record.flush()
}
