//! The parameter store of a drive: the stored rows of its object table in an EEPROM image of two banks.
//!
//! A write goes to the bank that is not in use and counts only once its checksum stands, so that a write cut short at
//! any byte leaves the old contents. A bank is a header (magic, version, number of records, sequence number), one
//! record a stored row (multiplexor key and value) and a CRC-32 (ISO 3309) over all of it, little endian.
//! Values are checked against the table on the way in: an image can never put a value out of range into a dictionary.

use canopen::Mux;
use canopen::od::{Dictionary, Entry, Slot, Storage, Table};

/// Bytes of one bank.
pub const BANK_SIZE: usize = 1024;
/// Bytes of the whole image.
pub const IMAGE_SIZE: usize = 2 * BANK_SIZE;

const MAGIC: u32 = u32::from_le_bytes(*b"FDRV");
/// Layout version: an image of another one is unreadable until factory settings are restored.
const VERSION: u16 = 1;
const HEADER_SIZE: usize = 12;
const RECORD_SIZE: usize = 8;
const CRC_SIZE: usize = 4;

/// Most rows that a bank holds.
pub const CAPACITY: usize = (BANK_SIZE - HEADER_SIZE - CRC_SIZE) / RECORD_SIZE;

/// Contents of an EEPROM, to be kept over power cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoredImage(pub [u8; IMAGE_SIZE]);

impl StoredImage {
    /// A chip that has never been written: no drive can read it until factory settings are restored.
    pub const BLANK: Self = Self([0xFF; IMAGE_SIZE]);

    /// The stored rows of a dictionary with their values.
    pub fn of<S: Storage>(dictionary: &Dictionary<S>) -> Self {
        let mut store = Store::new(Self::BLANK);
        store.format(dictionary);
        store.image
    }

    /// The image in a file's bytes: short files are padded as blank, long ones cut; a checksum shows whether it is sound.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let mut image = Self::BLANK;
        image.0.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        image
    }
}

/// No bank of the image holds a checked set of values: it is blank, damaged or of another firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unreadable;

/// Which rows are waiting to be stored: as many as a bank can hold.
#[derive(Clone, Copy, Debug)]
struct PendingRows {
    slots: [Option<Slot>; CAPACITY],
    count: u8,
}

/// An EEPROM with the rows that wait to be written into it.
#[derive(Clone, Debug)]
pub struct Store {
    image: StoredImage,
    active: Option<Bank>,
    pending: PendingRows,
    generation: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Bank {
    number: usize,
    sequence: u32,
}

impl Store {
    /// A store over what is found at power-on.
    pub fn new(image: StoredImage) -> Self {
        Self { image, active: newest_bank(&image), pending: PendingRows::NONE, generation: 0 }
    }

    /// The same EEPROM at the next power-on: what waited to be written is lost, the generation goes on.
    pub fn reopen(&mut self, image: StoredImage) {
        *self = Self { generation: self.generation, ..Self::new(image) };
    }

    /// The image and its generation, which changes with it.
    pub fn image(&self) -> (&StoredImage, u32) {
        (&self.image, self.generation)
    }

    /// True if the image can be read.
    pub fn is_readable(&self) -> bool {
        self.active.is_some()
    }

    /// Puts the stored values of the rows that `wanted` names into a dictionary. Rows that are not stored, unknown keys
    /// and values that the table refuses are passed over.
    ///
    /// # Errors
    /// [`Unreadable`]; the dictionary is as before.
    pub fn load<S: Storage>(
        &self,
        dictionary: &mut Dictionary<S>,
        wanted: fn(&Entry) -> bool,
    ) -> Result<(), Unreadable> {
        let bank = self.active.ok_or(Unreadable)?;
        let bytes = &self.image.0[bank.number * BANK_SIZE..][..BANK_SIZE];
        for record in bytes[HEADER_SIZE..].chunks_exact(RECORD_SIZE).take(record_count(bytes)) {
            let (key, raw) = (word(record, 0), word(record, 4));
            let table = dictionary.table();
            let Ok(slot) = table.find(Mux::from_key(key)) else { continue };
            let row = table.row(slot);
            if row.is_kept() && wanted(row) && row.check_value(row.data_type.value(raw)).is_ok() {
                dictionary.set_raw(slot, raw);
            }
        }
        Ok(())
    }

    /// True if the next [`commit`](Self::commit) has something to write and can.
    #[inline]
    pub fn has_pending(&self) -> bool {
        self.active.is_some() && !self.pending.is_empty()
    }

    /// Has a row's value stored by the next [`commit`](Self::commit), if it is a row to be stored with each write.
    pub fn mark(&mut self, table: &Table, slot: Slot) {
        if table.row(slot).stored {
            self.pending.insert(slot);
        }
    }

