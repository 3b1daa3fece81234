//! Datagrams in candump's notation, and patterns of those that answer them: `604#2F60600003000000`, `481#........3704`.

use can::Frame;

/// A frame that is expected: its identifier, and its bytes, of which `..` is any.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pattern {
    pub(super) id: u16,
    bytes: Vec<Option<u8>>,
}

impl Pattern {
    /// From text; `None` if it is not a pattern.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let (id, data) = text.split_once('#')?;
        let pairs = (0..data.len()).step_by(2).map(|at| data.get(at..at + 2));
        let byte = |pair: Option<&str>| match pair? {
            ".." => Some(None),
            digits => u8::from_str_radix(digits, 16).ok().map(Some),
        };
        Some(Self { id: u16::from_str_radix(id, 16).ok()?, bytes: pairs.map(byte).collect::<Option<_>>()? })
    }

    /// Whether a frame is so.
    pub(super) fn fits(&self, frame: &Frame) -> bool {
        let data = frame.data();
        let same = |(expected, byte): (&Option<u8>, &u8)| expected.is_none_or(|it| it == *byte);
        frame.standard_data_id() == Some(self.id)
            && self.bytes.len() == data.len()
            && self.bytes.iter().zip(data).all(same)
    }

    /// The bytes in hexadecimal.
    pub(super) fn data(&self) -> String {
        self.bytes.iter().map(|byte| byte.map_or_else(|| "..".into(), |byte| format!("{byte:02X}"))).collect()
    }

    /// What an SDO answer of this pattern means for the reader of a table.
    pub(super) fn meaning(&self) -> String {
        match self.bytes[..] {
            [Some(0x80), _, _, _, Some(a), Some(b), Some(c), Some(d)] => {
                format!("abort {:04X} {:04X}h", u16::from_le_bytes([c, d]), u16::from_le_bytes([a, b]))
            }
            _ => self.data(),
        }
    }

    /// The bytes of a frame that stand where the pattern leaves them open, as a number: little-endian and signed.
    pub(super) fn open_number(&self, frame: &Frame) -> i64 {
        let open = self.bytes.iter().zip(frame.data()).filter(|(expected, _)| expected.is_none());
        let bytes: Vec<u8> = open.map(|(_, byte)| *byte).collect();
        let fill = if bytes.last().is_some_and(|byte| byte & 0x80 != 0) { 0xFF } else { 0 };
        let mut wide = [fill; 8];
        wide.iter_mut().zip(bytes).for_each(|(to, from)| *to = from);
        i64::from_le_bytes(wide)
    }
}

/// Bytes in hexadecimal.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pattern(text: &str) -> Pattern {
        Pattern::parse(text).expect("a pattern")
    }

    #[test]
    fn points_stand_for_any_byte_and_identifier_and_length_must_agree() {
        let expected = pattern("481#....3704");
        let fits = |text: &str| expected.fits(&text.parse().expect("a frame"));
        assert!(fits("481#01023704"));
        assert!(!fits("481#01023705") && !fits("481#0102370400") && !fits("482#01023704"));
        assert_eq!(expected.data(), "....3704");
        assert_eq!(expected.open_number(&"481#FEFF3704".parse().expect("a frame")), -2);
        assert!(Pattern::parse("481#0").is_none() && Pattern::parse("48x#00").is_none());
    }

    #[test]
    fn an_abort_is_reported_by_its_code() {
        assert_eq!(pattern("584#8016100000000206").meaning(), "abort 0602 0000h");
        assert_eq!(pattern("584#6040600000000000").meaning(), "6040600000000000");
    }
}
