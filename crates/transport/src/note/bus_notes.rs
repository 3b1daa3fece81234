//! What a live bus says beside frames, for people: each kind once in a command, a connection that comes and goes each time.

use std::collections::BTreeSet;

use super::Note;
use crate::BusSpec;

/// Which kinds have been reported of a bus, and whether it is there.
#[derive(Clone, Debug)]
pub struct BusNotes {
    bus: String,
    reported: BTreeSet<&'static str>,
    lost: Option<String>,
    troubles: Vec<String>,
}

impl BusNotes {
    /// Nothing has been reported yet of `bus`.
    pub fn of(bus: &BusSpec) -> Self {
        Self { bus: bus.to_string(), reported: BTreeSet::new(), lost: None, troubles: Vec::new() }
    }

    /// The line to show for `note`: what happened and what to do about it, if that is new.
    pub fn news(&mut self, note: &Note) -> Option<String> {
        let comes_and_goes = matches!(note, Note::ConnectionLost { .. } | Note::ConnectionBack);
        if comes_and_goes {
            let is_lost = matches!(note, Note::ConnectionLost { .. });
            self.lost = is_lost.then(|| note.to_string());
        }
        if !self.reported.insert(note.kind()) && !comes_and_goes {
            return None;
        }
        // An advice names the interface of which most have only one.
        let advice = note.advice().map(|advice| format!("; {}", self.named(advice))).unwrap_or_default();
        if !advice.is_empty() && !comes_and_goes {
            self.troubles.push(format!("{note}{advice}"));
        }
        Some(format!("bus {}: {note}{advice}", self.bus))
    }

    /// How the connection to the bus was lost, while it is.
    pub fn lost(&self) -> Option<&str> {
        self.lost.as_deref()
    }

    /// What was reported of the bus that a person has to do something about, each kind once: a likely cause of what fails there.
    pub fn troubles(&self) -> impl Iterator<Item = &str> {
        self.troubles.iter().map(String::as_str)
    }

    fn named(&self, advice: &str) -> String {
        if self.bus.contains(':') { advice.to_owned() } else { advice.replace("can0", &self.bus) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ControllerState;

    #[test]
    fn a_kind_is_reported_once_and_a_connection_each_time() {
        let mut notes = BusNotes::of(&"can3".parse().unwrap());
        let off = Note::State(ControllerState::BusOff);
        let text = notes.news(&off).unwrap();
        assert!(text.starts_with("bus can3: ") && text.contains("ip link set can3 type can restart"), "{text}");
        assert_eq!(notes.news(&off), None);
        let troubles: Vec<_> = notes.troubles().collect();
        assert!(troubles.len() == 1 && text.ends_with(troubles[0]), "{troubles:?}");
        assert!(notes.news(&Note::ConnectionBack).is_some() && notes.news(&Note::ConnectionBack).is_some());
    }

    #[test]
    fn a_loss_lasts_until_the_bus_is_back() {
        let mut notes = BusNotes::of(&"can3".parse().unwrap());
        let lost = Note::ConnectionLost { reason: "unplugged".into() };
        assert!(notes.news(&lost).is_some());
        assert_eq!(notes.lost().unwrap(), "the connection to the bus is lost: unplugged");
        assert!(notes.news(&Note::ConnectionBack).is_some() && notes.lost().is_none());
    }
}
