use core::fmt;
use core::str::FromStr;

use crate::CanId;

/// Longest data field of a classical CAN frame, in bytes.
pub const MAX_DATA_LENGTH: usize = 8;

/// Data frame or remote frame (RTR bit).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrameKind {
    /// Carries 0 to 8 bytes.
    Data,
    /// Asks for a frame; carries a length but no bytes.
    Remote,
}

/// A classical CAN frame. Source: ISO 11898-1, 8.4.
///
/// Prints and parses as candump does: `604#4041600000000000`, `184#R4`, `00000604#` (extended).
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Frame {
    data: [u8; MAX_DATA_LENGTH],
    id: CanId,
    length: u8,
    kind: FrameKind,
}

impl Frame {
    /// A data frame. Bytes of `data` past the eighth are dropped.
    pub const fn new(id: CanId, data: &[u8]) -> Self {
        let length = if data.len() < MAX_DATA_LENGTH { data.len() } else { MAX_DATA_LENGTH };
        let mut bytes = [0; MAX_DATA_LENGTH];
        let mut i = 0;
        while i < length {
            bytes[i] = data[i];
            i += 1;
        }
        Self { data: bytes, id, length: length as u8, kind: FrameKind::Data }
    }

    /// A data frame with eight bytes.
    pub const fn full(id: CanId, data: [u8; MAX_DATA_LENGTH]) -> Self {
        Self { data, id, length: MAX_DATA_LENGTH as u8, kind: FrameKind::Data }
    }

    /// A data frame with the low `length` bytes (at most 8) of `bits`, the lowest byte first.
    pub const fn of_bits(id: CanId, bits: u64, length: u8) -> Self {
        let length = if length < MAX_DATA_LENGTH as u8 { length } else { MAX_DATA_LENGTH as u8 };
        let used = if length == 0 { 0 } else { u64::MAX >> (u64::BITS - length as u32 * 8) };
        Self { data: (bits & used).to_le_bytes(), id, length, kind: FrameKind::Data }
    }

    /// A remote frame asking for `length` bytes (at most 8).
    pub const fn remote(id: CanId, length: u8) -> Self {
        let length = if length < MAX_DATA_LENGTH as u8 { length } else { MAX_DATA_LENGTH as u8 };
        Self { data: [0; MAX_DATA_LENGTH], id, length, kind: FrameKind::Remote }
    }

    /// The identifier, of 11 or 29 bits.
    pub const fn id(&self) -> CanId {
        self.id
    }

    /// The 11 bits of a standard data frame; `None` for remote and extended frames.
    pub const fn standard_data_id(&self) -> Option<u16> {
        match self.kind {
            FrameKind::Data => self.id.as_standard(),
            FrameKind::Remote => None,
        }
    }

    /// Whether it is a data frame or a remote frame (RTR).
    pub const fn kind(&self) -> FrameKind {
        self.kind
    }

    /// True for a remote frame.
    pub const fn is_remote(&self) -> bool {
        matches!(self.kind, FrameKind::Remote)
    }

    /// Data length code, 0 to 8; for a remote frame the number of bytes asked for.
    pub const fn dlc(&self) -> u8 {
        self.length
    }

    /// The bytes carried; empty for a remote frame.
    pub fn data(&self) -> &[u8] {
        match self.kind {
            FrameKind::Data => &self.data[..self.length as usize],
            FrameKind::Remote => &[],
        }
    }

    /// The data field padded with zeros to eight bytes.
    pub const fn padded(&self) -> &[u8; MAX_DATA_LENGTH] {
        &self.data
    }

    /// Rank in arbitration: the frame with the lowest key wins the bus.
    ///
    /// The key is the arbitration field as sent: base identifier, RTR or SRR, IDE, identifier
    /// extension, RTR (ISO 11898-1, 8.4.2). Dominant bits are 0.
    pub const fn arbitration_key(&self) -> u32 {
        let remote = self.is_remote() as u32;
        let raw = self.id.raw();
        if self.id.is_extended() {
            // base (11) SRR=1 IDE=1 extension (18) RTR
            ((raw >> 18) << 21) | (0b11 << 19) | ((raw & 0x3_FFFF) << 1) | remote
        } else {
            // base (11) RTR IDE=0, then zeros
            (raw << 21) | (remote << 20)
        }
    }
}

impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}#", self.id)?;
        match self.kind {
            FrameKind::Remote => write!(f, "R{}", self.length),
            FrameKind::Data => self.data().iter().try_for_each(|byte| write!(f, "{byte:02X}")),
        }
    }
}

impl fmt::Debug for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Frame({self})")
    }
}

/// Why a text is not a frame in candump form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParseFrameError {
    /// No `#` between identifier and data.
    MissingSeparator,
    /// The identifier is not 3 hexadecimal digits (at most 7FF) or 8 (at most 1FFFFFFF).
    BadIdentifier,
    /// The data is not 0 to 8 pairs of hexadecimal digits (single dots may separate them).
    BadData,
    /// The length after `R` is not 0 to 8.
    BadRemoteLength,
    /// `##`: a CAN FD frame, which classical CAN cannot carry.
    CanFd,
}

