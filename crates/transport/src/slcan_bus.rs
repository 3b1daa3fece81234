//! A connection to an slcan adapter on a serial line, or to an slcan server over TCP.

use std::collections::VecDeque;

use can::{Bitrate, Frame, Instant};
use canlog::{Finding, Place};
use slcan::{Client, Event, Malformed, OpenError, Status};

use crate::link::Link;
use crate::note::{ControllerState, ErrorFrame, ErrorKind, ErrorKinds, Note};
use crate::reconnect::Reopen;
use crate::{AsyncBus, BusError, Received, WallClock};

/// A bus behind an slcan adapter, its channel open.
#[derive(Debug)]
pub struct SlcanBus {
    link: Link,
    client: Client,
    clock: WallClock,
    /// As the flags were last.
    state: ControllerState,
    /// What the adapter said and was not fetched yet.
    notes: VecDeque<Note>,
    refused: u64,
    malformed: u64,
}

/// Where an adapter is, and the bit rate to select there.
#[derive(Clone, Debug)]
pub(crate) struct SlcanPlace {
    /// `HOST:PORT`, or the device.
    pub(crate) address: String,
    /// Line speed, of a device.
    pub(crate) baud: Option<u32>,
    pub(crate) bitrate: Option<Bitrate>,
}

impl Reopen for SlcanBus {
    type Place = SlcanPlace;

    async fn open(SlcanPlace { address, baud, bitrate }: SlcanPlace, clock: WallClock) -> Result<Self, BusError> {
        match baud {
            Some(baud) => Self::open_serial(&address, baud, bitrate, &clock).await,
            None => Self::connect(&address, bitrate, &clock).await,
        }
    }
}

impl SlcanBus {
    /// Connects to `address` (`HOST:PORT`), selects `bitrate` if given, and opens the channel.
    pub async fn connect(address: &str, bitrate: Option<Bitrate>, clock: &WallClock) -> Result<Self, BusError> {
        Self::begin(Link::connect(address, clock).await?, bitrate, clock).await
    }

    /// Opens the serial device `path` with `baud` on the line, selects `bitrate` if given, and opens the channel.
    pub async fn open_serial(
        path: &str,
        baud: u32,
        bitrate: Option<Bitrate>,
        clock: &WallClock,
    ) -> Result<Self, BusError> {
        Self::begin(Link::open_serial(path, baud, clock)?, bitrate, clock).await
    }

    /// Frames that the adapter answered with BEL: it was in bus-off, or its send queue was full. They are lost, as on a
    /// real bus; the services above notice by their timeouts.
    pub fn frames_refused(&self) -> u64 {
        self.refused
    }

    /// Lines that were not slcan: noise on the line, or an extension of the firmware. They are skipped, and reported.
    pub fn lines_malformed(&self) -> u64 {
        self.malformed
    }

    /// Closes the channel, so that the adapter stops acknowledging frames on the bus.
    pub async fn close(mut self) -> Result<(), BusError> {
        self.client.close();
        self.flush().await
    }

    async fn begin(link: Link, bitrate: Option<Bitrate>, clock: &WallClock) -> Result<Self, BusError> {
        let not_selected = || BusError::NoSlcanBitrate { bitrate: bitrate.unwrap_or(Bitrate::K500) };
        let mut bus = Self {
            link,
            client: Client::open(bitrate, clock.now()).ok_or_else(not_selected)?,
            clock: clock.clone(),
            state: ControllerState::ErrorActive,
            notes: VecDeque::new(),
            refused: 0,
            malformed: 0,
        };
        loop {
            bus.flush().await?;
            match bus.client.poll_event() {
                Some(Event::Opened) => return Ok(bus),
                Some(Event::Failed(error)) => return Err(bus.not_opened(&error, bitrate)),
                Some(_) => {}
                None => bus.wait().await?,
            }
        }
    }

