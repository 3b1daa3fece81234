//! What a live bus says beside frames, for people: each kind once in a command.

use std::collections::BTreeSet;

use transport::Note;

/// Which kinds have been told.
#[derive(Debug, Default)]
pub(crate) struct BusNotes {
    told: BTreeSet<&'static str>,
}

impl BusNotes {
    /// The line to show for `note`, if its kind is new.
    pub(crate) fn news(&mut self, note: &Note) -> Option<String> {
        self.told.insert(note.kind()).then(|| format!("bus: {note}"))
    }
}
