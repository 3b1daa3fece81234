//! A connection to an slcan adapter on a serial line, or to an slcan server over TCP.

use std::time::Duration;

use can::{Bitrate, Frame, Instant};

use super::codec::{Answer, Command, Decoder, Line, bitrate_code};
use crate::link::{Link, within};
use crate::{AsyncBus, BusError, Note, Received, WallClock};

/// How long an adapter may take for an answer. Some firmwares never acknowledge; those cost this much at opening.
const PATIENCE: Duration = Duration::from_millis(500);

/// A bus behind an slcan adapter, its channel open.
#[derive(Debug)]
pub struct SlcanBus {
    link: Link,
    decoder: Decoder<Answer>,
    clock: WallClock,
    refused: u64,
    malformed: u64,
}

impl SlcanBus {
    /// Connects to `address` (`HOST:PORT`), selects `bitrate` if given, and opens the channel.
    pub async fn connect(address: &str, bitrate: Option<Bitrate>, clock: &WallClock) -> Result<Self, BusError> {
        Self::open(Link::connect(address, clock).await?, bitrate, clock).await
    }

    /// Opens the serial device `path` with `baud` on the line, selects `bitrate` if given, and opens the channel.
    pub async fn open_serial(
        path: &str,
        baud: u32,
        bitrate: Option<Bitrate>,
        clock: &WallClock,
    ) -> Result<Self, BusError> {
        Self::open(Link::open_serial(path, baud)?, bitrate, clock).await
    }

    /// Frames that the adapter answered with BEL: it was in bus-off, or its send queue was full. They are lost, as on a
    /// real bus; the services above notice by their timeouts.
    pub fn frames_refused(&self) -> u64 {
        self.refused
    }

    /// Lines that were no slcan: noise on the line, or an extension of the firmware. They are skipped.
    pub fn lines_malformed(&self) -> u64 {
        self.malformed
    }

    /// Closes the channel, so that the adapter stops acknowledging frames on the bus.
    pub async fn close(mut self) -> Result<(), BusError> {
        self.link.send(|out| Command::Close.emit(out)).await
    }

    async fn open(link: Link, bitrate: Option<Bitrate>, clock: &WallClock) -> Result<Self, BusError> {
        let code = match bitrate {
            Some(bitrate) => Some(bitrate_code(bitrate).ok_or(BusError::NoSlcanBitrate { bitrate })?),
            None => None,
        };
        let mut bus = Self { link, decoder: Decoder::default(), clock: clock.clone(), refused: 0, malformed: 0 };
        // What an earlier host left half typed ends here, and its channel closes. How many of these lines are answered
        // differs between adapters; the answer to V tells that all of them have been.
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
        bus.malformed = 0;
        Ok(bus)
    }

    /// Sends a command and waits for CR; true if it came, false if nothing came.
    async fn request(&mut self, command: Command, advice: &str) -> Result<bool, BusError> {
        self.link.send(|out| command.emit(out)).await?;
        match self.wait_for(|answer| matches!(answer, Answer::Done | Answer::Refused)).await? {
            Some(Answer::Refused) => {
                let request = format!("{command:?}");
                Err(BusError::Refused { address: self.link.address(), request, said: advice.to_owned() })
            }
            answer => Ok(answer.is_some()),
        }
    }

    async fn wait_for(&mut self, wanted: impl Fn(&Answer) -> bool) -> Result<Option<Answer>, BusError> {
        let clock = self.clock.clone();
        let search = async {
            loop {
                match self.answer().await {
                    Ok(answer) if !wanted(&answer) => {}
                    result => return result,
                }
            }
        };
        within(&clock, PATIENCE, search).await.transpose()
    }

    async fn answer(&mut self) -> Result<Answer, BusError> {
        loop {
            let decoder = &mut self.decoder;
            match self.link.take(|input| decoder.next(input)) {
                Some(Ok(answer)) => return Ok(answer),
                Some(Err(_)) => self.malformed += 1,
                None => self.link.fill().await?,
            }
        }
    }
}

impl AsyncBus for SlcanBus {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.link.send(|out| Command::Transmit(*frame).emit(out)).await
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        loop {
            match self.answer().await? {
                Answer::Frame { frame, .. } => return Ok((self.clock.now(), frame.into())),
                Answer::Refused => {
                    self.refused += 1;
                    return Ok((self.clock.now(), Note::SendQueueFull.into()));
                }
                _ => {}
            }
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio_serial::SerialStream;

    use super::*;

    /// Answers one line after the other on the adapter's end of a serial line; what it was told.
    async fn adapter(mut line: SerialStream, answers: &[&str]) -> String {
        let mut told = Vec::new();
        for answer in answers {
            while line.read_u8().await.map(|byte| told.push(byte)).is_ok() && told.last() != Some(&b'\r') {}
            line.write_all(answer.as_bytes()).await.unwrap();
        }
        String::from_utf8(told).unwrap()
    }

    #[tokio::test]
    async fn opens_a_serial_adapter_whatever_state_it_was_left_in() {
        let clock = WallClock::start();
        let (host, line) = SerialStream::pair().unwrap();
        // The channel was open and half a command stood in the buffer: BEL, CR, CR, then the version.
        let answers = ["\x07", "t1002", "1133\r\r", "V1013\r", "\r", "\r", "z\rnoise\r\x07t10021133\r"];
        let (told, bus) = tokio::join!(adapter(line, &answers), async {
            let mut bus = SlcanBus::open(Link::over_serial("tty", host), Some(Bitrate::K500), &clock).await.unwrap();
            bus.send(&"601#40".parse().unwrap()).await.unwrap();
            assert_eq!(bus.recv().await.unwrap().1, Note::SendQueueFull.into());
            assert_eq!(bus.recv().await.unwrap().1, "100#1133".parse::<Frame>().unwrap().into());
            bus
        });
        assert_eq!(told, "\r\rC\rV\rS6\rO\rt601140\r");
        assert_eq!((bus.frames_refused(), bus.lines_malformed()), (1, 1));
    }

    #[tokio::test]
    async fn a_refused_open_and_a_silent_line_are_told_apart() {
        let clock = WallClock::start();
        let (host, line) = SerialStream::pair().unwrap();
        let answers = ["\r", "\r", "\r", "V1013\r", "\x07"];
        let link = Link::over_serial("tty", host);
        let (_, refused) = tokio::join!(adapter(line, &answers), SlcanBus::open(link, None, &clock));
        assert!(refused.unwrap_err().to_string().contains("select a bit rate with ?bitrate=500k"));
        let (host, _line) = SerialStream::pair().unwrap();
        let silent = SlcanBus::open(Link::over_serial("tty", host), None, &clock).await.unwrap_err();
        assert!(matches!(silent, BusError::Silent { .. }), "{silent}");
        let odd = Bitrate::new(40_000).unwrap();
        let (host, _line) = SerialStream::pair().unwrap();
        let odd = SlcanBus::open(Link::over_serial("tty", host), Some(odd), &clock).await.unwrap_err();
        assert!(odd.to_string().contains("cannot select 40k"), "{odd}");
    }
}
