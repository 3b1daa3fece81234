//! The task that serves one client: moves bytes between its socket and its session, frames between session and hub.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use can::{Frame, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::net::tcp::{ReadHalf, WriteHalf};
use tokio::sync::{Semaphore, mpsc};

use super::event::{ClientId, HubEvent};
use super::session::Session;
use crate::link::within;
use crate::{Vitals, WallClock, tcp};

/// Read at once, in bytes.
const READ_SIZE: usize = 2048;

/// Frames are gathered into one write up to this size: what fits one Ethernet segment.
const WRITE_SIZE: usize = 1400;

/// Segments read or written before the other tasks have their turn. A segment of garbage has up to 64 refusals made for it,
/// some 100 µs of work; without a budget a few dozen such clients take more time than the world has for a step.
const SEGMENTS_A_TURN: u32 = 16;

/// How long a disconnected client may take to close its side.
const LINGER: Duration = Duration::from_secs(1);

/// What was on the bus, and when.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stamped {
    pub(super) at: Instant,
    pub(super) what: Carried,
}

/// What a bus carries.
#[derive(Clone, Copy, Debug)]
pub(super) enum Carried {
    Frame(Frame),
    /// An error frame, by its class in Linux's messages.
    Error(u32),
}

/// The task's end of what it shares with the hub.
pub(super) struct End {
    pub(super) client: ClientId,
    pub(super) vitals: Arc<Vitals>,
    pub(super) credits: Arc<Semaphore>,
    pub(super) frames: mpsc::Receiver<Stamped>,
    pub(super) inbox: mpsc::UnboundedSender<HubEvent>,
    pub(super) clock: WallClock,
}

/// Serves until the client closes the connection or the session is over.
pub(super) async fn serve(stream: TcpStream, session: Box<dyn Session>, end: End) -> io::Result<()> {
    let mut connection = ClientConnection {
        session,
        end,
        input: Vec::with_capacity(READ_SIZE),
        consumed: 0,
        waiting: None,
        segment: Vec::with_capacity(WRITE_SIZE + 64),
        quiet_until: None,
        at_end: false,
    };
    connection.run(stream).await
}

struct ClientConnection {
    session: Box<dyn Session>,
    end: End,
    /// Received bytes, of which `consumed` have been through the session.
    input: Vec<u8>,
    consumed: usize,
    /// A frame of the client's for which it has no credit yet.
    waiting: Option<Frame>,
    /// What is being written.
    segment: Vec<u8>,
    /// Frames stay away until then, or until the client speaks.
    quiet_until: Option<Instant>,
    /// The client has closed its side.
    at_end: bool,
}

impl ClientConnection {
    async fn run(&mut self, mut stream: TcpStream) -> io::Result<()> {
        let (mut reader, mut writer) = stream.split();
        let mut segments = 0;
        loop {
            segments += 1;
            if segments > SEGMENTS_A_TURN {
                segments = 0;
                tokio::task::yield_now().await;
            }
            self.read_requests();
            self.fill_segment();
            let has_input = self.consumed < self.input.len() || self.waiting.is_some();
            if self.segment.is_empty() && (self.session.is_over() || self.at_end && !has_input) {
                return self.part(reader, writer).await;
            }
            let wants_input = !has_input && !self.at_end && !self.session.is_over();
            let quiet_until = self.quiet_until.filter(|_| self.segment.is_empty());
            tokio::select! {
                written = writer.write(&self.segment), if !self.segment.is_empty() => {
                    match written? {
                        0 => return Err(io::ErrorKind::WriteZero.into()),
                        written => drop(self.segment.drain(..written)),
                    }
                }
                read = reader.read_buf(&mut self.input), if wants_input => {
                    self.at_end = read? == 0;
                    tcp::acknowledge_at_once(reader.as_ref());
                    self.quiet_until = None;
                    self.end.vitals.spoke(self.end.clock.now());
                }
                credit = self.end.credits.acquire(), if self.waiting.is_some() => {
                    if let (Ok(credit), Some(frame)) = (credit, self.waiting.take()) {
                        credit.forget();
                        let _ = self.end.inbox.send(HubEvent::Frame { client: self.end.client, frame });
                    }
                }
                stamped = self.end.frames.recv(), if self.segment.is_empty() && self.quiet_until.is_none() => {
                    match stamped {
                        Some(stamped) => deliver(&mut *self.session, &stamped, &mut self.segment),
                        None => return Ok(()),
                    }
                }
                () = self.end.clock.sleep_until_due(quiet_until), if quiet_until.is_some() => self.quiet_until = None,
            }
        }
    }

    /// Takes requests out of the input as far as credit and replies allow.
    fn read_requests(&mut self) {
        if self.waiting.is_none() {
            let mut unread = &self.input[self.consumed..];
            self.waiting = self.session.receive(&mut unread);
            self.consumed = self.input.len() - unread.len();
            if unread.is_empty() {
                self.input.clear();
                self.consumed = 0;
            }
            self.end.vitals.set_engaged(self.session.is_listening());
        }
    }

    /// Puts together what to write next, unless something is being written: one reply, or frames.
    fn fill_segment(&mut self) {
        if !self.segment.is_empty() {
            return;
        }
        if let Some(quiet) = self.session.next_reply(&mut self.segment) {
            self.quiet_until = (!quiet.is_zero()).then(|| self.end.clock.now() + quiet);
            return;
        }
        while self.quiet_until.is_none() && self.segment.len() < WRITE_SIZE {
            let Ok(stamped) = self.end.frames.try_recv() else { return };
            deliver(&mut *self.session, &stamped, &mut self.segment);
        }
    }

    /// Ends the connection so that the last reply arrives: closing a socket with unread input would destroy it.
    async fn part(&mut self, mut reader: ReadHalf<'_>, mut writer: WriteHalf<'_>) -> io::Result<()> {
        writer.shutdown().await?;
        let drained = async {
            while !self.at_end {
                self.input.clear();
                self.at_end = reader.read_buf(&mut self.input).await? == 0;
            }
            Ok(())
        };
        within(&self.end.clock, LINGER, drained).await.unwrap_or(Ok(()))
    }
}

fn deliver(session: &mut dyn Session, stamped: &Stamped, segment: &mut Vec<u8>) {
    match stamped.what {
        Carried::Frame(frame) => session.deliver(stamped.at, &frame, segment),
        Carried::Error(class) => session.deliver_error(stamped.at, class, segment),
    }
}
