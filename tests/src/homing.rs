//! Homing as in the drives' tables: the moves of one run, and the edge that becomes the origin.
//!
//! A move is a direction, a speed and what ends it. Speeds are names (`6099:01`, `origin`), since the tables say which
//! of the drive's speeds is used, not how fast that is. That each run is possible is asked of the running drives.

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
    /// What ends it: `home_on`, `home_off`, `home_off_back_off`, `never`, or something from outside.
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

fn one_move(text: &str) -> Move {
    let [way, speed, until] = words(text);
    Move { direction: direction(way), speed: speed.to_owned(), until: until.to_owned() }
}

fn latch(text: &str) -> Latch {
    let [switch, edge, way] = words(text);
    assert!(edge == "rising" || edge == "falling", "{edge:?} is not an edge");
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
        _ => panic!("{text:?} is not a direction"),
    }
}
