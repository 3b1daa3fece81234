//! Datagrams as manuals print them: bytes in hexadecimal with blanks between, and patterns of the answers.

use can::{CanId, Frame};

/// The bytes of an SDO: an answer always has eight.
const SDO_BYTES: usize = 8;

/// Bytes that a datagram must have; `None` is any byte.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pattern(Vec<Option<u8>>);

impl Pattern {
    /// From text: `37 04 .. ..`, where `..` is any byte.
    pub(super) fn new(text: &str) -> Self {
        Self(pairs(text).map(|pair| u8::from_str_radix(&pair, 16).ok()).collect())
    }

    /// An answer of an SDO server, filled up with zeros where fewer bytes are printed.
    pub(super) fn sdo(text: &str) -> Self {
        let Self(mut bytes) = Self::new(text);
        bytes.resize(bytes.len().max(SDO_BYTES), Some(0));
        Self(bytes)
    }

    /// Whether `data` is so.
    pub(super) fn fits(&self, data: &[u8]) -> bool {
        self.0.len() == data.len() && self.0.iter().zip(data).all(|(wanted, byte)| wanted.is_none_or(|it| it == *byte))
    }

    /// In hexadecimal.
    pub(super) fn text(&self) -> String {
        self.0.iter().map(|byte| byte.map_or_else(|| "..".into(), |byte| format!("{byte:02X}"))).collect()
    }

    /// What an SDO answer of this pattern means for the reader of a table.
    pub(super) fn expectation(&self) -> String {
        match self.0[..] {
            [Some(0x80), _, _, _, Some(a), Some(b), Some(c), Some(d)] => {
                format!("abort {:04X} {:04X}h", u16::from_le_bytes([c, d]), u16::from_le_bytes([a, b]))
            }
            _ => self.text(),
        }
    }
}

/// The bytes of a datagram as printed: `2F 60 60 00 03 00 00 00`. Blanks may be left out.
pub(super) fn bytes(text: &str) -> Vec<u8> {
    pairs(text).map(|pair| u8::from_str_radix(&pair, 16).unwrap_or_default()).collect()
}

/// A frame as printed: `201 2F 00 01 50 C3 00 00`.
pub(super) fn frame(text: &str) -> Frame {
    let (id, data) = text.split_once(' ').unwrap_or((text, ""));
    Frame::new(CanId::standard(u16::from_str_radix(id, 16).unwrap_or_default()), &bytes(data))
}

/// Bytes in hexadecimal.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect()
}

fn pairs(text: &str) -> impl Iterator<Item = String> {
    let digits: Vec<char> = text.chars().filter(|digit| !digit.is_whitespace()).collect();
    (0..digits.len() / 2).map(move |n| digits[2 * n..2 * n + 2].iter().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_printed_short_stands_for_eight_bytes() {
        assert!(Pattern::sdo("60 40 60 00").fits(&[0x60, 0x40, 0x60, 0, 0, 0, 0, 0]));
        assert!(!Pattern::sdo("60 40 60 00").fits(&[0x60, 0x40, 0x60, 0]));
    }

    #[test]
    fn points_stand_for_any_byte_and_lengths_must_agree() {
        let pattern = Pattern::new(".. .. 37 04");
        assert!(
            pattern.fits(&[1, 2, 0x37, 4]) && !pattern.fits(&[1, 2, 0x37, 5]) && !pattern.fits(&[1, 2, 0x37, 4, 0])
        );
        assert_eq!(pattern.text(), "....3704");
    }

    #[test]
    fn an_abort_is_reported_by_its_code() {
        assert_eq!(Pattern::sdo("80 16 10 00 00 00 02 06").expectation(), "abort 0602 0000h");
        assert_eq!(Pattern::sdo("60 40 60 00").expectation(), "6040600000000000");
    }

    #[test]
    fn frames_read_as_printed() {
        assert_eq!(frame("201 2F 00 01 50 C3 00 00").to_string(), "201#2F000150C30000");
        assert_eq!(frame("80").to_string(), "080#");
        assert_eq!(bytes("2b40"), [0x2B, 0x40]);
    }
}
