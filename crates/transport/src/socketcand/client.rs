//! A connection to a socketcand server.

use std::time::Duration;

use can::{Frame, Instant};

use super::codec::{Decoder, Message, Reply, Request};
use crate::link::{Link, within};
use crate::{AsyncBus, BusError, WallClock, text};

/// How long the server may take for one step of the greeting.
const PATIENCE: Duration = Duration::from_secs(5);

/// A bus behind a socketcand server, in raw mode.
#[derive(Debug)]
pub struct SocketcandBus {
    link: Link,
    decoder: Decoder<Reply>,
    clock: WallClock,
}

impl SocketcandBus {
    /// Connects to `address` (`HOST:PORT`) and opens `bus` there.
    pub async fn connect(address: &str, bus: &str, clock: &WallClock) -> Result<Self, BusError> {
        let link = Link::connect(address, clock).await?;
        let mut connection = Self { link, decoder: Decoder::default(), clock: clock.clone() };
        connection.expect(Reply::Hi, "< hi >", "the greeting").await?;
        for request in [Request::Open(bus.to_owned()), Request::RawMode] {
            let shown = if request == Request::RawMode { "rawmode".to_owned() } else { format!("open {bus}") };
            connection.link.send(|out| request.emit(out)).await?;
            connection.expect(Reply::Ok, "< ok >", &shown).await?;
        }
        Ok(connection)
    }

    async fn expect(&mut self, expected: Reply, text: &'static str, request: &str) -> Result<(), BusError> {
        let clock = self.clock.clone();
        match within(&clock, PATIENCE, self.reply()).await {
            Some(Ok(reply)) if reply == expected => Ok(()),
            Some(Ok(Reply::Error(said))) => {
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

    async fn reply(&mut self) -> Result<Reply, BusError> {
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

impl AsyncBus for SocketcandBus {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.link.send(|out| Request::Send(*frame).emit(out)).await
    }

    async fn recv(&mut self) -> Result<(Instant, Frame), BusError> {
        loop {
            match self.reply().await? {
                Reply::Frame { frame, .. } => return Ok((self.clock.now(), frame)),
                Reply::Error(said) if !is_error_frame(&said) => {
                    let request = "a frame".to_owned();
                    return Err(BusError::Refused { address: self.link.address(), request, said });
                }
                Reply::Error(_) | Reply::Hi | Reply::Ok | Reply::Echo => {}
            }
        }
    }
}

/// `< error 004 23.424242 >` tells of an error frame on the bus: class and time. It is no answer to a request.
fn is_error_frame(said: &str) -> bool {
    let mut words = said.split_ascii_whitespace();
    let class = words.next().and_then(|class| text::parse_hex(class, 8));
    class.is_some() && words.next().is_none_or(|time| text::parse_seconds(time).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_frames_are_told_from_refusals() {
        assert!(is_error_frame("004 23.424242") && is_error_frame("20000080"));
        assert!(!is_error_frame("bad request") && !is_error_frame("unknown command") && !is_error_frame(""));
    }
}
