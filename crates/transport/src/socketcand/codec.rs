//! socketcand messages as data: [`Request`] from client to server, [`ServerReply`] back, and a [`Decoder`] for either.
//!
//! Pure: bytes in, messages out; no message longer than [`MAX_MESSAGE_LENGTH`] is ever kept. Bytes may arrive cut
//! anywhere. After a malformed message the decoder goes on at the next `<`.

use std::marker::PhantomData;

use can::{CanId, Frame, Instant, MAX_DATA_LENGTH};
use canlog::text::{self, push_decimal, push_hex, push_hex_id, push_seconds};

/// Longest message between `<` and `>`, in bytes. The longest that raw mode needs is 60; socketcand's open-ended ones
/// (`muxfilter`, `sendpdu`) are not served here.
pub const MAX_MESSAGE_LENGTH: usize = 256;

/// What a client asks of a server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// `< open can0 >`
    Open(String),
    /// `< rawmode >`: from now on send me every frame.
    RawMode,
    /// `< bcmmode >`: back to broadcast-manager mode, in which no frame comes without a subscription.
    BcmMode,
    /// `< echo >`
    Echo,
    /// `< send 123 2 11 22 >`, or `< sendrtr 123 2 >` for a remote frame.
    Send(Frame),
    /// A command of the protocol that this implementation does not serve, by its name.
    Unsupported(&'static str),
}

/// What a server sends to a client.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ServerReply {
    /// `< hi >`: the greeting.
    Hi,
    /// `< ok >`
    Ok,
    /// `< echo >`
    Echo,
    /// `< frame 123 23.424242 1122 >`, or `< rtr 123 23.424242 2 >` for a remote frame. `at` counts from the server's
    /// zero (Unix time on Linux) and travels in whole microseconds.
    Frame {
        /// When the frame was on the bus.
        at: Instant,
        /// The frame.
        frame: Frame,
    },
    /// `< error .. >`: a refusal in words, or an error frame of the bus (class and time).
    Error(String),
}

/// Why a piece of a socketcand stream is not a message.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Malformed {
    /// No `>` came within [`MAX_MESSAGE_LENGTH`] bytes; the message was skipped up to its `>`.
    #[error("message longer than {MAX_MESSAGE_LENGTH} characters")]
    TooLong,
    /// Text between messages.
    #[error("'{0}' stands outside of angle brackets; a message looks like < open can0 >")]
    Stray(String),
    /// A new `<` came before the `>`.
    #[error("'{0}' ends without '>'")]
    Unclosed(String),
    /// No such command.
    #[error("unknown command '{0}'; known are open, rawmode, bcmmode, send, sendrtr and echo")]
    Unknown(String),
    /// A known command with something wrong in it.
    #[error("cannot read '{text}': expected {expected}")]
    Syntax {
        /// What stands between the brackets.
        text: String,
        /// The form that would have been right.
        expected: &'static str,
    },
}

/// A message of one direction.
pub trait Message: Sized {
    /// Reads what stands between `<` and `>`.
    fn parse(body: &str) -> Result<Self, Malformed>;

    /// Appends the message, brackets included.
    fn emit(&self, out: &mut Vec<u8>);
}

const SEND_FORM: &str = "send ID LENGTH and as many bytes as LENGTH says (0 to 8), all hexadecimal; \
                         an extended identifier has 8 digits; a remote frame goes by sendrtr";
const SENDRTR_FORM: &str = "sendrtr ID LENGTH (0 to 8)";
const FRAME_FORM: &str = "frame ID SECONDS.MICROSECONDS and 0 to 8 bytes as pairs of hexadecimal digits";
const RTR_FORM: &str = "rtr ID SECONDS.MICROSECONDS LENGTH (0 to 8)";

/// Commands of `protocol.md` beyond raw mode.
const UNSUPPORTED: [&str; 12] = [
    "add",
    "update",
    "delete",
    "filter",
    "muxfilter",
    "subscribe",
    "unsubscribe",
    "controlmode",
    "statistics",
    "isotpmode",
    "isotpconf",
    "sendpdu",
];

