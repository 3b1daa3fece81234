//! The changes of the world around virtual drives since the studio started.

use std::collections::VecDeque;

use serde::Serialize;

use crate::around::Changed;

/// Number of changes kept; older ones are dropped.
const KEPT: usize = 200;

/// See the [module](self).
#[derive(Debug, Default)]
pub(crate) struct Changes {
    kept: VecDeque<Change>,
    next: u64,
}

/// One change.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Change {
    /// Numbers them from 0.
    number: u64,
    /// In bus time.
    time_s: f64,
    /// The command in its normal form.
    line: String,
    /// The command that undoes it, if there is one.
    back: Option<String>,
    /// Consequences that a person may not expect.
    note: Option<String>,
}

impl Changes {
    /// The number of changes so far.
    pub(crate) const fn count(&self) -> u64 {
        self.next
    }

    /// Adds a change.
    pub(crate) fn add(&mut self, time_s: f64, Changed { line, back, note, .. }: Changed) {
        self.kept.push_back(Change { number: self.next, time_s, line, back, note });
        self.next += 1;
        if self.kept.len() > KEPT {
            self.kept.pop_front();
        }
    }

    /// The changes after the one with this number, or all that are kept.
    pub(crate) fn after(&self, number: Option<u64>) -> impl Iterator<Item = &Change> {
        self.kept.iter().filter(move |change| number.is_none_or(|number| change.number > number))
    }
}
