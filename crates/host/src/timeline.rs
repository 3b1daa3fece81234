//! What has happened to the drives, with causes and remedies. Kept whether a page is open or not.
//!
//! Bounded: the newest are kept, and a repeated emergency message is one entry with a count.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use can::Instant;
use canopen::NodeId;
use serde::Serialize;

/// Number of entries kept.
const KEPT: usize = 1_000;

/// The kind of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// An emergency message (CiA 301, 7.2.7).
    Emcy,
    /// The drive's fault object (603Fh, of some 260Eh) has a fault.
    Fault,
    /// A node is silent: its heartbeat or its answers are missing.
    Silent,
    /// A change of the power state (CiA 402-2, 8.2).
    State,
    /// A boot-up, or a change of the NMT state.
    Nmt,
    /// This studio stopped it.
    Stop,
}

impl Kind {
    /// It lasts until its end is reported.
    const fn lasts(self) -> bool {
        matches!(self, Self::Emcy | Self::Fault | Self::Silent)
    }
}

/// Something that happened.
#[derive(Clone, Debug)]
pub struct TimelineEvent {
    /// The time of the bus.
    pub at: Instant,
    /// Of which node.
    pub node: NodeId,
    /// What happened.
    pub kind: Kind,
    /// In words.
    pub what: String,
    /// The code that the drive reports.
    pub code: Option<u16>,
    /// Possible causes and remedies.
    pub remedy: Option<&'static str>,
    /// Source of these: document and section.
    pub source: Option<String>,
}

impl TimelineEvent {
    /// An event that needs no explanation.
    pub fn new(at: Instant, node: NodeId, kind: Kind, what: impl Into<String>) -> Self {
        Self { at, node, kind, what: what.into(), code: None, remedy: None, source: None }
    }
}

/// An event as it is shown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry {
    /// Numbers them from 0.
    number: u64,
    #[serde(skip)]
    revision: u64,
    /// In bus time: when it first came, when it last came, and when it ended.
    at_s: f64,
    last_s: f64,
    gone_s: Option<f64>,
    /// How often it came.
    count: u32,
    node: u8,
    kind: Kind,
    what: String,
    code: Option<u16>,
    remedy: Option<&'static str>,
    source: Option<String>,
}

/// The events so far. Cheap to clone and to read from any thread.
#[derive(Debug, Default)]
pub struct Timeline {
    kept: Mutex<EntryStore>,
}

#[derive(Debug, Default)]
struct EntryStore {
    entries: VecDeque<Entry>,
    next: u64,
    revision: u64,
}

/// The changes since a revision.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct News {
    /// The revision to continue from.
    revision: u64,
    /// Number of the oldest kept event.
    oldest: u64,
    /// New or changed, oldest first.
    entries: Vec<Entry>,
}

impl Timeline {
    /// Adds an event. One that lasts already is not repeated; an emergency message is counted.
    pub fn push(&self, event: TimelineEvent) {
        self.lock().push(event);
    }

    /// Ends the events of this kind on a node, except those with these codes.
    pub fn end_but(&self, at: Instant, node: NodeId, kind: Kind, codes: &[Option<u16>]) {
        self.lock().end_but(seconds(at), node, kind, codes);
    }

    /// Rises with each change.
    pub fn revision(&self) -> u64 {
        self.lock().revision
    }

    /// New and changed events since a revision; everything since 0.
    pub fn since(&self, revision: u64) -> News {
        let kept = self.lock();
        let entries = kept.entries.iter().filter(|entry| entry.revision > revision).cloned().collect();
        let oldest = kept.entries.front().map_or(kept.next, |entry| entry.number);
        News { revision: kept.revision, oldest, entries }
    }

