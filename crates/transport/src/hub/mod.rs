//! A CAN bus served to other programs: any number of clients over socketcand and slcan.
//!
//! The hub moves frames and knows no bus. The owner of the bus takes the clients' frames from [`Hub::next_event`], puts them
//! on the wire, and when the wire has carried a frame sends it to all with [`Hub::broadcast`]; the sender does not hear its
//! own. A client may have 64 frames that were neither broadcast nor discarded; then its connection is not read, so that a
//! client that sends faster than the bus is slowed down and no queue grows. A client that does not read is disconnected
//! when 16,384 frames wait for it; it never holds up the bus or the others. Reading what clients send is done in small turns,
//! so that neither the bus nor another client waits for one that sends a lot. When 256 clients are there, the next takes the
//! place of the one that matters least: one that does not listen, or else the one that has been silent for the longest.

mod client;
mod event;
mod joined;
mod session;

use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use can::{Bitrate, Frame, Instant};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc, oneshot};
use tokio::task::AbortHandle;

use crate::socketcan::class_of;
use crate::socketcand::SocketcandSession;
use crate::{AsyncBus, BusError, ErrorFrame, Note, Protocol, Received, ServeSpec, Vitals, WallClock, tcp};
use client::{Carried, Stamped};
pub use event::{ClientId, HubEvent, LeaveReason};
pub(crate) use session::{MAX_WAITING_REPLIES, Session};

/// Frames of one client that may wait for the wire: the send queue of its controller. Linux gives an interface 10; a
/// window of 64 lets a configuration tool write a burst without waiting.
const MAX_FRAMES_IN_FLIGHT: usize = 64;

/// Frames that may wait for one client besides what the sockets buffer: 2 s of a full bus at 1 Mbit/s.
const MAX_FRAMES_WAITING: usize = 16_384;

/// Clients served at a time, well below the 1024 files that a process may have open by default.
const MAX_CLIENTS: usize = 256;

/// Pause after a failed accept (out of file descriptors): the clients that are there go on.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// What a hub serves.
#[derive(Clone, Debug)]
pub struct HubOptions {
    /// The bus's name to socketcand clients.
    pub bus: String,
    /// If given, an slcan client that selects another rate cannot open its channel, as on a real bus.
    pub bitrate: Option<Bitrate>,
    /// Time stamp of [`Instant::ZERO`] in socketcand frames, usually [`WallClock::unix_zero`].
    pub zero: Duration,
}

impl Default for HubOptions {
    /// `can0`, any bit rate, time stamps from zero.
    fn default() -> Self {
        Self { bus: "can0".to_owned(), bitrate: None, zero: Duration::ZERO }
    }
}

/// Why a hub does not come up.
#[derive(Debug, thiserror::Error)]
pub enum HubError {
    /// A listener cannot be opened.
    #[error("cannot listen on {place}; is the port taken by another program, and is the address one of this machine?")]
    Listen {
        /// The place asked for.
        place: ServeSpec,
        /// What the system said.
        source: io::Error,
    },
}

/// A listener of a hub. Prints as `socketcand://127.0.0.1:29536`, with the real port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Listener {
    /// The protocol spoken.
    pub protocol: Protocol,
    /// The address, with the port that the system chose for port 0.
    pub address: SocketAddr,
}

impl fmt::Display for Listener {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}://{}", self.protocol, self.address)
    }
}

/// Serves one bus on any number of listeners. Dropping it ends every connection.
///
/// # Contract
/// Every [`HubEvent::Frame`] is answered once: by [`broadcast`](Self::broadcast) with its client when the wire has carried
/// it, or by [`discard`](Self::discard).
#[derive(Debug)]
pub struct Hub {
    shared: Arc<HubState>,
    inbox: mpsc::UnboundedReceiver<HubEvent>,
    listeners: Vec<Listener>,
    acceptors: Vec<AbortHandle>,
    clock: WallClock,
}

