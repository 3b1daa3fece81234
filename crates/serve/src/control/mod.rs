//! The sockets of the control connection: one task a client, which moves lines between its socket and the world's loop.
//!
//! What the lines mean is `host::control`. Nothing here holds up the world: a client that does not read has its newest events
//! and values kept and the others counted, and is not listened to while many answers wait for it. Where a token is asked for, who has
//! not given it is a stranger: there are few of them at a time, they come slowly, and they do not stay.

mod rate;
mod shared_outbox;
#[cfg(unix)]
mod unix;

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::time::Duration;

use host::control::{Class, ClientNumber, ControlAddress, LineBuffer, ReadLine};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadHalf, WriteHalf};
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, mpsc};
use transport::WallClock;

use rate::Rate;
pub use shared_outbox::{OutboxSender, SharedOutbox};
use words::failure::Failure;

/// Clients served at a time.
const MAX_CLIENTS: usize = 256;

/// The answer to a client that finds all places taken.
const NO_PLACE: &str = concat!(
    r#"{"id":null,"ok":false,"error":{"kind":"limit","message":"256 clients are connected, and no more are served","#,
    r#""node":null,"object":null,"abort":null,"next":"close a connection that is not needed"}}"#,
    "\n"
);

/// Pause after a failed accept (out of file descriptors): the clients that are there go on.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// How long a client that has closed its side, or is sent away, may take to read what waits for it.
const LINGER: Duration = Duration::from_secs(5);

/// Read at once, in bytes.
const READ_SIZE: usize = 4096;

/// Bytes written at once, about.
const WRITE_SIZE: usize = 16 * 1024;

/// What the world's loop hears of the clients.
pub enum ControlMessage {
    /// One has come. Lines for it go into the shared_outbox.
    Joined(ClientNumber, Arc<SharedOutbox>),
    /// It has sent a line.
    Line(ClientNumber, ReadLine),
    /// It is gone.
    Left(ClientNumber),
}

/// Clients that have not given the token yet; the one that has been there longest makes room for one more.
const MAX_STRANGERS: usize = 32;

/// How long a client has for giving the token.
const TOKEN_PATIENCE: Duration = Duration::from_secs(5);

/// The answer to a client that has not given it.
const SENT_AWAY: &str = concat!(
    r#"{"id":null,"ok":false,"error":{"kind":"token","message":"the token was not given in time","#,
    r#""node":null,"object":null,"abort":null,"next":"the first request is hello, with the token"}}"#,
);

/// Connections a second where a token is asked for, and how many may come at once: guessing tokens does not get far.
const STRANGERS_A_SECOND: u32 = 20;
const STRANGERS_AT_ONCE: u32 = 64;

/// Who may come to a server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// Everyone who reaches it.
    Free,
    /// Who gives the token in good time.
    ByToken,
}

/// Listens until it is dropped; a Unix socket is removed then.
pub struct ControlServer {
    place: ControlAddress,
    listening: tokio::task::JoinHandle<()>,
    places: Arc<Semaphore>,
    /// Goes with it.
    #[cfg(unix)]
    _path: Option<unix::OwnPath>,
}

impl ControlServer {
    /// Listens at `address`; messages go to `requests`. The world says whom it admits.
    pub async fn bind<T>(address: &ControlAddress, entry: Entry, requests: mpsc::Sender<T>) -> Result<Self, Failure>
    where
        T: From<ControlMessage> + Send + 'static,
    {
        let refused = |error: io::Error| {
            Failure::new(format!("cannot listen on {address}")).because(error).of_kind("control").next(
                "is the port or the path taken by another program, and is the address one of this machine? Port 0 takes a free one",
            )
        };
        let places = Arc::new(Semaphore::new(MAX_CLIENTS));
        let start = |listener| tokio::spawn(serve(listener, entry, Arc::clone(&places), requests));
        match address {
            ControlAddress::Tcp(host) => {
                let listener = TcpListener::bind(host).await.map_err(refused)?;
                let place = ControlAddress::Tcp(listener.local_addr().map_err(refused)?.to_string());
                let listening = start(Listener::Tcp(listener));
                Ok(Self {
                    place,
                    listening,
                    places,
                    #[cfg(unix)]
                    _path: None,
                })
            }
            #[cfg(unix)]
            ControlAddress::Unix(path) => {
                let (listener, path) = unix::bind(path).map_err(refused)?;
                let listening = start(Listener::Unix(listener));
                Ok(Self { place: address.clone(), listening, places, _path: Some(path) })
            }
            #[cfg(not(unix))]
            ControlAddress::Unix(_) => Err(refused(io::ErrorKind::Unsupported.into())),
        }
    }

    /// Where it listens, with the real port.
    pub const fn place(&self) -> &ControlAddress {
        &self.place
    }

    /// Accepts no more clients, and waits until the present ones have read what was sent, at most for `patience`. The world
    /// has released them before.
    pub async fn part(self, patience: Duration) {
        self.listening.abort();
        // Who does not read by then has no use for it.
        let _ = tokio::time::timeout(patience, self.places.acquire_many(MAX_CLIENTS as u32)).await;
    }
}

impl Drop for ControlServer {
    fn drop(&mut self) {
        self.listening.abort();
    }
}