    fn not_opened(&self, error: &OpenError, bitrate: Option<Bitrate>) -> BusError {
        let address = self.link.address();
        let (request, said) = match error {
            OpenError::BitrateRefused(code) => (format!("S{code}"), "the adapter does not offer this bit rate"),
            OpenError::OpenRefused if bitrate.is_some() => ("O".to_owned(), "is the bit rate right?"),
            OpenError::OpenRefused => ("O".to_owned(), "select a bit rate with ?bitrate=500k"),
            OpenError::Silent => {
                return BusError::Silent { address, expected: "an answer to V or O", protocol: "slcan" };
            }
        };
        BusError::Refused { address, request, said: said.to_owned() }
    }

    /// Sends what the client has for the adapter. Cancel-safe.
    async fn flush(&mut self) -> Result<(), BusError> {
        let client = &mut self.client;
        if !client.has_output() {
            return Ok(());
        }
        self.link.send(|out| client.append_output(out)).await
    }

    /// Waits for bytes of the adapter, or until the client is due. Cancel-safe.
    async fn wait(&mut self) -> Result<(), BusError> {
        let (client, clock) = (&mut self.client, &self.clock);
        tokio::select! {
            biased;
            filled = self.link.fill() => {
                filled?;
                self.link.take(|input| client.handle_input(std::mem::take(input), clock.now()));
            }
            () = clock.sleep_until_due(client.poll_timeout()) => client.handle_timeout(clock.now()),
        }
        Ok(())
    }

    fn handle_status(&mut self, flags: Status) {
        let state = state_of(flags);
        if std::mem::replace(&mut self.state, state) != state {
            self.notes.push_back(Note::State(state));
        }
        self.notes.extend(happened(flags));
    }

    fn handle_malformed(&mut self, line: u64, malformed: &Malformed) {
        self.malformed += 1;
        let (text, reason) = match malformed {
            Malformed::TooLong => (String::new(), malformed.to_string()),
            Malformed::Syntax { text, expected } => (text.clone(), format!("expected {expected}")),
        };
        self.notes.push_back(Note::TornRecord(Finding { place: Place::Line(line), text, reason }));
    }
}

impl AsyncBus for SlcanBus {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.client.transmit(frame);
        self.flush().await
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        loop {
            if let Some(note) = self.notes.pop_front() {
                return Ok((self.clock.now(), note.into()));
            }
            match self.client.poll_event() {
                Some(Event::Frame(frame)) => return Ok((self.clock.now(), frame.into())),
                Some(Event::Status(flags)) => self.handle_status(flags),
                Some(Event::FrameRefused) => {
                    self.refused += 1;
                    self.notes.push_back(Note::SendQueueFull);
                }
                Some(Event::Malformed(line, malformed)) => self.handle_malformed(line, &malformed),
                Some(Event::Silent) => return Err(BusError::FellSilent { address: self.link.address() }),
                // Of the opening.
                Some(Event::Opened | Event::Failed(_)) => {}
                None => {
                    self.flush().await?;
                    self.wait().await?;
                }
            }
        }
    }
}

/// The state of the controller by its flags.
const fn state_of(flags: Status) -> ControllerState {
    if flags.is_error_passive() {
        ControllerState::ErrorPassive
    } else if flags.is_error_warning() {
        ControllerState::ErrorWarning
    } else {
        ControllerState::ErrorActive
    }
}

/// What flags show beside the state.
fn happened(flags: Status) -> impl Iterator<Item = Note> {
    let lost = flags.is_arbitration_lost().then_some(ErrorKind::LostArbitration);
    let error = ErrorFrame { kinds: lost.into_iter().collect::<ErrorKinds>(), ..ErrorFrame::default() };
    [
        flags.is_receive_lost().then_some(Note::Overrun { lost: None }),
        flags.is_send_queue_full().then_some(Note::SendQueueFull),
        (flags.is_arbitration_lost() || flags.is_bus_error()).then_some(Note::ErrorFrame(error)),
    ]
    .into_iter()
    .flatten()
}

