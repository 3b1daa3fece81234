use core::fmt;
use core::str::FromStr;

/// Bit rate of a CAN bus in bit/s.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Bitrate(u32);

impl Bitrate {
    /// 1 Mbit/s, the highest rate of classical CAN.
    pub const M1: Self = Self(1_000_000);
    /// 500 kbit/s.
    pub const K500: Self = Self(500_000);
    /// 250 kbit/s.
    pub const K250: Self = Self(250_000);
    /// 125 kbit/s.
    pub const K125: Self = Self(125_000);
    /// 100 kbit/s.
    pub const K100: Self = Self(100_000);
    /// 50 kbit/s.
    pub const K50: Self = Self(50_000);

    /// A rate of 10 kbit/s to 1 Mbit/s that divides a second into whole nanoseconds per bit.
    pub const fn new(bits_per_second: u32) -> Option<Self> {
        let in_range = bits_per_second >= 10_000 && bits_per_second <= 1_000_000;
        if in_range && 1_000_000_000 % bits_per_second == 0 { Some(Self(bits_per_second)) } else { None }
    }

    /// The nominal bit rate in bit/s: 1 Mbit/s is 1,000,000.
    pub const fn bits_per_second(self) -> u32 {
        self.0
    }

    /// Duration of one bit in nanoseconds.
    pub const fn bit_nanos(self) -> u64 {
        1_000_000_000 / self.0 as u64
    }
}

/// `500k` or `1M`.
impl fmt::Display for Bitrate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            1_000_000 => f.write_str("1M"),
            rate if rate % 1_000 == 0 => write!(f, "{}k", rate / 1_000),
            rate => write!(f, "{rate}"),
        }
    }
}

/// A text that is not a bit rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParseBitrateError;

impl fmt::Display for ParseBitrateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("bit rate must be e.g. 500k, 1M or 125000, from 10k to 1M")
    }
}

impl core::error::Error for ParseBitrateError {}

impl FromStr for Bitrate {
    type Err = ParseBitrateError;

    fn from_str(text: &str) -> Result<Self, ParseBitrateError> {
        let (digits, factor) = match text.as_bytes().last() {
            Some(b'k' | b'K') => (&text[..text.len() - 1], 1_000),
            Some(b'M') => (&text[..text.len() - 1], 1_000_000),
            _ => (text, 1),
        };
        let value: u32 = digits.parse().map_err(|_| ParseBitrateError)?;
        value.checked_mul(factor).and_then(Self::new).ok_or(ParseBitrateError)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;

    #[test]
    fn parses_what_it_prints() {
        for text in ["1M", "500k", "250k", "125k", "100k", "50k", "20k", "10k"] {
            assert_eq!(text.parse::<Bitrate>().unwrap().to_string(), text);
        }
        for text in ["", "k", "2M", "5k", "abc", "500kk", "-500k", "300k"] {
            assert!(text.parse::<Bitrate>().is_err(), "{text:?}");
        }
    }
}
