//! slcan lines as data: [`Command`] from host to adapter, [`Answer`] back, and a [`Decoder`] for either.
//!
//! Pure: bytes in, lines out; no line longer than [`MAX_LINE_LENGTH`] is ever kept. Bytes may arrive cut anywhere.
//! After a malformed line the decoder goes on behind its CR.

use std::marker::PhantomData;

use can::{Bitrate, CanId, Frame, MAX_DATA_LENGTH};
use canlog::text::{self, push_decimal, push_hex};

/// Longest line without its CR, in bytes. The longest of the protocol is an extended frame with a time stamp: 30.
pub const MAX_LINE_LENGTH: usize = 64;

const CR: u8 = b'\r';
const BEL: u8 = 0x07;

/// What a host asks of an adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `S0` to `S8`: a standard bit rate, see [`bitrate_of_code`].
    SetBitrate(u8),
    /// `sxxyy`: the bit timing registers BTR0 and BTR1 of an SJA1000.
    SetTimingRegisters(u16),
    /// `O`: open the channel.
    Open,
    /// `L`: open the channel without ever sending.
    OpenListenOnly,
    /// `C`: close the channel.
    Close,
    /// `tiiil..`, `Tiiiiiiiil..`, `riiil`, `Riiiiiiiil`: send a frame.
    Transmit(Frame),
    /// `Z0`, `Z1`: time stamps on received frames.
    TimeStamps(bool),
    /// `F`: the status flags.
    Status,
    /// `V`: the version.
    Version,
    /// `N`: the serial number.
    SerialNumber,
    /// `Mxxxxxxxx`: the acceptance code.
    AcceptanceCode(u32),
    /// `mxxxxxxxx`: the acceptance mask.
    AcceptanceMask(u32),
    /// `X0`, `X1`: whether frames come by themselves.
    AutoSend(bool),
    /// An empty line, which hosts send to clear the line of half a command.
    Empty,
}

/// What an adapter sends to a host.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// CR: done.
    Done,
    /// BEL: refused.
    Refused,
    /// `z` or, for an extended identifier, `Z`: the frame is in the send queue.
    Queued {
        /// Extended identifier.
        extended: bool,
    },
    /// A received frame, with its time stamp in milliseconds of a minute (0 to 59,999) when those are on.
    Frame {
        /// The frame.
        frame: Frame,
        /// Milliseconds, modulo one minute.
        stamp_ms: Option<u16>,
    },
    /// `Fxx`: the status flags.
    Status(u8),
    /// `Vhhss`: hardware and software version; some firmwares put other text here.
    Version(String),
    /// `Nxxxx`: the serial number.
    SerialNumber(String),
}

/// Why a line is not an slcan line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Malformed {
    /// No CR came within [`MAX_LINE_LENGTH`] bytes; the line was skipped.
    #[error("line longer than {MAX_LINE_LENGTH} characters")]
    TooLong,
    /// Anything else.
    #[error("cannot read the line '{text}': expected {expected}")]
    Syntax {
        /// The line.
        text: String,
        /// The form that would have been right.
        expected: &'static str,
    },
}

/// Rates of `S0` to `S8`, in bit/s.
const BITRATES: [u32; 9] = [10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000];

/// The bit rate that `S` with this digit selects; `None` for digits above 8.
pub fn bitrate_of_code(code: u8) -> Option<Bitrate> {
    BITRATES.get(usize::from(code)).copied().and_then(Bitrate::new)
}

/// The digit behind `S` for a bit rate; `None` when slcan has none for it.
pub fn bitrate_code(bitrate: Bitrate) -> Option<u8> {
    BITRATES.iter().position(|rate| *rate == bitrate.bits_per_second()).map(|code| code as u8)
}

/// A line of one direction.
pub trait Line: Sized {
    /// What BEL means in this direction: an answer by itself, or nothing.
    const BEL: Option<Self>;

    /// Reads a line without its CR.
    fn parse(line: &str) -> Result<Self, Malformed>;

    /// Appends the line with its CR (or BEL).
    fn emit(&self, out: &mut Vec<u8>);
}

const FRAME_FORM: &str = "tIIIL, TIIIIIIIIL, rIIIL or RIIIIIIIIL (L from 0 to 8), behind t and T two digits a byte";
const FLAG_FORM: &str = "0 or 1 behind the letter";

impl Line for Command {
    const BEL: Option<Self> = None;

