//! The form of can-utils: one frame a line.
//!
//! Read are the log form of `candump -l` and `-L` (`(1700000000.123456) can0 604#4041600000000000`, with or without a
//! direction behind it) and the screen form of plain `candump`, `-ta` and `-td`
//! (`(1700000000.123456)  can0  604   [8]  40 41 60 00 00 00 00 00`). Written is the log form. Calendar times (`-tA`) are
//! refused: they need a time zone that the log does not have.

use can::{CanId, Frame, Instant, MAX_DATA_LENGTH, ParseFrameError};

use crate::record::{Content, Direction, Interface, RawErrorFrame, Record};
use crate::text::{self, push_hex, push_hex_id, push_padded};

/// SocketCAN marks error frames with bit 29 of the identifier (CAN_ERR_FLAG).
const ERROR_FLAG: u32 = 0x2000_0000;

/// Appends a line in log form, such as `(1700000000.123456) can0 604#4041600000000000 R`, line feed included. The direction
/// is omitted where it is not known; an FD frame becomes a comment, because its data was not kept.
pub fn emit_line(record: &Record, out: &mut Vec<u8>) {
    if matches!(record.content, Content::FdFrame { .. }) {
        out.extend_from_slice(b"# CAN FD: ");
    }
    let at = record.at.unwrap_or(Instant::ZERO);
    out.push(b'(');
    push_padded(out, at.as_nanos() / 1_000_000_000, 10);
    out.push(b'.');
    push_padded(out, at.as_nanos() % 1_000_000_000 / 1_000, 6);
    out.extend_from_slice(b") ");
    out.extend_from_slice(record.interface.name().as_bytes());
    out.push(b' ');
    match &record.content {
        Content::Frame(frame) => push_frame(frame, out),
        Content::Error(error) => {
            push_hex(out, error.class & (ERROR_FLAG - 1) | ERROR_FLAG, 8);
            out.push(b'#');
            error.data.iter().for_each(|byte| push_hex(out, u32::from(*byte), 2));
        }
        Content::FdFrame { id, length } => {
            push_hex_id(out, *id);
            out.extend_from_slice(b"## of ");
            push_padded(out, u64::from(*length), 1);
        }
    }
    out.extend_from_slice(match record.direction {
        Some(Direction::Received) => b" R\n",
        Some(Direction::Transmitted) => b" T\n",
        None => b"\n",
    });
}

fn push_frame(frame: &Frame, out: &mut Vec<u8>) {
    push_hex_id(out, frame.id());
    out.push(b'#');
    if frame.is_remote() {
        out.extend_from_slice(&[b'R', b'0' + frame.dlc()]);
    }
    for byte in frame.data() {
        push_hex(out, u32::from(*byte), 2);
    }
}

/// Why a line of a log is not a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParseRecordError {
    /// The parenthesis is not closed, or what stands in it is not a number of seconds.
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

/// Reads a line; `None` for an empty line and a comment (`#`).
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
    let interface = Interface::named(words.next().ok_or(ParseRecordError::Interface)?);
    let words: Vec<&str> = words.collect();
    let (direction, content) = match words.as_slice() {
        [] => return Err(ParseRecordError::Missing),
        [word, rest @ ..] if word.contains('#') => (direction(rest), parse_log_form(word)?),
        words => (direction(words), parse_screen_form(words).ok_or(ParseRecordError::Screen)?),
    };
    Ok(Some(Record { at, interface, direction, content }))
}

/// `R` or `T` behind the log form, `RX` or `TX` before the screen form.
fn direction(words: &[&str]) -> Option<Direction> {
    match words.first() {
        Some(&("R" | "RX")) => Some(Direction::Received),
        Some(&("T" | "TX")) => Some(Direction::Transmitted),
        _ => None,
    }
}

