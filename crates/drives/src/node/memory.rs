//! The parameter store of a device whose table comes from a description: one record a parameter in a byte image, as large
//! as the table asks for.
//!
//! An image is a header (magic, how many bytes of records), the records (multiplexor key, how many bytes, the value as an
//! SDO carries it) and a CRC-32 over all of it, little endian. Values are checked against the table on the way in: an image
//! can never put a value out of range into a dictionary.

use canopen::Mux;
use canopen::object::SERIAL_NUMBER;
use canopen::od::{Access, Dictionary, Entry, Slot, Storage, Table};
use canopen::sdo::parameter;

use super::program::is_of_program;
use crate::engine::storage::crc32;

const MAGIC: [u8; 4] = *b"FDN2";
/// Magic and length.
const HEADER_SIZE: usize = 8;
/// Key and length of one value.
const RECORD_HEADER_SIZE: usize = 8;
const CRC_SIZE: usize = 4;
/// The record that LSS keeps, behind those of the objects: no multiplexor has this key.
const LSS_KEY: u32 = u32::MAX;
/// Records with numbers of this one, which its maker has written: nothing on the bus changes them. The serial number has a key
/// of its own; those of others are above all multiplexors.
const SERIAL_KEY: u32 = u32::MAX - 1;
const MARK_KEY: u32 = 1 << 30;
const MARK_SIZE: usize = 4;
/// Records of programs: this and the multiplexor of their data.
const PROGRAM_KEY: u32 = 1 << 29;
/// Node-ID and index of the bit rate.
const LSS_SIZE: usize = 2;

/// Contents of the memory chip, to be kept over power cycles. `S` has room for the image of the device's table
/// ([`image_size`]).
#[derive(Clone)]
pub struct Memory<S: Storage> {
    image: S::Bytes,
    size: usize,
}

/// How large it is, and whether it can be read: a whole image is thousands of bytes.
impl<S: Storage> core::fmt::Debug for Memory<S> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Memory").field("size", &self.size).field("is_sound", &self.is_sound()).finish()
    }
}

/// Bytes of the image of a device with this table: each value that can be stored has its place, whatever its type, and so
/// have what LSS stores and the numbers of its maker.
pub fn image_size(table: &Table) -> usize {
    let records = table.rows().iter().filter(|row| is_storable(row)).map(|row| RECORD_HEADER_SIZE + most_bytes(row));
    // Room for a serial number is there in any case.
    let marks = table.rows().iter().filter(|row| is_makers_mark(row) && row.mux() != SERIAL_NUMBER).count() + 1;
    let programs = table.rows().iter().filter(|row| is_of_program(row) && row.stored_bytes() > 0);
    let programs = programs.map(|row| RECORD_HEADER_SIZE + row.stored_bytes() as usize);
    let no_object = RECORD_HEADER_SIZE + LSS_SIZE + marks * (RECORD_HEADER_SIZE + MARK_SIZE);
    HEADER_SIZE + records.sum::<usize>() + programs.sum::<usize>() + no_object + CRC_SIZE
}

impl<S: Storage> Memory<S> {
    /// A chip that holds no values: those of the table are in effect.
    ///
    /// # Panics
    /// If `S` has not enough room.
    pub fn empty(table: &Table) -> Self {
        let mut memory = Self::blank(table);
        Writer::new(&mut memory).finish();
        memory
    }

    /// The image in a file's bytes: short files are padded, long ones cut; a checksum shows whether it is sound.
    pub fn from_bytes(table: &Table, bytes: &[u8]) -> Self {
        let mut memory = Self::blank(table);
        let image = &mut memory.image.as_mut()[..memory.size];
        image.fill(0xFF);
        image.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        memory
    }

    fn blank(table: &Table) -> Self {
        let size = image_size(table);
        Self { image: S::bytes(size), size }
    }