impl Message for Request {
    fn parse(body: &str) -> Result<Self, Malformed> {
        let syntax = |expected| Malformed::Syntax { text: text::shown(body), expected };
        let mut words = body.split_ascii_whitespace();
        let request = match words.next() {
            Some("send") => return parse_send(words).ok_or_else(|| syntax(SEND_FORM)),
            Some("sendrtr") => return parse_sendrtr(words).ok_or_else(|| syntax(SENDRTR_FORM)),
            Some("open") => Self::Open(words.next().ok_or_else(|| syntax("open BUS"))?.to_owned()),
            Some("rawmode") => Self::RawMode,
            Some("bcmmode") => Self::BcmMode,
            Some("echo") => Self::Echo,
            Some(name) => match UNSUPPORTED.iter().find(|known| **known == name) {
                Some(known) => return Ok(Self::Unsupported(known)),
                None => return Err(Malformed::Unknown(text::shown(name))),
            },
            None => return Err(syntax("a command")),
        };
        if words.next().is_none() { Ok(request) } else { Err(syntax("nothing more after the command")) }
    }

    fn emit(&self, out: &mut Vec<u8>) {
        match self {
            Self::Open(bus) => {
                out.extend_from_slice(b"< open ");
                out.extend_from_slice(bus.as_bytes());
            }
            Self::RawMode => out.extend_from_slice(b"< rawmode"),
            Self::BcmMode => out.extend_from_slice(b"< bcmmode"),
            Self::Echo => out.extend_from_slice(b"< echo"),
            Self::Send(frame) => emit_send(frame, out),
            Self::Unsupported(name) => {
                out.extend_from_slice(b"< ");
                out.extend_from_slice(name.as_bytes());
            }
        }
        out.extend_from_slice(b" >");
    }
}

impl ServerReply {
    /// `< error CLASS SECONDS >`: an error frame of the bus, by its class in Linux's messages (`CAN_ERR_*`).
    pub(super) fn error_frame(at: Instant, class: u32) -> Self {
        let micros = at.as_nanos() / 1_000;
        Self::Error(format!("{class:03X} {}.{:06}", micros / 1_000_000, micros % 1_000_000))
    }
}

impl Message for ServerReply {
    fn parse(body: &str) -> Result<Self, Malformed> {
        let syntax = |expected| Malformed::Syntax { text: text::shown(body), expected };
        let mut words = body.split_ascii_whitespace();
        match words.next() {
            Some("frame") => parse_frame(words).ok_or_else(|| syntax(FRAME_FORM)),
            Some("rtr") => parse_rtr(words).ok_or_else(|| syntax(RTR_FORM)),
            Some("hi") => Ok(Self::Hi),
            Some("ok") => Ok(Self::Ok),
            Some("echo") => Ok(Self::Echo),
            Some("error") => Ok(Self::Error(body.trim().strip_prefix("error").unwrap_or(body).trim().to_owned())),
            _ => Err(syntax("hi, ok, echo, frame, rtr or error")),
        }
    }

    fn emit(&self, out: &mut Vec<u8>) {
        match self {
            Self::Hi => out.extend_from_slice(b"< hi >"),
            Self::Ok => out.extend_from_slice(b"< ok >"),
            Self::Echo => out.extend_from_slice(b"< echo >"),
            Self::Frame { at, frame } => emit_frame(*at, frame, out),
            Self::Error(words) => {
                out.extend_from_slice(b"< error ");
                let room = out.len() + MAX_MESSAGE_LENGTH - 16;
                for mut letter in words.chars().filter(|letter| !letter.is_control()) {
                    if matches!(letter, '<' | '>') {
                        letter = '\'';
                    }
                    let mut bytes = [0; 4];
                    let bytes = letter.encode_utf8(&mut bytes).as_bytes();
                    if out.len() + bytes.len() > room {
                        break;
                    }
                    out.extend_from_slice(bytes);
                }
                out.extend_from_slice(b" >");
            }
        }
    }
}

fn parse_send<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Request> {
    let id = parse_id(words.next()?)?;
    let length = parse_length(words.next()?)?;
    let mut data = [0; MAX_DATA_LENGTH];
    for byte in &mut data[..length] {
        *byte = text::parse_hex(words.next()?, 2)? as u8;
    }
    words.next().is_none().then(|| Request::Send(Frame::new(id, &data[..length])))
}

