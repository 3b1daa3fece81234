/// Data type of an object. Source: CiA 301, table 44 (codes), clause 7.1 (encoding: little endian).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DataType {
    /// BOOLEAN, code 1: one bit in a PDO, one byte in an SDO.
    Boolean,
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
    /// REAL32, code 8: IEEE 754 single precision.
    Real32,
    /// VISIBLE_STRING, code 9: bytes 20h to 7Eh.
    VisibleString,
    /// OCTET_STRING, code Ah.
    OctetString,
    /// UNICODE_STRING, code Bh: UNSIGNED16 each.
    UnicodeString,
    /// TIME_OF_DAY, code Ch: milliseconds after midnight in 28 bits, 4 bits of nothing, days since 1 January 1984 in 16.
    TimeOfDay,
    /// TIME_DIFFERENCE, code Dh: milliseconds in 28 bits, 4 bits of nothing, days in 16.
    TimeDifference,
    /// DOMAIN, code Fh: any number of bytes.
    Domain,
    /// INTEGER24, code 10h.
    Integer24,
    /// REAL64, code 11h: IEEE 754 double precision.
    Real64,
    /// INTEGER40, code 12h.
    Integer40,
    /// INTEGER48, code 13h.
    Integer48,
    /// INTEGER56, code 14h.
    Integer56,
    /// INTEGER64, code 15h.
    Integer64,
    /// UNSIGNED24, code 16h.
    Unsigned24,
    /// UNSIGNED40, code 18h.
    Unsigned40,
    /// UNSIGNED48, code 19h.
    Unsigned48,
    /// UNSIGNED56, code 1Ah.
    Unsigned56,
    /// UNSIGNED64, code 1Bh.
    Unsigned64,
}

/// What a type's values are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// BOOLEAN and UNSIGNED: a number from 0 on.
    Unsigned,
    /// INTEGER: a number in two's complement.
    Signed,
    /// REAL.
    Real,
    /// TIME_OF_DAY and TIME_DIFFERENCE.
    Time,
    /// A string or DOMAIN: as many bytes as there are.
    Bytes,
}

/// A row for each type: how the standard numbers and spells it, what its values are, and how many bits.
macro_rules! data_types {
    ($($variant:ident = $code:literal, $name:literal, $kind:ident, $bits:literal;)*) => {
        impl DataType {
            /// All of them, by code.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// The code of the type in EDS files and in the dictionary's index area 0001h to 001Bh.
            pub const fn code(self) -> u16 {
                match self { $(Self::$variant => $code,)* }
            }

            /// The type of a code; `None` for reserved codes and those of records (20h and more).
            pub const fn from_code(code: u16) -> Option<Self> {
                match code { $($code => Some(Self::$variant),)* _ => None }
            }

            /// The name as the standard prints it.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// What its values are.
            pub const fn kind(self) -> Kind {
                match self { $(Self::$variant => Kind::$kind,)* }
            }

            /// Bits, as a mapping record states them; 0 for strings and DOMAIN, whose length is the value's.
            pub const fn bits(self) -> u8 {
                match self { $(Self::$variant => $bits,)* }
            }
        }
    };
}

data_types! {
    Boolean = 0x01, "BOOLEAN", Unsigned, 1;
    Integer8 = 0x02, "INTEGER8", Signed, 8;
    Integer16 = 0x03, "INTEGER16", Signed, 16;
    Integer32 = 0x04, "INTEGER32", Signed, 32;
    Unsigned8 = 0x05, "UNSIGNED8", Unsigned, 8;
    Unsigned16 = 0x06, "UNSIGNED16", Unsigned, 16;
    Unsigned32 = 0x07, "UNSIGNED32", Unsigned, 32;
    Real32 = 0x08, "REAL32", Real, 32;
    VisibleString = 0x09, "VISIBLE_STRING", Bytes, 0;
    OctetString = 0x0A, "OCTET_STRING", Bytes, 0;
    UnicodeString = 0x0B, "UNICODE_STRING", Bytes, 0;
    TimeOfDay = 0x0C, "TIME_OF_DAY", Time, 48;
    TimeDifference = 0x0D, "TIME_DIFFERENCE", Time, 48;
    Domain = 0x0F, "DOMAIN", Bytes, 0;
    Integer24 = 0x10, "INTEGER24", Signed, 24;
    Real64 = 0x11, "REAL64", Real, 64;
    Integer40 = 0x12, "INTEGER40", Signed, 40;
    Integer48 = 0x13, "INTEGER48", Signed, 48;
    Integer56 = 0x14, "INTEGER56", Signed, 56;
    Integer64 = 0x15, "INTEGER64", Signed, 64;
    Unsigned24 = 0x16, "UNSIGNED24", Unsigned, 24;
    Unsigned40 = 0x18, "UNSIGNED40", Unsigned, 40;
    Unsigned48 = 0x19, "UNSIGNED48", Unsigned, 48;
    Unsigned56 = 0x1A, "UNSIGNED56", Unsigned, 56;
    Unsigned64 = 0x1B, "UNSIGNED64", Unsigned, 64;
}

impl DataType {
    /// Bytes on the wire; 0 for strings and DOMAIN, whose length is the value's.
    pub const fn size(self) -> usize {
        (self.bits() as usize).div_ceil(8)
    }

    /// True for the INTEGER types.
    pub const fn is_signed(self) -> bool {
        matches!(self.kind(), Kind::Signed)
    }

    /// True for BOOLEAN, INTEGER and UNSIGNED: its values are whole numbers.
    pub const fn is_integer(self) -> bool {
        matches!(self.kind(), Kind::Signed | Kind::Unsigned)
    }

