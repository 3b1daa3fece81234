use core::marker::PhantomData;

use super::{Entry, Scalar};
use crate::{AbortCode, Mux};

/// All rows of a device, ascending by index and sub-index, with their keys packed for the search.
#[derive(Clone, Copy)]
pub struct Table {
    rows: &'static [Entry],
    keys: &'static [u32],
}

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
        assert!(rows.len() == keys.len() && rows.len() <= u16::MAX as usize);
        Self { rows, keys }
    }

    /// All rows, ascending.
    pub const fn rows(&self) -> &'static [Entry] {
        self.rows
    }

    /// The row of a slot of this table.
    pub fn row(&self, slot: Slot) -> &'static Entry {
        &self.rows[slot.position()]
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
        match self.keys.binary_search(&key) {
            Ok(position) => Ok(Slot(position as u16)),
            Err(position) => Err(self.missing(mux.index, position)),
        }
    }

    #[cold]
    fn missing(&self, index: u16, position: usize) -> AbortCode {
        let has_index = |at: usize| self.keys.get(at).is_some_and(|key| key >> 8 == u32::from(index));
        if has_index(position) || position.checked_sub(1).is_some_and(has_index) {
            AbortCode::NO_SUCH_SUB_INDEX
        } else {
            AbortCode::NO_SUCH_OBJECT
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
