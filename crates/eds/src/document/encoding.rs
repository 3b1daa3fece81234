use crate::Refusal;

/// How a file codes letters beyond ASCII. CiA 306 knows none of them; the tools of many makers write them all the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// No letter beyond ASCII.
    Ascii,
    /// UTF-8.
    Utf8,
    /// UTF-8 behind a byte order mark.
    Utf8WithMark,
    /// ISO 8859-1: one byte a letter.
    Latin1,
}

impl Encoding {
    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ascii => "ASCII",
            Self::Utf8 => "UTF-8",
            Self::Utf8WithMark => "UTF-8 with a byte order mark",
            Self::Latin1 => "Latin-1",
        }
    }

    /// True if text of this letter can be written in a file of this encoding.
    pub(super) const fn has(self, letter: char) -> bool {
        match self {
            Self::Ascii => letter.is_ascii(),
            Self::Utf8 | Self::Utf8WithMark => true,
            Self::Latin1 => letter as u32 <= 0xFF,
        }
    }
}

const MARK: &[u8] = b"\xEF\xBB\xBF";

pub(super) fn decode(bytes: &[u8]) -> Result<(Encoding, String), Refusal> {
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        let reason = "the file is text of 16-bit characters (UTF-16)";
        return Err(Refusal::new(1, reason, "save it as UTF-8 or Latin-1 text"));
    }
    if let Some(rest) = bytes.strip_prefix(MARK)
        && let Ok(text) = str::from_utf8(rest)
    {
        return Ok((Encoding::Utf8WithMark, text.to_owned()));
    }
    match str::from_utf8(bytes) {
        Ok(text) if text.is_ascii() => Ok((Encoding::Ascii, text.to_owned())),
        Ok(text) => Ok((Encoding::Utf8, text.to_owned())),
        Err(_) => Ok((Encoding::Latin1, bytes.iter().map(|byte| char::from(*byte)).collect())),
    }
}

pub(super) fn encode(encoding: Encoding, text: &str) -> Vec<u8> {
    match encoding {
        Encoding::Ascii | Encoding::Utf8 => text.as_bytes().to_vec(),
        Encoding::Utf8WithMark => [MARK, text.as_bytes()].concat(),
        // Each letter came from a byte, or was checked before it was put in.
        Encoding::Latin1 => text.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap_or(b'?')).collect(),
    }
}
