//! The parameter store of a device whose table comes from a description: one record a parameter in a byte image.
//!
//! An image is a header (magic, number of records), one record a value (multiplexor key, value) and a CRC-32 over all of
//! it, little endian. Values are checked against the table on the way in: an image can never put a value out of range into
//! a dictionary.

use canopen::Mux;
use canopen::od::{Access, Dictionary, Entry, Storage};

use crate::engine::storage::crc32;

/// Bytes of the image.
pub const MEMORY_SIZE: usize = 8192;

const MAGIC: [u8; 4] = *b"FDN1";
const HEADER_SIZE: usize = 8;
const RECORD_SIZE: usize = 8;
const CRC_SIZE: usize = 4;

/// Most parameters that are stored.
pub const CAPACITY: usize = (MEMORY_SIZE - HEADER_SIZE - CRC_SIZE) / RECORD_SIZE;

/// Contents of the memory chip, to be kept over power cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory([u8; MEMORY_SIZE]);

impl Memory {
    /// A chip that holds no values: those of the table are in effect.
    pub fn empty() -> Self {
        let mut memory = Self([0; MEMORY_SIZE]);
        memory.put(&mut core::iter::empty());
        memory
    }

    /// The image in a file's bytes: short files are padded, long ones cut; a checksum tells if it is sound.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let mut image = [0xFF; MEMORY_SIZE];
        image.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        Self(image)
    }

    /// All bytes.
    pub const fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// The checksum is right.
    pub fn is_sound(&self) -> bool {
        let end = HEADER_SIZE + self.count() * RECORD_SIZE;
        self.0.starts_with(&MAGIC) && end + CRC_SIZE <= MEMORY_SIZE && crc32(&self.0[..end]) == word(&self.0, end)
    }

    /// Puts the stored values of the rows that `wanted` names into a dictionary; unknown keys and values that the table
    /// refuses are passed over, an unsound image is left alone.
    pub fn load<S: Storage>(&self, values: &mut Dictionary<S>, wanted: impl Fn(&Entry) -> bool) {
        if !self.is_sound() {
            return;
        }
        for (key, raw) in self.records() {
            let table = values.table();
            let Ok(slot) = table.find(Mux::from_key(key)) else { continue };
            let row = table.row(slot);
            if wanted(row) && row.check_value(row.data_type.value(raw)).is_ok() {
                values.set_raw(slot, raw);
            }
        }
    }

    /// Stores the values of the parameters that `wanted` names; the other records stay. What does not fit any more is left
    /// out.
    pub fn save<S: Storage>(&mut self, values: &Dictionary<S>, wanted: impl Fn(&Entry) -> bool) {
        let before = *self;
        let stored = |key| before.is_sound().then(|| before.records().find(|(known, _)| *known == key)).flatten();
        let mut records = values.table().iter().filter(|(_, row)| is_parameter(row)).filter_map(|(slot, row)| {
            let key = row.mux().key();
            if wanted(row) { Some((key, values.raw(slot))) } else { stored(key) }
        });
        self.put(&mut records);
    }

    /// Forgets the values of the rows that `wanted` names: those of the table are in effect from the next start on.
    pub fn forget(&mut self, wanted: impl Fn(Mux) -> bool) {
        let before = *self;
        if before.is_sound() {
            self.put(&mut before.records().filter(|(key, _)| !wanted(Mux::from_key(*key))));
        } else {
            *self = Self::empty();
        }
    }

    fn put(&mut self, records: &mut dyn Iterator<Item = (u32, u32)>) {
        let mut count = 0;
        for (key, raw) in records.take(CAPACITY) {
            let at = HEADER_SIZE + count * RECORD_SIZE;
            put_word(&mut self.0, at, key);
            put_word(&mut self.0, at + 4, raw);
            count += 1;
        }
        self.0[..MAGIC.len()].copy_from_slice(&MAGIC);
        put_word(&mut self.0, MAGIC.len(), count as u32);
        let end = HEADER_SIZE + count * RECORD_SIZE;
        let crc = crc32(&self.0[..end]);
        put_word(&mut self.0, end, crc);
    }

    fn count(&self) -> usize {
        word(&self.0, MAGIC.len()).min(CAPACITY as u32) as usize
    }

    fn records(&self) -> impl Iterator<Item = (u32, u32)> {
        self.0[HEADER_SIZE..]
            .chunks_exact(RECORD_SIZE)
            .take(self.count())
            .map(|record| (word(record, 0), word(record, 4)))
    }
}

/// Whether a row is a parameter, which 1010h stores: it can be written, and is neither a command nor a target.
pub fn is_parameter(row: &Entry) -> bool {
    let profile = if row.index < 0x6800 { row.index } else { 0x6000 | row.index & 0x7FF };
    let command = matches!(row.index, 0x1003 | 0x1010 | 0x1011)
        || (row.index >= 0x6000
            && matches!(
                profile,
                0x6040 | 0x6060 | 0x6071 | 0x607A | 0x60B0..=0x60B2 | 0x60B8 | 0x60C1 | 0x60FE | 0x60FF
            ));
    row.access == Access::ReadWrite && row.data_type.bits() > 0 && !command
}

fn word(bytes: &[u8], at: usize) -> u32 {
    let mut raw = [0; 4];
    raw.copy_from_slice(&bytes[at..at + 4]);
    u32::from_le_bytes(raw)
}

fn put_word(bytes: &mut [u8], at: usize, value: u32) {
    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;
    use canopen::NodeId;
    use devices::servo::objects::TABLE;

    type Values = Dictionary<canopen::od::Fixed<512, 512, 8, 256>>;

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
        assert!(Memory::empty().is_sound());
        assert!(!Memory::from_bytes(&[]).is_sound());
        assert!(!Memory::from_bytes(&[0; MEMORY_SIZE]).is_sound());
    }

    #[test]
    fn groups_are_stored_and_forgotten_apart() {
        let mut there = values();
        set(&mut there, TORQUE_LIMIT, 777);
        set(&mut there, HEARTBEAT, 250);
        let mut memory = Memory::empty();
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
    fn commands_are_not_stored_and_a_damaged_image_gives_nothing() {
        let mut there = values();
        set(&mut there, Mux::new(0x6040, 0), 0x0F);
        set(&mut there, TORQUE_LIMIT, 777);
        let mut memory = Memory::empty();
        memory.save(&there, |_| true);
        let mut back = values();
        memory.load(&mut back, |_| true);
        assert_eq!((get(&back, Mux::new(0x6040, 0)), get(&back, TORQUE_LIMIT)), (0, 777));
        let mut damaged = *memory.bytes().first_chunk::<MEMORY_SIZE>().unwrap();
        damaged[20] ^= 1;
        let mut back = values();
        Memory::from_bytes(&damaged).load(&mut back, |_| true);
        assert_eq!(get(&back, TORQUE_LIMIT), 3000);
    }
}