fn parse_sendrtr<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Request> {
    let id = parse_id(words.next()?)?;
    let length = parse_length(words.next()?)?;
    words.next().is_none().then(|| Request::Send(Frame::remote(id, length as u8)))
}

/// The bytes may stand together (as the daemon writes them) or apart (as its documentation does).
fn parse_frame<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<ServerReply> {
    let id = parse_id(words.next()?)?;
    let at = text::parse_seconds(words.next()?)?;
    let mut data = [0; MAX_DATA_LENGTH];
    let mut length = 0;
    for word in words {
        let (pairs, []) = word.as_bytes().as_chunks::<2>() else { return None };
        for pair in pairs {
            let (high, low) = (text::hex_digit(pair[0])?, text::hex_digit(pair[1])?);
            *data.get_mut(length)? = high << 4 | low;
            length += 1;
        }
    }
    Some(ServerReply::Frame { at, frame: Frame::new(id, &data[..length]) })
}

fn parse_rtr<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<ServerReply> {
    let id = parse_id(words.next()?)?;
    let at = text::parse_seconds(words.next()?)?;
    let length = parse_length(words.next()?)?;
    words.next().is_none().then(|| ServerReply::Frame { at, frame: Frame::remote(id, length as u8) })
}

/// Eight digits make an extended identifier, fewer a standard one.
fn parse_id(word: &str) -> Option<CanId> {
    let raw = text::parse_hex(word, 8)?;
    match word.len() {
        8 => (raw <= CanId::MAX_EXTENDED).then(|| CanId::extended(raw)),
        _ => (raw <= u32::from(CanId::MAX_STANDARD)).then(|| CanId::standard(raw as u16)),
    }
}

fn parse_length(word: &str) -> Option<usize> {
    match word.as_bytes() {
        [digit @ b'0'..=b'8'] => Some(usize::from(digit - b'0')),
        _ => None,
    }
}

fn emit_send(frame: &Frame, out: &mut Vec<u8>) {
    out.extend_from_slice(if frame.is_remote() { b"< sendrtr " } else { b"< send " });
    push_hex_id(out, frame.id());
    out.push(b' ');
    push_decimal(out, u64::from(frame.dlc()));
    for byte in frame.data() {
        out.push(b' ');
        push_hex(out, u32::from(*byte), 2);
    }
}

fn emit_frame(at: Instant, frame: &Frame, out: &mut Vec<u8>) {
    out.extend_from_slice(if frame.is_remote() { b"< rtr " } else { b"< frame " });
    push_hex_id(out, frame.id());
    out.push(b' ');
    push_seconds(out, at);
    out.push(b' ');
    if frame.is_remote() {
        push_decimal(out, u64::from(frame.dlc()));
    }
    for byte in frame.data() {
        push_hex(out, u32::from(*byte), 2);
    }
    out.extend_from_slice(b" >");
}

/// Cuts a byte stream into messages of type `M`.
#[derive(Clone, Debug)]
pub struct Decoder<M> {
    buffer: [u8; MAX_MESSAGE_LENGTH],
    length: usize,
    place: StreamPlace,
    message: PhantomData<M>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum StreamPlace {
    Between,
    Stray,
    Inside,
    Overlong,
}

impl<M> Default for Decoder<M> {
    fn default() -> Self {
        Self { buffer: [0; MAX_MESSAGE_LENGTH], length: 0, place: StreamPlace::Between, message: PhantomData }
    }
}

impl<M: Message> Decoder<M> {
    /// Consumes `input` up to the end of the next message and returns that; `None` when `input` is used up.
    pub fn next(&mut self, input: &mut &[u8]) -> Option<Result<M, Malformed>> {
        while let [byte, rest @ ..] = *input {
            let found = self.step(*byte);
            // The '<' that ends a stray or unclosed piece begins the next message: leave it where it is.
            if !(*byte == b'<' && found.is_some()) {
                *input = rest;
            }
            if found.is_some() {
                return found;
            }
        }
        None
    }

