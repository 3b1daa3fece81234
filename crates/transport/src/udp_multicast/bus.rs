//! A bus that is a multicast group.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use can::{Frame, Instant};
use socket2::{Domain, Protocol, Socket, Type};
use tokio::net::UdpSocket;

use super::codec::{Item, emit, parse};
use crate::datagrams::Datagrams;
use crate::note::{ErrorFrame, Note};
use crate::{AsyncBus, BusError, Received, WallClock};

/// A bus that is a multicast group. Frames go out by a socket of their own, by whose address they are known when they come back.
#[derive(Debug)]
pub struct UdpMulticastBus {
    datagrams: Datagrams,
    sender: UdpSocket,
    /// Port of `sender`: no two programs of a machine have the same. Other machines may; then the address distinguishes them.
    own_port: u16,
    /// From which address own frames come back, once one has.
    own_ip: Option<IpAddr>,
    group: SocketAddr,
    clock: WallClock,
    output: Vec<u8>,
}

impl UdpMulticastBus {
    /// Joins `group` at `port`. Frames pass `hops - 1` routers: with 1 they stay in the own network, with 0 in this machine.
    pub fn open(group: IpAddr, port: u16, hops: u8, clock: &WallClock) -> Result<Self, BusError> {
        let place = SocketAddr::new(group, port);
        let failed = |source| BusError::Listen { address: place.to_string(), source };
        let receiver = receiver(place).and_then(|socket| UdpSocket::from_std(socket.into())).map_err(failed)?;
        let sender = sender(place, hops).and_then(|socket| UdpSocket::from_std(socket.into())).map_err(failed)?;
        let own_port = sender.local_addr().map_err(failed)?.port();
        let datagrams = Datagrams::new(receiver, &place.to_string(), clock);
        Ok(Self { datagrams, sender, own_port, own_ip: None, group: place, clock: clock.clone(), output: Vec::new() })
    }

    fn take_in(&mut self, from: SocketAddr) {
        if from.port() == self.own_port && self.is_own(from.ip()) {
            return;
        }
        match parse(self.datagrams.datagram()) {
            Ok(Item::Frame(frame)) => self.datagrams.push(frame),
            Ok(Item::FdFrame { id, length }) => self.datagrams.push(Note::FdFrame { id, length }),
            Ok(Item::Error) => self.datagrams.push(Note::ErrorFrame(ErrorFrame::default())),
            Err(malformed) => self.datagrams.push_malformed(malformed.to_string()),
        }
    }

    fn is_own(&mut self, address: IpAddr) -> bool {
        if self.own_ip.is_none() && is_of_this_machine(address) {
            self.own_ip = Some(address);
        }
        self.own_ip == Some(address)
    }
}

impl AsyncBus for UdpMulticastBus {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let unix = self.clock.unix_zero() + (self.clock.now() - Instant::ZERO);
        self.output.clear();
        emit(frame, unix.as_secs_f64(), &mut self.output);
        let sent = self.sender.send_to(&self.output, self.group).await;
        sent.map(drop).map_err(|source| BusError::Lost { address: self.group.to_string(), source })
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        loop {
            if let Some(received) = self.datagrams.pop() {
                return Ok(received);
            }
            if let Some(from) = self.datagrams.receive().await? {
                self.take_in(from);
            }
        }
    }
}

/// Whether an address is one of this machine: a socket can be bound to it.
fn is_of_this_machine(address: IpAddr) -> bool {
    std::net::UdpSocket::bind((address, 0)).is_ok()
}

fn socket(group: SocketAddr) -> std::io::Result<Socket> {
    let socket = Socket::new(Domain::for_address(group), Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_nonblocking(true)?;
    Ok(socket)
}

/// Hears the group, beside any other program of this machine.
fn receiver(group: SocketAddr) -> std::io::Result<Socket> {
    let socket = socket(group)?;
    socket.set_reuse_address(true)?;
    #[cfg(all(unix, not(any(target_os = "solaris", target_os = "illumos", target_os = "cygwin"))))]
    socket.set_reuse_port(true)?;
    match group.ip() {
        IpAddr::V4(address) => {
            socket.bind(&SocketAddr::from((Ipv4Addr::UNSPECIFIED, group.port())).into())?;
            socket.join_multicast_v4(&address, &Ipv4Addr::UNSPECIFIED)?;
        }
        IpAddr::V6(address) => {
            socket.bind(&SocketAddr::from((Ipv6Addr::UNSPECIFIED, group.port())).into())?;
            socket.join_multicast_v6(&address, 0)?;
        }
    }
    Ok(socket)
}

/// Sends to the group from a port of its own.
fn sender(group: SocketAddr, hops: u8) -> std::io::Result<Socket> {
    let socket = socket(group)?;
    match group.ip() {
        IpAddr::V4(_) => {
            socket.set_multicast_ttl_v4(u32::from(hops))?;
            socket.bind(&SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)).into())?;
        }
        IpAddr::V6(_) => {
            socket.set_multicast_hops_v6(u32::from(hops))?;
            socket.bind(&SocketAddr::from((Ipv6Addr::UNSPECIFIED, 0)).into())?;
        }
    }
    Ok(socket)
}
