//! Values as text, and the bytes that they are on the bus (CiA 301, 7.1.4: little-endian).

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;

/// How a value is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GatewayType {
    /// `b`: 0 or 1.
    Boolean,
    /// `u8` to `u64`: bytes.
    Unsigned(u8),
    /// `i8` to `i64`: bytes.
    Integer(u8),
    /// `x8` to `x64`: as unsigned, shown in hexadecimal.
    Hexadecimal(u8),
    /// `r32`.
    Real32,
    /// `r64`.
    Real64,
    /// `vs`: a text, in quotes where it has spaces.
    VisibleString,
    /// `os`, `us`, `d`, `t`, `td`: bytes in base64 (RFC 2045).
    Bytes,
}

impl GatewayType {
    /// The type of this name, in any case.
    pub fn named(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase();
        let bits = |digits: &str| {
            let bits: u8 = digits.parse().ok()?;
            (bits.is_multiple_of(8) && (8..=64).contains(&bits)).then_some(bits / 8)
        };
        match &*name {
            "b" => Some(Self::Boolean),
            "r32" => Some(Self::Real32),
            "r64" => Some(Self::Real64),
            "vs" => Some(Self::VisibleString),
            "os" | "us" | "d" | "t" | "td" => Some(Self::Bytes),
            _ => match name.split_at_checked(1)? {
                ("u", digits) => bits(digits).map(Self::Unsigned),
                ("i", digits) => bits(digits).map(Self::Integer),
                ("x", digits) => bits(digits).map(Self::Hexadecimal),
                _ => None,
            },
        }
    }

    /// Bytes of a value; `None` where they may be any number.
    pub const fn size(self) -> Option<usize> {
        match self {
            Self::Boolean => Some(1),
            Self::Unsigned(bytes) | Self::Integer(bytes) | Self::Hexadecimal(bytes) => Some(bytes as usize),
            Self::Real32 => Some(4),
            Self::Real64 => Some(8),
            Self::VisibleString | Self::Bytes => None,
        }
    }

    /// The bytes of a value; `None` if the text is not of this type, or too large for it.
    pub fn bytes(self, text: &str) -> Option<Vec<u8>> {
        match self {
            Self::Boolean => match text {
                "0" | "1" => Some(vec![text.as_bytes()[0] - b'0']),
                _ => None,
            },
            Self::Unsigned(bytes) | Self::Hexadecimal(bytes) => {
                let value = unsigned(text)?;
                (bytes == 8 || value >> (8 * bytes) == 0).then(|| value.to_le_bytes()[..usize::from(bytes)].to_vec())
            }
            Self::Integer(bytes) => {
                let value: i64 = match text.strip_prefix('-') {
                    Some(digits) => i64::try_from(-i128::from(unsigned(digits)?)).ok()?,
                    None => i64::try_from(unsigned(text)?).ok()?,
                };
                let unused = 64 - 8 * u32::from(bytes);
                (value << unused >> unused == value).then(|| value.to_le_bytes()[..usize::from(bytes)].to_vec())
            }
            Self::Real32 => text.parse::<f32>().ok().map(|value| value.to_le_bytes().to_vec()),
            Self::Real64 => text.parse::<f64>().ok().map(|value| value.to_le_bytes().to_vec()),
            Self::VisibleString => Some(text.as_bytes().to_vec()),
            Self::Bytes => BASE64.decode(text).ok(),
        }
    }

    /// The text of a value; `None` if the bytes are not as long as one of this type.
    pub fn text(self, bytes: &[u8]) -> Option<String> {
        if self.size().is_some_and(|size| size != bytes.len()) {
            return None;
        }
        let mut wide = [0; 8];
        let used = bytes.len().min(8);
        wide[..used].copy_from_slice(&bytes[..used]);
        let raw = u64::from_le_bytes(wide);
        Some(match self {
            Self::Boolean => u64::from(raw != 0).to_string(),
            Self::Unsigned(_) => raw.to_string(),
            Self::Hexadecimal(bytes) => format!("0x{raw:0width$X}", width = 2 * usize::from(bytes)),
            Self::Integer(bytes) => {
                let unused = 64 - 8 * u32::from(bytes);
                (((raw << unused) as i64) >> unused).to_string()
            }
            Self::Real32 => f32::from_bits(raw as u32).to_string(),
            Self::Real64 => f64::from_bits(raw).to_string(),
            Self::VisibleString => quoted(&String::from_utf8_lossy(bytes)),
            Self::Bytes => BASE64.encode(bytes),
        })
    }
}

/// Decimal, or hexadecimal behind `0x`.
pub(super) fn unsigned(text: &str) -> Option<u64> {
    let hexadecimal = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"));
    let digits = hexadecimal.unwrap_or(text);
    // The parser of numbers would take a sign.
    if !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return None;
    }
    u64::from_str_radix(digits, if hexadecimal.is_some() { 16 } else { 10 }).ok()
}

/// In quotes, with those inside doubled, if it has spaces or quotes; without what would end the line.
fn quoted(text: &str) -> String {
    let text: String =
        text.trim_end_matches('\0').chars().map(|char| if char.is_control() { '?' } else { char }).collect();
    if text.is_empty() || text.contains([' ', '"', '#']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_bytes_and_come_back() {
        for (name, text, bytes) in [
            ("b", "1", &[1][..]),
            ("u8", "255", &[0xFF]),
            ("u16", "4660", &[0x34, 0x12]),
            ("u24", "66051", &[3, 2, 1]),
            ("u64", "18446744073709551615", &[0xFF; 8]),
            ("i8", "-128", &[0x80]),
            ("i16", "-2", &[0xFE, 0xFF]),
            ("i24", "-1", &[0xFF; 3]),
            ("i64", "-9223372036854775808", &[0, 0, 0, 0, 0, 0, 0, 0x80]),
            ("X32", "0x00020192", &[0x92, 0x01, 0x02, 0x00]),
            ("r32", "1.5", &[0, 0, 0xC0, 0x3F]),
            ("vs", "ZLAC", b"ZLAC"),
            ("vs", "\"a \"\"b\"\"\"", b"a \"b\""),
            ("d", "AQID", &[1, 2, 3]),
        ] {
            let kind = GatewayType::named(name).unwrap_or_else(|| panic!("{name}"));
            assert_eq!(kind.text(bytes).as_deref(), Some(text), "{name}");
            if !text.contains('"') {
                assert_eq!(kind.bytes(text).as_deref(), Some(bytes), "{name} {text}");
            }
        }
        assert_eq!(GatewayType::Unsigned(2).bytes("0x1234"), Some(vec![0x34, 0x12]));
    }

    #[test]
    fn what_is_no_value_of_its_type_is_refused() {
        for (name, text) in [
            ("b", "2"),
            ("u8", "256"),
            ("u8", "-1"),
            ("u8", "+1"),
            ("u8", ""),
            ("u8", "0x"),
            ("u16", "0x10000"),
            ("i8", "128"),
            ("i8", "-129"),
            ("i64", "9223372036854775808"),
            ("u64", "18446744073709551616"),
            ("r32", "fast"),
            ("d", "?"),
        ] {
            assert_eq!(GatewayType::named(name).unwrap().bytes(text), None, "{name} {text}");
        }
        for name in ["", "u", "u7", "u0", "u72", "i", "z8", "ü8", "real32"] {
            assert_eq!(GatewayType::named(name), None, "{name}");
        }
        assert_eq!(GatewayType::Unsigned(2).text(&[1]), None);
    }
}
