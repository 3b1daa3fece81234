use core::ops::Range;

use canopen::Mux;
use canopen::pdo::MappingRecord;

/// What a PDO carries, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PdoMap(pub Vec<MappingRecord>);

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
    pub fn fields(&self) -> impl Iterator<Item = (MappingRecord, Range<u32>)> {
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