/// Where clients come.
enum Listener {
    Tcp(TcpListener),
    #[cfg(unix)]
    Unix(tokio::net::UnixListener),
}

/// A client's socket of either kind.
trait Socket: AsyncRead + AsyncWrite + Unpin + Send {}

impl<S: AsyncRead + AsyncWrite + Unpin + Send> Socket for S {}

impl Listener {
    async fn accept(&self) -> io::Result<Box<dyn Socket>> {
        match self {
            Self::Tcp(listener) => {
                let (stream, _) = listener.accept().await?;
                // An option that fails costs some latency, not the connection.
                let _ = stream.set_nodelay(true);
                Ok(Box::new(stream))
            }
            #[cfg(unix)]
            Self::Unix(listener) => Ok(Box::new(listener.accept().await?.0)),
        }
    }
}

/// Serves each client that comes.
async fn serve<T>(listener: Listener, entry: Entry, places: Arc<Semaphore>, requests: mpsc::Sender<T>)
where
    T: From<ControlMessage> + Send + 'static,
{
    let clock = WallClock::start();
    let mut rate = Rate::new(STRANGERS_A_SECOND, STRANGERS_AT_ONCE);
    let mut strangers: VecDeque<Arc<SharedOutbox>> = VecDeque::new();
    let mut number = 0;
    loop {
        let Ok(mut stream) = listener.accept().await else {
            tokio::time::sleep(ACCEPT_PAUSE).await;
            continue;
        };
        if entry == Entry::ByToken {
            clock.sleep(rate.delay(clock.now())).await;
            strangers.retain(|stranger| stranger.is_stranger());
            if strangers.len() >= MAX_STRANGERS {
                strangers.pop_front().into_iter().for_each(|longest| longest.send_away());
            }
        }
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
            // Sent as far as its socket takes it at once.
            let _ = tokio::time::timeout(ACCEPT_PAUSE, stream.write_all(NO_PLACE.as_bytes())).await;
            continue;
        };
        number += 1;
        let client = Client { number, requests: requests.clone(), shared_outbox: Arc::default() };
        if entry == Entry::ByToken {
            strangers.push_back(Arc::clone(&client.shared_outbox));
        }
        tokio::spawn(async move {
            client.serve(stream, entry).await;
            drop(place);
        });
    }
}

/// The task of one client.
struct Client<T> {
    number: ClientNumber,
    requests: mpsc::Sender<T>,
    shared_outbox: Arc<SharedOutbox>,
}

impl<T: From<ControlMessage>> Client<T> {
    async fn serve(&self, stream: Box<dyn Socket>, entry: Entry) {
        if !self.send(ControlMessage::Joined(self.number, Arc::clone(&self.shared_outbox))).await {
            return;
        }
        let (reader, writer) = tokio::io::split(stream);
        let mut writing = std::pin::pin!(write_lines(writer, &self.shared_outbox));
        tokio::select! {
            _ = self.read_lines(reader) => {
                // What it has asked for is answered before this is heard.
                self.send(ControlMessage::Left(self.number)).await;
                let _ = tokio::time::timeout(LINGER, writing).await;
            }
            _ = &mut writing => {
                self.send(ControlMessage::Left(self.number)).await;
            }
            () = self.turned_away(), if entry == Entry::ByToken => {
                self.shared_outbox.put(Class::Answer, SENT_AWAY.to_owned());
                self.send(ControlMessage::Left(self.number)).await;
                let _ = tokio::time::timeout(LINGER, writing).await;
            }
        }
        self.shared_outbox.send_away();
    }

    /// Returns when the client is not to stay: it has not been admitted in time, or must make room.
    async fn turned_away(&self) {
        if let Ok(true) = tokio::time::timeout(TOKEN_PATIENCE, self.shared_outbox.is_admitted()).await {
            std::future::pending::<()>().await;
        }
    }

    /// False when the world's loop is over.
    async fn send(&self, message: ControlMessage) -> bool {
        self.requests.send(message.into()).await.is_ok()
    }

    /// Hands over whole lines until the client closes its side.
    async fn read_lines(&self, mut reader: ReadHalf<Box<dyn Socket>>) -> io::Result<()> {
        let mut buffer = LineBuffer::default();
        let mut bytes = [0; READ_SIZE];
        loop {
            let count = reader.read(&mut bytes).await?;
            if count == 0 {
                return Ok(());
            }
            let mut lines = Vec::new();
            buffer.take(&bytes[..count], |line| lines.push(line));
            for line in lines {
                self.shared_outbox.wait_for_room().await;
                if !self.send(ControlMessage::Line(self.number, line)).await {
                    return Ok(());
                }
            }
        }
    }
}

/// Writes what comes into the shared_outbox until it is closed and empty.
async fn write_lines(mut writer: WriteHalf<Box<dyn Socket>>, shared_outbox: &SharedOutbox) -> io::Result<()> {
    let mut text = String::with_capacity(WRITE_SIZE);
    while shared_outbox.fetch(&mut text, WRITE_SIZE).await {
        writer.write_all(text.as_bytes()).await?;
        text.clear();
    }
    writer.shutdown().await
}
