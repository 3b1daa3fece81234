//! Multiplexed PDOs (CiA 301, 7.2.3): one PDO for many objects, each named in the frame.
//!
//! In destination address mode the frame names an object of the consumer, in source address mode one of the producer, which the
//! consumer's object dispatching list (1FD0h to 1FFFh) leads to one of its own. What a producer sends in source address mode is in its
//! object scanning list (1FA0h to 1FCFh).

use can::{CanId, Frame};

use super::Direction;
use crate::od::{Table, View};
use crate::{AbortCode, Mux, NodeId};

/// Object scanning list (CiA 301, 7.5.2.39).
pub const SCANNING_LIST: core::ops::RangeInclusive<u16> = 0x1FA0..=0x1FCF;
/// Object dispatching list (CiA 301, 7.5.2.40).
pub const DISPATCHING_LIST: core::ops::RangeInclusive<u16> = 0x1FD0..=0x1FFF;

/// The most bytes of a value.
pub const MAX_SIZE: usize = 4;

/// Bit 7 of the first byte: the mode.
const DESTINATION: u8 = 1 << 7;
/// The highest sub-index of a record or array.
const LAST_SUB_INDEX: u8 = 254;

/// Whose object an MPDO names: sub-index 00h of its mapping record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AddressMode {
    /// FEh: one of the producer.
    Source,
    /// FFh: one of the consumer.
    Destination,
}

impl AddressMode {
    /// From sub-index 00h of a mapping record; `None` for a number of mapped objects.
    pub const fn from_count(count: u8) -> Option<Self> {
        match count {
            0xFE => Some(Self::Source),
            0xFF => Some(Self::Destination),
            _ => None,
        }
    }

    /// The reverse of [`from_count`](Self::from_count).
    pub const fn count(self) -> u8 {
        match self {
            Self::Source => 0xFE,
            Self::Destination => 0xFF,
        }
    }

    /// Whether a device with these objects has MPDOs of this mode and direction: those of the source address mode need their list.
    ///
    /// # Errors
    /// 0604 0042h, as for any other number that is larger than that of the entries.
    pub fn check(self, table: &Table, direction: Direction) -> Result<(), AbortCode> {
        let list = match (self, direction) {
            (Self::Destination, _) => return Ok(()),
            (Self::Source, Direction::Rpdo) => DISPATCHING_LIST,
            (Self::Source, Direction::Tpdo) => SCANNING_LIST,
        };
        let has_list = table.rows().iter().any(|row| list.contains(&row.index));
        if has_list { Ok(()) } else { Err(AbortCode::PDO_TOO_LONG) }
    }
}

/// The content of an MPDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mpdo {
    /// Whose object it names.
    pub mode: AddressMode,
    /// The producer in source address mode, the consumer in destination address mode: 0 there is every node, 1 to 127 one.
    pub node: u8,
    /// The object.
    pub object: Mux,
    /// Its value, the lowest byte first; what a shorter one leaves is 0.
    pub data: [u8; MAX_SIZE],
}

impl Mpdo {
    /// Reads a frame of eight bytes; `None` for any other. The identifier is the caller's to check.
    pub fn parse(frame: &Frame) -> Option<Self> {
        <[u8; 8]>::try_from(frame.data()).ok().map(|bytes| Self::from_bits(u64::from_le_bytes(bytes)))
    }

    /// The reverse of [`bits`](Self::bits).
    pub const fn from_bits(bits: u64) -> Self {
        let [address, low, high, sub_index, a, b, c, d] = bits.to_le_bytes();
        let mode = if address & DESTINATION == 0 { AddressMode::Source } else { AddressMode::Destination };
        let object = Mux::new(u16::from_le_bytes([low, high]), sub_index);
        Self { mode, node: address & !DESTINATION, object, data: [a, b, c, d] }
    }

    /// The eight bytes, as a number with the first byte lowest.
    pub const fn bits(&self) -> u64 {
        let mode = match self.mode {
            AddressMode::Source => 0,
            AddressMode::Destination => DESTINATION,
        };
        let [low, high] = self.object.index.to_le_bytes();
        let [a, b, c, d] = self.data;
        u64::from_le_bytes([mode | self.node & !DESTINATION, low, high, self.object.sub_index, a, b, c, d])
    }

