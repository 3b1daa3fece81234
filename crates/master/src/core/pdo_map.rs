use core::ops::Range;

use canopen::Mux;

/// One object in a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MappedObject {
    /// Which object of the device.
    pub mux: Mux,
    /// Its length in bits, 1 to 64.
    pub bits: u8,
}

impl MappedObject {
    /// From a mapping record (1600h.., 1A00h..): index, sub-index, length. Source: CiA 301, 7.5.2.36.
    pub const fn from_record(record: u32) -> Self {
        Self { mux: Mux::from_key(record >> 8), bits: record as u8 }
    }

    /// As a mapping record.
    pub const fn to_record(self) -> u32 {
        self.mux.key() << 8 | self.bits as u32
    }
}

/// What a PDO carries, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PdoMap(pub Vec<MappedObject>);

impl PdoMap {
    /// Total length in bits.
    pub fn bits(&self) -> u32 {
        self.0.iter().map(|object| u32::from(object.bits)).sum()
    }

    /// Total length in bytes, begun ones counted.
    pub fn bytes(&self) -> usize {
        self.bits().div_ceil(8) as usize
    }

    /// Every object with the bits it takes, bit 0 being the lowest bit of byte 0.
    pub fn fields(&self) -> impl Iterator<Item = (MappedObject, Range<u32>)> {
        let mut at = 0;
        self.0.iter().map(move |object| {
            let from = at;
            at += u32::from(object.bits);
            (*object, from..at)
        })
    }

    /// The bits of `mux`; `None` if it is not mapped or lies beyond the 64 bits of a frame.
    pub fn find(&self, mux: Mux) -> Option<Range<u32>> {
        let (_, bits) = self.fields().find(|(object, _)| object.mux == mux)?;
        (bits.end <= u64::BITS).then_some(bits)
    }
}
