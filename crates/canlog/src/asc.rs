//! Vector's ASCII logging format (ASC): a head with date and base, then an event a line.
//!
//! Read are frames, remote frames, error frames and CAN FD frames of any channel, in base `hex` or `dec`, with times since the
//! head's date or since the line before. Events of other kinds (statistics, comments, J1939) say nothing about frames and are
//! left out. Dates have no time zone and are taken for UTC.

use std::io::{self, Write};

use can::{CanId, Frame, Instant, MAX_DATA_LENGTH};

use crate::calendar::{parse_date, print_date};
use crate::record::{Content, Direction, Interface, RawErrorFrame, Record};
use crate::text::{self, push_decimal, push_hex, push_seconds};

/// Bit of the flags of a `CANFD` line that says that the frame is one of CAN FD; without it the line is a classical frame.
const FD_FLAG: u32 = 0x1000;
/// Bit of the same that says that it is a remote frame.
const REMOTE_FLAG: u32 = 0x10;

/// What the head of a file said, and where its times are.
#[derive(Debug)]
pub(super) struct Parser {
    decimal: bool,
    relative: bool,
    begin: Instant,
    last: Instant,
}

impl Default for Parser {
    fn default() -> Self {
        Self { decimal: false, relative: false, begin: Instant::ZERO, last: Instant::ZERO }
    }
}

impl Parser {
    /// Reads a line; `None` for the head, comments and events that are not frames.
    pub(super) fn line(&mut self, line: &str) -> Result<Option<Record>, &'static str> {
        let line = line.trim();
        if line.is_empty() || line.starts_with("//") || self.head(line) {
            return Ok(None);
        }
        let (time, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let offset = text::parse_seconds(time).ok_or("a line begins with its time in seconds, such as 1.500000")?;
        let since = if self.relative { self.last } else { self.begin };
        let nanos = since.as_nanos().checked_add(offset.as_nanos()).ok_or("the time is beyond all years")?;
        self.last = Instant::from_nanos(nanos);
        let words: Vec<&str> = rest.split_ascii_whitespace().collect();
        let read = match words.as_slice() {
            [fd, channel, rest @ ..] if fd.eq_ignore_ascii_case("CANFD") => self.fd(channel, rest)?,
            [channel, rest @ ..] if channel.bytes().all(|byte| byte.is_ascii_digit()) => {
                self.classical(channel, rest)?
            }
            _ => None,
        };
        Ok(read.map(|(interface, direction, content)| Record { at: Some(self.last), interface, direction, content }))
    }

    /// True for a line of the head or the foot.
    fn head(&mut self, line: &str) -> bool {
        let lower = line.to_ascii_lowercase();
        if let Some(date) = lower.strip_prefix("date ").or(lower.strip_prefix("begin triggerblock")) {
            // By bytes: lowering ASCII moves nothing.
            if let Some(begin) = parse_date(&line[line.len() - date.len()..]) {
                (self.begin, self.last) = (begin, begin);
            }
            return true;
        }
        if let Some(rest) = lower.strip_prefix("base ") {
            self.decimal = rest.trim_start().starts_with("dec");
            self.relative = rest.contains("relative");
            return true;
        }
        ["internal events", "no internal events", "end triggerblock"].iter().any(|known| lower.starts_with(known))
    }