    /// All bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.image.as_ref()[..self.size]
    }

    /// The checksum is right.
    pub fn is_sound(&self) -> bool {
        self.checked().is_some()
    }

    /// What LSS has stored: the node-ID, 255 for none, and the index of the bit rate in the table of CiA 305, 255 for as
    /// delivered. `None` if it has stored nothing.
    pub fn lss(&self) -> Option<[u8; LSS_SIZE]> {
        self.record(LSS_KEY)
    }

    /// Stores node-ID and bit rate for LSS; the objects' values stay.
    pub fn store_lss(&mut self, stored: [u8; LSS_SIZE]) {
        self.store_record(LSS_KEY, &stored);
    }

    /// What its maker has written of this one where it is not the table's: objects ([`is_makers_mark`]) and their values.
    pub fn marks(&self) -> impl Iterator<Item = (Mux, u32)> + '_ {
        records(self.checked().unwrap_or(&[])).filter_map(|(key, value)| {
            let object = match key {
                SERIAL_KEY => SERIAL_NUMBER,
                _ if key & !OBJECT_KEYS == MARK_KEY => Mux::from_key(key),
                _ => return None,
            };
            Some((object, u32::from_le_bytes(value.try_into().ok()?)))
        })
    }

    /// Writes a number of this one, as its maker does; the objects' values stay. There is room for it if the table has the object.
    pub fn store_mark(&mut self, object: Mux, number: u32) {
        let key = if object == SERIAL_NUMBER { SERIAL_KEY } else { MARK_KEY | object.key() };
        self.store_record(key, &number.to_le_bytes());
    }

    /// The program whose data goes to this object; empty where it was cleared. `None` if it is the one as delivered.
    pub(super) fn program(&self, object: Mux) -> Option<&[u8]> {
        records(self.checked()?).find(|(key, _)| *key == PROGRAM_KEY | object.key()).map(|(_, program)| program)
    }

    /// Stores a program; all else stays.
    pub(super) fn store_program(&mut self, object: Mux, program: &[u8]) {
        self.store_record(PROGRAM_KEY | object.key(), program);
    }

    /// The record of no object that has this key.
    fn record<const N: usize>(&self, wanted: u32) -> Option<[u8; N]> {
        let (_, stored) = records(self.checked()?).find(|(key, _)| *key == wanted)?;
        stored.try_into().ok()
    }

    fn store_record(&mut self, wanted: u32, value: &[u8]) {
        let before = self.clone();
        let mut writer = Writer::new(self);
        for (key, value) in records(before.checked().unwrap_or(&[])).filter(|(key, _)| *key != wanted) {
            writer.put(key, value);
        }
        writer.put(wanted, value);
        writer.finish();
    }

    /// The records, if the image is sound.
    fn checked(&self) -> Option<&[u8]> {
        let bytes = self.bytes();
        let end = HEADER_SIZE.checked_add(word(bytes, MAGIC.len())? as usize)?;
        let is_sound = bytes.starts_with(&MAGIC) && crc32(bytes.get(..end)?) == word(bytes, end)?;
        is_sound.then(|| &bytes[HEADER_SIZE..end])
    }

    /// Puts the stored values of the rows that `wanted` names into a dictionary; unknown keys and values that the table
    /// refuses are passed over, an unsound image is left alone.
    pub fn load<V: Storage>(&self, values: &mut Dictionary<V>, wanted: impl Fn(&Entry) -> bool) {
        for (key, value) in records(self.checked().unwrap_or(&[])) {
            let table = values.table();
            if is_no_object(key) {
                continue;
            }
            let Ok(slot) = table.find(Mux::from_key(key)) else { continue };
            let row = table.row(slot);
            if is_storable(row) && wanted(row) && values.check_bytes(slot, value).is_ok() {
                // It has just been found to fit.
                let _ = values.set_bytes(slot, value);
            }
        }
    }

    /// Stores the values of the rows that `wanted` names, but for dynamic COB-IDs of SDO channels; the other records stay.
    pub fn save<V: Storage>(&mut self, values: &Dictionary<V>, wanted: impl Fn(&Entry) -> bool) {
        let before = self.clone();
        // Both are in ascending order: one pass over each.
        let mut stored = records(before.checked().unwrap_or(&[])).peekable();
        let mut writer = Writer::new(self);
        for (slot, row) in values.table().iter().filter(|(_, row)| is_storable(row)) {
            let key = row.mux().key();
            if wanted(row) {
                if !is_dynamic(values, slot) {
                    writer.put_value(key, values, slot);
                }
                continue;
            }
            while stored.next_if(|(known, _)| *known < key).is_some() {}
            if let Some((_, value)) = stored.next_if(|(known, value)| *known == key && value.len() <= most_bytes(row)) {
                writer.put(key, value);
            }
        }
        for (key, value) in stored.filter(|(key, _)| is_no_object(*key)) {
            writer.put(key, value);
        }
        writer.finish();
    }

    /// Forgets the values of the rows that `wanted` names: those of the table are in effect from the next start on.
    pub fn forget(&mut self, wanted: impl Fn(Mux) -> bool) {
        let before = self.clone();
        let mut writer = Writer::new(self);
        for (key, value) in records(before.checked().unwrap_or(&[])) {
            if is_no_object(key) || !wanted(Mux::from_key(key)) {
                writer.put(key, value);
            }
        }
        writer.finish();
    }
}