    fn parse(line: &str) -> Result<Self, Malformed> {
        let error = |expected| Malformed::Syntax { text: text::shown(line), expected };
        let exact_hex = |digits, expected| {
            let value = line.get(1..).filter(|rest| rest.len() == digits);
            value.and_then(|rest| text::parse_hex(rest, digits)).ok_or_else(|| error(expected))
        };
        let flag = || match exact_hex(1, FLAG_FORM)? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(error(FLAG_FORM)),
        };
        let alone = |command| if line.len() == 1 { Ok(command) } else { Err(error("the letter alone")) };
        match line.as_bytes().first() {
            None => Ok(Self::Empty),
            Some(b't' | b'T' | b'r' | b'R') => match parse_frame(line.as_bytes()) {
                Some((frame, [])) => Ok(Self::Transmit(frame)),
                _ => Err(error(FRAME_FORM)),
            },
            Some(b'S') => match exact_hex(1, "S0 to S8")? {
                code @ 0..=8 => Ok(Self::SetBitrate(code as u8)),
                _ => Err(error("S0 to S8")),
            },
            Some(b's') => exact_hex(4, "s and four digits").map(|value| Self::SetTimingRegisters(value as u16)),
            Some(b'O') => alone(Self::Open),
            Some(b'L') => alone(Self::OpenListenOnly),
            Some(b'C') => alone(Self::Close),
            Some(b'F') => alone(Self::Status),
            Some(b'V') => alone(Self::Version),
            Some(b'N') => alone(Self::SerialNumber),
            Some(b'Z') => flag().map(Self::TimeStamps),
            Some(b'X') => flag().map(Self::AutoSend),
            Some(b'M') => exact_hex(8, "M and eight digits").map(Self::AcceptanceCode),
            Some(b'm') => exact_hex(8, "m and eight digits").map(Self::AcceptanceMask),
            Some(_) => Err(error("one of S s O L C t T r R Z F V N M m X")),
        }
    }

    fn emit(&self, out: &mut Vec<u8>) {
        let numbered = |out: &mut Vec<u8>, letter, value, digits| {
            out.push(letter);
            push_hex(out, value, digits);
        };
        match *self {
            Self::SetBitrate(code) => numbered(out, b'S', u32::from(code), 1),
            Self::SetTimingRegisters(value) => numbered(out, b's', u32::from(value), 4),
            Self::Open => out.push(b'O'),
            Self::OpenListenOnly => out.push(b'L'),
            Self::Close => out.push(b'C'),
            Self::Transmit(frame) => emit_frame(&frame, out),
            Self::TimeStamps(on) => numbered(out, b'Z', u32::from(on), 1),
            Self::Status => out.push(b'F'),
            Self::Version => out.push(b'V'),
            Self::SerialNumber => out.push(b'N'),
            Self::AcceptanceCode(value) => numbered(out, b'M', value, 8),
            Self::AcceptanceMask(value) => numbered(out, b'm', value, 8),
            Self::AutoSend(on) => numbered(out, b'X', u32::from(on), 1),
            Self::Empty => {}
        }
        out.push(CR);
    }
}

impl Line for Answer {
    const BEL: Option<Self> = Some(Self::Refused);

    fn parse(line: &str) -> Result<Self, Malformed> {
        let error = |expected| Malformed::Syntax { text: text::shown(line), expected };
        match line.as_bytes() {
            [] => Ok(Self::Done),
            [b'z'] => Ok(Self::Queued { extended: false }),
            [b'Z'] => Ok(Self::Queued { extended: true }),
            [b't' | b'T' | b'r' | b'R', ..] => match parse_frame(line.as_bytes()) {
                Some((frame, [])) => Ok(Self::Frame { frame, stamp_ms: None }),
                Some((frame, stamp)) => parse_stamp(stamp)
                    .map(|stamp| Self::Frame { frame, stamp_ms: Some(stamp) })
                    .ok_or_else(|| error("a time stamp of four digits behind the frame")),
                None => Err(error(FRAME_FORM)),
            },
            [b'F', ..] => {
                let flags = text::parse_hex(&line[1..], 2).ok_or_else(|| error("F and two digits"))?;
                Ok(Self::Status(flags as u8))
            }
            [b'V', ..] => Ok(Self::Version(line[1..].to_owned())),
            [b'N', ..] => Ok(Self::SerialNumber(line[1..].to_owned())),
            _ => Err(error("a frame, z, Z, F.., V.. or N..")),
        }
    }

    fn emit(&self, out: &mut Vec<u8>) {
        match self {
            Self::Done => {}
            Self::Refused => return out.push(BEL),
            Self::Queued { extended } => out.push(if *extended { b'Z' } else { b'z' }),
            Self::Frame { frame, stamp_ms } => {
                emit_frame(frame, out);
                if let Some(stamp) = stamp_ms {
                    push_hex(out, u32::from(*stamp), 4);
                }
            }
            Self::Status(flags) => {
                out.push(b'F');
                push_hex(out, u32::from(*flags), 2);
            }
            Self::Version(words) => {
                out.push(b'V');
                out.extend_from_slice(words.as_bytes());
            }
            Self::SerialNumber(words) => {
                out.push(b'N');
                out.extend_from_slice(words.as_bytes());
            }
        }
        out.push(CR);
    }
}

