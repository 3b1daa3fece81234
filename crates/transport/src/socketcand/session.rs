//! The server's side of one socketcand connection.
//!
//! Clients such as python-can read once after each request of the greeting and compare the whole of what came with
//! `< hi >` or `< ok >`. So each of these goes out as a segment of its own, and frames stay away from it until the client
//! has had time to read it ([`QUIET_AFTER_OK`]) or has spoken again.

use std::collections::VecDeque;
use std::time::Duration;

use can::{Frame, Instant};

use super::codec::{Decoder, Message, Request, ServerReply};
use crate::hub::{MAX_WAITING_REPLIES, Session};

/// How long frames wait behind `< ok >` for a client that says nothing: long enough for a busy machine to schedule the
/// reader, too short to notice. The frames are delayed, not lost, and keep their time stamps.
const QUIET_AFTER_OK: Duration = Duration::from_millis(100);

/// What the protocol document calls modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    NoBus,
    Bcm,
    Raw,
    /// Refused: the connection ends when the reason has been written.
    Over,
}

#[derive(Clone, Debug)]
pub(crate) struct SocketcandSession {
    bus: String,
    /// Time stamp of [`Instant::ZERO`].
    zero: Duration,
    mode: Mode,
    decoder: Decoder<Request>,
    replies: VecDeque<ServerReply>,
}

impl SocketcandSession {
    /// A session that serves a bus named `bus` and stamps frames with their time plus `zero`.
    pub(crate) fn new(bus: &str, zero: Duration) -> Self {
        let replies = VecDeque::from([ServerReply::Hi]);
        Self { bus: bus.to_owned(), zero, mode: Mode::NoBus, decoder: Decoder::default(), replies }
    }

    fn handle(&mut self, request: Request) -> Option<Frame> {
        let reply = match (request, self.mode) {
            (Request::Echo, _) => ServerReply::Echo,
            (Request::Open(bus), Mode::NoBus) if bus == self.bus => self.enter(Mode::Bcm),
            (Request::Open(bus), Mode::NoBus) => {
                self.mode = Mode::Over;
                ServerReply::Error(format!("no bus '{}' here; this server has '{}'", bus, self.bus))
            }
            (Request::Open(_), _) => ServerReply::Error(format!("the bus '{}' is open already", self.bus)),
            (_, Mode::NoBus) => ServerReply::Error(format!("no bus is open; begin with open {}", self.bus)),
            (Request::RawMode, _) => self.enter(Mode::Raw),
            (Request::BcmMode, _) => self.enter(Mode::Bcm),
            (Request::Send(frame), _) => return Some(frame),
            (Request::Unsupported(name), _) => ServerReply::Error(format!(
                "'{name}' is not supported; this server has rawmode, send, sendrtr and echo"
            )),
        };
        self.replies.push_back(reply);
        None
    }

    fn enter(&mut self, mode: Mode) -> ServerReply {
        self.mode = mode;
        ServerReply::Ok
    }
}

impl Session for SocketcandSession {
    fn receive(&mut self, input: &mut &[u8]) -> Option<Frame> {
        while self.mode != Mode::Over && self.replies.len() < MAX_WAITING_REPLIES {
            match self.decoder.next(input)? {
                Ok(request) => {
                    if let Some(frame) = self.handle(request) {
                        return Some(frame);
                    }
                }
                Err(malformed) => self.replies.push_back(ServerReply::Error(malformed.to_string())),
            }
        }
        None
    }

    fn is_listening(&self) -> bool {
        self.mode == Mode::Raw
    }

    fn next_reply(&mut self, out: &mut Vec<u8>) -> Option<Duration> {
        let reply = self.replies.pop_front()?;
        reply.emit(out);
        Some(if reply == ServerReply::Ok { QUIET_AFTER_OK } else { Duration::ZERO })
    }

    fn deliver(&mut self, at: Instant, frame: &Frame, out: &mut Vec<u8>) {
        if self.is_listening() {
            ServerReply::Frame { at: at + self.zero, frame: *frame }.emit(out);
        }
    }

