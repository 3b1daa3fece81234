use core::fmt;

/// Multiplexor: which entry of an object dictionary. Prints as `6041h:00`, with `{:X}` as it is typed: `6041:00`. Source: CiA 301,
/// 7.2.4.3.
#[doc(alias = "address")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Mux {
    /// Index, 0000h to FFFFh.
    pub index: u16,
    /// Sub-index, 00h to FFh.
    pub sub_index: u8,
}

impl Mux {
    /// Index and sub-index.
    pub const fn new(index: u16, sub_index: u8) -> Self {
        Self { index, sub_index }
    }

    /// `index << 8 | sub_index`: orders as the dictionary does.
    pub const fn key(self) -> u32 {
        (self.index as u32) << 8 | self.sub_index as u32
    }

    /// The reverse of [`key`](Self::key); the highest byte is dropped.
    pub const fn from_key(key: u32) -> Self {
        Self { index: (key >> 8) as u16, sub_index: key as u8 }
    }
}

impl fmt::Display for Mux {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}h:{:02X}", self.index, self.sub_index)
    }
}

impl fmt::UpperHex for Mux {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}:{:02X}", self.index, self.sub_index)
    }
}
