//! The observer: listens without taking part.

use std::collections::VecDeque;

use crate::wire::WireEvent;

/// What happened on the wire, oldest first: frames, errors, changes of error state.
///
/// Holds the last [`FrameLog::DEFAULT_LIMIT`] entries unless set otherwise.
#[derive(Clone, Debug)]
pub struct FrameLog {
    entries: VecDeque<WireEvent>,
    limit: usize,
    dropped: u64,
}

impl FrameLog {
    /// Entries held by default.
    pub const DEFAULT_LIMIT: usize = 4096;

    /// Holds the last `limit` entries; `usize::MAX` keeps everything until it is pulled.
    pub fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
        self.trim();
    }

    /// Takes out the oldest entry.
    pub fn pull(&mut self) -> Option<WireEvent> {
        self.entries.pop_front()
    }

    /// All entries held, oldest first.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &WireEvent> {
        self.entries.iter()
    }

    /// Entries lost because they were not pulled in time.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    pub(super) fn push(&mut self, event: WireEvent) {
        self.entries.push_back(event);
        self.trim();
    }

    fn trim(&mut self) {
        while self.entries.len() > self.limit {
            self.entries.pop_front();
            self.dropped += 1;
        }
    }
}

impl Default for FrameLog {
    fn default() -> Self {
        Self { entries: VecDeque::new(), limit: Self::DEFAULT_LIMIT, dropped: 0 }
    }
}
