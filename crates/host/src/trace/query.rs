//! Queries to the trace, and their results.

use std::collections::VecDeque;

use can::{BusFrame, Instant};
use canopen::NodeId;
use master::decode::{Decoded, ServiceKind};
use serde::{Deserialize, Serialize};

use super::line::{Begun, TraceLine, Transfers};
use super::ring::Held;

/// Default number of lines, and most lines.
const COUNT: usize = 500;
const MOST: usize = 2_000;

/// Most frames searched for one answer: about 50 ms of work.
pub(super) const MOST_SEARCHED: u64 = 20_000;

/// Frames before the first wanted one that are searched for the start of an SDO transfer that ends after it.
const LOOK_BACK: u64 = 1_000;

/// The parameters of a request, unparsed.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Asked {
    after: Option<u64>,
    before: Option<u64>,
    from_s: Option<f64>,
    until_s: Option<f64>,
    count: Option<usize>,
    #[serde(default)]
    node: String,
    #[serde(default)]
    kind: String,
    #[serde(default)]
    text: String,
    #[serde(default)]
    transfers: bool,
    #[serde(default)]
    quiet: bool,
}

/// A parsed query. A line matches if it has any of the nodes and any of the kinds (all, if none is given), and
/// every word.
#[derive(Clone, Debug, Default)]
pub struct Query {
    after: Option<u64>,
    before: Option<u64>,
    from: Option<Instant>,
    until: Option<Instant>,
    count: usize,
    nodes: Vec<NodeId>,
    kinds: Vec<ServiceKind>,
    words: Vec<String>,
    /// One line for each SDO transfer.
    transfers: bool,
    /// Without the reads of this program.
    quiet: bool,
}

/// A part of the trace: all matching lines of the frames from `from` to below `to`, oldest first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Selection {
    pub(super) from: u64,
    pub(super) to: u64,
    /// Frames between those of the reader and this part that are skipped: they were too many, or are no longer kept.
    pub(super) skipped: u64,
    /// Number of the oldest kept frame.
    pub(super) oldest: u64,
    /// Number of the next frame.
    pub(super) next: u64,
    pub(super) lines: VecDeque<TraceLine>,
}

impl Asked {
    /// Parses the parameters.
    ///
    /// # Errors
    /// The parameter that is not valid: a node, a service, a time.
    pub fn understand(self) -> Result<Query, String> {
        let time = |seconds: Option<f64>| match seconds {
            Some(seconds) if !(0.0..=1e9).contains(&seconds) => {
                Err(format!("expected a bus time in seconds, 0 or more, got {seconds}"))
            }
            Some(seconds) => Ok(Some(Instant::from_nanos((seconds * 1e9) as u64))),
            None => Ok(None),
        };
        Ok(Query {
            after: self.after,
            before: self.before,
            from: time(self.from_s)?,
            until: time(self.until_s)?,
            count: self.count.unwrap_or(COUNT).clamp(1, MOST),
            nodes: parts(&self.node).map(node).collect::<Result<_, _>>()?,
            kinds: parts(&self.kind).map(kind).collect::<Result<_, _>>()?,
            words: parts(&self.text).map(str::to_lowercase).collect(),
            transfers: self.transfers,
            quiet: self.quiet,
        })
    }
}

fn parts(list: &str) -> impl Iterator<Item = &str> {
    list.split(',').map(str::trim).filter(|part| !part.is_empty())
}

pub(super) fn node(text: &str) -> Result<NodeId, String> {
    let raw = text.parse().ok().and_then(NodeId::new);
    raw.ok_or_else(|| format!("'{text}' is not a node-ID; expected 1 to 127, several separated by commas"))
}

fn kind(text: &str) -> Result<ServiceKind, String> {
    let known = || ServiceKind::ALL.map(ServiceKind::word).join(", ");
    let kind = ServiceKind::ALL.into_iter().find(|kind| kind.word() == text);
    kind.ok_or_else(|| format!("'{text}' is not a kind of frame; expected some of {}", known()))
}

