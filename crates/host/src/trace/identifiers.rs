//! The traffic by identifier: how many frames of each, how far apart, and the last one in words.
//!
//! A reader asks for what came after the frames that it has, and adds the parts up: each answer costs only the frames in between.

use std::collections::BTreeMap;

use serde::Serialize;

use super::line::Line;
use super::query::{MOST_SEARCHED, Query};
use super::ring::Held;

/// The frames of one identifier within a part of the trace.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Identifier {
    /// COB-ID, hexadecimal.
    id: String,
    count: u64,
    /// Bus time in s.
    first_s: f64,
    /// The shortest and the longest time between two of them, in ms; `null` of a single frame.
    least_ms: Option<f64>,
    most_ms: Option<f64>,
    /// The last one.
    last: Line,
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

impl Query {
    /// The frames that match, by identifier, in the order of identifiers: standard ones before extended ones.
    pub fn identifiers(&self, held: &Held) -> Identifiers {
        let (floor, to) = self.bounds(held);
        let from = floor.max(to.saturating_sub(MOST_SEARCHED));
        let mut found: BTreeMap<(bool, u32), Identifier> = BTreeMap::new();
        self.each(held, from, to, |number, passed, decoded, _| {
            let line = Line::of_frame(number, passed, decoded);
            if !line.has(self.words()) {
                return;
            }
            let id = passed.frame.id();
            let one = found.entry((id.is_extended(), id.raw())).or_insert_with(|| Identifier {
                id: line.id.clone(),
                count: 0,
                first_s: line.at_s,
                least_ms: None,
                most_ms: None,
                last: line.clone(),
            });
            if one.count > 0 {
                let apart_ms = (line.at_s - one.last.at_s) * 1e3;
                one.least_ms = Some(one.least_ms.map_or(apart_ms, |least| least.min(apart_ms)));
                one.most_ms = Some(one.most_ms.map_or(apart_ms, |most| most.max(apart_ms)));
            }
            one.count += 1;
            one.last = line;
        });
        let skipped = self.after().map_or(0, |after| from.saturating_sub(after));
        Identifiers { from, to, skipped, identifiers: found.into_values().collect() }
    }
}
