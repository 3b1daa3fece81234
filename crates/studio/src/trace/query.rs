//! Which part of the trace is wanted, and the part.

use std::collections::VecDeque;

use can::Instant;
use canopen::NodeId;
use master::decode::{Decoded, ServiceKind};
use serde::{Deserialize, Serialize};

use super::line::{Line, Transfers};
use super::ring::Held;

/// Lines that are given where nobody says how many, and at most.
const COUNT: usize = 500;
const MOST: usize = 2_000;

/// Frames that are looked through for one answer: some 50 ms of work.
pub(super) const MOST_SEARCHED: u64 = 20_000;

/// Frames before the first wanted one in which the beginning of an SDO transfer is looked for that ends behind it.
const LOOK_BACK: u64 = 1_000;

/// What is asked for, in the words of a request.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Asked {
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

/// Which part of the trace is wanted. Of nodes and kinds any that is named will do, or all if none is; words have to be there
/// all.
#[derive(Clone, Debug, Default)]
pub(crate) struct Query {
    after: Option<u64>,
    before: Option<u64>,
    from: Option<Instant>,
    until: Option<Instant>,
    count: usize,
    nodes: Vec<NodeId>,
    kinds: Vec<ServiceKind>,
    words: Vec<String>,
    /// Of an SDO transfer one line.
    transfers: bool,
    /// Without what this program reads.
    quiet: bool,
}

/// A part of the trace: all lines that are wanted of the frames from `from` to below `to`, oldest first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Selection {
    pub(super) from: u64,
    pub(super) to: u64,
    /// Frames between what the reader has and this, of which nothing is said: they were too many, or are not kept any more.
    pub(super) skipped: u64,
    /// Of the oldest frame that is kept.
    pub(super) oldest: u64,
    /// Of the frame that comes next.
    pub(super) next: u64,
    pub(super) lines: VecDeque<Line>,
}

impl Asked {
    /// What that means.
    ///
    /// # Errors
    /// In words, what is none: a node, a service, a time.
    pub(crate) fn understand(self) -> Result<Query, String> {
        let time = |seconds: Option<f64>| match seconds {
            Some(seconds) if !(0.0..=1e9).contains(&seconds) => {
                Err(format!("{seconds} is no time of the bus in seconds"))
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
    raw.ok_or_else(|| format!("'{text}' is no node-ID; expected 1 to 127, several separated by commas"))
}

fn kind(text: &str) -> Result<ServiceKind, String> {
    let known = || ServiceKind::ALL.map(ServiceKind::word).join(", ");
    let kind = ServiceKind::ALL.into_iter().find(|kind| kind.word() == text);
    kind.ok_or_else(|| format!("'{text}' is no kind of frame; expected some of {}", known()))
}

impl Query {
    /// The newest lines that are wanted, as many as are asked for.
    pub(crate) fn select(&self, held: &Held) -> Selection {
        let (floor, ceiling) = self.bounds(held);
        let mut lines = VecDeque::new();
        let mut from = ceiling;
        // Backwards in steps, since the newest are wanted; within a step forwards, as frames are understood.
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

    /// The numbers between which it looks, the second one not included.
    pub(super) fn bounds(&self, held: &Held) -> (u64, u64) {
        let floor = [Some(held.oldest()), self.after, self.from.map(|from| held.number_at(from))];
        let ceiling = [Some(held.next()), self.before, self.until.map(|until| held.number_at(until))];
        let floor = floor.into_iter().flatten().max().unwrap_or_default();
        let ceiling = ceiling.into_iter().flatten().min().unwrap_or_default();
        (floor, ceiling.max(floor.min(held.next())))
    }

    /// True if nodes and service are those that are wanted.
    pub(super) fn chooses(&self, decoded: &Decoded) -> bool {
        (self.nodes.is_empty() || self.nodes.iter().any(|node| decoded.concerns(*node)))
            && (self.kinds.is_empty() || self.kinds.contains(&decoded.service()))
    }

    fn wants_all(&self) -> bool {
        self.nodes.is_empty() && self.kinds.is_empty() && self.words.is_empty() && !self.follows_transfers()
    }

    fn lines(&self, held: &Held, from: u64, to: u64) -> VecDeque<Line> {
        let mut transfers = Transfers::default();
        let mut lines = VecDeque::new();
        let begin = if self.follows_transfers() { from.saturating_sub(LOOK_BACK) } else { from };
        held.decode(begin, to, |number, passed, decoded| {
            let begun = match decoded {
                Decoded::Sdo(sdo) if self.follows_transfers() => transfers.follow(passed, sdo),
                _ => None,
            };
            if number < from
                || !self.chooses(decoded)
                || self.quiet && begun.is_some_and(|begun| begun.is_own_reading())
            {
                return;
            }
            let line = match decoded {
                Decoded::Sdo(sdo) if self.transfers => Line::of_transfer(number, passed, decoded, sdo, begun),
                _ => Some(Line::of_frame(number, passed, decoded)),
            };
            lines.extend(line.filter(|line| line.has(&self.words)));
        });
        lines
    }

    /// True if a frame can be told only with those before it.
    const fn follows_transfers(&self) -> bool {
        self.transfers || self.quiet
    }
}