    fn classical(&self, channel: &str, words: &[&str]) -> Result<Option<Parsed>, &'static str> {
        let interface = interface(channel)?;
        let (id, way, rest) = match words {
            [error, ..] if error.eq_ignore_ascii_case("ErrorFrame") => {
                return Ok(Some((interface, None, Content::Error(RawErrorFrame::UNSPECIFIED))));
            }
            [event, ..] if event.ends_with(':') || event.eq_ignore_ascii_case("OverloadFrame") => return Ok(None),
            // A request to send is not yet on the bus.
            [_, "TxRq", ..] => return Ok(None),
            [id, way, rest @ ..] => (self.id(id)?, direction(way)?, rest),
            _ => return Err("expected channel, identifier, Rx or Tx, and d with a length and so many bytes"),
        };
        let frame = match rest {
            ["r" | "R"] => Frame::remote(id, 0),
            ["r" | "R", length, ..] => Frame::remote(id, self.length(length)?),
            ["d" | "D", length, data @ ..] => self.data(id, self.length(length)?, data)?,
            _ => return Err("expected d with a length and so many bytes, or r"),
        };
        Ok(Some((interface, Some(way), Content::Frame(frame))))
    }

    /// `CANFD 1 Rx 123 [name] BRS ESI DLC LENGTH data.. duration bits flags ..`
    fn fd(&self, channel: &str, words: &[&str]) -> Result<Option<Parsed>, &'static str> {
        const FORM: &str = "expected CANFD, channel, Rx or Tx, identifier, BRS, ESI, DLC, length and so many bytes";
        let interface = interface(channel)?;
        let (way, rest) = words.split_first().ok_or(FORM)?;
        let way = direction(way)?;
        let (id, rest) = rest.split_first().ok_or(FORM)?;
        if id.eq_ignore_ascii_case("ErrorFrame") {
            return Ok(Some((interface, Some(way), Content::Error(RawErrorFrame::UNSPECIFIED))));
        }
        let id = self.id(id)?;
        let unnamed = matches!(rest, ["0" | "1", ..]);
        let [_brs, _esi, dlc, length, rest @ ..] = &rest[usize::from(!unnamed && !rest.is_empty())..] else {
            return Err(FORM);
        };
        let length: u8 = length.parse().ok().filter(|length| *length <= 64).ok_or(FORM)?;
        let data = rest.get(..usize::from(length)).ok_or(FORM)?;
        let flags = rest.get(usize::from(length) + 2).and_then(|flags| text::parse_hex(flags, 8));
        let content = match flags {
            Some(flags) if flags & FD_FLAG == 0 && flags & REMOTE_FLAG != 0 => {
                Content::Frame(Frame::remote(id, self.length(dlc)?))
            }
            Some(flags) if flags & FD_FLAG == 0 => Content::Frame(self.data(id, length.min(8), data)?),
            _ => Content::FdFrame { id, length },
        };
        Ok(Some((interface, Some(way), content)))
    }

    /// `64`, or `18EBFF00x` when extended.
    fn id(&self, word: &str) -> Result<CanId, &'static str> {
        let digits = word.strip_suffix(['x', 'X']);
        let raw =
            self.number(digits.unwrap_or(word)).ok_or("the identifier is not a number; log without symbolic names")?;
        match digits {
            Some(_) if raw <= CanId::MAX_EXTENDED => Ok(CanId::extended(raw)),
            None if raw <= u32::from(CanId::MAX_STANDARD) => Ok(CanId::standard(raw as u16)),
            _ => Err("the identifier is beyond 7FF, or beyond 1FFFFFFF with an x behind it"),
        }
    }

    fn length(&self, word: &str) -> Result<u8, &'static str> {
        // A DLC above 8 means 8 bytes (ISO 11898-1, 8.4.2.4).
        let dlc = self.number(word).filter(|dlc| *dlc <= 15).ok_or("the length is not a number from 0 to f")?;
        Ok(dlc.min(MAX_DATA_LENGTH as u32) as u8)
    }

    fn data(&self, id: CanId, length: u8, words: &[&str]) -> Result<Frame, &'static str> {
        let mut data = [0; MAX_DATA_LENGTH];
        let words = words.get(..usize::from(length)).ok_or("there are fewer bytes than the length says")?;
        for (byte, word) in data.iter_mut().zip(words) {
            let value = self.number(word).filter(|_| self.decimal || word.len() == 2);
            *byte = value.and_then(|value| u8::try_from(value).ok()).ok_or("a byte is not a number of its base")?;
        }
        Ok(Frame::new(id, &data[..usize::from(length)]))
    }

    fn number(&self, word: &str) -> Option<u32> {
        let digits = word.bytes().all(|byte| byte.is_ascii_digit());
        if self.decimal { word.parse().ok().filter(|_| digits) } else { text::parse_hex(word, 8) }
    }
}