    fn lock(&self) -> MutexGuard<'_, EntryStore> {
        // Events are added whole: a panic elsewhere leaves the list consistent.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl EntryStore {
    fn push(&mut self, event: TimelineEvent) {
        let TimelineEvent { at, node, kind, what, code, remedy, source } = event;
        let at_s = seconds(at);
        let mut open = self.entries.iter_mut().rev().filter(|entry| entry.goes_on(node, kind));
        if let Some(known) = open.find(|entry| entry.code == code) {
            if kind == Kind::Emcy {
                self.revision += 1;
                known.count = known.count.saturating_add(1);
                (known.last_s, known.revision) = (at_s, self.revision);
            }
            return;
        }
        if self.entries.len() == KEPT {
            self.entries.pop_front();
        }
        self.revision += 1;
        let (number, revision, node) = (self.next, self.revision, node.raw());
        let entry = Entry {
            number,
            revision,
            at_s,
            last_s: at_s,
            gone_s: None,
            count: 1,
            node,
            kind,
            what,
            code,
            remedy,
            source,
        };
        self.entries.push_back(entry);
        self.next += 1;
    }

    fn end_but(&mut self, at_s: f64, node: NodeId, kind: Kind, codes: &[Option<u16>]) {
        let open = self.entries.iter_mut().filter(|entry| entry.goes_on(node, kind));
        for entry in open.filter(|entry| !codes.contains(&entry.code)) {
            self.revision += 1;
            (entry.gone_s, entry.revision) = (Some(at_s), self.revision);
        }
    }
}

impl Entry {
    fn goes_on(&self, node: NodeId, kind: Kind) -> bool {
        kind.lasts() && self.kind == kind && self.node == node.raw() && self.gone_s.is_none()
    }
}

fn seconds(at: Instant) -> f64 {
    (at - Instant::ZERO).as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn emcy(at_s: u64, node: u8, code: u16) -> TimelineEvent {
        let node = NodeId::new(node).expect("a node-ID");
        TimelineEvent {
            code: Some(code),
            ..TimelineEvent::new(Instant::from_secs(at_s), node, Kind::Emcy, "over-voltage")
        }
    }

    #[test]
    fn an_emergency_message_that_comes_again_is_counted_until_it_is_over() {
        let timeline = Timeline::default();
        for at_s in 1..=3 {
            timeline.push(emcy(at_s, 4, 1));
        }
        timeline.push(emcy(3, 2, 1));
        timeline.push(emcy(4, 4, 2));
        let node = NodeId::new(4).expect("a node-ID");
        timeline.end_but(Instant::from_secs(5), node, Kind::Emcy, &[Some(2)]);
        timeline.push(emcy(6, 4, 1));
        let shown: Vec<_> =
            timeline.since(0).entries.iter().map(|entry| (entry.node, entry.code, entry.count, entry.gone_s)).collect();
        let expected =
            [(4, Some(1), 3, Some(5.0)), (2, Some(1), 1, None), (4, Some(2), 1, None), (4, Some(1), 1, None)];
        assert_eq!(shown, expected);
    }

    #[test]
    fn a_reader_gets_new_and_changed_events_since_its_revision() {
        let timeline = Timeline::default();
        timeline.push(emcy(1, 4, 1));
        timeline.push(emcy(1, 4, 2));
        let first = timeline.since(0);
        assert_eq!(timeline.since(first.revision).entries, []);
        let node = NodeId::new(4).expect("a node-ID");
        timeline.end_but(Instant::from_secs(2), node, Kind::Emcy, &[Some(2)]);
        let changed = timeline.since(first.revision);
        assert_eq!(changed.entries.len(), 1);
        assert_eq!((changed.entries[0].number, changed.entries[0].gone_s), (0, Some(2.0)));
        assert_eq!(changed.revision, timeline.revision());
    }

    #[test]
    fn the_newest_are_kept() {
        let timeline = Timeline::default();
        for round in 0..3 * KEPT as u64 {
            let node = NodeId::new(4).expect("a node-ID");
            timeline.push(TimelineEvent::new(Instant::from_secs(round), node, Kind::State, "to Fault"));
        }
        let news = timeline.since(0);
        assert_eq!((news.entries.len(), news.oldest), (KEPT, 2 * KEPT as u64));
    }
}