/// A frame at the start of `line`, and what follows it.
fn parse_frame(line: &[u8]) -> Option<(Frame, &[u8])> {
    let (kind, rest) = line.split_first()?;
    let extended = matches!(kind, b'T' | b'R');
    let (digits, rest) = rest.split_at_checked(if extended { 8 } else { 3 })?;
    let raw = text::parse_hex(std::str::from_utf8(digits).ok()?, 8)?;
    let id = match extended {
        true => (raw <= CanId::MAX_EXTENDED).then(|| CanId::extended(raw))?,
        false => (raw <= u32::from(CanId::MAX_STANDARD)).then(|| CanId::standard(raw as u16))?,
    };
    let (length @ b'0'..=b'8', rest) = rest.split_first()? else { return None };
    let length = usize::from(length - b'0');
    if matches!(kind, b'r' | b'R') {
        return Some((Frame::remote(id, length as u8), rest));
    }
    let (pairs, rest) = rest.split_at_checked(2 * length)?;
    let mut data = [0; MAX_DATA_LENGTH];
    for (byte, pair) in data.iter_mut().zip(pairs.chunks_exact(2)) {
        *byte = text::hex_digit(pair[0])? << 4 | text::hex_digit(pair[1])?;
    }
    Some((Frame::new(id, &data[..length]), rest))
}

fn parse_stamp(digits: &[u8]) -> Option<u16> {
    let text = std::str::from_utf8(digits).ok().filter(|text| text.len() == 4)?;
    text::parse_hex(text, 4).map(|value| value as u16)
}

fn emit_frame(frame: &Frame, out: &mut Vec<u8>) {
    let id = frame.id();
    out.push(match (id.is_extended(), frame.is_remote()) {
        (false, false) => b't',
        (false, true) => b'r',
        (true, false) => b'T',
        (true, true) => b'R',
    });
    text::push_hex_id(out, id);
    push_decimal(out, u64::from(frame.dlc()));
    for byte in frame.data() {
        push_hex(out, u32::from(*byte), 2);
    }
}

/// Cuts a byte stream into lines of type `L`. Line feeds are ignored, so that a terminal may be the host.
#[derive(Clone, Debug)]
pub struct Decoder<L> {
    buffer: [u8; MAX_LINE_LENGTH],
    length: usize,
    line: PhantomData<L>,
}

impl<L> Default for Decoder<L> {
    fn default() -> Self {
        Self { buffer: [0; MAX_LINE_LENGTH], length: 0, line: PhantomData }
    }
}

impl<L: Line> Decoder<L> {
    /// Consumes `input` up to the end of the next line and returns that; `None` when `input` is used up.
    pub fn next(&mut self, input: &mut &[u8]) -> Option<Result<L, Malformed>> {
        while let [byte, rest @ ..] = *input {
            *input = rest;
            match *byte {
                CR => return Some(self.end()),
                b'\n' => {}
                BEL if L::BEL.is_some() => {
                    // BEL stands alone: what came before it was half a line.
                    self.length = 0;
                    return L::BEL.map(Ok);
                }
                byte => {
                    if let Some(cell) = self.buffer.get_mut(self.length) {
                        *cell = byte;
                    }
                    self.length = (self.length + 1).min(MAX_LINE_LENGTH + 1);
                }
            }
        }
        None
    }

