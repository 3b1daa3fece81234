//! A bus behind a cannelloni peer.

use can::{Frame, Instant};
use tokio::net::{UdpSocket, lookup_host};

use super::codec::{Datagram, Item, emit};
use crate::datagrams::Datagrams;
use crate::note::Note;
use crate::socketcan::notes_of;
use crate::{AsyncBus, BusError, Received, WallClock};

/// A bus behind a cannelloni peer. Each frame is a datagram of its own.
#[derive(Debug)]
pub struct CannelloniBus {
    datagrams: Datagrams,
    /// Of the next datagram to send.
    sequence: u8,
    /// Of the next datagram to come, once one has.
    expected: Option<u8>,
    output: Vec<u8>,
}

impl CannelloniBus {
    /// Exchanges datagrams with the peer at `address` (`HOST:PORT`), from and at `local_port`: a peer sends to the port that it was
    /// given (`cannelloni -r`), and takes what comes from there.
    pub async fn open(address: &str, local_port: u16, clock: &WallClock) -> Result<Self, BusError> {
        let failed = |source| BusError::Connect { address: address.to_owned(), source };
        let peer = lookup_host(address).await.map_err(failed)?.next();
        let peer = peer.ok_or_else(|| failed(std::io::ErrorKind::NotFound.into()))?;
        let any = if peer.is_ipv6() { "[::]" } else { "0.0.0.0" };
        let local = format!("{any}:{local_port}");
        let taken = |source| BusError::Listen { address: local.clone(), source };
        let socket = UdpSocket::bind(&local).await.map_err(taken)?;
        socket.connect(peer).await.map_err(failed)?;
        let datagrams = Datagrams::new(socket, address, clock);
        Ok(Self { datagrams, sequence: 0, expected: None, output: Vec::new() })
    }

    fn take_in(&mut self) {
        // The items borrow the datagram, and go where it lies.
        let bytes = self.datagrams.datagram().to_vec();
        let datagram = match Datagram::parse(&bytes) {
            Ok(datagram) => datagram,
            Err(malformed) => return self.datagrams.push_malformed(malformed.to_string()),
        };
        let sequence = datagram.sequence();
        let count = self.expected.map_or(0, |expected| sequence.wrapping_sub(expected));
        // More than half of the numbers ahead is behind: overtaken on the way, or a peer that began anew.
        if count > 0 && count < 128 {
            self.datagrams.push(Note::DatagramsLost { count });
        }
        self.expected = Some(sequence.wrapping_add(1));
        for item in datagram {
            match item {
                Ok(Item::Frame(frame)) => self.datagrams.push(frame),
                Ok(Item::FdFrame { id, length }) => self.datagrams.push(Note::FdFrame { id, length }),
                Ok(Item::Error { class, data }) => notes_of(class, data).for_each(|note| self.datagrams.push(note)),
                Err(malformed) => self.datagrams.push_malformed(malformed.to_string()),
            }
        }
    }
}

impl AsyncBus for CannelloniBus {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.output.clear();
        emit(self.sequence, frame, &mut self.output);
        self.sequence = self.sequence.wrapping_add(1);
        self.datagrams.send(&self.output, None).await
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        loop {
            if let Some(received) = self.datagrams.pop() {
                return Ok(received);
            }
            if self.datagrams.receive().await?.is_some() {
                self.take_in();
            }
        }
    }
}