    /// The frame on `id`.
    pub const fn emit(&self, id: CanId) -> Frame {
        Frame::of_bits(id, self.bits(), 8)
    }

    /// Which of its objects a node with these values and this node-ID writes, as an RPDO of this mode asks; `None` where
    /// the MPDO is not for it.
    pub fn destination(&self, values: &View<'_>, node_id: NodeId, mode: AddressMode) -> Option<Mux> {
        match mode {
            _ if self.mode != mode => None,
            AddressMode::Destination => (self.node == 0 || self.node == node_id.raw()).then_some(self.object),
            AddressMode::Source => dispatched(values, self.node, self.object),
        }
    }
}

/// What the dispatching list makes of an object of another node: its entries are a node-ID (bits 0 to 7), a first sub-index (8 to
/// 15) and an index (16 to 31) there, a first sub-index (32 to 39) and an index (40 to 55) here, and how many sub-indices (56 to 63).
fn dispatched(values: &View<'_>, node: u8, object: Mux) -> Option<Mux> {
    let rows = values.table().iter();
    let entries = rows.filter(|(_, row)| DISPATCHING_LIST.contains(&row.index) && row.sub_index > 0);
    entries.into_iter().find_map(|(slot, _)| {
        let mut bytes = [0; 8];
        values.copy(slot, &mut bytes);
        let [of_node, first, low, high, local_sub_index, local_low, local_high, count] = bytes;
        let there = Mux::new(u16::from_le_bytes([low, high]), first);
        let offset = object.sub_index.checked_sub(there.sub_index)?;
        let is_listed = of_node == node && there.index == object.index && offset < count.max(1);
        let here = Mux::new(u16::from_le_bytes([local_low, local_high]), local_sub_index.checked_add(offset)?);
        (is_listed && of_node != 0).then_some(here)
    })
}

/// The objects that a node sends in source address mode, as its scanning list has them: a first sub-index (bits 0 to 7), an
/// index (8 to 23), and how many sub-indices (24 to 31).
pub fn scanned<'a>(values: &'a View<'_>) -> impl Iterator<Item = Mux> + use<'a> {
    let rows = values.table().iter();
    let entries = rows.filter(|(_, row)| SCANNING_LIST.contains(&row.index) && row.sub_index > 0);
    entries.map(|(slot, _)| values.raw(slot)).filter(|entry| *entry != 0).flat_map(|entry| {
        let (first, index, count) = (entry as u8, (entry >> 8) as u16, ((entry >> 24) as u8).max(1));
        let last = first.saturating_add(count - 1).min(LAST_SUB_INDEX.max(first));
        (first..=last).map(move |sub_index| Mux::new(index, sub_index))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_parsed_is_emitted_and_every_address_and_multiplexor_comes_back() {
        let id = CanId::standard(0x184);
        for first in 0..=u8::MAX {
            let frame = Frame::full(id, [first, 0x34, 0x12, 0x56, 1, 2, 3, 4]);
            let mpdo = Mpdo::parse(&frame).unwrap();
            assert_eq!(mpdo.emit(id), frame);
            assert_eq!((mpdo.object, mpdo.data, mpdo.node), (Mux::new(0x1234, 0x56), [1, 2, 3, 4], first & 0x7F));
            assert_eq!(mpdo.mode == AddressMode::Destination, first >= 0x80);
        }
        for text in ["184#", "184#01341256010203", "184#R8"] {
            assert_eq!(Mpdo::parse(&text.parse().unwrap()), None, "{text}");
        }
    }

    #[test]
    fn only_feh_and_ffh_are_address_modes() {
        let modes = (0..=u8::MAX).filter_map(|count| Some((count, AddressMode::from_count(count)?)));
        assert!(modes.clone().eq([(0xFE, AddressMode::Source), (0xFF, AddressMode::Destination)]));
        assert!(modes.into_iter().all(|(count, mode)| mode.count() == count));
    }
}
