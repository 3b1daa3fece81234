//! The adapter's side of one slcan connection, as LAWICEL's CANUSB behaves with auto-send on.

use std::collections::VecDeque;

use can::{Bitrate, Frame, Instant};

use crate::codec::{Answer, Command, Decoder, Line, bitrate_of_code};
use crate::status::Status;

/// Hardware version 1.0 (there is none), software version of this crate's first release.
const VERSION: &str = "1001";
const SERIAL_NUMBER: &str = "FD01";

/// Time stamps wrap after a minute.
const STAMP_PERIOD_MS: u64 = 60_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ChannelState {
    Closed,
    Open,
    ListenOnly,
}

/// Answers that may wait to be fetched before no more commands are read: a client that only asks and never reads stops itself.
const MAX_WAITING_REPLIES: usize = 64;

/// One connection to an adapter; frames go to and come from the bus that its owner has.
#[derive(Clone, Debug)]
pub struct Adapter {
    /// The rate of the bus served, if the client's choice is to be held against it.
    bus_bitrate: Option<Bitrate>,
    /// What the client selected; `None` for nothing, or for raw timing registers.
    bitrate: Option<Bitrate>,
    channel: ChannelState,
    time_stamps: bool,
    /// Flags of the status that stand for what has been: reading it clears them.
    happened: u8,
    decoder: Decoder<Command>,
    replies: VecDeque<Answer>,
}

impl Adapter {
    /// An adapter with its channel closed. With `bus_bitrate`, a client that selected another rate cannot open it.
    pub fn new(bus_bitrate: Option<Bitrate>) -> Self {
        Self {
            bus_bitrate,
            bitrate: None,
            channel: ChannelState::Closed,
            time_stamps: false,
            happened: 0,
            decoder: Decoder::default(),
            replies: VecDeque::new(),
        }
    }

    fn handle(&mut self, command: Command) -> (Answer, Option<Frame>) {
        if let Command::Transmit(frame) = command {
            return match self.channel {
                ChannelState::Open => (Answer::Queued { extended: frame.id().is_extended() }, Some(frame)),
                ChannelState::Closed | ChannelState::ListenOnly => (Answer::Refused, None),
            };
        }
        let is_closed = self.channel == ChannelState::Closed;
        let answer = match command {
            Command::Version => Answer::Version(VERSION.to_owned()),
            Command::SerialNumber => Answer::SerialNumber(SERIAL_NUMBER.to_owned()),
            Command::Empty | Command::AutoSend(true) => Answer::Done,
            // No other flag can be set: the bus is never off, and a client that falls behind is disconnected.
            Command::Status if !is_closed => Answer::Status(std::mem::take(&mut self.happened)),
            Command::Close if !is_closed => self.set(ChannelState::Closed),
            Command::Open if is_closed && self.rate_fits() => self.set(ChannelState::Open),
            Command::OpenListenOnly if is_closed && self.rate_fits() => self.set(ChannelState::ListenOnly),
            Command::SetBitrate(code) if is_closed => {
                self.bitrate = bitrate_of_code(code);
                Answer::Done
            }
            Command::SetTimingRegisters(_) if is_closed => {
                self.bitrate = None;
                Answer::Done
            }
            Command::TimeStamps(on) if is_closed => {
                self.time_stamps = on;
                Answer::Done
            }
            // The values that let everything pass; filtering is not offered.
            Command::AcceptanceCode(0) | Command::AcceptanceMask(u32::MAX) if is_closed => Answer::Done,
            _ => Answer::Refused,
        };
        (answer, None)
    }

    fn rate_fits(&self) -> bool {
        self.bitrate.is_none() || self.bus_bitrate.is_none() || self.bitrate == self.bus_bitrate
    }

    fn set(&mut self, channel: ChannelState) -> Answer {
        self.channel = channel;
        Answer::Done
    }
}

impl Adapter {
    /// Consumes `input` until it yields a frame for the bus, or is used up, or too many answers wait to be fetched.
    pub fn receive(&mut self, input: &mut &[u8]) -> Option<Frame> {
        while self.replies.len() < MAX_WAITING_REPLIES {
            let (answer, frame) = match self.decoder.next(input)? {
                Ok(command) => self.handle(command),
                Err(_) => (Answer::Refused, None),
            };
            self.replies.push_back(answer);
            if frame.is_some() {
                return frame;
            }
        }
        None
    }

    /// Whether the channel is open.
    pub fn is_open(&self) -> bool {
        self.channel != ChannelState::Closed
    }