/// Writes an image from its beginning.
struct Writer<'a> {
    image: &'a mut [u8],
    end: usize,
}

impl<'a> Writer<'a> {
    fn new<S: Storage>(memory: &'a mut Memory<S>) -> Self {
        let size = memory.size;
        Self { image: &mut memory.image.as_mut()[..size], end: HEADER_SIZE }
    }

    fn put(&mut self, key: u32, value: &[u8]) {
        let at = self.begin(key, value.len());
        self.image[at..self.end].copy_from_slice(value);
    }

    fn put_value(&mut self, key: u32, values: &Dictionary<impl Storage>, slot: Slot) {
        let view = values.view();
        let at = self.begin(key, view.length(slot));
        view.copy(slot, &mut self.image[at..self.end]);
    }

    /// The head of a record; where its value begins. The image has room for each row's longest value once.
    fn begin(&mut self, key: u32, length: usize) -> usize {
        put_word(self.image, self.end, key);
        put_word(self.image, self.end + 4, length as u32);
        let at = self.end + RECORD_HEADER_SIZE;
        self.end = at + length;
        at
    }

    fn finish(self) {
        self.image[..MAGIC.len()].copy_from_slice(&MAGIC);
        put_word(self.image, MAGIC.len(), (self.end - HEADER_SIZE) as u32);
        let crc = crc32(&self.image[..self.end]);
        put_word(self.image, self.end, crc);
        self.image[self.end + CRC_SIZE..].fill(0xFF);
    }
}

/// A COB-ID of an SDO channel that was given until the next start (CiA 301, 7.5.2.33: bit 30).
fn is_dynamic(values: &Dictionary<impl Storage>, slot: Slot) -> bool {
    parameter::is_cob_id(values.table().row(slot).mux()) && values.raw(slot) & parameter::DYNAMIC != 0
}

/// A row whose value can be in the store at all: it can be written, and has bytes.
pub const fn is_storable(row: &Entry) -> bool {
    matches!(row.access, Access::ReadWrite) && most_bytes(row) > 0 && !is_of_program(row)
}

/// What the maker writes of one device, and no host: the serial number, and of what can only be read 1000h, 1018h, and the modes of
/// an axis (6502h), which a data sheet often leaves to the device.
pub const fn is_makers_mark(row: &Entry) -> bool {
    let is_known = match row.index {
        0x1000 => true,
        0x1018 => row.sub_index > 0,
        0x6000..=0x9FFF => row.index % 0x800 == 0x6502 % 0x800,
        _ => false,
    };
    let is_serial = row.index == SERIAL_NUMBER.index && row.sub_index == SERIAL_NUMBER.sub_index;
    is_serial || (is_known && !row.access.is_writable() && row.data_type.fits_cell())
}

/// The bits of a key that are a multiplexor.
const OBJECT_KEYS: u32 = (1 << 24) - 1;