impl Hub {
    /// Listens on all of `places`; clients are served from now on by tasks of the current tokio runtime.
    pub async fn bind(places: &[ServeSpec], options: HubOptions, clock: &WallClock) -> Result<Self, HubError> {
        // Unbounded in type only: each client is held to MAX_FRAMES_IN_FLIGHT.
        let (sender, inbox) = mpsc::unbounded_channel();
        let shared = Arc::new(HubState { options, clock: clock.clone(), inbox: sender, clients: Mutex::default() });
        let clock = clock.clone();
        let mut hub = Self { shared, inbox, listeners: Vec::new(), acceptors: Vec::new(), clock };
        for place in places {
            let failed = |source| HubError::Listen { place: place.clone(), source };
            let socket = TcpListener::bind(&place.address).await.map_err(failed)?;
            let address = socket.local_addr().map_err(failed)?;
            hub.listeners.push(Listener { protocol: place.protocol, address });
            let acceptor = accept(socket, place.protocol, Arc::clone(&hub.shared));
            hub.acceptors.push(tokio::spawn(acceptor).abort_handle());
        }
        Ok(hub)
    }

    /// The listeners in the order asked for, with their real ports.
    pub fn listeners(&self) -> &[Listener] {
        &self.listeners
    }

    /// Makes `bus` a client like any other: its frames come as [`HubEvent::Frame`], and what is broadcast goes onto it. `tell`
    /// hears its notes. Completes, with the reason, when that bus ends or takes frames more slowly than they come; the frames
    /// are carried from now on by a task of the current tokio runtime, also while this is not awaited.
    pub fn join<B, T>(&self, bus: B, tell: T) -> impl Future<Output = BusError> + Send + use<B, T>
    where
        B: AsyncBus + Send + 'static,
        T: FnMut(&Note) + Send + 'static,
    {
        let (ended, end) = oneshot::channel();
        let shared = Arc::downgrade(&self.shared);
        let mut clients = self.shared.lock();
        let entry = self.shared.enter(&mut clients, Vitals::of_a_bus(), None, |end| async move {
            let client = end.client;
            let error = joined::serve(bus, end, tell).await;
            if let Some(shared) = shared.upgrade() {
                shared.forget(client, LeaveReason::Broken);
            }
            // It may not be awaited.
            let _ = ended.send(error);
        });
        clients.list.push(entry);
        // A task that was ended from outside had too many frames waiting.
        async move { end.await.unwrap_or(BusError::TooSlow) }
    }

    /// Clients connected now.
    pub fn client_count(&self) -> usize {
        self.shared.lock().list.len()
    }

    /// The next thing that a client did; pending while nothing happens. Cancel-safe.
    pub async fn next_event(&mut self) -> HubEvent {
        match self.inbox.recv().await {
            Some(event) => event,
            // Cannot be while `shared` holds a sender.
            None => std::future::pending().await,
        }
    }

    /// The next thing that a client has done already.
    pub fn try_next_event(&mut self) -> Option<HubEvent> {
        self.inbox.try_recv().ok()
    }

    /// Sends every listening client but `from` a frame that was on the bus at `at`, and lets `from` send another.
    pub fn broadcast(&self, frame: &Frame, at: Instant, from: Option<ClientId>) {
        self.hand_out(Stamped { at, what: Carried::Frame(*frame) }, from);
    }

    /// Reports to every listening client, as far as its protocol can, an error frame that was on the bus at `at`.
    pub fn broadcast_error(&self, error: &ErrorFrame, at: Instant) {
        self.hand_out(Stamped { at, what: Carried::Error(class_of(error)) }, None);
    }

    fn hand_out(&self, stamped: Stamped, from: Option<ClientId>) {
        let mut clients = self.shared.lock();
        clients.list.retain(|client| {
            if Some(client.id) == from {
                client.credits.add_permits(1);
                return true;
            }
            let kept = !client.vitals.is_engaged()
                || !matches!(client.outgoing.try_send(stamped), Err(mpsc::error::TrySendError::Full(_)));
            if !kept {
                client.task.abort();
                self.shared.tell(HubEvent::Left { client: client.id, reason: LeaveReason::TooSlow });
            }
            kept
        });
    }

    /// Gives up a frame of `client` that the wire will not carry, and lets the client send another.
    pub fn discard(&self, client: ClientId) {
        if let Some(client) = self.shared.lock().list.iter().find(|other| other.id == client) {
            client.credits.add_permits(1);
        }
    }
}

impl Drop for Hub {
    fn drop(&mut self) {
        self.acceptors.iter().for_each(AbortHandle::abort);
        let mut clients = self.shared.lock();
        clients.closed = true;
        clients.list.drain(..).for_each(|client| client.task.abort());
    }
}

