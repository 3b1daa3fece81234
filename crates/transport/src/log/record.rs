//! One line of a candump log.
//!
//! Read are the log form of `candump -l` and `-L` (`(1700000000.123456) can0 604#4041600000000000`, with or without a
//! direction behind it) and the screen form of plain `candump`, `-ta` and `-td`
//! (`(1700000000.123456)  can0  604   [8]  40 41 60 00 00 00 00 00`). Written is the log form. Calendar times (`-tA`) are
//! refused: they need a time zone that the log does not tell.

use can::{CanId, Frame, Instant, MAX_DATA_LENGTH, ParseFrameError};

use crate::text::{self, push_hex, push_hex_id, push_padded};

/// A frame in a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// The time stamp, for `-l`, `-L` and `-ta` Unix time; `None` where the line has none.
    pub at: Option<Instant>,
    /// The interface, such as `can0`.
    pub interface: String,
    /// The frame.
    pub frame: Frame,
}

impl Record {
    /// Appends the line in log form, line feed included.
    pub fn emit(&self, out: &mut Vec<u8>) {
        emit_line(self.at.unwrap_or(Instant::ZERO), &self.interface, &self.frame, out);
    }
}

/// Appends a line in log form: `(1700000000.123456) can0 604#4041600000000000`.
pub(super) fn emit_line(at: Instant, interface: &str, frame: &Frame, out: &mut Vec<u8>) {
    out.push(b'(');
    push_padded(out, at.as_nanos() / 1_000_000_000, 10);
    out.push(b'.');
    push_padded(out, at.as_nanos() % 1_000_000_000 / 1_000, 6);
    out.extend_from_slice(b") ");
    out.extend_from_slice(interface.as_bytes());
    out.push(b' ');
    push_hex_id(out, frame.id());
    out.push(b'#');
    if frame.is_remote() {
        out.extend_from_slice(&[b'R', b'0' + frame.dlc()]);
    }
    for byte in frame.data() {
        push_hex(out, u32::from(*byte), 2);
    }
    out.push(b'\n');
}

/// Why a line of a log is no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParseRecordError {
    /// The parenthesis is not closed, or what stands in it is no number of seconds.
    #[error("the time stamp must be seconds in parentheses, such as (1700000000.123456); log with candump -L or -ta")]
    TimeStamp,
    /// Nothing behind the time stamp.
    #[error("no interface name; expected e.g. (1700000000.123456) can0 604#4041600000000000")]
    Interface,
    /// Nothing behind the interface.
    #[error("no frame; expected e.g. (1700000000.123456) can0 604#4041600000000000")]
    Missing,
    /// The log form's frame.
    #[error(transparent)]
    Frame(#[from] ParseFrameError),
    /// The screen form's frame.
    #[error("expected an identifier of 3 or 8 hexadecimal digits, a length from [0] to [8] and as many bytes")]
    Screen,
}

/// Reads a line; `None` for an empty line, a comment (`#`) and an error frame, which say nothing about traffic.
pub fn parse_line(line: &str) -> Result<Option<Record>, ParseRecordError> {
    let line = line.trim();
    if line.is_empty() || line.starts_with('#') {
        return Ok(None);
    }
    let (at, rest) = match line.strip_prefix('(') {
        Some(rest) => {
            let (stamp, rest) = rest.split_once(')').ok_or(ParseRecordError::TimeStamp)?;
            (Some(text::parse_seconds(stamp.trim()).ok_or(ParseRecordError::TimeStamp)?), rest)
        }
        None => (None, line),
    };
    let mut words = rest.split_ascii_whitespace();
    let interface = words.next().ok_or(ParseRecordError::Interface)?;
    let words: Vec<&str> = words.collect();
    let frame = match words.first() {
        None => return Err(ParseRecordError::Missing),
        Some(word) if word.contains('#') => parse_log_form(word)?,
        Some(_) => parse_screen_form(&words).ok_or(ParseRecordError::Screen)?,
    };
    Ok(frame.map(|frame| Record { at, interface: interface.to_owned(), frame }))
}

fn parse_log_form(word: &str) -> Result<Option<Frame>, ParseFrameError> {
    let id = word.split('#').next().unwrap_or_default();
    if is_error_frame(id) { Ok(None) } else { word.parse().map(Some) }
}