    fn step(&mut self, byte: u8) -> Option<Result<M, Malformed>> {
        match (self.place, byte) {
            (StreamPlace::Between, b'<') => self.begin(StreamPlace::Inside),
            (StreamPlace::Between, byte) if byte.is_ascii_whitespace() || byte == 0 => None,
            (StreamPlace::Between, byte) => {
                self.begin(StreamPlace::Stray);
                self.keep(byte);
                None
            }
            (StreamPlace::Stray, b'<' | b'\n') => self.end(|text| Err(Malformed::Stray(text::shown(text)))),
            (StreamPlace::Inside, b'<') => self.end(|text| Err(Malformed::Unclosed(text::shown(text)))),
            (StreamPlace::Inside, b'>') => self.end(M::parse),
            (StreamPlace::Overlong, b'<' | b'>') => self.end(|_| Err(Malformed::TooLong)),
            (StreamPlace::Overlong, _) => None,
            (StreamPlace::Stray | StreamPlace::Inside, byte) => {
                if !self.keep(byte) && self.place == StreamPlace::Inside {
                    self.place = StreamPlace::Overlong;
                }
                None
            }
        }
    }

    fn begin(&mut self, place: StreamPlace) -> Option<Result<M, Malformed>> {
        self.place = place;
        self.length = 0;
        None
    }

    fn keep(&mut self, byte: u8) -> bool {
        match self.buffer.get_mut(self.length) {
            Some(cell) => {
                *cell = byte;
                self.length += 1;
                true
            }
            None => false,
        }
    }

