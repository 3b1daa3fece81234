use core::fmt;

/// A CAN identifier as it stands on the wire: 11 bits (standard) or 29 bits (extended).
///
/// Not a COB-ID: that is the 32-bit value of an object and has flags of its own.
/// Source: ISO 11898-1, 8.4.2.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct CanId(u32);

const EXTENDED_FLAG: u32 = 1 << 31;

impl CanId {
    /// Largest standard identifier.
    pub const MAX_STANDARD: u16 = 0x7FF;
    /// Largest extended identifier.
    pub const MAX_EXTENDED: u32 = 0x1FFF_FFFF;

    /// The standard identifier with the low 11 bits of `raw`; higher bits are dropped.
    pub const fn standard(raw: u16) -> Self {
        Self((raw & Self::MAX_STANDARD) as u32)
    }

    /// The extended identifier with the low 29 bits of `raw`; higher bits are dropped.
    pub const fn extended(raw: u32) -> Self {
        Self((raw & Self::MAX_EXTENDED) | EXTENDED_FLAG)
    }

    /// The identifier as a number, right aligned, without flags.
    pub const fn raw(self) -> u32 {
        self.0 & Self::MAX_EXTENDED
    }

    /// True for a 29-bit identifier.
    pub const fn is_extended(self) -> bool {
        self.0 & EXTENDED_FLAG != 0
    }

    /// The 11 bits, if this is a standard identifier.
    pub const fn as_standard(self) -> Option<u16> {
        if self.is_extended() { None } else { Some(self.0 as u16) }
    }
}

/// `604`, or `00000604` when extended: the candump form.
impl fmt::Display for CanId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_extended() { write!(f, "{:08X}", self.raw()) } else { write!(f, "{:03X}", self.raw()) }
    }
}

impl fmt::Debug for CanId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "CanId({self})")
    }
}
