//! The host's SDO client, by the bytes.

use can::{CanId, Frame};

use super::{Bench, BenchSubject};

/// Bit 31 of a PDO's COB-ID: it is off.
const INVALID: i64 = 1 << 31;

/// An abort code that a drive answered.
pub type Abort = u32;

/// Where an object stands: its index, or its index and its sub-index.
pub trait ObjectAddress: Copy {
    /// Index and sub-index.
    fn place(self) -> (u16, u8);
}

impl ObjectAddress for u16 {
    fn place(self) -> (u16, u8) {
        (self, 0)
    }
}

impl ObjectAddress for (u16, u8) {
    fn place(self) -> (u16, u8) {
        self
    }
}

/// Panics where a test is wrong, and where a drive does not do what a helper takes for granted.
impl<S: BenchSubject> Bench<S> {
    /// Sends an SDO request; the eight bytes that answer it, or `None`.
    pub fn sdo(&mut self, request: &[u8]) -> Option<[u8; 8]> {
        let node = u16::from(self.node);
        let answer = self.ask(Frame::new(CanId::standard(0x600 + node), request), 0x580 + node)?;
        Some(answer.data().try_into().expect("an SDO answer has eight bytes"))
    }

    /// Writes `value` with the object's width; four bytes for one that the manual does not have.
    pub fn write(&mut self, object: impl ObjectAddress, value: i64) -> Result<(), Abort> {
        let (index, sub) = object.place();
        let size = S::rows().find(index, sub).map_or(4, |row| row.size);
        let mut request = head(0x23 | (4 - size as u8) << 2, index, sub);
        request[4..4 + size].copy_from_slice(&value.to_le_bytes()[..size]);
        let answer = self.sdo(&request).unwrap_or_else(|| panic!("no answer to a write of {index:04X}h:{sub:02X}"));
        match answer[0] {
            0x60 => Ok(()),
            _ => Err(abort_of(&answer)),
        }
    }

    /// Writes a value that the drive must take.
    #[track_caller]
    pub fn set(&mut self, object: impl ObjectAddress, value: i64) -> &mut Self {
        let (index, sub) = object.place();
        let done = self.write(object, value);
        assert_eq!(done, Ok(()), "{index:04X}h:{sub:02X} = {value} at {} s", self.seconds());
        self
    }

    /// The bytes of an object, as many as the drive sends.
    pub fn read(&mut self, object: impl ObjectAddress) -> Result<Vec<u8>, Abort> {
        let (index, sub) = object.place();
        let answer = self.sdo(&head(0x40, index, sub));
        let answer = answer.unwrap_or_else(|| panic!("no answer to a read of {index:04X}h:{sub:02X}"));
        match answer[0] {
            0x43 | 0x47 | 0x4B | 0x4F => Ok(answer[4..8 - usize::from(answer[0] >> 2 & 3)].to_vec()),
            _ => Err(abort_of(&answer)),
        }
    }

    /// The value of an object, with the sign that its type has.
    #[track_caller]
    pub fn get(&mut self, object: impl ObjectAddress) -> i64 {
        let (index, sub) = object.place();
        let bytes = self.read(object).unwrap_or_else(|abort| panic!("{index:04X}h:{sub:02X}: {abort:08X}h"));
        value_of(&bytes, S::rows().find(index, sub).is_some_and(|row| row.signed))
    }

    /// Maps objects into a PDO, as CiA 301 wants it: none, then each, then how many. `record` is 1600h or 1A00h and on.
    #[track_caller]
    pub fn map(&mut self, record: u16, objects: &[i64]) -> &mut Self {
        let parameter = (record - 0x200, 1);
        let cob_id = if S::REMAPS_WHILE_VALID { 0 } else { self.get(parameter) };
        if !S::REMAPS_WHILE_VALID {
            self.set(parameter, cob_id | INVALID);
        }
        self.set(record, 0);
        for (sub, object) in (1..).zip(objects) {
            self.set((record, sub), *object);
        }
        self.set(record, objects.len() as i64);
        if S::REMAPS_WHILE_VALID { self } else { self.set(parameter, cob_id) }
    }

    /// 6041h.
    pub fn statusword(&mut self) -> u16 {
        self.get(0x6041) as u16
    }

    /// The controlwords of CiA 402: shutdown, switch on, enable operation.
    pub fn enable(&mut self) -> &mut Self {
        self.set(0x6040, 0x06).set(0x6040, 0x07).set(0x6040, 0x0F)
    }
}

/// The first bytes of an SDO request; the data bytes are zero.
#[must_use]
pub fn head(command: u8, index: u16, sub: u8) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    [command, low, high, sub, 0, 0, 0, 0]
}

fn abort_of(answer: &[u8; 8]) -> Abort {
    assert_eq!(answer[0], 0x80, "neither an answer nor an abort: {answer:02X?}");
    u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]])
}

fn value_of(bytes: &[u8], signed: bool) -> i64 {
    let negative = signed && bytes.last().is_some_and(|byte| byte & 0x80 != 0);
    let mut wide = [if negative { 0xFF } else { 0 }; 8];
    wide[..bytes.len()].copy_from_slice(bytes);
    i64::from_le_bytes(wide)
}