/// A hub is a bus of its own, without arbitration: what a client sends is at once heard by the others and by the owner.
impl AsyncBus for Hub {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.broadcast(frame, self.clock.now(), None);
        Ok(())
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        loop {
            if let HubEvent::Frame { client, frame } = self.next_event().await {
                let now = self.clock.now();
                self.broadcast(&frame, now, Some(client));
                return Ok((now, frame.into()));
            }
        }
    }
}

#[derive(Debug)]
struct HubState {
    options: HubOptions,
    clock: WallClock,
    inbox: mpsc::UnboundedSender<HubEvent>,
    clients: Mutex<Clients>,
}

#[derive(Debug, Default)]
struct Clients {
    list: Vec<Client>,
    last_id: u64,
    closed: bool,
}

/// The hub's end of a client's task.
#[derive(Debug)]
struct Client {
    id: ClientId,
    vitals: Arc<Vitals>,
    credits: Arc<Semaphore>,
    outgoing: mpsc::Sender<Stamped>,
    task: AbortHandle,
}

impl HubState {
    fn lock(&self) -> MutexGuard<'_, Clients> {
        self.clients.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn tell(&self, event: HubEvent) {
        // The receiver is gone only while the hub is being dropped.
        let _ = self.inbox.send(event);
    }

    fn admit(self: &Arc<Self>, stream: TcpStream, peer: SocketAddr, protocol: Protocol) {
        let session: Box<dyn Session> = match protocol {
            Protocol::Socketcand => Box::new(SocketcandSession::new(&self.options.bus, self.options.zero)),
            Protocol::Slcan => Box::new(slcan::Adapter::new(self.options.bitrate)),
        };
        let mut clients = self.lock();
        if clients.closed {
            return;
        }
        if clients.list.len() >= MAX_CLIENTS {
            self.displace_one(&mut clients);
        }
        let vitals = Vitals::new(self.clock.now());
        let shared = Arc::downgrade(self);
        let entry = self.enter(&mut clients, vitals, Some((protocol, peer)), |end| async move {
            let client = end.client;
            let reason = match client::serve(stream, session, end).await {
                Ok(()) => LeaveReason::Closed,
                Err(_) => LeaveReason::Broken,
            };
            if let Some(shared) = shared.upgrade() {
                shared.forget(client, reason);
            }
        });
        clients.list.push(entry);
    }

    /// A further client, and the task that serves it.
    fn enter<T>(
        &self,
        clients: &mut Clients,
        vitals: Vitals,
        peer: Option<(Protocol, SocketAddr)>,
        serve: impl FnOnce(client::End) -> T,
    ) -> Client
    where
        T: Future<Output = ()> + Send + 'static,
    {
        clients.last_id += 1;
        let id = ClientId(clients.last_id);
        let (outgoing, frames) = mpsc::channel(MAX_FRAMES_WAITING);
        let vitals = Arc::new(vitals);
        let credits = Arc::new(Semaphore::new(MAX_FRAMES_IN_FLIGHT));
        self.tell(HubEvent::Joined { client: id, peer });
        let task = tokio::spawn(serve(client::End {
            client: id,
            vitals: Arc::clone(&vitals),
            credits: Arc::clone(&credits),
            frames,
            inbox: self.inbox.clone(),
            clock: self.clock.clone(),
        }));
        Client { id, vitals, credits, outgoing, task: task.abort_handle() }
    }

    fn displace_one(&self, clients: &mut Clients) {
        if let Some(place) = Vitals::least(clients.list.iter().map(|client| &*client.vitals)) {
            let client = clients.list.remove(place);
            client.task.abort();
            self.tell(HubEvent::Left { client: client.id, reason: LeaveReason::Displaced });
        }
    }

    fn forget(&self, id: ClientId, reason: LeaveReason) {
        let mut clients = self.lock();
        if let Some(place) = clients.list.iter().position(|client| client.id == id) {
            clients.list.remove(place);
            self.tell(HubEvent::Left { client: id, reason });
        }
    }
}

async fn accept(socket: TcpListener, protocol: Protocol, shared: Arc<HubState>) {
    loop {
        match socket.accept().await {
            Ok((stream, peer)) => {
                // Each reply is a segment of its own, and a frame is sent at once.
                if tcp::send_at_once(&stream).is_ok() {
                    shared.admit(stream, peer, protocol);
                }
            }
            Err(_) => shared.clock.sleep(ACCEPT_PAUSE).await,
        }
    }
}
