//! The sockets of the control connection: one task a client, which moves lines between its socket and the world's loop.
//!
//! What the lines mean is `testbench::control`. Nothing here holds up the world: a client that does not read has its newest events
//! and values kept and the others counted, and is not listened to while many answers wait for it.

mod mailbox;

use std::io;
use std::sync::Arc;
use std::time::Duration;

use testbench::control::{ClientNumber, ControlAddress, LineBuffer, ReadLine};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadHalf, WriteHalf};
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, mpsc};

use crate::failure::Failure;
pub(crate) use mailbox::{Letters, Mailbox};

/// Clients served at a time.
const MAX_CLIENTS: usize = 256;

/// What one is told that finds all places taken.
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
pub(crate) enum ControlMessage {
    /// One has come. Lines for it go into the mailbox.
    Joined(ClientNumber, Arc<Mailbox>),
    /// It says something.
    Line(ClientNumber, ReadLine),
    /// It is gone.
    Left(ClientNumber),
}

/// Listens until it is dropped; a Unix socket is removed then.
pub(crate) struct ControlServer {
    place: ControlAddress,
    listening: tokio::task::JoinHandle<()>,
}

impl ControlServer {
    /// Listens at `address`; messages go to `requests`.
    pub(crate) async fn bind<T>(address: &ControlAddress, requests: mpsc::Sender<T>) -> Result<Self, Failure>
    where
        T: From<ControlMessage> + Send + 'static,
    {
        let refused = |error: io::Error| {
            Failure::new(format!("cannot listen on {address}")).because(error).of_kind("control").next(
                "is the port or the path taken by another program, and is the address one of this machine? Port 0 takes a free one",
            )
        };
        let (listener, place) = match address {
            ControlAddress::Tcp(host) => {
                let listener = TcpListener::bind(host).await.map_err(refused)?;
                let place = ControlAddress::Tcp(listener.local_addr().map_err(refused)?.to_string());
                (Listener::Tcp(listener), place)
            }
            #[cfg(unix)]
            ControlAddress::Unix(path) => (Listener::Unix(unix::bind(path).map_err(refused)?), address.clone()),
            #[cfg(not(unix))]
            ControlAddress::Unix(_) => return Err(refused(io::ErrorKind::Unsupported.into())),
        };
        Ok(Self { place, listening: tokio::spawn(serve(listener, requests)) })
    }

    /// Where it listens, with the real port.
    pub(crate) const fn place(&self) -> &ControlAddress {
        &self.place
    }
}

impl Drop for ControlServer {
    fn drop(&mut self) {
        self.listening.abort();
        if let ControlAddress::Unix(path) = &self.place {
            // What is not there need not be removed.
            let _ = std::fs::remove_file(path);
        }
    }
}

#[cfg(unix)]
mod unix {
    use std::io;
    use std::os::unix::fs::{FileTypeExt, PermissionsExt};
    use std::path::Path;

    use tokio::net::UnixListener;

    /// A socket that only this user may connect to, in place of one that nobody listens to any more.
    pub(super) fn bind(path: &Path) -> io::Result<UnixListener> {
        if let Ok(metadata) = std::fs::symlink_metadata(path) {
            if !metadata.file_type().is_socket() {
                return Err(io::Error::new(io::ErrorKind::AlreadyExists, "there is something else at this path"));
            }
            if std::os::unix::net::UnixStream::connect(path).is_ok() {
                return Err(io::Error::new(io::ErrorKind::AddrInUse, "another program listens there"));
            }
            std::fs::remove_file(path)?;
        }
        let listener = UnixListener::bind(path)?;
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600))?;
        Ok(listener)
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
async fn serve<T>(listener: Listener, requests: mpsc::Sender<T>)
where
    T: From<ControlMessage> + Send + 'static,
{
    let places = Arc::new(Semaphore::new(MAX_CLIENTS));
    let mut number = 0;
    loop {
        let Ok(mut stream) = listener.accept().await else {
            tokio::time::sleep(ACCEPT_PAUSE).await;
            continue;
        };
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
            // Told as far as its socket takes it at once.
            let _ = tokio::time::timeout(ACCEPT_PAUSE, stream.write_all(NO_PLACE.as_bytes())).await;
            continue;
        };
        number += 1;
        let client = Client { number, requests: requests.clone(), mailbox: Arc::default() };
        tokio::spawn(async move {
            client.serve(stream).await;
            drop(place);
        });
    }
}

/// The task of one client.
struct Client<T> {
    number: ClientNumber,
    requests: mpsc::Sender<T>,
    mailbox: Arc<Mailbox>,
}

impl<T: From<ControlMessage>> Client<T> {
    async fn serve(&self, stream: Box<dyn Socket>) {
        if !self.tell(ControlMessage::Joined(self.number, Arc::clone(&self.mailbox))).await {
            return;
        }
        let (reader, writer) = tokio::io::split(stream);
        let mut writing = std::pin::pin!(write_lines(writer, &self.mailbox));
        tokio::select! {
            _ = self.read_lines(reader) => {
                // What it has asked for is answered before this is heard.
                self.tell(ControlMessage::Left(self.number)).await;
                let _ = tokio::time::timeout(LINGER, writing).await;
            }
            _ = &mut writing => {
                self.tell(ControlMessage::Left(self.number)).await;
            }
        }
    }

    /// False when the world's loop is over.
    async fn tell(&self, message: ControlMessage) -> bool {
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
                self.mailbox.wait_for_room().await;
                if !self.tell(ControlMessage::Line(self.number, line)).await {
                    return Ok(());
                }
            }
        }
    }
}

/// Writes what comes into the mailbox until it is closed and empty.
async fn write_lines(mut writer: WriteHalf<Box<dyn Socket>>, mailbox: &Mailbox) -> io::Result<()> {
    let mut text = String::with_capacity(WRITE_SIZE);
    while mailbox.fetch(&mut text, WRITE_SIZE).await {
        writer.write_all(text.as_bytes()).await?;
        text.clear();
    }
    writer.shutdown().await
}