    fn deliver_error(&mut self, at: Instant, class: u32, out: &mut Vec<u8>) {
        if self.is_listening() {
            ServerReply::error_frame(at + self.zero, class).emit(out);
        }
    }

    fn is_over(&self) -> bool {
        self.mode == Mode::Over
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the session answers to `input`, and the frames it lets through.
    fn exchange(session: &mut SocketcandSession, mut input: &[u8]) -> (String, Vec<Frame>) {
        let (mut out, mut frames) = (Vec::new(), Vec::new());
        frames.extend(std::iter::from_fn(|| session.receive(&mut input)));
        while session.next_reply(&mut out).is_some() {}
        (String::from_utf8(out).unwrap(), frames)
    }

    #[test]
    fn a_client_gets_from_greeting_to_raw_mode() {
        let mut session = SocketcandSession::new("can0", Duration::from_secs(1_700_000_000));
        let mut out = Vec::new();
        assert_eq!(session.next_reply(&mut out), Some(Duration::ZERO));
        assert_eq!(out, b"< hi >");
        assert_eq!(exchange(&mut session, b"< rawmode >").0, "< error no bus is open; begin with open can0 >");
        assert_eq!(exchange(&mut session, b"< open can0 >").0, "< ok >");
        assert!(!session.is_listening());
        assert_eq!(exchange(&mut session, b"< rawmode >").0, "< ok >");
        assert!(session.is_listening());
        let frame: Frame = "604#40".parse().unwrap();
        assert_eq!(exchange(&mut session, b"< send 604 1 40 >< echo >"), ("< echo >".into(), vec![frame]));
        out.clear();
        session.deliver(Instant::from_millis(1500), &frame, &mut out);
        assert_eq!(out, b"< frame 604 1700000001.500000 40 >");
        // The protocol document of socketcand, "Error frame transmission": the class, then seconds and microseconds.
        out.clear();
        session.deliver_error(Instant::from_millis(1500), 0x88, &mut out);
        assert_eq!(out, b"< error 088 1700000001.500000 >");
        assert_eq!(exchange(&mut session, b"< bcmmode >").0, "< ok >");
        out.clear();
        session.deliver_error(Instant::ZERO, 0x88, &mut out);
        session.deliver(Instant::ZERO, &frame, &mut out);
        assert!(out.is_empty() && !session.is_over());
    }

    #[test]
    fn refusals_say_why() {
        let mut session = SocketcandSession::new("can0", Duration::ZERO);
        exchange(&mut session, b"< open can0 >");
        for (input, answer) in [
            (
                "< subscribe 0 0 123 >",
                "< error 'subscribe' is not supported; this server has rawmode, send, sendrtr and echo >",
            ),
            ("< open can0 >", "< error the bus 'can0' is open already >"),
            ("< jump >", "< error unknown command 'jump'; known are open, rawmode, bcmmode, send, sendrtr and echo >"),
        ] {
            assert_eq!(exchange(&mut session, input.as_bytes()), (answer.into(), vec![]));
        }
    }

    #[test]
    fn an_unknown_bus_ends_the_connection() {
        let mut session = SocketcandSession::new("can0", Duration::ZERO);
        let answer = exchange(&mut session, b"< open can1 >< rawmode >< send 1 0 >");
        assert_eq!(answer, ("< hi >< error no bus 'can1' here; this server has 'can0' >".into(), vec![]));
        assert!(session.is_over());
    }

    #[test]
    fn a_client_that_never_reads_stops_itself() {
        let mut session = SocketcandSession::new("can0", Duration::ZERO);
        let flood = b"< echo >".repeat(1000);
        let mut input = &flood[..];
        assert_eq!(session.receive(&mut input), None);
        assert_eq!(session.replies.len(), MAX_WAITING_REPLIES);
        assert!(!input.is_empty());
    }
}
