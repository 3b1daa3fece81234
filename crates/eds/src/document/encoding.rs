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
    /// The same behind the byte order mark of UTF-8: a tool put it before what it did not translate.
    Latin1WithMark,
}

impl Encoding {
    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ascii => "ASCII",
            Self::Utf8 => "UTF-8",
            Self::Utf8WithMark => "UTF-8 with a byte order mark",
            Self::Latin1 => "Latin-1",
            Self::Latin1WithMark => "Latin-1 with a byte order mark of UTF-8",
        }
    }

    /// True if text of this letter can be written in a file of this encoding.
    pub(super) const fn has(self, letter: char) -> bool {
        match self {
            Self::Ascii => letter.is_ascii(),
            Self::Utf8 | Self::Utf8WithMark => true,
            Self::Latin1 | Self::Latin1WithMark => letter as u32 <= 0xFF,
        }
    }
}

const MARK: &[u8] = b"\xEF\xBB\xBF";

pub(super) fn decode(bytes: &[u8]) -> Result<(Encoding, String), Refusal> {
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        let reason = "the file is text of 16-bit characters (UTF-16)";
        return Err(Refusal::new(1, reason, "save it as UTF-8 or Latin-1 text"));
    }
    let latin_1 = |bytes: &[u8]| bytes.iter().map(|byte| char::from(*byte)).collect();
    if let Some(rest) = bytes.strip_prefix(MARK) {
        // What stands behind a mark begins behind it, however it is coded: its first line is the first section.
        return Ok(match str::from_utf8(rest) {
            Ok(text) => (Encoding::Utf8WithMark, text.to_owned()),
            Err(_) => (Encoding::Latin1WithMark, latin_1(rest)),
        });
    }
    match str::from_utf8(bytes) {
        Ok(text) if text.is_ascii() => Ok((Encoding::Ascii, text.to_owned())),
        Ok(text) => Ok((Encoding::Utf8, text.to_owned())),
        Err(_) => Ok((Encoding::Latin1, latin_1(bytes))),
    }
}

pub(super) fn encode(encoding: Encoding, text: &str) -> Vec<u8> {
    match encoding {
        Encoding::Ascii | Encoding::Utf8 => text.as_bytes().to_vec(),
        Encoding::Utf8WithMark => [MARK, text.as_bytes()].concat(),
        Encoding::Latin1 => one_byte_each(text),
        Encoding::Latin1WithMark => [MARK, &one_byte_each(text)].concat(),
    }
}

/// Each letter came from a byte, or was checked before it was put in.
fn one_byte_each(text: &str) -> Vec<u8> {
    text.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap_or(b'?')).collect()
}