impl Query {
    /// The newest matching lines, as many as requested.
    pub fn select(&self, held: &Held) -> Selection {
        let (floor, ceiling) = self.bounds(held);
        let mut lines = VecDeque::new();
        let mut from = ceiling;
        // Backwards in steps, since the newest are wanted; forwards within a step, as frames are decoded in order.
        while from > floor && lines.len() < self.count && ceiling - from < MOST_SEARCHED {
            let start = match self.wants_all() {
                true => from.saturating_sub(self.count as u64),
                false => held.chunk_start(from - 1),
            };
            let step = self.lines(held, start.max(floor), from);
            step.into_iter().rev().for_each(|line| lines.push_front(line));
            from = start.max(floor);
        }
        while lines.len() > self.count {
            lines.pop_front();
            from = lines.front().map_or(from, |line| line.number);
        }
        let (oldest, next) = (held.oldest(), held.next());
        Selection {
            from,
            to: ceiling,
            skipped: self.after.map_or(0, |after| from.saturating_sub(after)),
            oldest,
            next,
            lines,
        }
    }

    /// The range of frame numbers, the second one excluded.
    pub(super) fn bounds(&self, held: &Held) -> (u64, u64) {
        let floor = [Some(held.oldest()), self.after, self.from.map(|from| held.number_at(from))];
        let ceiling = [Some(held.next()), self.before, self.until.map(|until| held.number_at(until))];
        let floor = floor.into_iter().flatten().max().unwrap_or_default();
        let ceiling = ceiling.into_iter().flatten().min().unwrap_or_default();
        (floor, ceiling.max(floor.min(held.next())))
    }

    /// True if node and service match.
    pub(super) fn chooses(&self, decoded: &Decoded) -> bool {
        (self.nodes.is_empty() || self.nodes.iter().any(|node| decoded.concerns(*node)))
            && (self.kinds.is_empty() || self.kinds.contains(&decoded.service()))
    }

    fn wants_all(&self) -> bool {
        self.nodes.is_empty() && self.kinds.is_empty() && self.words.is_empty() && !self.follows_transfers()
    }

    fn lines(&self, held: &Held, from: u64, to: u64) -> VecDeque<TraceLine> {
        let mut lines = VecDeque::new();
        self.each(held, from, to, |number, passed, decoded, begun| {
            let line = match decoded {
                Decoded::Sdo(sdo) if self.transfers => TraceLine::of_transfer(number, passed, decoded, sdo, begun),
                _ => Some(TraceLine::of_frame(number, passed, decoded)),
            };
            lines.extend(line.filter(|line| line.has(&self.words)));
        });
        lines
    }

    /// Visits each frame of node, service and reader that match, with the start of the SDO transfer that it belongs to.
    pub(super) fn each(
        &self,
        held: &Held,
        from: u64,
        to: u64,
        mut visit: impl FnMut(u64, &BusFrame, &Decoded, Option<Begun>),
    ) {
        let mut transfers = Transfers::default();
        let begin = if self.follows_transfers() { from.saturating_sub(LOOK_BACK) } else { from };
        held.decode(begin, to, |number, passed, decoded| {
            let begun = match decoded {
                Decoded::Sdo(sdo) if self.follows_transfers() => transfers.follow(passed, sdo),
                _ => None,
            };
            let is_hidden = self.quiet && begun.is_some_and(|begun| begun.is_own_reading());
            if number >= from && self.chooses(decoded) && !is_hidden {
                visit(number, passed, decoded, begun);
            }
        });
    }

    pub(super) fn words(&self) -> &[String] {
        &self.words
    }

    pub(super) const fn after(&self) -> Option<u64> {
        self.after
    }

    /// True if a frame can be decoded only with those before it.
    const fn follows_transfers(&self) -> bool {
        self.transfers || self.quiet
    }
}