fn parse_log_form(word: &str) -> Result<Content, ParseFrameError> {
    let (id, body) = word.split_once('#').ok_or(ParseFrameError::MissingSeparator)?;
    if let Some(class) = error_class(id) {
        // An error frame has the form of a data frame with an identifier of its own.
        let frame: Frame = format!("{class:08X}#{body}").parse()?;
        return Ok(Content::Error(RawErrorFrame { class, data: *frame.padded() }));
    }
    // Behind the second '#' of an FD frame is a digit of flags, then its data.
    if let Some(body) = body.strip_prefix('#') {
        let digits = body.get(1..).filter(|data| data.len() % 2 == 0).ok_or(ParseFrameError::BadData)?;
        let all_hex = body.bytes().all(|byte| byte.is_ascii_hexdigit());
        let length = u8::try_from(digits.len() / 2).ok().filter(|length| *length <= 64 && all_hex);
        let id = parse_id(id).ok_or(ParseFrameError::BadIdentifier)?;
        return Ok(Content::FdFrame { id, length: length.ok_or(ParseFrameError::BadData)? });
    }
    word.parse().map(Content::Frame)
}

/// `604 [8] 40 41 ..`, `123 [4] remote request`; `-x` puts `TX - -` or `RX - -` first, `-a` the text last; an FD frame's length
/// has two digits.
fn parse_screen_form(words: &[&str]) -> Option<Content> {
    let words = match words {
        ["RX" | "TX", flags @ ..] => {
            &flags[flags.iter().take_while(|flag| matches!(**flag, "-" | "B" | "E")).count()..]
        }
        _ => words,
    };
    let [id, length, rest @ ..] = words else { return None };
    let digits = length.strip_prefix('[')?.strip_suffix(']')?;
    let length: u8 = digits.parse().ok()?;
    if digits.len() == 2 && length <= 64 {
        return Some(Content::FdFrame { id: parse_id(id)?, length });
    }
    if digits.len() != 1 || usize::from(length) > MAX_DATA_LENGTH {
        return None;
    }
    if let ["remote", "request", ..] = rest {
        return Some(Content::Frame(Frame::remote(parse_id(id)?, length)));
    }
    let length = usize::from(length);
    let mut data = [0; MAX_DATA_LENGTH];
    for (byte, word) in data[..length].iter_mut().zip(rest.get(..length)?) {
        *byte = text::parse_hex(word, 2).filter(|_| word.len() == 2)? as u8;
    }
    if let Some(class) = error_class(id) {
        return Some(Content::Error(RawErrorFrame { class, data }));
    }
    match rest.get(length) {
        Some(more) if !more.starts_with('\'') => None,
        _ => Some(Content::Frame(Frame::new(parse_id(id)?, &data[..length]))),
    }
}

/// An identifier as candump writes it: 3 digits, or 8 for an extended one.
pub(super) fn parse_id(word: &str) -> Option<CanId> {
    let raw = text::parse_hex(word, 8)?;
    match word.len() {
        3 if raw <= u32::from(CanId::MAX_STANDARD) => Some(CanId::standard(raw as u16)),
        8 if raw <= CanId::MAX_EXTENDED => Some(CanId::extended(raw)),
        _ => None,
    }
}