    fn end(&mut self) -> Result<L, Malformed> {
        let length = std::mem::take(&mut self.length);
        let kept = self.buffer.get(..length).ok_or(Malformed::TooLong)?;
        match std::str::from_utf8(kept) {
            Ok(text) if text.is_ascii() => L::parse(text),
            _ => Err(Malformed::Syntax { text: text::shown_bytes(kept), expected: "plain text" }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn emitted(line: &impl Line) -> Vec<u8> {
        let mut out = Vec::new();
        line.emit(&mut out);
        out
    }

    fn decode<L: Line + PartialEq + std::fmt::Debug>(bytes: &[u8]) -> Vec<Result<L, Malformed>> {
        let mut decoder = Decoder::default();
        let mut input = bytes;
        std::iter::from_fn(|| decoder.next(&mut input)).collect()
    }

    fn any_frame() -> impl Strategy<Value = Frame> {
        let id = prop_oneof![
            (0..=CanId::MAX_STANDARD).prop_map(CanId::standard),
            (0..=CanId::MAX_EXTENDED).prop_map(CanId::extended)
        ];
        let data = proptest::collection::vec(any::<u8>(), 0..=MAX_DATA_LENGTH);
        (id, data, any::<bool>()).prop_map(|(id, data, is_remote)| match is_remote {
            true => Frame::remote(id, data.len() as u8),
            false => Frame::new(id, &data),
        })
    }

    #[test]
    fn frames_have_the_form_of_the_manual() {
        for (text, frame) in [
            (&b"t10021133\r"[..], "100#1133"),
            (b"T0000010021133\r", "00000100#1133"),
            (b"r1002\r", "100#R2"),
            (b"R000001002\r", "00000100#R2"),
            (b"t7FF0\r", "7FF#"),
            (b"T1FFFFFFF0\r", "1FFFFFFF#"),
        ] {
            let frame: Frame = frame.parse().unwrap();
            assert_eq!(emitted(&Command::Transmit(frame)), text);
            assert_eq!(decode::<Command>(text), [Ok(Command::Transmit(frame))]);
            assert_eq!(decode::<Answer>(text), [Ok(Answer::Frame { frame, stamp_ms: None })]);
        }
        let frame = "100#1133".parse().unwrap();
        assert_eq!(decode::<Answer>(b"t10021133EA5F\r"), [Ok(Answer::Frame { frame, stamp_ms: Some(59_999) })]);
    }

    #[test]
    fn commands_and_answers_read_what_they_write() {
        use Command::*;
        for command in [
            SetBitrate(6),
            SetTimingRegisters(0x031C),
            Open,
            OpenListenOnly,
            Close,
            TimeStamps(true),
            TimeStamps(false),
            Status,
            Version,
            SerialNumber,
            AcceptanceCode(0),
            AcceptanceMask(u32::MAX),
            AutoSend(true),
            Empty,
        ] {
            assert_eq!(decode::<Command>(&emitted(&command)), [Ok(command)]);
        }
        for answer in [
            Answer::Done,
            Answer::Refused,
            Answer::Queued { extended: false },
            Answer::Queued { extended: true },
            Answer::Status(0x80),
            Answer::Version("1013".into()),
            Answer::SerialNumber("A123".into()),
        ] {
            assert_eq!(decode::<Answer>(&emitted(&answer)), [Ok(answer)]);
        }
    }

    proptest! {
        #[test]
        fn any_frame_reads_as_it_was_written(frame in any_frame(), stamp_ms in proptest::option::of(0..60_000_u16)) {
            let answer = Answer::Frame { frame, stamp_ms };
            prop_assert_eq!(decode::<Command>(&emitted(&Command::Transmit(frame))), [Ok(Command::Transmit(frame))]);
            prop_assert_eq!(decode::<Answer>(&emitted(&answer)), [Ok(answer)]);
        }
    }

    #[test]
    fn malformed_lines_cost_only_themselves() {
        for line in [
            &b"t"[..],
            b"t1002113",
            b"t100211334",
            b"t8000",
            b"t1009",
            b"T200000000",
            b"t10x0",
            b"t1002113x",
            b"S9",
            b"S",
            b"S66",
            b"OO",
            b"Z2",
            b"s123",
            b"M1",
            b"P",
            b"\xFF",
            b"t\xC3\xA410",
            b"\x07",
            b"< open can0 >",
        ] {
            let stream = [line, b"\rV\r"].concat();
            let found = decode::<Command>(&stream);
            assert!(matches!(found[..], [Err(Malformed::Syntax { .. }), Ok(Command::Version)]), "{line:?}: {found:?}");
        }
        let endless = [&[b't'; 100_000][..], b"\rV\r"].concat();
        assert_eq!(decode::<Command>(&endless), [Err(Malformed::TooLong), Ok(Command::Version)]);
    }

    #[test]
    fn bell_ends_half_an_answer() {
        assert_eq!(decode::<Answer>(b"t100\x07z\r"), [Ok(Answer::Refused), Ok(Answer::Queued { extended: false })]);
    }

    proptest! {
        /// How a stream may be cut is a law of `tests`.
        #[test]
        fn random_bytes_never_panic_and_never_hide_what_follows(
            pieces in proptest::collection::vec("(t|T|r|R|100|00000100|8|1122334455667788|\r|\n|S6|Z1|.)", 0..30)
        ) {
            let stream = [pieces.concat().as_bytes(), b"\rN\r"].concat();
            prop_assert_eq!(decode::<Command>(&stream).pop(), Some(Ok(Command::SerialNumber)));
            prop_assert_eq!(decode::<Answer>(&stream).pop(), Some(Ok(Answer::SerialNumber(String::new()))));
        }
    }

    #[test]
    fn bit_rates_have_the_manuals_digits() {
        assert_eq!(bitrate_of_code(6), Some(Bitrate::K500));
        assert_eq!(bitrate_of_code(8), Some(Bitrate::M1));
        assert_eq!(bitrate_of_code(9), None);
        for code in 0..=8 {
            assert_eq!(bitrate_code(bitrate_of_code(code).unwrap()), Some(code));
        }
    }
}
