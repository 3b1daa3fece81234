//! What the buses over UDP share: datagrams with their time, sent and received, and a peer that is not there.

use std::collections::VecDeque;
use std::io;
use std::net::SocketAddr;

use can::Instant;
use canlog::{Finding, Place};
use tokio::net::UdpSocket;

use crate::note::Note;
use crate::{BusError, Received, WallClock};

/// Longest datagram of UDP.
const MAX_LENGTH: usize = 65_536;

/// Longest piece of a datagram that a note shows, in bytes.
const SHOWN_LENGTH: usize = 16;

/// A socket, and what came by it. Cancel-safe throughout: a datagram goes or comes whole.
#[derive(Debug)]
pub(crate) struct Datagrams {
    socket: UdpSocket,
    address: String,
    clock: WallClock,
    buffer: Box<[u8]>,
    received: usize,
    /// What came and was not fetched yet: at most what one datagram carries.
    waiting: VecDeque<Received>,
    /// The system reports that no program listens there.
    is_lost: bool,
}

impl Datagrams {
    /// `address` is how the peer is called in messages.
    pub(crate) fn new(socket: UdpSocket, address: &str, clock: &WallClock) -> Self {
        Self {
            socket,
            address: address.to_owned(),
            clock: clock.clone(),
            buffer: vec![0; MAX_LENGTH].into_boxed_slice(),
            received: 0,
            waiting: VecDeque::new(),
            is_lost: false,
        }
    }

    /// The next thing that waits, and now.
    pub(crate) fn pop(&mut self) -> Option<(Instant, Received)> {
        self.waiting.pop_front().map(|received| (self.clock.now(), received))
    }

    /// Something that a datagram carried.
    pub(crate) fn push(&mut self, received: impl Into<Received>) {
        self.waiting.push_back(received.into());
    }

    /// Notes that the last datagram, or the rest of it, does not follow the protocol.
    pub(crate) fn push_malformed(&mut self, reason: String) {
        let shown = &self.datagram()[..self.received.min(SHOWN_LENGTH)];
        let text = shown.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
        self.push(Note::TornRecord(Finding { place: Place::Line(1), text, reason }));
    }

    /// The last datagram.
    pub(crate) fn datagram(&self) -> &[u8] {
        &self.buffer[..self.received]
    }

    /// Waits for a datagram, and says where from.
    pub(crate) async fn receive(&mut self) -> Result<Option<SocketAddr>, BusError> {
        self.received = 0;
        let result = self.socket.recv_from(&mut self.buffer).await;
        let Some((length, from)) = self.unless_refused(result)? else { return Ok(None) };
        self.received = length;
        if std::mem::take(&mut self.is_lost) {
            self.push(Note::ConnectionBack);
        }
        Ok(Some(from))
    }

    /// Sends a datagram, to `to` or to the socket's peer.
    pub(crate) async fn send(&mut self, bytes: &[u8], to: Option<SocketAddr>) -> Result<(), BusError> {
        let result = match to {
            Some(to) => self.socket.send_to(bytes, to).await,
            None => self.socket.send(bytes).await,
        };
        self.unless_refused(result).map(drop)
    }

    /// What the system says for lack of a peer comes with a later call than the one that went astray, and is not an end: the peer
    /// may come. It is reported once.
    fn unless_refused<T>(&mut self, result: io::Result<T>) -> Result<Option<T>, BusError> {
        use io::ErrorKind::{ConnectionRefused, HostUnreachable, NetworkUnreachable};
        match result {
            Ok(done) => Ok(Some(done)),
            Err(error) if matches!(error.kind(), ConnectionRefused | HostUnreachable | NetworkUnreachable) => {
                if !std::mem::replace(&mut self.is_lost, true) {
                    let reason = format!("no program listens at {}: {error}", self.address);
                    self.push(Note::ConnectionLost { reason });
                }
                Ok(None)
            }
            Err(source) => Err(BusError::Lost { address: self.address.clone(), source }),
        }
    }
}