/// `604 [8] 40 41 ..`, `123 [4] remote request`; `-x` puts `TX - -` or `RX - -` first, `-a` the text last. The outer `None`
/// is a malformed line, the inner one an error frame.
fn parse_screen_form(words: &[&str]) -> Option<Option<Frame>> {
    let words = match words {
        ["RX" | "TX", flags @ ..] => {
            &flags[flags.iter().take_while(|flag| matches!(**flag, "-" | "B" | "E")).count()..]
        }
        _ => words,
    };
    let [id, length, rest @ ..] = words else { return None };
    if is_error_frame(id) {
        return Some(None);
    }
    let id = parse_id(id)?;
    let length = match length.as_bytes() {
        [b'[', digit @ b'0'..=b'8', b']'] => usize::from(digit - b'0'),
        _ => return None,
    };
    if let ["remote", "request", ..] = rest {
        return Some(Some(Frame::remote(id, length as u8)));
    }
    let mut data = [0; MAX_DATA_LENGTH];
    for (byte, word) in data[..length].iter_mut().zip(rest.get(..length)?) {
        *byte = text::parse_hex(word, 2).filter(|_| word.len() == 2)? as u8;
    }
    match rest.get(length) {
        Some(more) if !more.starts_with('\'') => None,
        _ => Some(Some(Frame::new(id, &data[..length]))),
    }
}

fn parse_id(word: &str) -> Option<CanId> {
    let raw = text::parse_hex(word, 8)?;
    match word.len() {
        3 if raw <= u32::from(CanId::MAX_STANDARD) => Some(CanId::standard(raw as u16)),
        8 if raw <= CanId::MAX_EXTENDED => Some(CanId::extended(raw)),
        _ => None,
    }
}

/// SocketCAN writes error frames with bit 29 of the identifier set (CAN_ERR_FLAG).
fn is_error_frame(id: &str) -> bool {
    id.len() == 8 && text::parse_hex(id, 8).is_some_and(|raw| raw & 0x2000_0000 != 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    fn record(nanos: u64, frame: &str) -> Record {
        Record { at: Some(Instant::from_nanos(nanos)), interface: "can0".into(), frame: frame.parse().unwrap() }
    }

    #[test]
    fn reads_every_form_that_candump_writes() {
        const T: u64 = 1_700_000_000_123_456_000;
        for (line, expected) in [
            ("(1700000000.123456) can0 604#4041600000000000", record(T, "604#4041600000000000")),
            ("(1700000000.123456) can0 604#4041 R", record(T, "604#4041")),
            ("(1700000000.123456) can0 00000604#R4\r", record(T, "00000604#R4")),
            (" (1700000000.123456)  can0  604   [8]  40 41 60 00 00 00 00 00", record(T, "604#4041600000000000")),
            (" (1700000000.123456)  can0  080   [0] ", record(T, "080#")),
            (" (000.000100)  can0  123   [4]  remote request", record(100_000, "123#R4")),
            (" (0.000100)  can0  TX - -  123   [2]  41 42", record(100_000, "123#4142")),
            (" (0.000100)  can0  RX B E  123   [2]  41 42   'AB'", record(100_000, "123#4142")),
            ("  can0  00000604   [1]  07", Record { at: None, ..record(0, "00000604#07") }),
        ] {
            assert_eq!(parse_line(line), Ok(Some(expected)), "{line}");
        }
        for line in
            ["", "  ", "# comment", "(1.0) can0 20000080#0000000000000000", " can0  20000004   [8]  00 04 ERRORFRAME"]
        {
            assert_eq!(parse_line(line), Ok(None), "{line}");
        }
    }

    #[test]
    fn says_what_is_wrong_with_a_line() {
        use ParseRecordError::*;
        for (line, error) in [
            ("(2023-11-14 22:13:20.123456) can0 604#", TimeStamp),
            ("(1.5 can0 604#", TimeStamp),
            ("(1.5)", Interface),
            ("(1.5) can0", Missing),
            ("(1.5) can0 604##1", Frame(ParseFrameError::CanFd)),
            ("(1.5) can0 604#4", Frame(ParseFrameError::BadData)),
            ("(1.5) can0 604 [9] 1", Screen),
            ("(1.5) can0 604 [2] 11", Screen),
            ("(1.5) can0 604 [1] 11 22", Screen),
            ("(1.5) can0 60 [0]", Screen),
            ("(1.5) can0 TX", Screen),
            ("hello", Missing),
        ] {
            assert_eq!(parse_line(line), Err(error), "{line}");
        }
    }

    #[test]
    fn reads_what_it_writes() {
        let mut random = Random::new(0x5EED_0005);
        for _ in 0..2_000 {
            let at = Some(Instant::from_micros(random.next() >> 12));
            let record = Record { at, interface: "vcan0".into(), frame: random.frame() };
            let mut out = Vec::new();
            record.emit(&mut out);
            assert_eq!(parse_line(std::str::from_utf8(&out).unwrap()), Ok(Some(record)));
        }
    }

    #[test]
    fn random_lines_never_panic() {
        let words =
            [&b"("[..], b")", b"1.5", b" ", b"can0", b"604", b"#", b"11", b"[2]", b"R", b"RX", b"-", b"20000000", b"'"];
        let mut random = Random::new(0x5EED_0006);
        for _ in 0..5_000 {
            let _ = parse_line(&String::from_utf8_lossy(&random.salad(&words, 12)));
        }
    }
}