    /// True if a value fits a 32-bit cell: integers and reals of up to 32 bits.
    pub const fn fits_cell(self) -> bool {
        self.bits() > 0 && self.bits() <= 32
    }

    /// The number that the low [`size`](Self::size) bytes of `raw` stand for; of a type that
    /// [fits a cell](Self::fits_cell) and is not REAL32. See [`Value`](super::Value) for all types.
    pub const fn value(self, raw: u32) -> i64 {
        let unused = self.unused_bits();
        if self.is_signed() { ((raw << unused) as i32 >> unused) as i64 } else { (raw << unused >> unused) as i64 }
    }

    /// The cell for `value`: its low bytes, higher ones zero. Bits that do not fit are dropped.
    pub const fn raw(self, value: i64) -> u32 {
        value as u32 & self.mask()
    }

    /// Which bits of a cell the type's bytes use; all of them for a type that does not fit one.
    pub const fn mask(self) -> u32 {
        u32::MAX >> self.unused_bits()
    }

    /// High bits of a cell that the type leaves zero.
    const fn unused_bits(self) -> u32 {
        match self.size() {
            1 => 24,
            2 => 16,
            3 => 8,
            _ => 0,
        }
    }

    /// Smallest and largest number of an integer type. UNSIGNED64 goes on beyond the largest `i64`, which is given for it;
    /// (0, 0) for other types.
    pub const fn range(self) -> (i64, i64) {
        let bits = self.bits() as u32;
        match self.kind() {
            Kind::Signed => (i64::MIN >> (64 - bits), i64::MAX >> (64 - bits)),
            Kind::Unsigned if bits == 64 => (0, i64::MAX),
            Kind::Unsigned => (0, (1 << bits) - 1),
            _ => (0, 0),
        }
    }
}

/// A Rust number that an object can hold.
pub trait Held: Copy {
    /// The object's data type.
    const DATA_TYPE: DataType;
}

/// A number that fits a cell.
pub trait Scalar: Held {
    /// From the low bytes of a cell.
    fn from_raw(raw: u32) -> Self;
    /// To a cell, higher bytes zero.
    fn to_raw(self) -> u32;
}

macro_rules! scalar {
    ($($rust:ty, $unsigned:ty => $data_type:ident;)*) => {$(
        impl Held for $rust {
            const DATA_TYPE: DataType = DataType::$data_type;
        }

        impl Scalar for $rust {
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

impl Held for bool {
    const DATA_TYPE: DataType = DataType::Boolean;
}

impl Scalar for bool {
    fn from_raw(raw: u32) -> Self {
        raw & 1 != 0
    }
    fn to_raw(self) -> u32 {
        self.into()
    }
}

impl Held for f32 {
    const DATA_TYPE: DataType = DataType::Real32;
}

impl Scalar for f32 {
    fn from_raw(raw: u32) -> Self {
        Self::from_bits(raw)
    }
    fn to_raw(self) -> u32 {
        self.to_bits()
    }
}

/// A number of 64 bits.
pub trait LongScalar: Held {
    /// From the bytes as an SDO carries them.
    fn from_bytes(bytes: [u8; 8]) -> Self;
    /// The bytes as an SDO carries them.
    fn to_bytes(self) -> [u8; 8];
}

macro_rules! long_scalar {
    ($($rust:ty => $data_type:ident;)*) => {$(
        impl Held for $rust {
            const DATA_TYPE: DataType = DataType::$data_type;
        }

        impl LongScalar for $rust {
            fn from_bytes(bytes: [u8; 8]) -> Self {
                Self::from_le_bytes(bytes)
            }
            fn to_bytes(self) -> [u8; 8] {
                self.to_le_bytes()
            }
        }
    )*};
}

long_scalar! {
    i64 => Integer64;
    u64 => Unsigned64;
    f64 => Real64;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_leads_to_its_type_and_reserved_codes_to_none() {
        let known = (0..=0x40).filter_map(DataType::from_code).count();
        assert_eq!((known, DataType::ALL.len()), (25, 25));
        for data_type in DataType::ALL {
            assert_eq!(DataType::from_code(data_type.code()), Some(*data_type));
        }
        for reserved in [0x00, 0x0E, 0x17, 0x1C, 0x20, 0xFFFF] {
            assert_eq!(DataType::from_code(reserved), None);
        }
    }

    #[test]
    fn names_say_how_many_bits_a_number_has() {
        for data_type in DataType::ALL {
            let digits = data_type.name().trim_start_matches(|letter: char| !letter.is_ascii_digit());
            if let Ok(bits) = digits.parse::<u8>() {
                assert_eq!(data_type.bits(), bits, "{data_type:?}");
            }
        }
    }

    #[test]
    fn ranges_are_those_of_two_s_complement() {
        assert_eq!(DataType::Boolean.range(), (0, 1));
        assert_eq!(DataType::Integer24.range(), (-8_388_608, 8_388_607));
        assert_eq!(DataType::Unsigned24.range(), (0, 16_777_215));
        assert_eq!(DataType::Integer40.range(), (-549_755_813_888, 549_755_813_887));
        assert_eq!(DataType::Unsigned56.range(), (0, 72_057_594_037_927_935));
        assert_eq!(DataType::Integer64.range(), (i64::MIN, i64::MAX));
        assert_eq!(DataType::Integer24.value(0x80_0000), -8_388_608);
        assert_eq!(DataType::Unsigned24.value(0xFF80_0000), 0x80_0000);
    }
}