    /// Appends the next answer; false when none waits.
    pub fn next_reply(&mut self, out: &mut Vec<u8>) -> bool {
        let reply = self.replies.pop_front();
        reply.iter().for_each(|reply| reply.emit(out));
        reply.is_some()
    }

    /// Appends a frame that was on the bus at `at`, if the channel is open.
    pub fn deliver(&mut self, at: Instant, frame: &Frame, out: &mut Vec<u8>) {
        if self.is_open() {
            let stamp = (at.as_nanos() / 1_000_000 % STAMP_PERIOD_MS) as u16;
            Answer::Frame { frame: *frame, stamp_ms: self.time_stamps.then_some(stamp) }.emit(out);
        }
    }

    /// An error was on the bus: the protocol has no message for it, and the status shows it.
    pub fn deliver_error(&mut self) {
        if self.is_open() {
            self.happened |= Status::BUS_ERROR.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exchange(adapter: &mut Adapter, input: &str) -> (String, usize) {
        let mut input = input.as_bytes();
        let frames = std::iter::from_fn(|| adapter.receive(&mut input)).count();
        let mut out = Vec::new();
        while adapter.next_reply(&mut out) {}
        (String::from_utf8(out).unwrap(), frames)
    }

    fn heard(adapter: &mut Adapter, at: Instant) -> String {
        let mut out = Vec::new();
        adapter.deliver(at, &"184#0102".parse().unwrap(), &mut out);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn a_closed_channel_neither_sends_nor_hears() {
        let mut adapter = Adapter::new(None);
        assert_eq!(exchange(&mut adapter, "t1000\rF\rC\r"), ("\x07\x07\x07".into(), 0));
        assert_eq!(heard(&mut adapter, Instant::ZERO), "");
        assert_eq!(exchange(&mut adapter, "S6\rO\r"), ("\r\r".into(), 0));
        assert_eq!(exchange(&mut adapter, "t1000\rT000001001FF\rr1002\r"), ("z\rZ\rz\r".into(), 3));
        assert_eq!(heard(&mut adapter, Instant::ZERO), "t18420102\r");
        assert_eq!(exchange(&mut adapter, "C\rt1000\r"), ("\r\x07".into(), 0));
        assert_eq!(heard(&mut adapter, Instant::ZERO), "");
    }

    #[test]
    fn listen_only_hears_and_refuses_to_send() {
        let mut adapter = Adapter::new(None);
        assert_eq!(exchange(&mut adapter, "L\rt1000\r"), ("\r\x07".into(), 0));
        assert_eq!(heard(&mut adapter, Instant::ZERO), "t18420102\r");
    }

    #[test]
    fn the_status_reports_a_bus_error_once() {
        let mut adapter = Adapter::new(None);
        adapter.deliver_error();
        assert_eq!(exchange(&mut adapter, "O\rF\r").0, "\rF00\r", "a closed channel hears nothing");
        adapter.deliver_error();
        // LAWICEL's CANUSB manual, command F: bit 7 is the bus error; reading clears it.
        assert_eq!(exchange(&mut adapter, "F\rF\r").0, "F80\rF00\r");
    }

    #[test]
    fn settings_are_made_while_the_channel_is_closed() {
        let mut adapter = Adapter::new(None);
        assert_eq!(exchange(&mut adapter, "Z1\rs031C\rM00000000\rmFFFFFFFF\rX1\rO\r").0, "\r\r\r\r\r\r");
        assert_eq!(exchange(&mut adapter, "Z0\rS6\rs031C\rO\rL\rM00000000\r").0, "\x07".repeat(6));
        assert_eq!(heard(&mut adapter, Instant::from_millis(61_234)), "t1842010204D2\r");
        assert_eq!(exchange(&mut adapter, "V\rN\rF\r\r").0, "V1001\rNFD01\rF00\r\r");
        assert_eq!(exchange(&mut adapter, "M12345678\rP\rhello\rS9\r").0, "\x07".repeat(4));
    }

    #[test]
    fn a_rate_that_is_not_the_buses_opens_nothing_where_that_is_asked_for() {
        let mut adapter = Adapter::new(Some(Bitrate::K500));
        assert_eq!(exchange(&mut adapter, "S8\rO\rL\rS6\rO\r").0, "\r\x07\x07\r\r");
        assert_eq!(exchange(&mut Adapter::new(None), "S8\rO\r").0, "\r\r");
    }
}
