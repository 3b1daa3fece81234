//! The traffic by identifier: how many frames of each, how far apart, and the last one in words.
//!
//! A reader asks for what came after the frames that it has, and adds the parts up: each answer costs only the frames in between.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::time::Duration;

use can::{BusFrame, Instant};
use master::decode::Decoded;
use serde::Serialize;

use super::line::TraceLine;
use super::query::{MOST_SEARCHED, Query};
use super::ring::Held;

/// The frames of one identifier within a part of the trace.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Identifier {
    /// COB-ID, hexadecimal.
    id: String,
    count: u64,
    /// Bus time in s.
    first_s: f64,
    /// The shortest and the longest time between two of them, in ms; `null` of a single frame.
    least_ms: Option<f64>,
    most_ms: Option<f64>,
    /// The last one.
    last: TraceLine,
}

/// What the frames from `from` to below `to` are, by identifier.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Identifiers {
    from: u64,
    to: u64,
    /// Frames between those of the reader and this part: they were too many, or are no longer kept.
    skipped: u64,
    identifiers: Vec<Identifier>,
}

/// What is known of one while the frames pass. Only the last frame of each becomes a line: texts for all cost most of the time.
struct Passing {
    count: u64,
    first: Instant,
    least: Option<Duration>,
    most: Option<Duration>,
    last: (u64, BusFrame, Decoded),
}

impl Passing {
    fn new(number: u64, passed: &BusFrame, decoded: &Decoded) -> Self {
        let last = (number, *passed, decoded.clone());
        Self { count: 1, first: passed.at, least: None, most: None, last }
    }

    fn take(&mut self, number: u64, passed: &BusFrame, decoded: &Decoded) {
        let apart = passed.at - self.last.1.at;
        self.least = Some(self.least.map_or(apart, |least| least.min(apart)));
        self.most = Some(self.most.map_or(apart, |most| most.max(apart)));
        self.count += 1;
        self.last = (number, *passed, decoded.clone());
    }

    fn ended(self) -> Identifier {
        let Self { count, first, least, most, last: (number, passed, decoded) } = self;
        let last = TraceLine::of_frame(number, &passed, &decoded);
        let first_s = (first - Instant::ZERO).as_secs_f64();
        let ms = |time: Duration| time.as_nanos() as f64 / 1e6;
        Identifier { id: last.id.clone(), count, first_s, least_ms: least.map(ms), most_ms: most.map(ms), last }
    }
}

/// Frames by identifier, as they pass: in the order of identifiers, standard ones before extended ones.
#[derive(Default)]
pub struct ByIdentifier(BTreeMap<(bool, u32), Passing>);

impl ByIdentifier {
    /// Adds a frame, which has this number.
    pub fn take(&mut self, number: u64, passed: &BusFrame, decoded: &Decoded) {
        let id = passed.frame.id();
        match self.0.entry((id.is_extended(), id.raw())) {
            Entry::Vacant(place) => drop(place.insert(Passing::new(number, passed, decoded))),
            Entry::Occupied(mut one) => one.get_mut().take(number, passed, decoded),
        }
    }

    /// What there was of each.
    pub fn ended(self) -> Vec<Identifier> {
        self.0.into_values().map(Passing::ended).collect()
    }
}

impl Identifier {
    /// For people: COB-ID, frames, the shortest and the longest time between two of them in ms, service, and the last one in words.
    pub fn cells(&self) -> [String; 6] {
        let ms = |time: Option<f64>| time.map_or_else(|| "-".to_owned(), |ms| format!("{ms:.3}"));
        let TraceLine { kind, text, .. } = &self.last;
        let count = self.count.to_string();
        [self.id.clone(), count, ms(self.least_ms), ms(self.most_ms), (*kind).to_owned(), text.clone()]
    }
}

impl Query {
    /// The frames that match, by identifier, in the order of identifiers: standard ones before extended ones.
    pub fn identifiers(&self, held: &Held) -> Identifiers {
        let (floor, to) = self.bounds(held);
        // A reader of a studio that was started anew has seen more than there is.
        let from = floor.max(to.saturating_sub(MOST_SEARCHED)).min(to);
        let mut found = ByIdentifier::default();
        self.each(held, from, to, |number, passed, decoded, _| {
            if !self.words().is_empty() && !TraceLine::of_frame(number, passed, decoded).has(self.words()) {
                return;
            }
            found.take(number, passed, decoded);
        });
        let skipped = self.after().map_or(0, |after| from.saturating_sub(after));
        Identifiers { from, to, skipped, identifiers: found.ended() }
    }
}
