//! What holds at an instant only: a frame or an attempt at one on the wire, and what a world reports of itself
//! ([`sim::events`]).
//!
//! `4 event fault 0x0020` and `event bus_state bus-off` in a scenario are an [`EventPattern`]: a kind of event, of one node or of
//! any, and what is special about it.

use std::fmt;

use canopen::NmtState;
use cia402::{ModeOfOperation, PowerState};
use sim::Place;
use sim::events::{Event, EventKind, KINDS, PowerPhase};
use sim::wire::{ErrorCause, ErrorState, WireEvent};

use words::mode::mode;
use words::suggest::{did_you_mean, near};

/// Something that has just happened.
#[derive(Clone, Copy, Debug)]
pub enum Occurrence<'a> {
    /// On the wire.
    Wire(&'a WireEvent),
    /// An event of a drive, the bus or an intervention from outside.
    Event(&'a Event),
}

/// For people: `frame 704#00`, `node 4: fault 0020h, over-current`.
impl fmt::Display for Occurrence<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Wire(WireEvent::Frame { frame, .. }) => write!(f, "frame {frame}"),
            Self::Wire(WireEvent::Error { frame, cause, .. }) => {
                write!(f, "error frame ({}, of {frame})", cause.word())
            }
            Self::Wire(WireEvent::State { state, .. }) => write!(f, "a controller is {}", state.word()),
            Self::Event(event) => event.fmt(f),
        }
    }
}

/// A kind of event, and of which node and in which form it is meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EventPattern {
    place: Option<Place>,
    kind: &'static str,
    detail: Detail,
}

/// What is special about an event.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Detail {
    Any,
    /// Of a fault, in the drive's own codes; of an EMCY, its error code; of a mode, its number.
    Code(u32),
    /// The state that something has come to, or the first words of a world command.
    Words(String),
}

impl EventPattern {
    /// The node that it is about; `None` for any, and for what has no node.
    pub fn place(&self) -> Option<Place> {
        self.place
    }

    /// Whether this event is one of those.
    pub fn matches(&self, event: &Event) -> bool {
        event.kind.name() == self.kind
            && self.place.is_none_or(|place| event.place == Some(place))
            && match &self.detail {
                Detail::Any => true,
                Detail::Code(code) => code_of(&event.kind) == Some(*code),
                Detail::Words(words) if self.kind == "stimulus" => {
                    said_of(&event.kind).is_some_and(|said| begins_with(&said, words))
                }
                Detail::Words(words) => said_of(&event.kind).is_some_and(|said| said == *words),
            }
    }

    /// Reads what stands behind `event`: a kind, with or without what is special about it.
    ///
    /// # Errors
    /// Which kinds there are, or what may stand behind this one.
    pub fn parse(place: Option<Place>, words: &[&str]) -> Result<Self, String> {
        let (kind, rest) = kind(words)?;
        let detail = match rest {
            [] => Detail::Any,
            rest => detail(kind, rest)?,
        };
        Ok(Self { place, kind, detail })
    }
}

/// `supply 30.0` begins with `supply`, and not with `sup`.
fn begins_with(said: &str, words: &str) -> bool {
    said.strip_prefix(words).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
}

