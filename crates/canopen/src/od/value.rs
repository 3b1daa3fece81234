use super::{DataType, Kind};

/// A value of any data type. Source: CiA 301, 7.1.4 to 7.1.6.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// BOOLEAN, INTEGER and UNSIGNED; UNSIGNED64 up to the largest `i64`.
    Integer(i64),
    /// UNSIGNED64 beyond the largest `i64`.
    Unsigned(u64),
    /// REAL32.
    Real32(f32),
    /// REAL64.
    Real64(f64),
    /// TIME_OF_DAY and TIME_DIFFERENCE.
    Time {
        /// Milliseconds, 28 bits.
        millis: u32,
        /// Days.
        days: u16,
    },
    /// Strings and DOMAIN, as they are.
    Bytes(&'a [u8]),
}

/// Most bytes of a value that is neither a string nor a DOMAIN.
pub const MAX_NUMBER: usize = 8;

/// The bits of a time's first four bytes that are milliseconds.
const MILLIS_MASK: u32 = 0x0FFF_FFFF;

impl<'a> Value<'a> {
    /// The value that `bytes` are, as an SDO carries them; `None` if they are not as many as the type has, or half a letter
    /// of a UNICODE_STRING.
    pub fn parse(data_type: DataType, bytes: &'a [u8]) -> Option<Self> {
        if data_type.kind() == Kind::Bytes {
            let whole = data_type != DataType::UnicodeString || bytes.len().is_multiple_of(2);
            return whole.then_some(Self::Bytes(bytes));
        }
        let size = data_type.size();
        let mut all = [0; MAX_NUMBER];
        all.get_mut(..size).filter(|_| bytes.len() == size)?.copy_from_slice(bytes);
        Some(Self::of_bits(data_type, u64::from_le_bytes(all)))
    }

    /// The number in the low bits of `bits`, of a type that is neither a string nor DOMAIN.
    pub(crate) fn of_bits(data_type: DataType, bits: u64) -> Value<'static> {
        let unused = u64::BITS - 8 * data_type.size() as u32;
        match data_type.kind() {
            Kind::Signed => Value::Integer((bits << unused) as i64 >> unused),
            Kind::Unsigned => {
                let value = bits << unused >> unused;
                i64::try_from(value).map_or(Value::Unsigned(value), Value::Integer)
            }
            Kind::Real if data_type.size() == 4 => Value::Real32(f32::from_bits(bits as u32)),
            Kind::Real => Value::Real64(f64::from_bits(bits)),
            Kind::Time => Value::Time { millis: bits as u32 & MILLIS_MASK, days: (bits >> 32) as u16 },
            Kind::Bytes => Value::Bytes(&[]),
        }
    }

    /// The value as an SDO carries it, in its low bytes. `None` where it is not a value of the type; strings and DOMAIN are
    /// their own bytes.
    pub fn to_bits(self, data_type: DataType) -> Option<u64> {
        let mask = u64::MAX >> (u64::BITS - 8 * data_type.size().max(1) as u32);
        match (self, data_type.kind()) {
            (Self::Integer(value), Kind::Signed | Kind::Unsigned) => {
                let (low, high) = data_type.range();
                (low..=high).contains(&value).then_some(value as u64 & mask)
            }
            (Self::Unsigned(value), Kind::Unsigned) => (data_type == DataType::Unsigned64).then_some(value),
            (Self::Real32(value), Kind::Real) if data_type == DataType::Real32 => Some(value.to_bits().into()),
            (Self::Real64(value), Kind::Real) if data_type == DataType::Real64 => Some(value.to_bits()),
            (Self::Time { millis, days }, Kind::Time) if millis <= MILLIS_MASK => {
                Some(u64::from(days) << 32 | u64::from(millis))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    /// A generator whose numbers are the same each time (xorshift64, Marsaglia 2003).
    fn numbers(mut state: u64) -> impl Iterator<Item = u64> {
        core::iter::from_fn(move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            Some(state)
        })
    }

    #[test]
    fn what_is_parsed_is_emitted_again_for_every_type_and_any_bits() {
        for data_type in DataType::ALL.iter().filter(|data_type| data_type.kind() != Kind::Bytes) {
            let size = data_type.size();
            for bits in numbers(0x1234_5678).take(500).chain([0, u64::MAX]) {
                let bits = bits & (u64::MAX >> (64 - 8 * size));
                let bytes = &bits.to_le_bytes()[..size];
                let value = Value::parse(*data_type, bytes).unwrap();
                let again = value.to_bits(*data_type);
                let expected = match data_type {
                    DataType::Boolean if bits > 1 => None,
                    DataType::TimeOfDay | DataType::TimeDifference => Some(bits & 0xFFFF_0FFF_FFFF),
                    _ => Some(bits),
                };
                assert_eq!(again, expected, "{data_type:?} {bits:#X}");
                assert_eq!(Value::parse(*data_type, &bits.to_le_bytes()[..size - 1]), None);
            }
        }
    }

    /// CiA 301, 7.1.4.4: INTEGER; IEEE 754: 1.0 and -2.5; 7.1.6.5: noon of 2 January 1984.
    #[test]
    fn bytes_read_as_the_standard_says() {
        let parse = Value::parse;
        assert_eq!(parse(DataType::Integer24, &[0xFF, 0xFF, 0xFF]), Some(Value::Integer(-1)));
        assert_eq!(parse(DataType::Integer40, &[0, 0, 0, 0, 0x80]), Some(Value::Integer(-549_755_813_888)));
        assert_eq!(parse(DataType::Unsigned56, &[1, 0, 0, 0, 0, 0, 0x80]), Some(Value::Integer(0x80_0000_0000_0001)));
        assert_eq!(parse(DataType::Unsigned64, &[0xFF; 8]), Some(Value::Unsigned(u64::MAX)));
        assert_eq!(parse(DataType::Real32, &[0, 0, 0x80, 0x3F]), Some(Value::Real32(1.0)));
        assert_eq!(parse(DataType::Real64, &[0, 0, 0, 0, 0, 0, 4, 0xC0]), Some(Value::Real64(-2.5)));
        let noon = parse(DataType::TimeOfDay, &[0x00, 0x2E, 0x93, 0x02, 1, 0]);
        assert_eq!(noon, Some(Value::Time { millis: 43_200_000, days: 1 }));
        assert_eq!(parse(DataType::UnicodeString, b"a\0b"), None);
    }
}