    /// Has all kept rows that `wanted` names stored by the next [`commit`](Self::commit).
    pub fn mark_all(&mut self, table: &Table, wanted: fn(&Entry) -> bool) {
        let kept = table.iter().filter(|(_, row)| row.is_kept() && wanted(row));
        kept.for_each(|(slot, _)| self.pending.insert(slot));
    }

    /// Writes the marked rows with their values in `dictionary`, all in one step. An unreadable image is left alone:
    /// only [`format`](Self::format) makes it readable again.
    pub fn commit<S: Storage>(&mut self, dictionary: &Dictionary<S>) {
        let Some(bank) = self.active else {
            self.pending = PendingRows::NONE;
            return;
        };
        if self.pending.is_empty() {
            return;
        }
        let pending = core::mem::replace(&mut self.pending, PendingRows::NONE);
        let old = bank.number * BANK_SIZE;
        let mut bytes = [0; BANK_SIZE];
        bytes.copy_from_slice(&self.image.0[old..][..BANK_SIZE]);
        let stored = dictionary.table().iter().filter(|(_, row)| row.is_kept());
        for (position, (slot, row)) in stored.enumerate() {
            let record = HEADER_SIZE + position * RECORD_SIZE;
            // A record of another row: the image came from a table with other rows. Write this table's whole set.
            let foreign = word(&bytes, record) != row.mux().key();
            if pending.contains(slot) || foreign {
                put_word(&mut bytes, record, row.mux().key());
                put_word(&mut bytes, record + 4, dictionary.raw(slot));
            }
        }
        self.write(
            Bank { number: 1 - bank.number, sequence: bank.sequence.wrapping_add(1) },
            bytes,
            dictionary.table(),
        );
    }

    /// Writes all stored rows with their values in `dictionary`, whatever the image held.
    pub fn format<S: Storage>(&mut self, dictionary: &Dictionary<S>) {
        let bank = match self.active {
            Some(bank) => Bank { number: 1 - bank.number, sequence: bank.sequence.wrapping_add(1) },
            None => Bank { number: 0, sequence: 0 },
        };
        let mut bytes = [0xFF; BANK_SIZE];
        for (position, (slot, row)) in dictionary.table().iter().filter(|(_, row)| row.is_kept()).enumerate() {
            let record = HEADER_SIZE + position * RECORD_SIZE;
            put_word(&mut bytes, record, row.mux().key());
            put_word(&mut bytes, record + 4, dictionary.raw(slot));
        }
        self.pending = PendingRows::NONE;
        self.write(bank, bytes, dictionary.table());
    }

    fn write(&mut self, bank: Bank, mut bytes: [u8; BANK_SIZE], table: &Table) {
        let count = stored_rows(table);
        put_word(&mut bytes, 0, MAGIC);
        put_word(&mut bytes, 4, u32::from(VERSION) | (count as u32) << 16);
        put_word(&mut bytes, 8, bank.sequence);
        let end = HEADER_SIZE + count * RECORD_SIZE;
        let crc = crc32(&bytes[..end]);
        put_word(&mut bytes, end, crc);
        self.image.0[bank.number * BANK_SIZE..][..BANK_SIZE].copy_from_slice(&bytes);
        self.active = Some(bank);
        self.generation = self.generation.wrapping_add(1);
    }
}

/// Number of stored rows of a table.
///
/// # Panics
/// If a bank cannot hold them; used in a `const` of the drive, at compile time:
///
/// ```compile_fail,E0080
/// use canopen::od::{Access, DataType, Entry, Index, Table};
/// use ferrodrive_drives::engine::storage::{CAPACITY, stored_rows};
///
/// static ROWS: [Entry; CAPACITY + 1] = {
///     let row = Entry::new(0, 0, DataType::Unsigned16, Access::ReadWrite, "row", "").stored();
///     let mut rows = [row; CAPACITY + 1];
///     let mut i = 0;
///     while i < rows.len() {
///         rows[i].index = 0x2000 + i as u16;
///         i += 1;
///     }
///     rows
/// };
/// static INDEX: Index<{ CAPACITY + 1 }> = Index::of(&ROWS);
/// static TABLE: Table = Table::new(&ROWS, &INDEX);
/// const _: usize = stored_rows(&TABLE); // without "+ 1" it compiles
/// ```
pub const fn stored_rows(table: &Table) -> usize {
    let rows = table.rows();
    let (mut i, mut count) = (0, 0);
    while i < rows.len() {
        count += rows[i].is_kept() as usize;
        i += 1;
    }
    assert!(count <= CAPACITY, "a bank cannot hold all stored rows");
    count
}

impl PendingRows {
    const NONE: Self = Self { slots: [None; CAPACITY], count: 0 };