/// The kind that the first words name, with `_` or apart: `target_reached`, `target reached`. The longest name counts.
fn kind<'a, 'b>(words: &'a [&'b str]) -> Result<(&'static str, &'a [&'b str]), String> {
    let named = |count: usize| {
        let name = words.get(..count)?.join("_").replace('-', "_");
        let (known, _) = KINDS.iter().find(|(known, _)| *known == name)?;
        Some((*known, &words[count..]))
    };
    named(2).or_else(|| named(1)).ok_or_else(|| {
        let names = || KINDS.iter().map(|(name, _)| *name);
        let all: Vec<_> = names().collect();
        match words.first() {
            None => format!("a kind of event is missing; expected one of: {}", all.join(", ")),
            Some(word) => {
                let guess = did_you_mean(&near(word, names()));
                format!("unknown kind of event '{word}'{guess}; expected one of: {}", all.join(", "))
            }
        }
    })
}

fn detail(kind: &'static str, words: &[&str]) -> Result<Detail, String> {
    if matches!(kind, "fault" | "fault_reset" | "emcy") {
        return match words {
            [word] => code(word).map(Detail::Code),
            _ => Err(format!("'event {kind}' takes one code, as in 0x3220")),
        };
    }
    let said = words.join(" ");
    if kind == "mode" {
        return mode(&said).map(|mode| Detail::Code(number_of(mode)));
    }
    if kind == "stimulus" {
        return Ok(Detail::Words(said));
    }
    let said = spelled(&said);
    let known = details(kind);
    match known.is_empty() {
        false if known.contains(&said) => Ok(Detail::Words(said)),
        false => Err(format!("'event {kind}' does not take '{said}'; expected one of: {}", known.join(", "))),
        true => Err(format!("'event {kind}' takes nothing further, got '{said}'")),
    }
}

/// The byte of 6060h.
fn number_of(mode: ModeOfOperation) -> u32 {
    u32::from(mode.0 as u8)
}

/// What may be special about an event of this kind.
fn details(kind: &str) -> Vec<String> {
    let words = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect();
    match kind {
        "power" => {
            use PowerPhase::{Booting, Cycling, Draining, Off, On};
            words(&[Off, Booting, On, Draining, Cycling].map(PowerPhase::word))
        }
        "nmt" => {
            use NmtState::{Initialising, Operational, PreOperational, Stopped};
            [Initialising, PreOperational, Operational, Stopped].map(|state| state.to_string()).into()
        }
        "state" => PowerState::ALL.map(|state| spelled(state.name())).into(),
        "internal_limit" => words(&["active", "over"]),
        "bus_error" => {
            use ErrorCause::{Abandoned, BitRate, Collision, Disturbed, NotAcknowledged};
            [Disturbed, NotAcknowledged, Collision, BitRate, Abandoned].map(|cause| spelled(cause.word())).into()
        }
        "bus_state" => {
            use ErrorState::{BusOff, ErrorActive, ErrorPassive};
            words(&[ErrorActive, ErrorPassive, BusOff].map(ErrorState::word))
        }
        "cable" => words(&["cut", "joined"]),
        _ => Vec::new(),
    }
}

/// In small letters with hyphens: `operation-enabled`.
pub(super) fn spelled(words: &str) -> String {
    words.to_lowercase().replace([' ', '_'], "-")
}

/// A code in hexadecimal: `0x3220`, `3220h`, `3220`.
pub(super) fn code(text: &str) -> Result<u32, String> {
    let digits = text.strip_prefix("0x").or_else(|| text.strip_suffix('h')).unwrap_or(text);
    let number = u32::from_str_radix(digits, 16).ok().filter(|_| !digits.starts_with('+'));
    number.ok_or_else(|| format!("'{text}' is not a code; expected hexadecimal digits, as in 0x3220"))
}

fn code_of(kind: &EventKind) -> Option<u32> {
    match kind {
        EventKind::Fault { code, .. } | EventKind::FaultReset { code, .. } => Some(*code),
        EventKind::Emcy { emcy, .. } => Some(emcy.code.0.into()),
        EventKind::Mode(mode) => Some(number_of(*mode)),
        _ => None,
    }
}

/// What is special about an event, spelled as [`details`] has it.
fn said_of(kind: &EventKind) -> Option<String> {
    Some(match kind {
        EventKind::Power(phase) => phase.word().to_owned(),
        EventKind::Nmt { to, .. } => to.to_string(),
        EventKind::State { to, .. } => spelled(to.name()),
        EventKind::InternalLimit(active) => if *active { "active" } else { "over" }.to_owned(),
        EventKind::BusError { cause, .. } => spelled(cause.word()),
        EventKind::BusState { to, .. } => to.word().to_owned(),
        EventKind::Cable(cut) => if *cut { "cut" } else { "joined" }.to_owned(),
        EventKind::Stimulus { words, .. } => words.to_string(),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use can::Instant;

    use super::*;

    fn pattern(words: &str) -> Result<EventPattern, String> {
        EventPattern::parse(None, &words.split_whitespace().collect::<Vec<_>>())
    }

    fn event(kind: EventKind) -> Event {
        Event { at: Instant::ZERO, place: Some(Place::node(4)), kind }
    }

    #[test]
    fn a_pattern_names_a_kind_and_what_is_special_about_it() {
        let fault = event(EventKind::Fault { code: 0x20, row: None });
        let limit = event(EventKind::InternalLimit(true));
        let state = event(EventKind::State { from: None, to: PowerState::OperationEnabled });
        let mode = event(EventKind::Mode(ModeOfOperation::PROFILE_VELOCITY));
        let load = event(EventKind::Stimulus { words: "load torque 2.5".into(), by: None });
        for (words, event, is_meant) in [
            ("fault", &fault, true),
            ("fault 0x0020", &fault, true),
            ("fault 20h", &fault, true),
            ("fault 0x21", &fault, false),
            ("fault reset", &fault, false),
            ("internal limit active", &limit, true),
            ("internal-limit over", &limit, false),
            ("state operation-enabled", &state, true),
            ("state Operation enabled", &state, true),
            ("state fault", &state, false),
            ("mode 3", &mode, true),
            ("mode profile velocity", &mode, true),
            ("mode -1", &mode, false),
            ("stimulus load", &load, true),
            ("stimulus load torque", &load, true),
            ("stimulus load tor", &load, false),
        ] {
            assert_eq!(pattern(words).map(|pattern| pattern.matches(event)), Ok(is_meant), "{words}");
        }
        let of_four = EventPattern::parse(Some(Place::node(4)), &["fault"]).unwrap();
        assert!(of_four.matches(&fault) && !of_four.matches(&Event { place: Some(Place::node(5)), ..fault }));
    }

    #[test]
    fn what_names_no_event_is_refused_with_the_known_ones() {
        for (words, said) in [
            ("", "a kind of event is missing"),
            ("falt", "did you mean fault"),
            ("fault motor", "'motor' is not a code"),
            ("fault 1 2", "one code"),
            ("nmt running", "pre-operational"),
            ("state on", "switched-on"),
            ("mode fast", "profile-velocity"),
            ("boot again", "'event boot' takes nothing further"),
            ("cable open", "cut, joined"),
        ] {
            let refused = pattern(words).expect_err(words);
            assert!(refused.contains(said), "{words}: {refused}");
        }
    }

    #[test]
    fn every_kind_can_be_named_and_so_can_all_that_is_special_about_it() {
        for (kind, _) in KINDS {
            assert!(pattern(kind).is_ok() && pattern(&kind.replace('_', " ")).is_ok(), "{kind}");
            for detail in details(kind) {
                assert!(pattern(&format!("{kind} {detail}")).is_ok(), "{kind} {detail}");
            }
        }
    }
}