type Parsed = (Interface, Option<Direction>, Content);

fn interface(channel: &str) -> Result<Interface, &'static str> {
    channel.parse().map(Interface::numbered).map_err(|_| "the channel is not a number")
}

fn direction(word: &str) -> Result<Direction, &'static str> {
    match word {
        _ if word.eq_ignore_ascii_case("Rx") => Ok(Direction::Received),
        _ if word.eq_ignore_ascii_case("Tx") => Ok(Direction::Transmitted),
        _ => Err("expected Rx or Tx behind the identifier"),
    }
}

/// Writes the lines of a file; the head comes with the first record, whose time it has.
#[derive(Debug, Default)]
pub(super) struct AscWriter {
    begin: Option<Instant>,
    last: Instant,
    line: Vec<u8>,
}

impl AscWriter {
    pub(super) fn write(&mut self, output: &mut impl Write, record: &Record) -> io::Result<()> {
        let begin = self.head(output, record.at)?;
        // Time does not go back in such a file.
        self.last = record.at.unwrap_or(self.last).max(begin);
        self.line.clear();
        self.line.extend_from_slice(b"   ");
        push_seconds(&mut self.line, Instant::ZERO + (self.last - begin));
        self.line.push(b' ');
        emit(record, &mut self.line);
        output.write_all(&self.line)
    }

    pub(super) fn finish(&mut self, output: &mut impl Write) -> io::Result<()> {
        self.head(output, None)?;
        output.write_all(b"End TriggerBlock\n")
    }

    /// The file's zero of time, which its head has to the millisecond.
    fn head(&mut self, output: &mut impl Write, first: Option<Instant>) -> io::Result<Instant> {
        if let Some(begin) = self.begin {
            return Ok(begin);
        }
        let begin = Instant::from_millis(first.unwrap_or(Instant::ZERO).as_nanos() / 1_000_000);
        self.begin = Some(begin);
        let date = print_date(begin);
        write!(
            output,
            "date {date}\nbase hex  timestamps absolute\ninternal events logged\nBegin Triggerblock {date}\n   0.000000 Start of \
             measurement\n"
        )?;
        Ok(begin)
    }
}

/// The line behind its time.
fn emit(record: &Record, out: &mut Vec<u8>) {
    let way: &[u8] = if record.direction == Some(Direction::Transmitted) { b"Tx" } else { b"Rx" };
    if let Content::FdFrame { .. } = record.content {
        // Its data was not kept: a comment, which readers pass over.
        out.splice(0..0, *b"// CANFD ");
    }
    push_decimal(out, u64::from(record.interface.number()));
    out.extend_from_slice(b"  ");
    let frame = match &record.content {
        Content::Frame(frame) => frame,
        Content::Error(_) => return out.extend_from_slice(b"ErrorFrame\n"),
        Content::FdFrame { id, length } => {
            push_id(out, *id);
            out.extend_from_slice(b" of ");
            push_decimal(out, u64::from(*length));
            return out.push(b'\n');
        }
    };
    push_id(out, frame.id());
    out.extend_from_slice(b"             ");
    out.extend_from_slice(way);
    out.extend_from_slice(if frame.is_remote() { b"   r " } else { b"   d " });
    out.push(b'0' + frame.dlc());
    for byte in frame.data() {
        out.push(b' ');
        push_hex(out, u32::from(*byte), 2);
    }
    out.push(b'\n');
}

