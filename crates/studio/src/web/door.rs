//! Limits unauthenticated connections (without the cookie or the token) in number and time.
//!
//! A connection counts as a stranger's until a request on it was authenticated. Strangers that send nothing, or half a header, keep
//! neither places nor file descriptors from authenticated clients: a further stranger takes the place of the one that has been connected
//! for the longest, and each has [`PATIENCE`].

use std::collections::VecDeque;
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::Router;
use axum::extract::Request;
use axum::extract::connect_info::{ConnectInfo, Connected};
use axum::serve::{IncomingStream, Listener};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::oneshot;
use tokio::time::Sleep;

/// How long a stranger's connection may last: one request and its answer.
const PATIENCE: Duration = Duration::from_secs(5);

/// Connections of strangers at once: a browser opens six.
const MOST_STRANGERS: usize = 64;

/// Pause after a failed accept (out of file descriptors); existing connections are still served.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Serves `app` at `listener` until the future is dropped.
///
/// # Errors
/// Errors of the listener.
pub async fn serve(listener: TcpListener, app: Router) -> io::Result<()> {
    let door = Door { listener, strangers: Strangers::default() };
    axum::serve(door, app.into_make_service_with_connect_info::<Visitor>()).await
}

/// The client at the other end of a connection.
#[derive(Clone, Debug)]
pub(super) struct Visitor(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    address: SocketAddr,
    known: AtomicBool,
}

impl Visitor {
    pub(super) fn new(address: SocketAddr) -> Self {
        Self(Arc::new(Inner { address, known: AtomicBool::new(false) }))
    }

    /// The visitor of this request, if it came over a connection.
    pub(super) fn of(request: &Request) -> Option<&Self> {
        request.extensions().get::<ConnectInfo<Self>>().map(|ConnectInfo(visitor)| visitor)
    }

    /// Its address; for IPv6 the /64 network, since one host has a whole network of addresses.
    pub(super) fn origin(visitor: Option<&Self>) -> IpAddr {
        match visitor.map(|visitor| visitor.0.address.ip().to_canonical()) {
            Some(IpAddr::V6(address)) => IpAddr::V6((address.to_bits() >> 64 << 64).into()),
            Some(address) => address,
            None => IpAddr::V4(Ipv4Addr::UNSPECIFIED),
        }
    }

    /// It is authenticated.
    pub(super) fn admit(&self) {
        self.0.known.store(true, Ordering::Relaxed);
    }

    fn is_known(&self) -> bool {
        self.0.known.load(Ordering::Relaxed)
    }
}

impl Connected<IncomingStream<'_, Door>> for Visitor {
    fn connect_info(stream: IncomingStream<'_, Door>) -> Self {
        stream.remote_addr().clone()
    }
}

/// The connected strangers, oldest first.
#[derive(Debug, Default)]
struct Strangers(VecDeque<(Visitor, oneshot::Sender<()>)>);

impl Strangers {
    /// Adds a stranger; the returned receiver ends when another needs its place.
    fn take(&mut self, visitor: &Visitor) -> oneshot::Receiver<()> {
        self.0.retain(|(visitor, stay)| !visitor.is_known() && !stay.is_closed());
        if self.0.len() >= MOST_STRANGERS {
            self.0.pop_front();
        }
        let (stay, stays) = oneshot::channel();
        self.0.push_back((visitor.clone(), stay));
        stays
    }
}

/// The listening socket.
struct Door {
    listener: TcpListener,
    strangers: Strangers,
}

impl Listener for Door {
    type Io = Connection;
    type Addr = Visitor;

    async fn accept(&mut self) -> (Connection, Visitor) {
        loop {
            let Ok((stream, address)) = self.listener.accept().await else {
                tokio::time::sleep(ACCEPT_PAUSE).await;
                continue;
            };
            let visitor = Visitor::new(address);
            let stay = self.strangers.take(&visitor);
            let patience = Box::pin(tokio::time::sleep(PATIENCE));
            return (Connection { stream, visitor: visitor.clone(), patience, stay, sent_away: false }, visitor);
        }
    }

    fn local_addr(&self) -> io::Result<Visitor> {
        self.listener.local_addr().map(Visitor::new)
    }
}

/// A connection that ends unless its visitor is authenticated in time.
struct Connection {
    stream: TcpStream,
    visitor: Visitor,
    patience: Pin<Box<Sleep>>,
    stay: oneshot::Receiver<()>,
    sent_away: bool,
}

impl Connection {
    /// The stream, unless the visitor has to leave.
    fn stream(&mut self, context: &mut Context<'_>) -> io::Result<Pin<&mut TcpStream>> {
        if !self.sent_away && !self.visitor.is_known() {
            let displaced = Pin::new(&mut self.stay).poll(context).is_ready();
            self.sent_away = displaced || self.patience.as_mut().poll(context).is_ready();
        }
        if self.sent_away { Err(io::ErrorKind::TimedOut.into()) } else { Ok(Pin::new(&mut self.stream)) }
    }
}

impl AsyncRead for Connection {
    fn poll_read(mut self: Pin<&mut Self>, context: &mut Context<'_>, into: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        self.stream(context)?.poll_read(context, into)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(mut self: Pin<&mut Self>, context: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        self.stream(context)?.poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_stranger_makes_room_and_no_authenticated_visitor() {
        let mut strangers = Strangers::default();
        let visitors: Vec<Visitor> = (0..=MOST_STRANGERS).map(|_| Visitor::new(([10, 0, 0, 1], 1).into())).collect();
        let mut stays: Vec<_> = visitors.iter().take(MOST_STRANGERS).map(|visitor| strangers.take(visitor)).collect();
        visitors[0].admit();
        // A visitor that has been authenticated since needs no place.
        stays.push(strangers.take(&visitors[MOST_STRANGERS]));
        assert!(stays[1].try_recv() == Err(oneshot::error::TryRecvError::Empty));
        stays.push(strangers.take(&Visitor::new(([10, 0, 0, 2], 1).into())));
        assert!(stays[1].try_recv() == Err(oneshot::error::TryRecvError::Closed));
        assert!(stays[2].try_recv() == Err(oneshot::error::TryRecvError::Empty));
    }

    #[test]
    fn of_ipv6_a_network_is_one_origin() {
        let origin = |text: &str| Visitor::origin(Some(&Visitor::new(text.parse().expect("an address"))));
        assert_eq!(origin("[2001:db8::1]:5"), origin("[2001:db8::2:3]:6"));
        assert_ne!(origin("[2001:db8::1]:5"), origin("[2001:db8:0:1::1]:5"));
        assert_eq!(origin("[::ffff:10.0.0.1]:5"), origin("10.0.0.1:7"));
        assert_ne!(origin("10.0.0.1:7"), origin("10.0.0.2:7"));
    }
}
