//! A connection to an slcan adapter on a serial line, or to an slcan server over TCP.

use std::collections::VecDeque;
use std::time::Duration;

use can::{Bitrate, Frame, Instant};
use canlog::{Finding, Place};

use super::codec::{Answer, Command, Decoder, Line, Malformed, bitrate_code};
use super::status;
use crate::link::{Link, within};
use crate::note::{ControllerState, Note};
use crate::reconnect::Reopen;
use crate::{AsyncBus, BusError, Received, WallClock};

/// How long an adapter may take for an answer. Some firmwares never acknowledge; those cost this much at opening.
const PATIENCE: Duration = Duration::from_millis(500);

/// How often the status flags are asked for: often enough for a person, and one frame's worth of the line.
const STATUS_PERIOD: Duration = Duration::from_secs(1);

/// A bus behind an slcan adapter, its channel open.
#[derive(Debug)]
pub struct SlcanBus {
    link: Link,
    decoder: Decoder<Answer>,
    clock: WallClock,
    polling: Polling,
    /// As the flags were last.
    state: ControllerState,
    /// What the flags showed and was not fetched yet: a handful.
    notes: VecDeque<Note>,
    lines: usize,
    refused: u64,
    malformed: u64,
}

/// Whether the adapter reports its status flags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Polling {
    /// It does not.
    Never,
    /// Asked for the first time: answers come in the order of the commands, so a BEL that comes next says no.
    Asked,
    /// Asked, by one that answers.
    AskedAgain,
    /// It does, and is asked again then.
    Due(Instant),
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
        self.link.send(|out| Command::Close.emit(out)).await
    }

    async fn begin(link: Link, bitrate: Option<Bitrate>, clock: &WallClock) -> Result<Self, BusError> {
        let code = match bitrate {
            Some(bitrate) => Some(bitrate_code(bitrate).ok_or(BusError::NoSlcanBitrate { bitrate })?),
            None => None,
        };
        let mut bus = Self {
            link,
            decoder: Decoder::default(),
            clock: clock.clone(),
            polling: Polling::Never,
            state: ControllerState::ErrorActive,
            notes: VecDeque::new(),
            lines: 0,
            refused: 0,
            malformed: 0,
        };
        // What an earlier host left half typed ends here, and its channel closes. How many of these lines are answered
        // differs between adapters; the answer to V shows that all of them have been.
        for command in [Command::Empty, Command::Empty, Command::Close, Command::Version] {
            bus.link.send(|out| command.emit(out)).await?;
        }
        let mut answered = bus.wait_for(|answer| matches!(answer, Answer::Version(_))).await?.is_some();
        if let Some(code) = code {
            answered |= bus.request(Command::SetBitrate(code), "the adapter does not offer this bit rate").await?;
        }
        let advice = if code.is_some() { "is the bit rate right?" } else { "select a bit rate with ?bitrate=500k" };
        answered |= bus.request(Command::Open, advice).await?;
        if !answered {
            let expected = "an answer to V or O";
            return Err(BusError::Silent { address: bus.link.address(), expected, protocol: "slcan" });
        }
        (bus.malformed, bus.lines) = (0, 0);
        bus.polling = Polling::Asked;
        bus.link.send(|out| Command::Status.emit(out)).await?;
        Ok(bus)
    }

    /// Sends a command and waits for CR; true if it came, false if nothing came.
    async fn request(&mut self, command: Command, advice: &str) -> Result<bool, BusError> {
        self.link.send(|out| command.emit(out)).await?;
        match self.wait_for(|answer| matches!(answer, Answer::Done | Answer::Refused)).await? {
            Some(Answer::Refused) => {
                let mut line = Vec::new();
                command.emit(&mut line);
                let request = String::from_utf8_lossy(line.trim_ascii_end()).into_owned();
                Err(BusError::Refused { address: self.link.address(), request, said: advice.to_owned() })
            }
            answer => Ok(answer.is_some()),
        }
    }

    async fn wait_for(&mut self, wanted: impl Fn(&Answer) -> bool) -> Result<Option<Answer>, BusError> {
        let clock = self.clock.clone();
        let search = async {
            loop {
                match self.line().await? {
                    Ok(answer) if wanted(&answer) => return Ok(answer),
                    Ok(_) | Err(_) => {}
                }
            }
        };
        within(&clock, PATIENCE, search).await.transpose()
    }

    /// The next line, for which it waits as long as it takes.
    async fn line(&mut self) -> Result<Result<Answer, Malformed>, BusError> {
        loop {
            let decoder = &mut self.decoder;
            match self.link.take(|input| decoder.next(input)) {
                Some(line) => {
                    self.lines += 1;
                    return Ok(line);
                }
                None => self.link.fill().await?,
            }
        }
    }

    /// The next line, or `None` when the status flags are to be asked for.
    async fn line_until_due(&mut self) -> Result<Option<Result<Answer, Malformed>>, BusError> {
        let Polling::Due(at) = self.polling else { return self.line().await.map(Some) };
        let clock = self.clock.clone();
        tokio::select! {
            biased;
            line = self.line() => line.map(Some),
            () = clock.sleep_until(at) => Ok(None),
        }
    }

    fn handle_status(&mut self, flags: u8) {
        self.polling = Polling::Due(self.clock.now() + STATUS_PERIOD);
        let state = status::state(flags);
        if std::mem::replace(&mut self.state, state) != state {
            self.notes.push_back(Note::State(state));
        }
        self.notes.extend(status::happened(flags));
    }

    fn handle_refusal(&mut self) {
        if self.polling == Polling::Asked {
            self.polling = Polling::Never;
        } else {
            self.refused += 1;
            self.notes.push_back(Note::SendQueueFull);
        }
    }

    fn handle_malformed(&mut self, malformed: &Malformed) {
        self.malformed += 1;
        let (text, reason) = match malformed {
            Malformed::TooLong => (String::new(), malformed.to_string()),
            Malformed::Syntax { text, expected } => (text.clone(), format!("expected {expected}")),
        };
        self.notes.push_back(Note::TornRecord(Finding { place: Place::Line(self.lines as u64), text, reason }));
    }
}

impl AsyncBus for SlcanBus {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.link.send(|out| Command::Transmit(*frame).emit(out)).await
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        loop {
            if let Some(note) = self.notes.pop_front() {
                return Ok((self.clock.now(), note.into()));
            }
            match self.line_until_due().await? {
                Some(Ok(Answer::Frame { frame, .. })) => return Ok((self.clock.now(), frame.into())),
                Some(Ok(Answer::Status(flags))) => self.handle_status(flags),
                Some(Ok(Answer::Refused)) => self.handle_refusal(),
                Some(Ok(_)) => {}
                Some(Err(malformed)) => self.handle_malformed(&malformed),
                None => {
                    // First, so that a call that is dropped here asks once all the same.
                    self.polling = Polling::AskedAgain;
                    self.link.send(|out| Command::Status.emit(out)).await?;
                }
            }
        }
    }
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
