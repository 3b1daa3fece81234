//! Homing as the drives' tables tell it: the moves of one run, and a track of switches on which they can be tried.
//!
//! A move is a direction, a speed and what ends it. Speeds are names (`6099:01`, `origin`), since the tables say which
//! of the drive's speeds is used, not how fast that is. The track has no dynamics: one count a step, and an overrun
//! after each move that stands for slowing down.

use std::ops::RangeInclusive;

use crate::csv::Row;

/// One row of a `homing.csv`.
#[derive(Debug, Clone)]
pub struct HomingRow {
    /// The value of 6098h.
    pub method: u8,
    /// Where it starts, in words: `between`, `on_home`.
    pub start: String,
    /// The moves in order.
    pub moves: Vec<Move>,
    /// The edge that becomes the origin; `None` when none is reached.
    pub latch: Option<Latch>,
    /// `attained`, `failed`, `running`, or how it was ended from outside.
    pub result: String,
}

/// A stretch in one direction at one speed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Move {
    /// 1 towards positive positions, -1 towards negative ones.
    pub direction: i32,
    /// Which of the drive's homing speeds.
    pub speed: String,
    /// What ends it: `home_on`, `home_off`, `home_off_back_off`, `never`, or something outside the track.
    pub until: String,
}

/// The edge of a switch, seen while moving.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Latch {
    /// The switch: `home`, `negative_limit`, `dir`.
    pub switch: String,
    /// From inactive to active.
    pub rising: bool,
    /// The direction of the move that meets it, as in [`Move`].
    pub direction: i32,
}

/// The switches along the axis, each active over a range of positions.
pub type Track = Vec<(&'static str, RangeInclusive<i32>)>;

/// Further than any track of the tests is long.
const FAR: i32 = 10_000;

/// How far a motor goes on while it slows down.
const OVERRUN: i32 = 10;

/// How far a motor leaves a switch that it has to meet again.
const BACK_OFF: i32 = 30;

impl Latch {
    /// Where on the track it is: the first position at which the switch has changed.
    ///
    /// # Panics
    ///
    /// When the track has no such switch.
    #[must_use]
    pub fn place(&self, track: &Track) -> i32 {
        let found = track.iter().find(|(name, _)| *name == self.switch);
        let (_, range) = found.unwrap_or_else(|| panic!("no {} on the track", self.switch));
        match (self.rising, self.direction > 0) {
            (true, true) => *range.start(),
            (true, false) => *range.end(),
            (false, true) => *range.end() + 1,
            (false, false) => *range.start() - 1,
        }
    }
}

/// Reads a row.
pub(crate) fn homing(row: Row<'_>) -> HomingRow {
    HomingRow {
        method: row.get("method").parse().expect("a method is a number"),
        start: row.get("start").to_owned(),
        moves: row.get("moves").split(" | ").filter(|text| !text.is_empty()).map(one_move).collect(),
        latch: Some(row.get("latch")).filter(|text| !text.is_empty()).map(latch),
        result: row.get("result").to_owned(),
    }
}

/// Whether `switch` is active at `position`.
#[must_use]
pub fn is_on(track: &Track, switch: &str, position: i32) -> bool {
    track.iter().any(|(name, range)| *name == switch && range.contains(&position))
}

/// Makes the moves of `row` from `start`. Gives the position where the last of them ended, before the overrun, or
/// `None` when a move found no end on the track.
///
/// # Panics
///
/// When `must_not_meet` gives a switch for the direction of a move and the move meets that switch without ending there.
#[must_use]
pub fn run(
    row: &HomingRow,
    track: &Track,
    start: i32,
    must_not_meet: impl Fn(i32) -> Option<&'static str>,
) -> Option<i32> {
    let (mut position, mut ended) = (start, None);
    for step in &row.moves {
        let mut steps = 0;
        while !ends(&step.until, track, position) {
            if let Some(limit) = must_not_meet(step.direction) {
                assert!(!is_on(track, limit, position), "{row:?} meets {limit} at {position}");
            }
            position += step.direction;
            steps += 1;
            if steps > FAR {
                return None;
            }
        }
        if step.until.ends_with("_back_off") {
            position += step.direction * BACK_OFF;
        }
        ended = Some(position);
        position += step.direction * OVERRUN;
    }
    ended
}

fn ends(until: &str, track: &Track, position: i32) -> bool {
    let until = until.trim_end_matches("_back_off");
    match (until.strip_suffix("_on"), until.strip_suffix("_off")) {
        (Some(switch), _) => is_on(track, switch, position),
        (_, Some(switch)) => !is_on(track, switch, position),
        (None, None) => false,
    }
}

fn one_move(text: &str) -> Move {
    let [way, speed, until] = words(text);
    Move { direction: direction(way), speed: speed.to_owned(), until: until.to_owned() }
}

fn latch(text: &str) -> Latch {
    let [switch, edge, way] = words(text);
    assert!(edge == "rising" || edge == "falling", "{edge:?} is no edge");
    Latch { switch: switch.to_owned(), rising: edge == "rising", direction: direction(way) }
}

fn words(text: &str) -> [&str; 3] {
    let words: Vec<_> = text.split_whitespace().collect();
    words.try_into().unwrap_or_else(|words| panic!("{words:?} are not three words"))
}

fn direction(text: &str) -> i32 {
    match text {
        "positive" => 1,
        "negative" => -1,
        _ => panic!("{text:?} is no direction"),
    }
}