#[cfg(all(test, unix))]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio_serial::SerialStream;

    use super::*;

    /// Answers one line after the other on the adapter's end of a serial line; what it was sent.
    async fn adapter(mut line: SerialStream, answers: &[&str]) -> String {
        let mut received = Vec::new();
        for answer in answers {
            while line.read_u8().await.map(|byte| received.push(byte)).is_ok() && received.last() != Some(&b'\r') {}
            line.write_all(answer.as_bytes()).await.unwrap();
        }
        String::from_utf8(received).unwrap()
    }

    #[tokio::test]
    async fn opens_a_serial_adapter_whatever_state_it_was_left_in() {
        let clock = WallClock::start();
        let (host, line) = SerialStream::pair().unwrap();
        // The channel was open and half a command stood in the buffer: BEL, CR, CR, then the version.
        // Then flags of an error-passive adapter that has lost arbitration; a frame with a time stamp comes last.
        let frames = "z\rnoise\r\x07t100211330FA0\r";
        let answers = ["\x07", "t1002", "1133\r\r", "V1013\r", "\r", "\r", "F64\r", frames];
        let (received, bus) = tokio::join!(adapter(line, &answers), async {
            let mut bus =
                SlcanBus::begin(Link::over_serial("tty", host, &clock), Some(Bitrate::K500), &clock).await.unwrap();
            bus.send(&"601#40".parse().unwrap()).await.unwrap();
            let mut notes = Vec::new();
            let frame = loop {
                match bus.recv().await.unwrap().1 {
                    Received::Note(note) => notes.push(note.to_string()),
                    Received::Frame(frame) => break frame,
                }
            };
            assert_eq!(frame, "100#1133".parse().unwrap());
            let torn = "line 3 passed over, 'noise': expected a frame, z, Z, F.., V.. or N..";
            let full = "a frame could not be sent and is lost: the send queue is full";
            let lost = "error frame: arbitration lost";
            assert_eq!(notes, ["the controller is error-passive", lost, torn, full]);
            bus
        });
        assert_eq!(received, "\r\rC\rV\rS6\rO\rF\rt601140\r");
        assert_eq!((bus.frames_refused(), bus.lines_malformed()), (1, 1));
    }

    #[tokio::test]
    async fn an_adapter_that_falls_silent_ends_the_bus_as_a_lost_connection() {
        let clock = WallClock::start();
        let (host, line) = SerialStream::pair().unwrap();
        let opening = SlcanBus::begin(Link::over_serial("tty", host, &clock), None, &clock);
        let (_, bus) = tokio::join!(adapter(line, &["\r", "\r", "\r", "V1013\r", "\r"]), opening);
        let mut bus = bus.unwrap();
        // Its silence in the client's time, without waiting.
        while let Some(at) = bus.client.poll_timeout() {
            bus.client.handle_timeout(at);
        }
        let error = bus.recv().await.unwrap_err();
        assert!(error.is_loss_of_connection() && error.to_string().starts_with("tty says nothing any more"), "{error}");
    }

    #[tokio::test]
    async fn a_refused_open_and_a_silent_line_are_distinguished() {
        let clock = WallClock::start();
        let (host, line) = SerialStream::pair().unwrap();
        let answers = ["\r", "\r", "\r", "V1013\r", "\x07"];
        let link = Link::over_serial("tty", host, &clock);
        let (_, refused) = tokio::join!(adapter(line, &answers), SlcanBus::begin(link, None, &clock));
        assert!(refused.unwrap_err().to_string().contains("select a bit rate with ?bitrate=500k"));
        let (host, _line) = SerialStream::pair().unwrap();
        let silent = SlcanBus::begin(Link::over_serial("tty", host, &clock), None, &clock).await.unwrap_err();
        assert!(matches!(silent, BusError::Silent { .. }), "{silent}");
        let odd = Bitrate::new(40_000).unwrap();
        let (host, _line) = SerialStream::pair().unwrap();
        let odd = SlcanBus::begin(Link::over_serial("tty", host, &clock), Some(odd), &clock).await.unwrap_err();
        assert!(odd.to_string().contains("cannot select 40k"), "{odd}");
    }
}
