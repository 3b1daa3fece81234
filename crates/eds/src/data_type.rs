//! Data types as an EDS names them: by code.

use std::fmt;

/// The code of a data type. Source: CiA 301, table 44.
///
/// Open: a file may name any code; [`is_known`](Self::is_known) distinguishes those of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TypeCode(pub u16);

/// How values of a type are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A whole number of so many bits.
    Integer {
        /// 1 to 64.
        bits: u8,
        /// Two's complement.
        signed: bool,
    },
    /// A number with a decimal point, of 32 or 64 bits.
    Real {
        /// 32 or 64.
        bits: u8,
    },
    /// Text, or bytes that stand there as text.
    Text,
    /// Days and milliseconds.
    Time,
    /// A record of several values: never that of one variable.
    Record,
}

impl TypeCode {
    /// BOOLEAN.
    pub const BOOLEAN: Self = Self(0x01);
    /// INTEGER8.
    pub const INTEGER8: Self = Self(0x02);
    /// INTEGER16.
    pub const INTEGER16: Self = Self(0x03);
    /// INTEGER32.
    pub const INTEGER32: Self = Self(0x04);
    /// UNSIGNED8.
    pub const UNSIGNED8: Self = Self(0x05);
    /// UNSIGNED16.
    pub const UNSIGNED16: Self = Self(0x06);
    /// UNSIGNED32.
    pub const UNSIGNED32: Self = Self(0x07);
    /// REAL32.
    pub const REAL32: Self = Self(0x08);
    /// VISIBLE_STRING.
    pub const VISIBLE_STRING: Self = Self(0x09);
    /// OCTET_STRING.
    pub const OCTET_STRING: Self = Self(0x0A);
    /// UNICODE_STRING.
    pub const UNICODE_STRING: Self = Self(0x0B);
    /// TIME_OF_DAY.
    pub const TIME_OF_DAY: Self = Self(0x0C);
    /// TIME_DIFFERENCE.
    pub const TIME_DIFFERENCE: Self = Self(0x0D);
    /// DOMAIN.
    pub const DOMAIN: Self = Self(0x0F);
    /// REAL64.
    pub const REAL64: Self = Self(0x11);
    /// INTEGER64.
    pub const INTEGER64: Self = Self(0x15);
    /// UNSIGNED64.
    pub const UNSIGNED64: Self = Self(0x1B);

    /// True for a code of the standard that one variable may have.
    pub const fn is_known(self) -> bool {
        !matches!(self.form(), None | Some(Form::Record))
    }

    /// How values are written; `None` for a code that the standard does not have.
    pub const fn form(self) -> Option<Form> {
        let (bits, signed) = match self.0 {
            0x01 => (1, false),
            0x02 => (8, true),
            0x03 => (16, true),
            0x04 => (32, true),
            0x05 => (8, false),
            0x06 => (16, false),
            0x07 => (32, false),
            0x08 => return Some(Form::Real { bits: 32 }),
            0x09..=0x0B | 0x0F => return Some(Form::Text),
            0x0C | 0x0D => return Some(Form::Time),
            0x10 => (24, true),
            0x11 => return Some(Form::Real { bits: 64 }),
            0x12 => (40, true),
            0x13 => (48, true),
            0x14 => (56, true),
            0x15 => (64, true),
            0x16 => (24, false),
            0x18 => (40, false),
            0x19 => (48, false),
            0x1A => (56, false),
            0x1B => (64, false),
            0x20..=0x23 => return Some(Form::Record),
            _ => return None,
        };
        Some(Form::Integer { bits, signed })
    }

    /// Smallest and largest whole number of the type; `None` for a type of others.
    pub const fn range(self) -> Option<(i128, i128)> {
        match self.form() {
            Some(Form::Integer { bits, signed: true }) => Some((-(1 << (bits - 1)), (1 << (bits - 1)) - 1)),
            Some(Form::Integer { bits, signed: false }) => Some((0, (1 << bits) - 1)),
            _ => None,
        }
    }

    /// Bits in a PDO; `None` for what has no fixed length.
    pub const fn bits(self) -> Option<u8> {
        match self.form() {
            Some(Form::Integer { bits, .. } | Form::Real { bits }) => Some(bits),
            Some(Form::Time) => Some(48),
            _ => None,
        }
    }

    /// As the standard prints it; `None` for a code that it does not have.
    pub const fn name(self) -> Option<&'static str> {
        Some(match self.0 {
            0x01 => "BOOLEAN",
            0x02 => "INTEGER8",
            0x03 => "INTEGER16",
            0x04 => "INTEGER32",
            0x05 => "UNSIGNED8",
            0x06 => "UNSIGNED16",
            0x07 => "UNSIGNED32",
            0x08 => "REAL32",
            0x09 => "VISIBLE_STRING",
            0x0A => "OCTET_STRING",
            0x0B => "UNICODE_STRING",
            0x0C => "TIME_OF_DAY",
            0x0D => "TIME_DIFFERENCE",
            0x0F => "DOMAIN",
            0x10 => "INTEGER24",
            0x11 => "REAL64",
            0x12 => "INTEGER40",
            0x13 => "INTEGER48",
            0x14 => "INTEGER56",
            0x15 => "INTEGER64",
            0x16 => "UNSIGNED24",
            0x18 => "UNSIGNED40",
            0x19 => "UNSIGNED48",
            0x1A => "UNSIGNED56",
            0x1B => "UNSIGNED64",
            0x20 => "PDO_COMMUNICATION_PARAMETER",
            0x21 => "PDO_MAPPING",
            0x22 => "SDO_PARAMETER",
            0x23 => "IDENTITY",
            _ => return None,
        })
    }
}

impl fmt::Display for TypeCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => f.write_str(name),
            None => write!(f, "type {:04X}h", self.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_those_of_the_types() {
        assert_eq!(TypeCode::INTEGER8.range(), Some((-128, 127)));
        assert_eq!(TypeCode::BOOLEAN.range(), Some((0, 1)));
        assert_eq!(TypeCode::INTEGER64.range(), Some((i64::MIN.into(), i64::MAX.into())));
        assert_eq!(TypeCode::UNSIGNED64.range(), Some((0, u64::MAX.into())));
        assert_eq!(TypeCode(0x10).range(), Some((-0x80_0000, 0x7F_FFFF)));
        assert_eq!(TypeCode::REAL32.range(), None);
    }

    #[test]
    fn names_and_forms_belong_to_the_same_codes() {
        for code in 0..=u16::MAX {
            assert_eq!(TypeCode(code).name().is_some(), TypeCode(code).form().is_some(), "{code:04X}h");
        }
        assert_eq!(TypeCode(0x47).to_string(), "type 0047h");
        assert!(!TypeCode(0x21).is_known() && TypeCode::DOMAIN.is_known());
    }
}
