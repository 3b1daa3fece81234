/// Data type of an object. Source: CiA 301, table 44 (codes), clause 7.1 (encoding: little endian).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataType {
    /// INTEGER8, code 2.
    Integer8,
    /// INTEGER16, code 3.
    Integer16,
    /// INTEGER32, code 4.
    Integer32,
    /// UNSIGNED8, code 5.
    Unsigned8,
    /// UNSIGNED16, code 6.
    Unsigned16,
    /// UNSIGNED32, code 7.
    Unsigned32,
    /// VISIBLE_STRING, code 9. Constant here.
    VisibleString,
}

impl DataType {
    /// Bytes on the wire; 0 for a string, whose length is its text's.
    pub const fn size(self) -> usize {
        match self {
            Self::Integer8 | Self::Unsigned8 => 1,
            Self::Integer16 | Self::Unsigned16 => 2,
            Self::Integer32 | Self::Unsigned32 => 4,
            Self::VisibleString => 0,
        }
    }

    /// Bits, as a mapping record states them.
    pub const fn bits(self) -> u8 {
        self.size() as u8 * 8
    }

    /// True for the INTEGER types.
    pub const fn is_signed(self) -> bool {
        matches!(self, Self::Integer8 | Self::Integer16 | Self::Integer32)
    }

    /// The code of the type in EDS files and at 0002h to 0009h.
    pub const fn code(self) -> u16 {
        match self {
            Self::Integer8 => 0x2,
            Self::Integer16 => 0x3,
            Self::Integer32 => 0x4,
            Self::Unsigned8 => 0x5,
            Self::Unsigned16 => 0x6,
            Self::Unsigned32 => 0x7,
            Self::VisibleString => 0x9,
        }
    }

    /// The name as the standard prints it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Integer8 => "INTEGER8",
            Self::Integer16 => "INTEGER16",
            Self::Integer32 => "INTEGER32",
            Self::Unsigned8 => "UNSIGNED8",
            Self::Unsigned16 => "UNSIGNED16",
            Self::Unsigned32 => "UNSIGNED32",
            Self::VisibleString => "VISIBLE_STRING",
        }
    }

    /// The number that the low [`size`](Self::size) bytes of `raw` stand for.
    pub const fn value(self, raw: u32) -> i64 {
        let unused = self.unused_bits();
        if self.is_signed() { ((raw << unused) as i32 >> unused) as i64 } else { (raw << unused >> unused) as i64 }
    }

    /// The cell for `value`: its low bytes, higher ones zero. Bits that do not fit are dropped.
    pub const fn raw(self, value: i64) -> u32 {
        value as u32 & self.mask()
    }

    /// Which bits of a cell the type uses.
    pub const fn mask(self) -> u32 {
        u32::MAX >> self.unused_bits()
    }

    /// High bits of a cell that the type leaves zero.
    const fn unused_bits(self) -> u32 {
        match self.size() {
            1 => 24,
            2 => 16,
            _ => 0,
        }
    }

    /// Smallest and largest number of the type.
    pub const fn range(self) -> (i64, i64) {
        match self {
            Self::Integer8 => (i8::MIN as i64, i8::MAX as i64),
            Self::Integer16 => (i16::MIN as i64, i16::MAX as i64),
            Self::Integer32 => (i32::MIN as i64, i32::MAX as i64),
            Self::Unsigned8 => (0, u8::MAX as i64),
            Self::Unsigned16 => (0, u16::MAX as i64),
            Self::Unsigned32 | Self::VisibleString => (0, u32::MAX as i64),
        }
    }
}

/// A Rust number that an object can hold.
pub trait Scalar: Copy {
    /// The object's data type.
    const DATA_TYPE: DataType;
    /// From the low bytes of a cell.
    fn from_raw(raw: u32) -> Self;
    /// To a cell, higher bytes zero.
    fn to_raw(self) -> u32;
}

macro_rules! scalar {
    ($($rust:ty, $unsigned:ty => $data_type:ident;)*) => {$(
        impl Scalar for $rust {
            const DATA_TYPE: DataType = DataType::$data_type;
            fn from_raw(raw: u32) -> Self {
                raw as Self
            }
            fn to_raw(self) -> u32 {
                self as $unsigned as u32
            }
        }
    )*};
}

scalar! {
    i8, u8 => Integer8;
    i16, u16 => Integer16;
    i32, u32 => Integer32;
    u8, u8 => Unsigned8;
    u16, u16 => Unsigned16;
    u32, u32 => Unsigned32;
}
