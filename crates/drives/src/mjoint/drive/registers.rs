//! The RS485 side: the control objects as 16-bit Modbus registers ("M Robot Joint Motor CanOpen Manual", 5.04, column
//! "Modbus address").
//!
//! Addresses and words go in, words or a [`RegisterError`] come out; framing, checksums and lines are others' work. A
//! write is checked against the object table and has the consequences of an SDO download of the same value. Unlike
//! SDO, registers do not depend on the NMT state. While 2600h is 0, "modbus forbid", only 2600h itself can be written: it is
//! the first register, so that a master can enable itself.

use canopen::AbortCode;
use canopen::node::Via;
use canopen::od::{Entry, Slot};

use super::MJoint;
use crate::RegisterError;
use crate::mjoint::objects::modbus::{Register, find};
use crate::mjoint::objects::{MODBUS_ENABLE, TABLE};
use crate::mjoint::variations::FORBIDS_NOTHING;

/// Address of 2600h.
const ENABLE_ADDRESS: u16 = 0x00;

/// What some of the given words mean for one object.
struct Change {
    slot: Slot,
    raw: u32,
    /// How many of the words it took.
    words: usize,
}

impl MJoint {
    /// The address that it answers to on the RS485 line: the node-ID in use (2615h as it was at power-on). `None` while
    /// it has no power.
    pub fn modbus_address(&self) -> Option<u8> {
        self.device.is_running().then(|| self.device.node().node_id().raw())
    }

    /// Reads the registers from `address` on into `words`. Values of 8 bits are extended with their sign; half of a
    /// 32-bit value may be read alone.
    ///
    /// # Errors
    /// [`RegisterError::NoSuchAddress`]; `words` is then of no use.
    pub fn read_registers(&self, address: u16, words: &mut [u16]) -> Result<(), RegisterError> {
        for (offset, word) in words.iter_mut().enumerate() {
            let (register, half) = at(address, offset)?;
            let value = self.values().value(slot(register)?);
            *word = (value >> (16 * half)) as u16;
        }
        Ok(())
    }

    /// Writes `words` to the registers from `address` on, all of them or none, in the order of their addresses.
    ///
    /// Both words of a 32-bit value act together, as one SDO download. One word of it alone is joined to the present
    /// other half, and the whole acts at once: with 607Ah or 260Ch that can start a move.
    ///
    /// # Errors
    /// See [`RegisterError`].
    pub fn write_registers(&mut self, address: u16, words: &[u16]) -> Result<(), RegisterError> {
        if !self.takes_writes(address, words) {
            return Err(RegisterError::Forbidden);
        }
        let mut done = 0;
        while done < words.len() {
            let change = self.change(address, done, &words[done..])?;
            self.values().check_write(change.slot, change.raw)?;
            done += change.words;
        }
        done = 0;
        while done < words.len() {
            let change = self.change(address, done, &words[done..])?;
            let raw = self.device.values_mut().write(change.slot, change.raw)?;
            self.act_on(change.slot, raw, Via::Sdo);
            done += change.words;
        }
        self.publish_status();
        Ok(())
    }

    /// 2600h is 1, or this write makes it so, or touches nothing else.
    fn takes_writes(&self, address: u16, words: &[u16]) -> bool {
        let enabled = self.values().get(MODBUS_ENABLE) == 1 || self.device.variant().is(FORBIDS_NOTHING);
        enabled || (address == ENABLE_ADDRESS && (words.len() <= 1 || words[0] == 1))
    }

    /// What the first of `words`, at `address + offset`, and the next if it belongs to it, make of their object.
    fn change(&self, address: u16, offset: usize, words: &[u16]) -> Result<Change, RegisterError> {
        let (register, half) = at(address, offset)?;
        let slot = slot(register)?;
        let row = self.values().table().row(slot);
        if !row.access.is_writable() {
            return Err(RegisterError::ReadOnly);
        }
        if register.words == 1 {
            return Ok(Change { slot, raw: narrow(row, words[0])?, words: 1 });
        }
        let count = words.len().min(usize::from(register.words) - half);
        let mut raw = self.values().raw(slot);
        for (half, word) in (half..).zip(&words[..count]) {
            raw = raw & !(0xFFFF << (16 * half)) | u32::from(*word) << (16 * half);
        }
        Ok(Change { slot, raw, words: count })
    }
}

fn at(address: u16, offset: usize) -> Result<(&'static Register, usize), RegisterError> {
    let place = usize::from(address) + offset;
    u16::try_from(place).ok().and_then(find).ok_or(RegisterError::NoSuchAddress)
}

fn slot(register: &Register) -> Result<Slot, RegisterError> {
    TABLE.find(register.object).map_err(|_| RegisterError::NoSuchAddress)
}

/// The cell of an object of 8 or 16 bits; a word that does not fit into it is refused, not cut.
fn narrow(row: &Entry, word: u16) -> Result<u32, RegisterError> {
    let value = if row.data_type.is_signed() { i64::from(word as i16) } else { i64::from(word) };
    let (low, high) = row.data_type.range();
    match value {
        _ if value < low => Err(RegisterError::BadValue(AbortCode::VALUE_TOO_LOW)),
        _ if value > high => Err(RegisterError::BadValue(AbortCode::VALUE_TOO_HIGH)),
        _ => Ok(row.data_type.raw(value)),
    }
}
