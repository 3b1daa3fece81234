use std::collections::BTreeSet;

use can::Instant;

use super::request::Ticket;

/// Deadlines that futures wait for, ordered by time. Arming and the next deadline cost O(log n).
#[derive(Clone, Debug, Default)]
pub(super) struct Timers {
    armed: BTreeSet<(Instant, Ticket)>,
}

impl Timers {
    pub(super) fn arm(&mut self, due: Instant, ticket: Ticket) {
        self.armed.insert((due, ticket));
    }

    /// Scans: few are armed. False if it is not here.
    pub(super) fn cancel(&mut self, ticket: Ticket) -> bool {
        let before = self.armed.len();
        self.armed.retain(|(_, armed)| *armed != ticket);
        self.armed.len() < before
    }

    pub(super) fn next(&self) -> Option<Instant> {
        self.armed.first().map(|(due, _)| *due)
    }

    /// Takes the earliest deadline that is at or before `now`.
    pub(super) fn pop_due(&mut self, now: Instant) -> Option<Ticket> {
        let (due, ticket) = *self.armed.first()?;
        if due > now {
            return None;
        }
        self.armed.pop_first();
        Some(ticket)
    }
}
