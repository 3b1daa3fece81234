//! A connection to a socketcand server.

use std::collections::VecDeque;
use std::time::Duration;

use can::{Frame, Instant};
use canlog::text;

use super::codec::{Decoder, Message, Request, ServerReply};
use crate::link::{Link, within};
use crate::note::Suspicions;
use crate::reconnect::Reopen;
use crate::socketcan::notes_of;
use crate::{AsyncBus, BusError, Note, Received, WallClock};

/// How long the server may take for one step of the greeting.
const PATIENCE: Duration = Duration::from_secs(5);

/// The class of an error message is its identifier without the flags.
const CLASS_MASK: u32 = 0x1FFF_FFFF;

/// A bus behind a socketcand server, in raw mode.
#[derive(Debug)]
pub struct SocketcandBus {
    link: Link,
    decoder: Decoder<ServerReply>,
    clock: WallClock,
    /// What one error message said and was not fetched yet: a handful.
    notes: VecDeque<Note>,
    suspicions: Suspicions,
}

impl SocketcandBus {
    /// Connects to `address` (`HOST:PORT`) and opens `bus` there.
    pub async fn connect(address: &str, bus: &str, clock: &WallClock) -> Result<Self, BusError> {
        let link = Link::connect(address, clock).await?;
        let mut connection = Self {
            link,
            decoder: Decoder::default(),
            clock: clock.clone(),
            notes: VecDeque::new(),
            suspicions: Suspicions::default(),
        };
        connection.expect(ServerReply::Hi, "< hi >", "the greeting").await?;
        for request in [Request::Open(bus.to_owned()), Request::RawMode] {
            let shown = if request == Request::RawMode { "rawmode".to_owned() } else { format!("open {bus}") };
            connection.link.send(|out| request.emit(out)).await?;
            connection.expect(ServerReply::Ok, "< ok >", &shown).await?;
        }
        Ok(connection)
    }

    async fn expect(&mut self, expected: ServerReply, text: &'static str, request: &str) -> Result<(), BusError> {
        let clock = self.clock.clone();
        match within(&clock, PATIENCE, self.reply()).await {
            Some(Ok(reply)) if reply == expected => Ok(()),
            Some(Ok(ServerReply::Error(said))) => {
                Err(BusError::Refused { address: self.link.address(), request: request.to_owned(), said })
            }
            Some(Ok(reply)) => {
                let received = format!("{reply:?}");
                Err(BusError::Unexpected { address: self.link.address(), received, expected: text })
            }
            Some(Err(error)) => Err(error),
            None => Err(BusError::Silent { address: self.link.address(), expected: text, protocol: "socketcand" }),
        }
    }

    async fn reply(&mut self) -> Result<ServerReply, BusError> {
        loop {
            let decoder = &mut self.decoder;
            match self.link.take(|input| decoder.next(input)) {
                Some(Ok(reply)) => return Ok(reply),
                Some(Err(source)) => return Err(BusError::Malformed { address: self.link.address(), source }),
                None => self.link.fill().await?,
            }
        }
    }
}

/// Address and bus.
impl Reopen for SocketcandBus {
    type Place = (String, String);

    async fn open((address, bus): Self::Place, clock: WallClock) -> Result<Self, BusError> {
        Self::connect(&address, &bus, &clock).await
    }
}

impl AsyncBus for SocketcandBus {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.link.send(|out| Request::Send(*frame).emit(out)).await
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        loop {
            if let Some(note) = self.notes.pop_front() {
                let note = Received::Note(note);
                self.notes.extend(self.suspicions.after(&note));
                return Ok((self.clock.now(), note));
            }
            match self.reply().await? {
                ServerReply::Frame { frame, .. } => {
                    let frame = Received::Frame(frame);
                    self.notes.extend(self.suspicions.after(&frame));
                    return Ok((self.clock.now(), frame));
                }
                ServerReply::Error(said) => match error_class(&said) {
                    Some(class) => self.notes.extend(notes_of(class, [0; 8])),
                    None => {
                        let request = "a frame".to_owned();
                        return Err(BusError::Refused { address: self.link.address(), request, said });
                    }
                },
                ServerReply::Hi | ServerReply::Ok | ServerReply::Echo => {}
            }
        }
    }
}

/// `< error 004 23.424242 >` reports an error frame on the bus: class (with or without the flag of error messages) and
/// time. It is not an answer to a request.
fn error_class(said: &str) -> Option<u32> {
    let mut words = said.split_ascii_whitespace();
    let class = text::parse_hex(words.next()?, 8)?;
    words.next().is_none_or(|time| text::parse_seconds(time).is_some()).then_some(class & CLASS_MASK)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_frames_are_distinguished_from_refusals() {
        assert_eq!([error_class("004 23.424242"), error_class("20000080")], [Some(4), Some(0x80)]);
        assert_eq!(["bad request", "unknown command", ""].map(error_class), [None; 3]);
    }
}
