use core::marker::PhantomData;

use super::{Entry, Gate, Scalar, Summary};
use crate::{AbortCode, Mux};

/// All rows of a device, ascending by index and sub-index, with their keys packed for the search.
///
/// Every request of a peer begins with a search, so it is made once, at compile time: a hash directory leads from a key
/// to its row, most often in one step. Searching 200 sorted keys by halves takes three times as long.
#[derive(Clone)]
pub struct Table {
    rows: &'static [Entry],
    keys: &'static [u32],
    directory: [u16; DIRECTORY_LENGTH],
    summaries: [Summary; MAX_ROWS],
    gates: [Gate; MAX_ROWS],
}

/// Places of the directory: a power of two, so that the hash needs no division.
const DIRECTORY_LENGTH: usize = 1024;
/// Most rows of a table: a quarter of the directory stays free, so that searches end soon.
pub const MAX_ROWS: usize = DIRECTORY_LENGTH / 4 * 3;
/// A free place.
const FREE: u16 = u16::MAX;

/// The number of a row in its table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Slot(u16);

impl Slot {
    /// The row's position, from 0.
    pub const fn position(self) -> usize {
        self.0 as usize
    }
}

/// A row known at compile time to exist and to hold a `T`.
#[derive(Debug)]
pub struct Object<T> {
    slot: Slot,
    value: PhantomData<fn() -> T>,
}

impl<T> Clone for Object<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Object<T> {}

impl<T> Object<T> {
    /// The row.
    pub const fn slot(self) -> Slot {
        self.slot
    }
}

/// The search keys of `rows`; for a `static` beside the rows.
///
/// # Panics
/// At compile time if the rows are not strictly ascending by index and sub-index.
pub const fn keys<const N: usize>(rows: &[Entry; N]) -> [u32; N] {
    let mut keys = [0; N];
    let mut i = 0;
    while i < N {
        keys[i] = rows[i].mux().key();
        assert!(i == 0 || keys[i - 1] < keys[i], "object rows must ascend by index and sub-index");
        i += 1;
    }
    keys
}

impl Table {
    /// A table of `rows` with `keys` = [`keys`]`(rows)`.
    pub const fn new(rows: &'static [Entry], keys: &'static [u32]) -> Self {
        assert!(rows.len() == keys.len() && rows.len() <= MAX_ROWS);
        let mut directory = [FREE; DIRECTORY_LENGTH];
        let mut summaries = [Summary::NONE; MAX_ROWS];
        let mut gates = [Gate::CLOSED; MAX_ROWS];
        let mut position = 0;
        while position < keys.len() {
            let mut place = first_place(keys[position]);
            while directory[place] != FREE {
                place = next_place(place);
            }
            directory[place] = position as u16;
            summaries[position] = Summary::of(&rows[position]);
            gates[position] = Gate::of(&rows[position]);
            position += 1;
        }
        Self { rows, keys, directory, summaries, gates }
    }

    /// All rows, ascending.
    pub const fn rows(&self) -> &'static [Entry] {
        self.rows
    }

    /// The row of a slot of this table.
    pub fn row(&self, slot: Slot) -> &'static Entry {
        &self.rows[slot.position()]
    }

    /// The row of a slot of this table in short.
    #[inline]
    pub(crate) const fn summary(&self, slot: Slot) -> Summary {
        self.summaries[slot.position()]
    }

    /// What a value has to pass that is written to the row of a slot of this table.
    #[inline]
    pub(super) const fn gate(&self, slot: Slot) -> &Gate {
        &self.gates[slot.position()]
    }

    /// All slots with their rows.
    pub fn iter(&self) -> impl Iterator<Item = (Slot, &'static Entry)> + use<> {
        self.rows.iter().enumerate().map(|(i, row)| (Slot(i as u16), row))
    }

    /// Finds a row.
    ///
    /// # Errors
    /// [`AbortCode::NO_SUCH_OBJECT`] if no row has the index, [`AbortCode::NO_SUCH_SUB_INDEX`] if some have.
    #[inline]
    pub fn find(&self, mux: Mux) -> Result<Slot, AbortCode> {
        let key = mux.key();
        let mut place = first_place(key);
        // A free place comes before the directory has been gone round.
        while let Some(found) = self.keys.get(usize::from(self.directory[place])) {
            if *found == key {
                return Ok(Slot(self.directory[place]));
            }
            place = next_place(place);
        }
        Err(self.missing(mux.index))
    }

    #[cold]
    fn missing(&self, index: u16) -> AbortCode {
        let first = self.keys.partition_point(|key| key >> 8 < u32::from(index));
        match self.keys.get(first) {
            Some(key) if key >> 8 == u32::from(index) => AbortCode::NO_SUCH_SUB_INDEX,
            _ => AbortCode::NO_SUCH_OBJECT,
        }
    }

    /// The slot of a row, at compile time.
    ///
    /// # Panics
    /// If the table has no such row.
    pub const fn slot(&self, index: u16, sub_index: u8) -> Slot {
        let key = Mux::new(index, sub_index).key();
        let (mut low, mut high) = (0, self.keys.len());
        while low < high {
            let middle = (low + high) / 2;
            if self.keys[middle] < key {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        assert!(low < self.keys.len() && self.keys[low] == key, "no such object in the table");
        Slot(low as u16)
    }

    /// A typed object, for a `const` of the device.
    ///
    /// # Panics
    /// If the table has no such row or its data type is not `T`'s: at compile time in a `const`.
    pub const fn object<T: Scalar>(&self, index: u16, sub_index: u8) -> Object<T> {
        let slot = self.slot(index, sub_index);
        let same = self.rows[slot.position()].data_type.code() == T::DATA_TYPE.code();
        assert!(same, "the object has another data type");
        Object { slot, value: PhantomData }
    }
}

/// Where the search for a key begins: the high bits of a multiplicative hash (Knuth, vol. 3, 6.4).
const fn first_place(key: u32) -> usize {
    const GOLDEN_RATIO: u32 = 0x9E37_79B1;
    (key.wrapping_mul(GOLDEN_RATIO) >> (u32::BITS - DIRECTORY_LENGTH.trailing_zeros())) as usize
}

const fn next_place(place: usize) -> usize {
    (place + 1) % DIRECTORY_LENGTH
}
