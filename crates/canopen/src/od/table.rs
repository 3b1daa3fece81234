use core::marker::PhantomData;

use super::index::{FREE, Room, fill, first_place, next_place};
use super::{AccessBits, Entry, Gate, Held, Index, Places, RowFacts, Slot, TableError};
use crate::{AbortCode, Mux};

/// All rows of a device, with what makes the search among them fast. They lie in the order of their [`Slot`]s, which is that of
/// index and sub-index unless the table was [`amended`](Self::amended).
///
/// Every request of a peer begins with a search, so it is prepared once: a hash directory leads from a key to its row,
/// most often in one step. Searching 200 sorted keys by halves takes three times as long.
///
/// A firmware builds its table at compile time, beside its rows:
///
/// ```
/// use canopen::od::{Access, DataType, Entry, Index, Table};
///
/// static ROWS: [Entry; 1] = [Entry::new(0x1000, 0, DataType::Unsigned32, Access::Const, "device_type", "Device type")];
/// static INDEX: Index<1> = Index::of(&ROWS);
/// static TABLE: Table = Table::new(&ROWS, &INDEX);
/// ```
///
/// A program that learns of the rows at run time, from a file say, makes room for the index and keeps rows, index and table
/// for the rest of its life. A program that may read the same file twice keeps what it has, by content:
///
/// ```
/// use canopen::Mux;
/// use canopen::od::{Access, DataType, Entry, FREE_PLACES, RowFacts, Table};
///
/// let rows = vec![Entry::new(0x1000, 0, DataType::Unsigned32, Access::Const, "device_type", "Device type")];
/// let rows: &'static [Entry] = rows.leak();
/// let facts = vec![RowFacts::NONE; rows.len()].leak();
/// let places = vec![FREE_PLACES; rows.len()].leak();
/// let table: &'static Table = Box::leak(Box::new(Table::at_run_time(rows, facts, places)?));
/// assert!(table.find(Mux::new(0x1000, 0)).is_ok());
/// # Ok::<(), canopen::od::TableError>(())
/// ```
#[derive(Clone, Copy)]
pub struct Table {
    by_slot: &'static [Entry],
    /// The same, ascending by index and sub-index.
    rows: &'static [Entry],
    facts: &'static [RowFacts],
    places: &'static [u16],
    room: Room,
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
    /// The place of the row in its table.
    pub const fn slot(self) -> Slot {
        self.slot
    }
}

impl Table {
    /// A table of `rows` with `index` = [`Index::of`]`(rows)`.
    pub const fn new<const N: usize>(rows: &'static [Entry; N], index: &'static Index<N>) -> Self {
        Self::over(rows, rows, index)
    }

    /// The table of another edition of a device: `rows` are those of its [`new`](Self::new) table in their order, some of
    /// them perhaps another type, access or default, and behind them those that only this edition has. So each object that
    /// both have keeps its slot, and a firmware its typed constants, but for those whose type is another. `index` =
    /// [`Index::of_amended`]; `ascending` are the same rows by index and sub-index.
    ///
    /// # Panics
    /// At compile time if `ascending` does not ascend, or has another row.
    pub const fn amended<const N: usize>(
        rows: &'static [Entry; N],
        ascending: &'static [Entry; N],
        index: &'static Index<N>,
    ) -> Self {
        let table = Self::over(rows, ascending, index);
        let mut i = 0;
        while i < N {
            let key = ascending[i].mux().key();
            assert!(i == 0 || ascending[i - 1].mux().key() < key, "the rows do not ascend");
            table.slot(ascending[i].index, ascending[i].sub_index);
            i += 1;
        }
        table
    }

    const fn over<const N: usize>(
        rows: &'static [Entry; N],
        ascending: &'static [Entry; N],
        index: &'static Index<N>,
    ) -> Self {
        let Index { facts, places, room } = index;
        Self { by_slot: rows, rows: ascending, facts, places: places.as_flattened(), room: *room }
    }

    /// Whether rows make a table, before they are kept for it. `facts` and `places` are as long as the rows, whatever is in
    /// them.
    ///
    /// # Errors
    /// [`TableError`].
    pub fn check(rows: &[Entry], facts: &mut [RowFacts], places: &mut [Places]) -> Result<(), TableError> {
        fill(rows, rows.len(), facts, places).map(|_| ())
    }

