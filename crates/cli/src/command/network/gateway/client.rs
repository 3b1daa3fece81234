//! One client of the gateway: lines in, lines out.

use std::io;
use std::time::Duration;

use can::BusFrame;
use host::clients::Client;
use master::Network;
use master::core::Event;
use master::gateway::{MAX_LINE, Session};
use tokio::io::{AsyncBufRead, AsyncBufReadExt, AsyncWriteExt, BufReader};
use tokio::net::TcpStream;
use tokio::net::tcp::OwnedWriteHalf;
use tokio::sync::broadcast;
use tokio::sync::broadcast::error::RecvError;
use transport::Vitals;

use super::places::ClientPlace;

/// How long a client may take to read what it is sent; one that never reads is disconnected.
const READER_PATIENCE: Duration = Duration::from_secs(10);

/// What a client has of the gateway.
pub(super) struct Handle {
    pub(super) frames: broadcast::Receiver<BusFrame>,
    pub(super) events: broadcast::Receiver<Event>,
    pub(super) client: Client,
}

/// Serves a client until its connection ends or another needs its place, then has stopped what it moved.
pub(super) async fn serve(stream: TcpStream, network: Network, mut handle: Handle, place: ClientPlace) {
    let mut session = Session::new(network);
    tokio::select! {
        // Whatever ended it, what it moved is stopped.
        _ = converse(stream, &mut session, &mut handle, &place.vitals) => {}
        _ = place.stay => {}
    }
    handle.client.let_go(session.moved());
}

async fn converse(stream: TcpStream, session: &mut Session, handle: &mut Handle, vitals: &Vitals) -> io::Result<()> {
    // Answers are small and waited for.
    stream.set_nodelay(true)?;
    let (input, mut output) = stream.into_split();
    let mut input = BufReader::new(input);
    let mut line = PartialLine::default();
    loop {
        let said = tokio::select! {
            read = line.read(&mut input) => {
                vitals.spoke(session.network().now());
                match read? {
                    Read::End => return Ok(()),
                    Read::Unreadable => Some(Session::unreadable()),
                    Read::Line(text) => {
                        handle.client.guard(session.about_to_move(&text)).await;
                        let answer = session.answer(&text).await;
                        vitals.set_engaged(!session.moved().is_empty());
                        answer
                    }
                }
            }
            frame = handle.frames.recv() => match frame {
                Ok(passed) => session.frame_line(&passed.frame),
                Err(RecvError::Lagged(_)) => None,
                Err(RecvError::Closed) => return Ok(()),
            },
            event = handle.events.recv() => match event {
                Ok(event) => session.event_line(&event),
                Err(RecvError::Lagged(_)) => None,
                Err(RecvError::Closed) => return Ok(()),
            },
        };
        if let Some(said) = said {
            say(&mut output, &said).await?;
        }
    }
}

async fn say(output: &mut OwnedWriteHalf, text: &str) -> io::Result<()> {
    let written = tokio::time::timeout(READER_PATIENCE, output.write_all(text.as_bytes())).await;
    written.unwrap_or_else(|_| Err(io::ErrorKind::TimedOut.into()))
}

/// A line as far as it has come.
#[derive(Default)]
struct PartialLine {
    bytes: Vec<u8>,
    /// It was too long, and its rest is passed over.
    too_long: bool,
}

enum Read {
    Line(String),
    /// Too long, or no text.
    Unreadable,
    End,
}

impl PartialLine {
    /// The next line. Cancel-safe: what has come is kept.
    async fn read(&mut self, input: &mut (impl AsyncBufRead + Unpin)) -> io::Result<Read> {
        loop {
            let come = input.fill_buf().await?;
            if come.is_empty() {
                // A line without its end may be half a command.
                return Ok(Read::End);
            }
            let end = come.iter().position(|byte| *byte == b'\n');
            let taken = end.map_or(come.len(), |end| end + 1);
            if self.bytes.len() + taken > MAX_LINE {
                self.too_long = true;
                self.bytes.clear();
            } else if !self.too_long {
                self.bytes.extend_from_slice(&come[..taken]);
            }
            input.consume(taken);
            if end.is_some() {
                let bytes = std::mem::take(&mut self.bytes);
                let too_long = std::mem::take(&mut self.too_long);
                return Ok(match String::from_utf8(bytes) {
                    Ok(text) if !too_long => Read::Line(text),
                    _ => Read::Unreadable,
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::AsyncReadExt;

    use super::*;
    use crate::session::runtime;

    /// What comes of `first` and then `rest`: a line, or `None` for one that is unreadable.
    fn lines(first: &[u8], rest: &[u8]) -> Vec<Option<String>> {
        let mut input = BufReader::with_capacity(64, first.chain(rest));
        let mut line = PartialLine::default();
        let mut lines = Vec::new();
        runtime().unwrap().block_on(async {
            loop {
                match line.read(&mut input).await.unwrap() {
                    Read::End => return,
                    Read::Line(text) => lines.push(Some(text)),
                    Read::Unreadable => lines.push(None),
                }
            }
        });
        lines
    }

    #[test]
    fn lines_come_whole_and_what_is_unreadable_does_not_take_the_next_with_it() {
        let whole = |text: &str| Some(text.to_owned());
        assert_eq!(
            lines(b"[77] 4 r 0x", b"6083 0 u32\r\n[78]\n"),
            [whole("[77] 4 r 0x6083 0 u32\r\n"), whole("[78]\n")]
        );
        assert_eq!(lines(b"[9] \xFF\xFE\n", b"[10]\n"), [None, whole("[10]\n")]);
        let long = [&b"1".repeat(100_000)[..], b"\n"].concat();
        assert_eq!(lines(&long, b"[10]\n"), [None, whole("[10]\n")]);
        let just = [&b"1".repeat(MAX_LINE - 1)[..], b"\n"].concat();
        assert_eq!(lines(&just, b"").iter().flatten().map(String::len).collect::<Vec<_>>(), [MAX_LINE]);
        // Half a command.
        assert_eq!(lines(b"[1] 4 stop\n[2] 4 sto", b"p"), [whole("[1] 4 stop\n")]);
    }
}