/// The key of a record that does not belong to an object.
const fn is_no_object(key: u32) -> bool {
    key > OBJECT_KEYS
}

const fn most_bytes(row: &Entry) -> usize {
    if row.data_type.fits_cell() { row.data_type.size() } else { row.stored_bytes() as usize }
}

/// Key and value of each record of an image that is sound.
fn records(mut left: &[u8]) -> impl Iterator<Item = (u32, &[u8])> {
    core::iter::from_fn(move || {
        let (key, length) = (word(left, 0)?, word(left, 4)? as usize);
        let value = left.get(RECORD_HEADER_SIZE..RECORD_HEADER_SIZE.checked_add(length)?)?;
        left = &left[RECORD_HEADER_SIZE + length..];
        Some((key, value))
    })
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn put_word(bytes: &mut [u8], at: usize, value: u32) {
    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use canopen::NodeId;
    use canopen::od::{DataType, Fixed, Index};
    use devices::servo::objects::TABLE;

    type Room = Fixed<512, 16_384, 8, 256>;
    type Values = Dictionary<Room>;
    type Store = Memory<Room>;

    fn values() -> Values {
        Dictionary::new(&TABLE, NodeId::MIN)
    }

    const TORQUE_LIMIT: Mux = Mux::new(0x6072, 0);
    const HEARTBEAT: Mux = Mux::new(0x1017, 0);

    fn set(values: &mut Values, mux: Mux, raw: u32) {
        values.set_raw(TABLE.find(mux).unwrap(), raw);
    }

    fn get(values: &Values, mux: Mux) -> u32 {
        values.raw(TABLE.find(mux).unwrap())
    }

    #[test]
    fn an_empty_memory_is_sound_and_a_blank_one_is_not() {
        assert!(Store::empty(&TABLE).is_sound());
        assert!(!Store::from_bytes(&TABLE, &[]).is_sound());
        assert!(!Store::from_bytes(&TABLE, &[0; 16_384]).is_sound());
    }

    #[test]
    fn groups_are_stored_and_forgotten_apart() {
        let mut there = values();
        set(&mut there, TORQUE_LIMIT, 777);
        set(&mut there, HEARTBEAT, 250);
        let mut memory = Store::empty(&TABLE);
        memory.save(&there, Entry::is_communication);
        let mut back = values();
        memory.load(&mut back, |_| true);
        assert_eq!((get(&back, TORQUE_LIMIT), get(&back, HEARTBEAT)), (3000, 250));
        memory.save(&there, |row| !row.is_communication());
        memory.load(&mut back, |_| true);
        assert_eq!((get(&back, TORQUE_LIMIT), get(&back, HEARTBEAT)), (777, 250));
        memory.forget(|mux| mux.index < 0x2000);
        let mut back = values();
        memory.load(&mut back, |_| true);
        assert_eq!((get(&back, TORQUE_LIMIT), get(&back, HEARTBEAT)), (777, 0));
    }

    #[test]
    fn what_lss_stores_stays_when_parameters_are_stored_and_forgotten() {
        let mut there = values();
        set(&mut there, HEARTBEAT, 250);
        let mut memory = Store::empty(&TABLE);
        assert_eq!(memory.lss(), None);
        memory.store_lss([5, 3]);
        memory.save(&there, |_| true);
        memory.store_lss([255, 255]);
        assert_eq!(Store::from_bytes(&TABLE, memory.bytes()).lss(), Some([255, 255]));
        memory.forget(|_| true);
        let mut back = values();
        memory.load(&mut back, |_| true);
        assert_eq!((get(&back, HEARTBEAT), memory.lss()), (0, Some([255, 255])));
    }

    #[test]
    fn the_serial_number_stays_whatever_is_stored_and_forgotten() {
        let mut memory = Store::empty(&TABLE);
        memory.store_lss([5, 3]);
        memory.store_mark(SERIAL_NUMBER, 0xDEAD_BEEF);
        memory.save(&values(), |_| true);
        memory.store_lss([6, 2]);
        memory.forget(|_| true);
        let memory = Store::from_bytes(&TABLE, memory.bytes());
        assert_eq!(memory.marks().collect::<std::vec::Vec<_>>(), [(SERIAL_NUMBER, 0xDEAD_BEEF)]);
        assert_eq!(memory.lss(), Some([6, 2]));
    }

    const fn row(index: u16, data_type: DataType) -> Entry {
        Entry::new(index, 0, data_type, Access::ReadWrite, "", "")
    }

    static ROWS: [Entry; 7] = [
        row(0x2000, DataType::Real32).range_real(-1.0, 1.0),
        row(0x2001, DataType::Real64),
        row(0x2002, DataType::Unsigned64).default_unsigned(u64::MAX),
        row(0x2003, DataType::VisibleString).text("as delivered").capacity(20),
        row(0x2004, DataType::TimeOfDay),
        row(0x2005, DataType::Domain).capacity(300),
        row(0x2006, DataType::Integer24),
    ];
    static INDEX: Index<7> = Index::of(&ROWS);
    static ANY: Table = Table::new(&ROWS, &INDEX);

    #[test]
    fn values_of_every_type_come_back_byte_for_byte() {
        let long = [0x5A; 300];
        let stored: [&[u8]; 7] = [
            &0.5_f32.to_le_bytes(),
            &(-1e300_f64).to_le_bytes(),
            &0x8000_0000_0000_0001_u64.to_le_bytes(),
            b"another",
            &[1, 2, 3, 4, 5, 6],
            &long,
            &[1, 0, 0x80],
        ];
        let mut there = Values::new(&ANY, NodeId::MIN);
        let slots: std::vec::Vec<_> = ANY.iter().map(|(slot, _)| slot).collect();
        for (slot, bytes) in slots.iter().zip(stored) {
            there.set_bytes(*slot, bytes).unwrap();
        }
        let mut memory = Store::empty(&ANY);
        memory.save(&there, |_| true);
        // The image is as long as the longest values need: with the string shorter than it may be, not all of it is used.
        // Behind them what LSS stores (10) and the serial number (12).
        assert!(memory.is_sound() && memory.bytes().len() == 12 + 7 * 8 + 4 + 8 + 8 + 20 + 6 + 300 + 3 + 10 + 12);
        let mut back = Values::new(&ANY, NodeId::MIN);
        Store::from_bytes(&ANY, memory.bytes()).load(&mut back, |_| true);
        for (slot, bytes) in slots.iter().zip(stored) {
            let mut read = [0; 300];
            let length = back.view().copy(*slot, &mut read);
            assert_eq!(&read[..length], bytes, "{}", ANY.row(*slot).mux());
        }
    }

    #[test]
    fn a_real_out_of_its_limits_is_not_loaded_and_a_damaged_image_gives_nothing() {
        let mut there = Values::new(&ANY, NodeId::MIN);
        let (slot, _) = ANY.iter().next().unwrap();
        there.set_bytes(slot, &1.5_f32.to_le_bytes()).unwrap();
        let mut memory = Store::empty(&ANY);
        memory.save(&there, |_| true);
        let mut back = Values::new(&ANY, NodeId::MIN);
        memory.load(&mut back, |_| true);
        assert_eq!(back.raw(slot), 0);
        there.set_bytes(slot, &0.5_f32.to_le_bytes()).unwrap();
        memory.save(&there, |_| true);
        let sound = memory.bytes().to_vec();
        for at in 0..sound.len() {
            let mut damaged = sound.clone();
            damaged[at] ^= 1;
            let mut back = Values::new(&ANY, NodeId::MIN);
            let store = Store::from_bytes(&ANY, &damaged);
            store.load(&mut back, |_| true);
            let expected = if store.is_sound() { 0.5 } else { 0.0 };
            assert_eq!(f32::from_bits(back.raw(slot)), expected, "byte {at}");
        }
        assert!(!Store::from_bytes(&ANY, &sound[..40]).is_sound());
    }
}
