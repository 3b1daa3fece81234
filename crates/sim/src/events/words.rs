//! Events in words, for people.

use std::fmt;

use cia402::ModeOfOperation;
use devices::faults::FaultRow;

use super::{Event, EventKind};
use crate::wire::{ErrorCause, ErrorState};

impl Event {
    /// What to do about it, where something can be done.
    pub fn remedy(&self) -> Option<&'static str> {
        match self.kind {
            EventKind::Fault { row, .. } | EventKind::Emcy { row, .. } => row.map(|row| row.remedy),
            EventKind::BusError { cause, .. } => Some(remedy_of_error(cause)),
            EventKind::BusState { to: ErrorState::BusOff, .. } => {
                Some("look for a node at another bit rate, a broken wire or a missing terminator")
            }
            EventKind::Behind(_) => Some("fewer drives or clients, or a slower pace"),
            EventKind::Missed(_) => Some("pull events more often, or subscribe to fewer"),
            _ => None,
        }
    }
}

/// `node 4: fault 0001h, over-voltage`: what happened, without time and remedy.
impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Some(place) => write!(f, "node {place}: {}", self.kind),
            None => self.kind.fmt(f),
        }
    }
}

impl fmt::Display for EventKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Power(phase) => f.write_str(phase.sentence()),
            Self::Boot => f.write_str("boot-up message"),
            Self::Nmt { to, .. } => write!(f, "NMT state {to}"),
            Self::State { from: None, to } => write!(f, "state {}", to.name()),
            Self::State { from: Some(from), to } => write!(f, "state {} (was {})", to.name(), from.name()),
            Self::Mode(mode) => write!(f, "mode {}", mode_name(*mode)),
            Self::Fault { code, row } => write!(f, "fault {code:04X}h{}", FaultName(*row)),
            Self::FaultReset { code, row } => write!(f, "fault {code:04X}h is gone{}", FaultName(*row)),
            Self::Emcy { emcy, row: None } => write!(f, "EMCY {:04X}h, {}", emcy.code.0, emcy.code.class()),
            Self::Emcy { emcy, row } => write!(f, "EMCY {:04X}h{}", emcy.code.0, FaultName(*row)),
            Self::TargetReached => f.write_str("target reached"),
            Self::InternalLimit(true) => f.write_str("an internal limit is active"),
            Self::InternalLimit(false) => f.write_str("no internal limit is active any more"),
            Self::StoreBegun => f.write_str("begins to store"),
            Self::StoreDone { generation } => write!(f, "store {generation} is done"),
            Self::Damage(what) => f.write_str(what),
            Self::BusError { cause, frame, attempt } => {
                write!(f, "frame {frame} failed: {}", cause.sentence())?;
                if *attempt > 1 { write!(f, ", attempt {attempt}") } else { Ok(()) }
            }
            Self::BusState { from: ErrorState::BusOff, to } => write!(f, "{} again after bus-off", to.word()),
            Self::BusState { to, .. } => f.write_str(to.word()),
            Self::Cable(true) => f.write_str("the bus cable is cut"),
            Self::Cable(false) => f.write_str("the bus cable is joined"),
            Self::Stimulus { words, by: None } => f.write_str(words),
            Self::Stimulus { words, by: Some(by) } => write!(f, "{words} (by {by})"),
            Self::Behind(by) => write!(f, "the bus is {} ms behind the clock", by.as_millis()),
            Self::CaughtUp { worst } => {
                write!(f, "the bus has caught up with the clock; it was up to {} ms behind", worst.as_millis())
            }
            Self::Missed(count) => write!(f, "{count} events are missing here: they were not read in time"),
        }
    }
}

/// The name of a fault behind its code.
struct FaultName(Option<&'static FaultRow>);

impl fmt::Display for FaultName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.map_or(Ok(()), |row| write!(f, ", {}", row.name))
    }
}

fn mode_name(mode: ModeOfOperation) -> String {
    mode.name().map_or_else(|| mode.0.to_string(), str::to_owned)
}

impl ErrorState {
    /// The word for it: `bus-off`.
    pub const fn word(self) -> &'static str {
        match self {
            Self::ErrorActive => "error-active",
            Self::ErrorPassive => "error-passive",
            Self::BusOff => "bus-off",
        }
    }
}

impl ErrorCause {
    /// The word for it: `not_acknowledged`.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Disturbed => "disturbed",
            Self::NotAcknowledged => "not_acknowledged",
            Self::Collision => "collision",
            Self::BitRate => "bit_rate",
            Self::Abandoned => "abandoned",
        }
    }

    const fn sentence(self) -> &'static str {
        match self {
            Self::Disturbed => "disturbed on the wire",
            Self::NotAcknowledged => "it was not acknowledged",
            Self::Collision => "another node sent the same identifier with other contents",
            Self::BitRate => "a node at another bit rate got in between",
            Self::Abandoned => "its sender lost power or cable in the middle of it",
        }
    }
}

/// What to do about a frame that does not get through.
const fn remedy_of_error(cause: ErrorCause) -> &'static str {
    match cause {
        ErrorCause::Disturbed => "screen, terminators and contacts of the bus; a single one does no harm",
        ErrorCause::NotAcknowledged => "a second node at the same bit rate: a single one is never acknowledged",
        ErrorCause::Collision => "look for two nodes with one node-ID",
        ErrorCause::BitRate => "give all nodes the same bit rate",
        ErrorCause::Abandoned => "nothing, if power or cable were taken on purpose",
    }
}