fn error_class(id: &str) -> Option<u32> {
    let raw = text::parse_hex(id, 8).filter(|_| id.len() == 8)?;
    (raw & 0xE000_0000 == ERROR_FLAG).then_some(raw & (ERROR_FLAG - 1))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn directed(direction: Direction, record: Record) -> Record {
        Record { direction: Some(direction), ..record }
    }

    fn record(nanos: u64, frame: &str) -> Record {
        Record::of_frame(Instant::from_nanos(nanos), frame.parse().unwrap())
    }

    #[test]
    fn reads_every_form_that_candump_writes() {
        const T: u64 = 1_700_000_000_123_456_000;
        for (line, expected) in [
            ("(1700000000.123456) can0 604#4041600000000000", record(T, "604#4041600000000000")),
            ("(1700000000.123456) can0 604#4041 R", directed(Direction::Received, record(T, "604#4041"))),
            ("(1700000000.123456) can0 00000604#R4\r", record(T, "00000604#R4")),
            (" (1700000000.123456)  can0  604   [8]  40 41 60 00 00 00 00 00", record(T, "604#4041600000000000")),
            (" (1700000000.123456)  can0  080   [0] ", record(T, "080#")),
            (" (000.000100)  can0  123   [4]  remote request", record(100_000, "123#R4")),
            (
                " (0.000100)  can0  TX - -  123   [2]  41 42",
                directed(Direction::Transmitted, record(100_000, "123#4142")),
            ),
            (
                " (0.000100)  can0  RX B E  123   [2]  41 42   'AB'",
                directed(Direction::Received, record(100_000, "123#4142")),
            ),
            ("  can0  00000604   [1]  07", Record { at: None, ..record(0, "00000604#07") }),
        ] {
            assert_eq!(parse_line(line), Ok(Some(expected)), "{line}");
        }
        for line in ["", "  ", "# comment"] {
            assert_eq!(parse_line(line), Ok(None), "{line}");
        }
    }

    #[test]
    fn error_frames_and_fd_frames_are_distinguished() {
        let content = |line| parse_line(line).map(|record| record.map(|record| record.content));
        let error = |class, data| Ok(Some(Content::Error(RawErrorFrame { class, data })));
        assert_eq!(content("(1.0) can0 20000080#0000000000000000"), error(0x80, [0; 8]));
        assert_eq!(
            content(" can0  20000004   [8]  00 04 00 00 00 00 07 00   ERRORFRAME"),
            error(4, [0, 4, 0, 0, 0, 0, 7, 0])
        );
        let fd = |length| Ok(Some(Content::FdFrame { id: CanId::standard(0x123), length }));
        assert_eq!(content("(1.0) can0 123##1112233445566778899AABBCC"), fd(12));
        assert_eq!(content("(1.0) can0 123##0"), fd(0));
        assert_eq!(content("(1.0)  can0  123  [12]  11 22 33 44 55 66 77 88 99 AA BB CC"), fd(12));
        assert_eq!(content("(1.0) can0 123##"), Err(ParseRecordError::Frame(ParseFrameError::BadData)));
        assert_eq!(content("(1.0) can0 123##1zz"), Err(ParseRecordError::Frame(ParseFrameError::BadData)));
    }

    #[test]
    fn says_what_is_wrong_with_a_line() {
        use ParseRecordError::*;
        for (line, error) in [
            ("(2023-11-14 22:13:20.123456) can0 604#", TimeStamp),
            ("(1.5 can0 604#", TimeStamp),
            ("(1.5)", Interface),
            ("(1.5) can0", Missing),
            ("(1.5) can0 604##", Frame(ParseFrameError::BadData)),
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

    fn frame() -> impl Strategy<Value = Frame> {
        let id = prop_oneof![
            (0..=CanId::MAX_STANDARD).prop_map(CanId::standard),
            (0..=CanId::MAX_EXTENDED).prop_map(CanId::extended),
        ];
        let data = prop_oneof![
            (0..=8_u8).prop_map(Err),
            prop::collection::vec(any::<u8>(), 0..=MAX_DATA_LENGTH).prop_map(Ok),
        ];
        (id, data).prop_map(|(id, data)| match data {
            Ok(data) => Frame::new(id, &data),
            Err(length) => Frame::remote(id, length),
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn reads_what_it_writes(frame in frame(), us in 0..1_u64 << 52, way in 0..3_usize) {
            let direction = [None, Some(Direction::Received), Some(Direction::Transmitted)][way];
            let interface = Interface::named("vcan0");
            let record = Record { direction, interface, ..Record::of_frame(Instant::from_micros(us), frame) };
            let mut out = Vec::new();
            emit_line(&record, &mut out);
            prop_assert_eq!(parse_line(str::from_utf8(&out).unwrap()), Ok(Some(record)));
        }

        #[test]
        fn no_line_causes_a_panic(
            line in r"(\(|\)|1\.5| |can0|604|#|11|\[2\]|R|RX|-|20000000|'|.){0,12}",
        ) {
            let _ = parse_line(&line);
        }
    }
}
