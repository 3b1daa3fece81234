//! A CAN identifier with its flags in 32 bits, as Linux has it (`canid_t` of `linux/can.h`): the form that cannelloni sends.

use can::{CanId, Frame, FrameKind};

/// 29-bit identifier.
const EXTENDED: u32 = 1 << 31;
/// Remote frame.
const REMOTE: u32 = 1 << 30;
/// An error message, no frame of the wire.
const ERROR: u32 = 1 << 29;

/// What such a word stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RawId {
    /// A data frame.
    Data(CanId),
    /// A remote frame.
    Remote(CanId),
    /// An error message of this class.
    Error(u32),
}

impl RawId {
    /// Reads a word. `None`: a standard identifier with more than 11 bits.
    pub(crate) fn of_word(word: u32) -> Option<Self> {
        let raw = word & CanId::MAX_EXTENDED;
        if word & ERROR != 0 {
            return Some(Self::Error(raw));
        }
        let id = match word & EXTENDED != 0 {
            true => CanId::extended(raw),
            false => CanId::standard(u16::try_from(raw).ok().filter(|raw| *raw <= CanId::MAX_STANDARD)?),
        };
        Some(if word & REMOTE != 0 { Self::Remote(id) } else { Self::Data(id) })
    }

    /// The word of a frame.
    pub(crate) fn word_of(frame: &Frame) -> u32 {
        let id = frame.id();
        let extended = if id.is_extended() { EXTENDED } else { 0 };
        let remote = if frame.kind() == FrameKind::Remote { REMOTE } else { 0 };
        id.raw() | extended | remote
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_those_of_linux() {
        for (text, word) in
            [("604#40", 0x604), ("00000604#40", 0x8000_0604), ("604#R2", 0x4000_0604), ("1FFFFFFF#R", 0xDFFF_FFFF)]
        {
            let frame: Frame = text.parse().unwrap();
            assert_eq!(RawId::word_of(&frame), word, "{text}");
            let (RawId::Data(id) | RawId::Remote(id)) = RawId::of_word(word).unwrap() else { panic!("{text}") };
            assert_eq!((id, frame.is_remote()), (frame.id(), matches!(RawId::of_word(word), Some(RawId::Remote(_)))));
        }
        assert_eq!(RawId::of_word(0x2000_0004), Some(RawId::Error(4)));
        assert_eq!(RawId::of_word(0x0000_0800), None);
    }
}
