//! What a record is given: its kind, where it goes, and what happened; and what a file is read as.

use std::borrow::Cow;
use std::io::{Read, Seek, Write};

use can::{Frame, Instant};
use sim::events::{Event, EventKind};
use sim::recorder::Recorder;
use sim::wire::ErrorState;

use super::column::{Column, Subject};

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
    /// The time of the bus.
    pub at: Instant,
    /// To what: `node 4`; empty for the whole.
    pub of: Cow<'static, str>,
    /// What kind of thing, by the name of [`sim::events::KINDS`]; empty if that is not known.
    pub kind: Cow<'static, str>,
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

impl From<&Event> for Mark {
    fn from(event: &Event) -> Self {
        let of = event.place.map_or_else(String::new, |place| Subject::Axis(place).title());
        let severity = match &event.kind {
            EventKind::Fault { .. } | EventKind::Damage(_) | EventKind::BusState { to: ErrorState::BusOff, .. } => {
                Severity::Fault
            }
            EventKind::Emcy { emcy, .. } if emcy.code.0 != 0 => Severity::Warning,
            EventKind::InternalLimit(true)
            | EventKind::Cable(true)
            | EventKind::BusError { .. }
            | EventKind::BusState { to: ErrorState::ErrorPassive, .. }
            | EventKind::Behind(_)
            | EventKind::Missed(_) => Severity::Warning,
            _ => Severity::Note,
        };
        let (kind, text) = (event.kind.name().into(), event.kind.to_string());
        Self { at: event.at, of: of.into(), kind, severity, text }
    }
}

/// What a record is given at one time.
#[derive(Clone, Copy, Debug)]
pub enum Entry<'a> {
    /// The values of all columns, in their order; not a number where there is none.
    Row(Instant, &'a [f64]),
    /// A frame that the bus carried, with the time of its last bit.
    Frame(Instant, &'a Frame),
    /// Something that happened.
    Mark(&'a Mark),
}

/// What happened since the batch before, each kind in the order of its times.
#[derive(Clone, Debug, Default)]
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

    /// How many rows it has.
    pub fn samples(&self) -> usize {
        self.rows.len() + self.recorded.as_ref().map_or(0, |recorded| recorded.times().len())
    }

    /// Gives all of it in the order of the times: of one time the frames first, the row last.
    ///
    /// # Errors
    /// What `take` says.
    pub fn give<E>(&self, mut take: impl FnMut(Entry<'_>) -> Result<(), E>) -> Result<(), E> {
        let mut frames = self.frames.iter().peekable();
        let mut marks = self.marks.iter().peekable();
        let rows = self.rows.iter().map(|(at, values)| (*at, values.as_slice()));
        for (at, values) in self.recorded.iter().flat_map(Recorder::rows).chain(rows) {
            while let Some((ended, frame)) = frames.next_if(|(ended, _)| *ended <= at) {
                take(Entry::Frame(*ended, frame))?;
            }
            while let Some(mark) = marks.next_if(|mark| mark.at <= at) {
                take(Entry::Mark(mark))?;
            }
            take(Entry::Row(at, values))?;
        }
        frames.try_for_each(|(ended, frame)| take(Entry::Frame(*ended, frame)))?;
        marks.try_for_each(|mark| take(Entry::Mark(mark)))
    }
}

/// What a file may be written to: a file, or memory. It is read too: the index at the end of an MCAP file is made from what stands
/// before it.
pub trait Target: Read + Write + Seek + Send {}

impl<T: Read + Write + Seek + Send> Target for T {}

/// One signal over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The signal, with its axis and unit.
    pub column: Column,
    /// Time in s and value, times ascending; not a number where there was none.
    pub points: Vec<(f64, f64)>,
}

/// What a file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recorded {
    /// In the order of the file.
    pub series: Vec<Series>,
    /// What happened.
    pub marks: Vec<Mark>,
    /// The file ends in the middle of something.
    pub torn: bool,
}