fn push_id(out: &mut Vec<u8>, id: CanId) {
    let digits = (1..8).find(|digits| id.raw() >> (4 * digits) == 0).unwrap_or(8);
    push_hex(out, id.raw(), digits);
    if id.is_extended() {
        out.push(b'x');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(lines: &str) -> Vec<Result<Record, &'static str>> {
        let mut parser = Parser::default();
        lines.lines().filter_map(|line| parser.line(line).transpose()).collect()
    }

    #[test]
    fn frames_of_every_kind_are_read() {
        let log = "date Sat Sep 30 15:06:13.191 2017\nbase hex  timestamps absolute\nno internal events logged\n\
                   // version 8.1.0\nBegin Triggerblock Sat Sep 30 15:06:13.191 2017\n   0.000000 Start of measurement\n\
                   \x20  2.501000 1  64              Rx   d 8 00 01 02 03 04 05 06 07 Length = 0 BitCount = 64\n\
                   \x20  2.6 2  18EBFF00x  Tx  d 2 AA BB\n   2.7 1  C8  Rx   r\n   2.8 1  C8  Rx   r 8\n   2.9 1  ErrorFrame\n\
                   \x20  3.0 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%\n   3.1 CAN 1 Status:chip status error active\n\
                   \x20  3.2 1  64  TxRq  d 1 00\nEnd TriggerBlock\n";
        let records: Vec<Record> = read(log).into_iter().map(Result::unwrap).collect();
        let frames: Vec<String> = records.iter().filter_map(|record| record.frame().map(ToString::to_string)).collect();
        assert_eq!(frames, ["064#0001020304050607", "18EBFF00#AABB", "0C8#R0", "0C8#R8"]);
        assert_eq!(records[0].at, Some(Instant::from_millis(1_506_783_973_191 + 2_501)));
        assert_eq!((records[1].interface.name(), records[1].direction), ("can1", Some(Direction::Transmitted)));
        assert_eq!(records[4].content, Content::Error(RawErrorFrame::UNSPECIFIED));
        assert_eq!(records.len(), 5);
    }

    #[test]
    fn numbers_may_be_decimal_and_times_relative() {
        let records = read("base dec  timestamps relative\n 0.5 1 100 Rx d 2 10 255\n 0.25 1 100 Rx d 0\n");
        let records: Vec<Record> = records.into_iter().map(Result::unwrap).collect();
        assert_eq!(records[0].frame().unwrap().to_string(), "064#0AFF");
        assert_eq!(records[1].at, Some(Instant::from_millis(750)));
    }

    #[test]
    fn a_canfd_line_is_what_its_flags_say() {
        let content = |line| read(line).pop().unwrap().map(|record| record.content);
        let fd = Ok(Content::FdFrame { id: CanId::standard(0x123), length: 2 });
        assert_eq!(content("1.0 CANFD   1 Rx  123  1 0 2  2 AA BB"), fd);
        assert_eq!(content("1.0 CANFD   1 Rx  123  name 1 0 2  2 AA BB 130000  130  3000 0"), fd);
        let classical = Ok(Content::Frame("123#AABB".parse().unwrap()));
        assert_eq!(content("1.0 CANFD   1 Rx  123  0 0 2  2 AA BB 130000  130  0 0"), classical);
        assert_eq!(
            content("1.0 CANFD   1 Tx  123  0 0 4  0 130000  130  10 0"),
            Ok(Content::Frame("123#R4".parse().unwrap()))
        );
        assert!(content("1.0 CANFD   1 Rx  123  1 0 d 32 AA BB").is_err());
    }

    #[test]
    fn a_line_that_is_torn_says_what_is_missing() {
        for (line, reason) in [
            ("hello", "time in seconds"),
            ("1.0 1", "expected channel, identifier"),
            ("1.0 1 64", "expected channel, identifier"),
            ("1.0 1 64 Rx", "expected d with a length"),
            ("1.0 1 64 Sideways d 0", "expected Rx or Tx"),
            ("1.0 1 EngineData Rx d 0", "symbolic names"),
            ("1.0 1 800 Rx d 0", "beyond 7FF"),
            ("1.0 1 64 Rx d 2 00", "fewer bytes"),
            ("1.0 1 64 Rx d 2 00 0", "not a number of its base"),
            ("1.0 1 64 Rx d 99 00", "from 0 to f"),
            ("1.0 99999999 64 Rx d 0", "the channel"),
            ("date Sat Sep 30 15:06:13 2017\n18446744073.0 1 64 Rx d 0", "beyond all years"),
        ] {
            let errors: Vec<_> = read(line).into_iter().filter_map(Result::err).collect();
            assert!(errors.iter().any(|error| error.contains(reason)), "{line}: {errors:?}");
        }
    }
}
