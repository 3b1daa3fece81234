//! What makes a search among rows fast: a hash directory from a key to its row, and of each row what requests must know.

use super::{AccessBits, Entry, Gate, MAX_ROWS, TableError};

/// A free place of the directory.
pub(super) const FREE: u16 = u16::MAX;

/// What every request must know of a row.
#[derive(Clone, Copy, Debug)]
pub struct RowFacts {
    pub(super) key: u32,
    pub(super) gate: Gate,
    pub(crate) summary: AccessBits,
}

impl RowFacts {
    /// Of no row.
    pub const NONE: Self = Self { key: 0, gate: Gate::CLOSED, summary: AccessBits::NONE };
}

/// Two places of the directory: it has twice as many places as there are rows, so that searches end soon.
pub type Places = [u16; 2];

/// Free places.
pub const FREE_PLACES: Places = [FREE; 2];

/// The index of a table that is known at compile time; for a `static` beside the rows.
#[derive(Clone, Copy, Debug)]
pub struct Index<const N: usize> {
    pub(super) facts: [RowFacts; N],
    pub(super) places: [Places; N],
    pub(super) room: Room,
}

/// The bytes of a dictionary: those of long values, and behind them for each SDO server a place in which a value waits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    /// Of all long values.
    pub(super) values: u32,
    /// Of the longest: one place.
    pub(super) staging: u32,
    /// SDO servers beside the default one.
    pub(super) channels: u8,
}

impl Room {
    pub(super) const fn byte_count(self) -> u32 {
        self.values + self.staging * (1 + self.channels as u32)
    }
}

impl<const N: usize> Index<N> {
    /// The index of `rows`.
    ///
    /// # Panics
    /// At compile time if the rows are not strictly ascending by index and sub-index, or are more than [`MAX_ROWS`].
    pub const fn of(rows: &[Entry; N]) -> Self {
        Self::of_amended(rows, N)
    }

    /// The index of rows of which those from position `base` on were added behind the others: see
    /// [`Table::amended`](super::Table::amended).
    ///
    /// # Panics
    /// At compile time if either part is not strictly ascending by index and sub-index, one row is at the place of
    /// another, or they are more than [`MAX_ROWS`].
    pub const fn of_amended(rows: &[Entry; N], base: usize) -> Self {
        let (mut facts, mut places) = ([RowFacts::NONE; N], [FREE_PLACES; N]);
        match fill(rows, base, &mut facts, &mut places) {
            Ok(room) => Self { facts, places, room },
            Err(_) => panic!("object rows must ascend by index and sub-index"),
        }
    }
}

/// Fills `facts` and `places`, which are as long as `rows`. The rows before position `base` ascend, and those from there on.
pub(super) const fn fill(
    rows: &[Entry],
    base: usize,
    facts: &mut [RowFacts],
    places: &mut [Places],
) -> Result<Room, TableError> {
    if rows.len() > MAX_ROWS {
        return Err(TableError::TooManyRows);
    }
    if facts.len() != rows.len() || places.len() != rows.len() {
        return Err(TableError::OtherLength);
    }
    let places = places.as_flattened_mut();
    // A place that is taken before the first row is in would be searched for ever.
    let mut place = 0;
    while place < places.len() {
        places[place] = FREE;
        place += 1;
    }
    let (mut offset, mut staging, mut channels, mut position) = (0_u32, 0, 0, 0);
    while position < rows.len() {
        let row = &rows[position];
        let key = row.mux().key();
        let follows = position == 0 || position == base || facts[position - 1].key < key;
        if !follows || (position >= base && has(facts, places, key)) {
            return Err(TableError::NotAscending { position });
        }
        let summary = AccessBits::of(row);
        let mut gate = Gate::of(row);
        if summary.is_long() {
            let capacity = row.stored_bytes();
            gate = Gate::of_long(offset, capacity);
            staging = if capacity > staging { capacity } else { staging };
            offset = match offset.checked_add(capacity) {
                Some(sum) => sum,
                None => return Err(TableError::TooManyBytes),
            };
        }
        if matches!(row.index, 0x1201..=0x127F) && row.sub_index == 1 {
            channels += 1;
        }
        facts[position] = RowFacts { key, gate, summary };
        insert(places, key, position as u16);
        position += 1;
    }
    let room = Room { values: offset, staging, channels };
    match offset as u64 + staging as u64 * (1 + channels as u64) {
        0..=MAX_BYTES => Ok(room),
        _ => Err(TableError::TooManyBytes),
    }
}

const MAX_BYTES: u64 = u32::MAX as u64;

/// Whether a row with this key is in the directory.
const fn has(facts: &[RowFacts], places: &[u16], key: u32) -> bool {
    let mut place = first_place(key, places.len());
    while places[place] != FREE {
        if facts[places[place] as usize].key == key {
            return true;
        }
        place = next_place(place, places.len());
    }
    false
}

const fn insert(places: &mut [u16], key: u32, position: u16) {
    let mut place = first_place(key, places.len());
    while places[place] != FREE {
        place = next_place(place, places.len());
    }
    places[place] = position;
}

/// Where the search for a key begins: a multiplicative hash (Knuth, vol. 3, 6.4), scaled to the number of places.
#[inline(always)]
pub(super) const fn first_place(key: u32, count: usize) -> usize {
    const GOLDEN_RATIO: u32 = 0x9E37_79B1;
    ((key.wrapping_mul(GOLDEN_RATIO) as u64 * count as u64) >> u32::BITS) as usize
}

#[inline(always)]
pub(super) const fn next_place(place: usize, count: usize) -> usize {
    if place + 1 < count { place + 1 } else { 0 }
}