    fn insert(&mut self, slot: Slot) {
        if !self.contains(slot)
            && let Some(place) = self.slots.get_mut(usize::from(self.count))
        {
            *place = Some(slot);
            self.count += 1;
        }
    }

    fn contains(&self, slot: Slot) -> bool {
        self.slots[..usize::from(self.count)].contains(&Some(slot))
    }

    const fn is_empty(&self) -> bool {
        self.count == 0
    }
}

fn newest_bank(image: &StoredImage) -> Option<Bank> {
    let bank = |number: usize| {
        let bytes = &image.0[number * BANK_SIZE..][..BANK_SIZE];
        is_sound(bytes).then(|| Bank { number, sequence: word(bytes, 8) })
    };
    match (bank(0), bank(1)) {
        (Some(a), Some(b)) if (b.sequence.wrapping_sub(a.sequence) as i32) > 0 => Some(b),
        (Some(a), _) => Some(a),
        (None, b) => b,
    }
}

fn is_sound(bank: &[u8]) -> bool {
    let count = record_count(bank);
    let end = HEADER_SIZE + count * RECORD_SIZE;
    word(bank, 0) == MAGIC
        && word(bank, 4) as u16 == VERSION
        && count <= CAPACITY
        && word(bank, end) == crc32(&bank[..end])
}

fn record_count(bank: &[u8]) -> usize {
    (word(bank, 4) >> 16) as usize
}

/// The four bytes at `at`; zeros past the end.
fn word(bytes: &[u8], at: usize) -> u32 {
    match bytes.get(at..at + 4) {
        Some(&[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
        _ => 0,
    }
}

fn put_word(bytes: &mut [u8], at: usize, value: u32) {
    if let Some(place) = bytes.get_mut(at..at + 4) {
        place.copy_from_slice(&value.to_le_bytes());
    }
}

/// CRC-32 of ISO 3309 (reflected polynomial EDB88320h), half a byte at a time.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 16] = {
        let mut table = [0; 16];
        let mut i = 0;
        while i < 16 {
            let mut value = i as u32;
            let mut bit = 0;
            while bit < 4 {
                value = if value & 1 == 1 { value >> 1 ^ 0xEDB8_8320 } else { value >> 1 };
                bit += 1;
            }
            table[i] = value;
            i += 1;
        }
        table
    };
    !bytes.iter().fold(!0, |crc: u32, byte| {
        let crc = crc ^ u32::from(*byte);
        let crc = crc >> 4 ^ TABLE[(crc & 15) as usize];
        crc >> 4 ^ TABLE[(crc & 15) as usize]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use canopen::NodeId;
    use canopen::od::{Access, DataType, Fixed, Index, Object};

    static ROWS: [Entry; 4] = [
        Entry::new(0x2000, 0, DataType::Unsigned16, Access::ReadWrite, "a", "").default(7).range(0, 100).stored(),
        Entry::new(0x2001, 0, DataType::Unsigned16, Access::ReadWrite, "b", "").default(8),
        Entry::new(0x2002, 0, DataType::Integer16, Access::ReadWrite, "c", "").default(-9).stored(),
        Entry::new(0x2003, 0, DataType::Unsigned16, Access::ReadWrite, "d", "").default(4).saved(),
    ];
    static INDEX: Index<4> = Index::of(&ROWS);
    static TABLE: Table = Table::new(&ROWS, &INDEX);
    const A: Object<u16> = TABLE.object(0x2000, 0);
    const B: Object<u16> = TABLE.object(0x2001, 0);
    const C: Object<i16> = TABLE.object(0x2002, 0);

    fn defaults() -> Dictionary<Fixed<4>> {
        Dictionary::new(&TABLE, NodeId::MIN)
    }

    fn formatted() -> Store {
        let mut store = Store::new(StoredImage::BLANK);
        store.format(&defaults());
        store
    }

    fn values(image: StoredImage) -> (u16, u16, i16) {
        let mut dictionary = defaults();
        Store::new(image).load(&mut dictionary, |_| true).unwrap();
        (dictionary.get(A), dictionary.get(B), dictionary.get(C))
    }

    #[test]
    fn the_checksum_is_the_standard_one() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn a_blank_image_is_unreadable_until_it_is_formatted() {
        let mut store = Store::new(StoredImage::BLANK);
        assert_eq!(store.load(&mut defaults(), |_| true), Err(Unreadable));
        store.mark_all(&TABLE, |_| true);
        store.commit(&defaults());
        assert!(!store.is_readable());
        store.format(&defaults());
        assert_eq!(values(*store.image().0), (7, 8, -9));
    }

    #[test]
    fn only_marked_rows_of_stored_objects_are_written() {
        let mut store = formatted();
        let mut dictionary = defaults();
        dictionary.set(A, 11);
        dictionary.set(B, 22);
        dictionary.set(C, -33);
        store.mark(&TABLE, C.slot());
        store.mark(&TABLE, B.slot());
        store.commit(&dictionary);
        assert_eq!(values(*store.image().0), (7, 8, -33));
    }

    #[test]
    fn a_row_that_only_a_save_keeps_is_written_by_no_mark_of_its_own() {
        const D: Object<u16> = TABLE.object(0x2003, 0);
        let kept = |store: &Store| {
            let mut dictionary = defaults();
            store.load(&mut dictionary, |_| true).unwrap();
            dictionary.get(D)
        };
        let mut store = formatted();
        let mut dictionary = defaults();
        dictionary.set(D, 5);
        store.mark(&TABLE, D.slot());
        store.commit(&dictionary);
        assert_eq!(kept(&store), 4);
        store.mark_all(&TABLE, |row| row.stored);
        store.commit(&dictionary);
        assert_eq!(kept(&store), 4);
        store.mark_all(&TABLE, |_| true);
        store.commit(&dictionary);
        assert_eq!(kept(&store), 5);
    }

    #[test]
    fn the_generation_changes_only_with_the_bytes() {
        let mut store = formatted();
        let before = store.image().1;
        store.commit(&defaults());
        assert_eq!(store.image().1, before);
        store.mark_all(&TABLE, |_| true);
        store.commit(&defaults());
        assert_ne!(store.image().1, before);
    }

    #[test]
    fn a_write_cut_short_at_any_byte_leaves_the_old_or_the_new_values() {
        let mut store = formatted();
        let mut dictionary = defaults();
        for round in 1..5_u16 {
            let old = *store.image().0;
            dictionary.set(A, round);
            store.mark_all(&TABLE, |_| true);
            store.commit(&dictionary);
            let new = *store.image().0;
            for cut in 0..=IMAGE_SIZE {
                let mut torn = old;
                torn.0[..cut].copy_from_slice(&new.0[..cut]);
                let a = values(torn).0;
                assert!(a == values(old).0 || a == round, "cut at {cut}");
            }
        }
    }

    #[test]
    fn any_flipped_bit_is_noticed_or_harmless() {
        let mut store = formatted();
        let mut dictionary = defaults();
        dictionary.set(A, 50);
        store.mark_all(&TABLE, |_| true);
        store.commit(&dictionary);
        for byte in 0..IMAGE_SIZE {
            let mut image = *store.image().0;
            image.0[byte] ^= 0x10;
            let (a, _, c) = values(image);
            assert!(matches!((a, c), (50, -9) | (7, -9)), "byte {byte}");
        }
    }

    const WIDE: usize = 1000;
    /// Many rows, of which the last ones are stored: as many as a bank can hold.
    static WIDE_ROWS: [Entry; WIDE] = {
        let mut rows = [ROWS[1]; WIDE];
        let mut i = 0;
        while i < WIDE {
            rows[i] = Entry::new(0x2000 + i as u16, 0, DataType::Unsigned16, Access::ReadWrite, "row", "");
            if i >= WIDE - CAPACITY {
                rows[i] = rows[i].stored();
            }
            i += 1;
        }
        rows
    };
    static WIDE_INDEX: Index<WIDE> = Index::of(&WIDE_ROWS);
    static WIDE_TABLE: Table = Table::new(&WIDE_ROWS, &WIDE_INDEX);
    const _: usize = stored_rows(&WIDE_TABLE);

    #[test]
    fn every_row_of_a_full_bank_is_stored_by_itself() {
        let wide = || Dictionary::<Fixed<WIDE>>::new(&WIDE_TABLE, NodeId::MIN);
        let mut store = Store::new(StoredImage::BLANK);
        store.format(&wide());
        for (slot, _) in WIDE_TABLE.iter().filter(|(_, row)| row.is_kept()) {
            let mut store = store.clone();
            let mut written = wide();
            written.set_raw(slot, 77);
            store.mark(&WIDE_TABLE, slot);
            store.commit(&written);
            let mut loaded = wide();
            store.load(&mut loaded, |_| true).unwrap();
            assert_eq!(loaded.raw(slot), 77, "row {}", slot.position());
        }
    }

    #[test]
    fn values_out_of_range_are_not_loaded() {
        let mut store = formatted();
        let mut dictionary = defaults();
        dictionary.set(A, 101);
        store.mark_all(&TABLE, |_| true);
        store.commit(&dictionary);
        assert_eq!(values(*store.image().0).0, 7);
    }
}
