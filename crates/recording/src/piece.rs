//! What a record is given: its kind, where it goes, and what happened; and what a file is read as.

use std::borrow::Cow;
use std::io::{Read, Seek, Write};

use can::Instant;
use sim::events::{Event, EventKind};
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
    /// When.
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

/// What a file may be written to: a file, or memory. It is read too: the index at the end of an MCAP file is made from what stands
/// before it.
pub trait Target: Read + Write + Seek + Send {}

impl<T: Read + Write + Seek + Send> Target for T {}

/// One signal over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Which.
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