    /// A table of rows that are read at run time. `facts` and `places` are as long as the rows, whatever is in them:
    /// [`RowFacts::NONE`] and [`FREE_PLACES`](super::FREE_PLACES), say.
    ///
    /// # Errors
    /// [`TableError`].
    pub fn at_run_time(
        rows: &'static [Entry],
        facts: &'static mut [RowFacts],
        places: &'static mut [Places],
    ) -> Result<Self, TableError> {
        let room = fill(rows, rows.len(), facts, places)?;
        Ok(Self { by_slot: rows, rows, facts, places: places.as_flattened(), room })
    }

    /// All rows, ascending by index and sub-index. Where a row lies here is not its slot: [`iter`](Self::iter) has both.
    pub const fn rows(&self) -> &'static [Entry] {
        self.rows
    }

    /// The row of a slot of this table.
    pub fn row(&self, slot: Slot) -> &'static Entry {
        &self.by_slot[slot.position()]
    }

    /// Bytes that a dictionary of this table needs for values longer than a cell, and to take one of them in by each SDO server.
    pub const fn byte_count(&self) -> usize {
        self.room.byte_count() as usize
    }

    /// Of these, the bytes in which a value of one SDO server waits until it is complete; server 0 is the default one.
    pub(super) const fn staging_place(&self, server: u8) -> core::ops::Range<usize> {
        let length = self.room.staging as usize;
        let start = self.room.values as usize + server as usize * length;
        start..start + length
    }

    /// SDO servers beside the default one: records 1201h to 127Fh.
    pub(crate) const fn channel_count(&self) -> usize {
        self.room.channels as usize
    }

    /// The row of a slot of this table in short.
    #[inline]
    pub(crate) const fn summary(&self, slot: Slot) -> AccessBits {
        self.facts[slot.position()].summary
    }

    /// What a value has to pass that is written to the row of a slot of this table.
    #[inline]
    pub(super) const fn gate(&self, slot: Slot) -> &'static Gate {
        &self.facts[slot.position()].gate
    }

    /// All slots with their rows, in the order of the slots.
    pub fn iter(&self) -> impl Iterator<Item = (Slot, &'static Entry)> + use<> {
        self.by_slot.iter().enumerate().map(|(i, row)| (Slot::at(i), row))
    }

    /// Finds a row.
    ///
    /// # Errors
    /// [`AbortCode::NO_SUCH_OBJECT`] if no row has the index, [`AbortCode::NO_SUCH_SUB_INDEX`] if some have.
    #[inline]
    pub fn find(&self, mux: Mux) -> Result<Slot, AbortCode> {
        self.look_up(mux).map(|(slot, _)| slot)
    }

    /// Finds a row and what requests must know of it.
    ///
    /// # Errors
    /// As [`find`](Self::find).
    #[inline(always)]
    pub(crate) fn look_up(&self, mux: Mux) -> Result<(Slot, &'static RowFacts), AbortCode> {
        let key = mux.key();
        let mut place = first_place(key, self.places.len());
        // A free place, which is not the position of a row, comes before the directory has been gone round.
        while let Some(position) = self.places.get(place)
            && let Some(facts) = self.facts.get(usize::from(*position))
        {
            if facts.key == key {
                return Ok((Slot::at(usize::from(*position)), facts));
            }
            place = next_place(place, self.places.len());
        }
        Err(self.missing(mux.index))
    }

    #[cold]
    fn missing(&self, index: u16) -> AbortCode {
        let first = self.rows.partition_point(|row| row.index < index);
        match self.rows.get(first) {
            Some(row) if row.index == index => AbortCode::NO_SUCH_SUB_INDEX,
            _ => AbortCode::NO_SUCH_OBJECT,
        }
    }

    /// The slot of a row, at compile time.
    ///
    /// # Panics
    /// If the table has no such row.
    pub const fn slot(&self, index: u16, sub_index: u8) -> Slot {
        let key = Mux::new(index, sub_index).key();
        let mut place = first_place(key, self.places.len());
        while self.places[place] != FREE {
            let position = self.places[place] as usize;
            if self.facts[position].key == key {
                return Slot::at(position);
            }
            place = next_place(place, self.places.len());
        }
        panic!("no such object in the table")
    }

    /// A typed object, for a `const` of the device.
    ///
    /// # Panics
    /// If the table has no such row or its data type is not `T`'s: at compile time in a `const`.
    pub const fn object<T: Held>(&self, index: u16, sub_index: u8) -> Object<T> {
        let slot = self.slot(index, sub_index);
        let same = self.by_slot[slot.position()].data_type.code() == T::DATA_TYPE.code();
        assert!(same, "the object has another data type");
        Object { slot, value: PhantomData }
    }
}

const _: () = assert!(FREE as usize >= super::MAX_ROWS, "a free place is not a position");