    fn end(&mut self, read: impl FnOnce(&str) -> Result<M, Malformed>) -> Option<Result<M, Malformed>> {
        self.place = StreamPlace::Between;
        let kept = &self.buffer[..self.length];
        Some(match std::str::from_utf8(kept) {
            Ok(text) => read(text),
            Err(_) => Err(Malformed::Syntax { text: text::shown_bytes(kept), expected: "plain text" }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, all};

    fn emitted(message: &impl Message) -> Vec<u8> {
        let mut out = Vec::new();
        message.emit(&mut out);
        out
    }

    fn decode<M: Message + PartialEq + std::fmt::Debug>(bytes: &[u8]) -> Vec<Result<M, Malformed>> {
        let mut decoder = Decoder::default();
        all(bytes, |input| decoder.next(input))
    }

    fn frame(text: &str) -> Frame {
        text.parse().unwrap()
    }

    #[test]
    fn messages_have_the_form_of_the_protocol_document() {
        let at = Instant::from_micros(23_424_242);
        let reply = |text| ServerReply::Frame { at, frame: frame(text) };
        assert_eq!(emitted(&reply("123#11223344")), b"< frame 123 23.424242 11223344 >");
        assert_eq!(emitted(&reply("080#")), b"< frame 080 23.424242  >");
        assert_eq!(emitted(&reply("1AAAAAAA#01F1")), b"< frame 1AAAAAAA 23.424242 01F1 >");
        assert_eq!(emitted(&reply("123#R4")), b"< rtr 123 23.424242 4 >");
        assert_eq!(emitted(&Request::Send(frame("123#"))), b"< send 123 0 >");
        assert_eq!(emitted(&Request::Send(frame("1AAAAAAA#01F1"))), b"< send 1AAAAAAA 2 01 F1 >");
        assert_eq!(emitted(&Request::Send(frame("1AAAAAAA#R2"))), b"< sendrtr 1AAAAAAA 2 >");
        assert_eq!(emitted(&Request::Open("can0".into())), b"< open can0 >");
    }

    #[test]
    fn reads_what_real_peers_write() {
        // python-can: bytes unpadded, two blanks when there are none.
        assert_eq!(
            decode::<Request>(b"< send 604 8 40 41 60 0 0 0 0 0 >"),
            [Ok(Request::Send(frame("604#4041600000000000")))]
        );
        assert_eq!(decode::<Request>(b"< send 080 0  >"), [Ok(Request::Send(frame("080#")))]);
        // socketcandcl: a blank after every byte, `open` and `rawmode` in one go.
        assert_eq!(
            decode::<Request>(b"< open can0 >< rawmode >< send 123 2 0a ff  >"),
            [Ok(Request::Open("can0".into())), Ok(Request::RawMode), Ok(Request::Send(frame("123#0AFF")))]
        );
        // The document's own spellings: no blank before a word, bytes of a frame apart.
        assert_eq!(decode::<Request>(b"<open can0>"), [Ok(Request::Open("can0".into()))]);
        let at = Instant::from_micros(23_424_242);
        assert_eq!(
            decode::<ServerReply>(b"< frame 123 23.424242 11 22 33 44 >"),
            [Ok(ServerReply::Frame { at, frame: frame("123#11223344") })]
        );
        assert_eq!(decode::<ServerReply>(b"< error 004 1.5 >"), [Ok(ServerReply::Error("004 1.5".into()))]);
    }

    #[test]
    fn malformed_messages_say_what_is_wrong_and_cost_only_themselves() {
        for (bytes, said) in [
            (&b"< send 123 9 0 0 0 0 0 0 0 0 0 >"[..], "expected send ID LENGTH"),
            (b"< send 123 2 11 >", "expected send ID LENGTH"),
            (b"< send 123 1 11 22 >", "expected send ID LENGTH"),
            (b"< send 800 0 >", "8 digits"),
            (b"< send FFFFFFFF 0 >", "8 digits"),
            (b"< send 123 1 100 >", "cannot read 'send 123 1 100'"),
            (b"< sendrtr 123 >", "expected sendrtr ID LENGTH"),
            (b"< open >", "expected open BUS"),
            (b"< >", "expected a command"),
            (b"< echo echo >", "nothing more"),
            (b"< dance >", "unknown command 'dance'"),
            (
                b"open can0
",
                "outside of angle brackets",
            ),
            (b"garbage", "outside of angle brackets"),
            (b"< send 123 1 ", "ends without '>'"),
            (b"< \xFF\xFE >", "plain text"),
        ] {
            let stream = [bytes, b"< echo >"].concat();
            let [Err(error), Ok(Request::Echo)] = &decode::<Request>(&stream)[..] else {
                panic!("{:?}", decode::<Request>(&stream));
            };
            assert!(error.to_string().contains(said), "{error}");
        }
    }

    #[test]
    fn an_endless_message_is_skipped_without_being_kept() {
        let stream = [b"< send ", &[b'1'; 100_000][..], b" >< echo >"].concat();
        assert_eq!(decode::<Request>(&stream), [Err(Malformed::TooLong), Ok(Request::Echo)]);
    }

    #[test]
    fn an_error_text_cannot_forge_a_message() {
        let bytes = emitted(&ServerReply::Error("no bus 'x >< ok >\n'".into()));
        assert_eq!(decode::<ServerReply>(&bytes), [Ok(ServerReply::Error("no bus 'x '' ok ''".into()))]);
    }

    #[test]
    fn decoding_gives_back_what_was_emitted_wherever_the_bytes_are_cut() {
        let mut random = Random::new(0x5EED_0001);
        for _ in 0..2_000 {
            let at = Instant::from_micros(random.next() >> 12);
            let reply = ServerReply::Frame { at, frame: random.frame() };
            let request = Request::Send(random.frame());
            assert_eq!(decode::<ServerReply>(&emitted(&reply)), [Ok(reply)]);
            assert_eq!(decode::<Request>(&emitted(&request)), [Ok(request)]);
        }
    }

    #[test]
    fn random_bytes_never_panic_and_never_hide_what_follows() {
        let words = [
            &b"<"[..],
            b">",
            b" ",
            b"send",
            b"sendrtr",
            b"frame",
            b"rtr",
            b"123",
            b"1FFFFFFF",
            b"8",
            b"11",
            b"\xC3",
            b"\0",
            b"error",
            b"open",
            b"1.5",
            b"\n",
            b"can0",
        ];
        let mut random = Random::new(0x5EED_0002);
        for _ in 0..2_000 {
            let mut stream = random.salad(&words, 40);
            stream.extend_from_slice(b">\n< echo >");
            assert_eq!(decode::<Request>(&stream).last(), Some(&Ok(Request::Echo)));
            assert_eq!(decode::<ServerReply>(&stream).last(), Some(&Ok(ServerReply::Echo)));
        }
    }
}
