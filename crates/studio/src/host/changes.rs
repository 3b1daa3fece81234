//! What was done to the world around virtual drives since the studio began.

use std::collections::VecDeque;

use serde::Serialize;

use crate::world::Changed;

/// Changes that are kept; older ones are forgotten.
const KEPT: usize = 200;

/// See the [module](self).
#[derive(Debug, Default)]
pub(super) struct Changes {
    kept: VecDeque<Change>,
    next: u64,
}

/// One thing that was done.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Change {
    /// Numbers them from 0.
    number: u64,
    /// In the time of the bus.
    time_s: f64,
    /// As it was understood.
    line: String,
    /// What takes it back, where anything does.
    back: Option<String>,
    /// What will come of it, where a person may not expect it.
    note: Option<String>,
}

impl Changes {
    /// How many there have been.
    pub(super) const fn count(&self) -> u64 {
        self.next
    }

    /// Keeps one more.
    pub(super) fn add(&mut self, time_s: f64, Changed { line, back, note, .. }: Changed) {
        self.kept.push_back(Change { number: self.next, time_s, line, back, note });
        self.next += 1;
        if self.kept.len() > KEPT {
            self.kept.pop_front();
        }
    }

    /// Those after the one of this number, or all that are kept.
    pub(super) fn after(&self, number: Option<u64>) -> impl Iterator<Item = &Change> {
        self.kept.iter().filter(move |change| number.is_none_or(|number| change.number > number))
    }
}