impl fmt::Display for ParseFrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::MissingSeparator => "no '#' between identifier and data",
            Self::BadIdentifier => "identifier must be 3 hexadecimal digits up to 7FF, or 8 up to 1FFFFFFF",
            Self::BadData => "data must be 0 to 8 pairs of hexadecimal digits",
            Self::BadRemoteLength => "a remote frame's length after R must be 0 to 8",
            Self::CanFd => "'##' marks a CAN FD frame; only classical CAN is supported",
        })
    }
}

impl core::error::Error for ParseFrameError {}

impl FromStr for Frame {
    type Err = ParseFrameError;

    fn from_str(text: &str) -> Result<Self, ParseFrameError> {
        let (id, body) = text.split_once('#').ok_or(ParseFrameError::MissingSeparator)?;
        let id = parse_id(id)?;
        if body.starts_with('#') {
            return Err(ParseFrameError::CanFd);
        }
        match body.strip_prefix(['R', 'r']) {
            Some("") => Ok(Self::remote(id, 0)),
            Some(length) => match length.as_bytes() {
                [digit @ b'0'..=b'8'] => Ok(Self::remote(id, digit - b'0')),
                _ => Err(ParseFrameError::BadRemoteLength),
            },
            None => parse_data(id, body),
        }
    }
}

fn parse_id(text: &str) -> Result<CanId, ParseFrameError> {
    if !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return Err(ParseFrameError::BadIdentifier);
    }
    let raw = u32::from_str_radix(text, 16).map_err(|_| ParseFrameError::BadIdentifier)?;
    match text.len() {
        3 if raw <= CanId::MAX_STANDARD as u32 => Ok(CanId::standard(raw as u16)),
        8 if raw <= CanId::MAX_EXTENDED => Ok(CanId::extended(raw)),
        _ => Err(ParseFrameError::BadIdentifier),
    }
}

fn parse_data(id: CanId, text: &str) -> Result<Frame, ParseFrameError> {
    let mut data = [0; MAX_DATA_LENGTH];
    let mut length = 0;
    let mut rest = text.as_bytes();
    while let [high, low, tail @ ..] = rest {
        let (Some(high), Some(low)) = (hex_digit(*high), hex_digit(*low)) else {
            return Err(ParseFrameError::BadData);
        };
        *data.get_mut(length).ok_or(ParseFrameError::BadData)? = high << 4 | low;
        length += 1;
        rest = match tail {
            [b'.', after @ ..] if !after.is_empty() => after,
            _ => tail,
        };
    }
    if rest.is_empty() { Ok(Frame::new(id, &data[..length])) } else { Err(ParseFrameError::BadData) }
}

fn hex_digit(byte: u8) -> Option<u8> {
    (byte as char).to_digit(16).map(|digit| digit as u8)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;

    #[test]
    fn prints_and_parses_candump_form() {
        for text in ["604#4041600000000000", "000#0104", "080#", "184#R4", "184#R0", "00000604#01", "1FFFFFFF#R8"] {
            assert_eq!(text.parse::<Frame>().unwrap().to_string(), text);
        }
        assert_eq!("123#11.22.33".parse::<Frame>().unwrap(), Frame::new(CanId::standard(0x123), &[0x11, 0x22, 0x33]));
    }

    #[test]
    fn bits_are_carried_from_the_lowest_byte_on() {
        let bits = 0x8877_6655_4433_2211;
        for length in 0..=MAX_DATA_LENGTH {
            let frame = Frame::of_bits(CanId::standard(0x184), bits, length as u8);
            assert_eq!(frame, Frame::new(CanId::standard(0x184), &bits.to_le_bytes()[..length]));
        }
        assert_eq!(Frame::of_bits(CanId::standard(0x184), bits, 9).dlc(), 8);
    }

    #[test]
    fn refuses_what_is_no_classical_frame() {
        use ParseFrameError::*;
        for (text, error) in [
            ("", MissingSeparator),
            ("604", MissingSeparator),
            ("604##0", CanFd),
            ("800#", BadIdentifier),
            ("60#", BadIdentifier),
            ("+60#", BadIdentifier),
            ("20000000#", BadIdentifier),
            ("604#1", BadData),
            ("604#xx", BadData),
            ("604#11.", BadData),
            ("604#112233445566778899", BadData),
            ("604#R9", BadRemoteLength),
            ("604#R10", BadRemoteLength),
        ] {
            assert_eq!(text.parse::<Frame>(), Err(error), "{text:?}");
        }
    }

    #[test]
    fn arbitration_prefers_dominant_bits() {
        let data = Frame::new(CanId::standard(0x123), &[]);
        let remote = Frame::remote(CanId::standard(0x123), 0);
        let extended_same_base = Frame::new(CanId::extended(0x123 << 18), &[]);
        let lower = Frame::remote(CanId::standard(0x122), 0);
        let mut frames = [extended_same_base, remote, data, lower];
        frames.sort_by_key(Frame::arbitration_key);
        assert_eq!(frames, [lower, data, remote, extended_same_base]);
    }
}
