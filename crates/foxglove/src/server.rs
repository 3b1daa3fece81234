//! The server: its thread, its sockets, and the way in for data.

use std::io;
use std::net::{SocketAddr, TcpListener as StdListener};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use recording::{Batch, Channels, Column};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, mpsc};
use tokio::task::LocalSet;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use tokio_tungstenite::tungstenite::protocol::{CloseFrame, WebSocketConfig};
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{WebSocketStream, accept_hdr_async_with_config};

use crate::client::Client;
use crate::clients::Clients;
use crate::handshake::Handshake;
use crate::shared::Shared;

/// Clients at a time, those included whose handshake is under way.
const MOST_CLIENTS: usize = 64;

/// The largest message that is read: a subscription to a thousand channels has 40 kB.
const LARGEST_MESSAGE: usize = 64 << 10;

/// How long a handshake may take.
const HANDSHAKE_PATIENCE: Duration = Duration::from_secs(5);

/// How long a client may take to read anything at all; the kernel takes some 100 kB for it before that counts, between programs of one
/// machine some MB.
const READING_PATIENCE: Duration = Duration::from_secs(30);

/// Pause after a failed accept (out of file descriptors): the clients that are there go on.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Batches that may wait for the server's thread.
const BATCHES: usize = 32;

/// How long the end waits for clients to read the last of it.
const PARTING_PATIENCE: Duration = Duration::from_millis(500);

/// Who may look.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Pages that are let in beside those of this machine and of Foxglove: `https://lichtblick.example`.
    pub origins: Vec<String>,
}

/// Serves those who watch, until it is [finished](Self::finish) or dropped. A drop does not wait: its thread closes the connections as long
/// as the process lives.
pub struct Server {
    address: SocketAddr,
    pieces: mpsc::Sender<Piece>,
    shared: Arc<Shared>,
    /// Closed when the thread has ended.
    ended: std::sync::mpsc::Receiver<()>,
}

/// What is handed to the thread.
enum Piece {
    Batch(Box<Batch>),
    Columns(Vec<Column>),
}

impl Server {
    /// Listens at `address`, `HOST:PORT`, for viewers of these channels.
    ///
    /// # Errors
    /// The system's: the port is taken, the address is another machine's.
    pub fn start(address: &str, options: Options, channels: Channels) -> io::Result<Self> {
        let listener = StdListener::bind(address)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let (pieces, incoming) = mpsc::channel(BATCHES);
        let (_alive, ended) = std::sync::mpsc::channel();
        let shared = Arc::<Shared>::default();
        let (of_thread, session) = (Arc::clone(&shared), random_name()?);
        std::thread::Builder::new().name("foxglove".to_owned()).spawn(move || {
            let _alive = _alive;
            let clients = Rc::new(Clients::new(channels, session, Arc::clone(&of_thread)));
            let serving = serve(listener, options, Rc::clone(&clients), incoming, &of_thread);
            let _: io::Result<()> = LocalSet::new().block_on(&runtime, serving);
        })?;
        Ok(Self { address, pieces, shared, ended })
    }

    /// Where it listens, with the real port.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Whether anything is subscribed to: else nothing has to be sampled.
    pub fn is_watched(&self) -> bool {
        self.shared.subscriptions.load(Ordering::Relaxed) > 0
    }

    /// Shows what has happened. This never waits: where the server's thread is behind, the batch is left out, and a
    /// status message reports it.
    pub fn show(&self, batch: Batch) {
        let entries = batch.samples() + batch.frames.len() + batch.marks.len();
        if self.is_watched() && !self.hand(Piece::Batch(Box::new(batch))) {
            self.leave_out(entries);
        }
    }

    /// Notes that so many samples, frames or events did not find room before they could be shown: a status message reports them to those
    /// who watch.
    pub fn leave_out(&self, entries: usize) {
        if self.is_watched() {
            self.shared.lost.fetch_add(entries as u64, Ordering::Relaxed);
        }
    }

    /// Adds columns at the end of a row, whose subjects are new; false if there is no room for that now: try again later.
    pub fn add(&self, columns: &[Column]) -> bool {
        self.hand(Piece::Columns(columns.to_vec()))
    }

    fn hand(&self, piece: Piece) -> bool {
        self.pieces.try_send(piece).is_ok()
    }

    /// Waits until what was shown has reached those who read it in good time, 1 s at most, and their connections are closed. Not for a
    /// program that has something to stop first.
    pub fn finish(self) {
        let Self { pieces, ended, .. } = self;
        drop(pieces);
        let _ = ended.recv_timeout(PARTING_PATIENCE * 2);
    }
}

/// Distinguishes this server from one before at the same address.
fn random_name() -> io::Result<String> {
    let mut bytes = [0; 8];
    getrandom::fill(&mut bytes).map_err(io::Error::other)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Serves until nothing more comes.
async fn serve(
    listener: StdListener,
    options: Options,
    clients: Rc<Clients>,
    mut incoming: mpsc::Receiver<Piece>,
    shared: &Shared,
) -> io::Result<()> {
    let listener = TcpListener::from_std(listener)?;
    let accepting = tokio::task::spawn_local(accept(listener, options, Rc::clone(&clients)));
    while let Some(piece) = incoming.recv().await {
        match piece {
            Piece::Batch(batch) => clients.show(&batch),
            Piece::Columns(columns) => clients.add(&columns),
        }
        let lost = shared.lost.swap(0, Ordering::Relaxed);
        if lost > 0 {
            clients.warn(&format!(
                "{lost} samples, frames and events were left out: this machine has no time to show them"
            ));
        }
        // Clients have their turn before the next batch, however fast those come.
        tokio::task::yield_now().await;
    }
    accepting.abort();
    clients.end();
    let all_gone = async {
        while !clients.is_empty() {
            tokio::time::sleep(PARTING_PATIENCE / 50).await;
        }
    };
    // Who does not read by then has no use for it.
    let _ = timeout(PARTING_PATIENCE, all_gone).await;
    Ok(())
}

/// Lets clients in.
async fn accept(listener: TcpListener, options: Options, clients: Rc<Clients>) {
    let (places, options) = (Arc::new(Semaphore::new(MOST_CLIENTS)), Rc::new(options));
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            tokio::time::sleep(ACCEPT_PAUSE).await;
            continue;
        };
        // Without a place the connection is closed; clients try again.
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else { continue };
        let (clients, options) = (Rc::clone(&clients), Rc::clone(&options));
        tokio::task::spawn_local(async move {
            let _ = stream.set_nodelay(true);
            let config = WebSocketConfig::default()
                .max_message_size(Some(LARGEST_MESSAGE))
                .max_frame_size(Some(LARGEST_MESSAGE));
            let callback = Handshake { origins: &options.origins };
            let handshake = accept_hdr_async_with_config(stream, callback, Some(config));
            if let Ok(Ok(socket)) = timeout(HANDSHAKE_PATIENCE, handshake).await {
                let client = clients.join();
                talk(socket, &clients, &client).await;
                clients.leave(&client);
            }
            drop(place);
        });
    }
}

/// Serves a client until it goes, reads nothing, or nothing more comes.
async fn talk<S: AsyncRead + AsyncWrite + Unpin>(socket: WebSocketStream<S>, clients: &Clients, client: &Client) {
    let (mut sink, mut stream) = socket.split();
    let writing = async {
        while let Some(message) = client.next().await {
            let sending = async {
                sink.feed(message).await?;
                // What waits goes out in one piece, so far as it came.
                for _ in 0..PIECES_AT_ONCE {
                    let Some(message) = client.take() else { break };
                    sink.feed(message).await?;
                }
                sink.flush().await
            };
            if !matches!(timeout(READING_PATIENCE, sending).await, Ok(Ok(()))) {
                return CloseCode::Policy;
            }
        }
        CloseCode::Away
    };
    let reading = async {
        loop {
            match stream.next().await {
                Some(Ok(Message::Text(text))) => {
                    if !clients.handle_text(client, &text) {
                        return CloseCode::Policy;
                    }
                }
                Some(Ok(Message::Binary(_))) => {
                    if !clients.refuse_binary(client) {
                        return CloseCode::Policy;
                    }
                }
                Some(Ok(Message::Ping(_) | Message::Pong(_) | Message::Frame(_))) => {}
                Some(Err(Error::Capacity(_))) => return CloseCode::Size,
                Some(Err(Error::Utf8(_))) => return CloseCode::Invalid,
                Some(Err(Error::Protocol(_))) => return CloseCode::Protocol,
                Some(Ok(Message::Close(_)) | Err(_)) | None => return CloseCode::Normal,
            }
        }
    };
    let code = tokio::select! {
        code = reading => code,
        code = writing => code,
    };
    let reason = match code {
        CloseCode::Size => "a message has 64 KiB at most",
        CloseCode::Policy => "what was sent was not read",
        CloseCode::Away => "the program has ended",
        _ => "",
    };
    let frame = CloseFrame { code, reason: reason.into() };
    let _ = timeout(PARTING_PATIENCE, sink.send(Message::Close(Some(frame)))).await;
}

/// Messages that are sent together.
const PIECES_AT_ONCE: usize = 256;

#[cfg(test)]
mod tests {
    use can::Instant;
    use serde_json::Value;
    use tokio_tungstenite::connect_async;
    use tokio_tungstenite::tungstenite::client::IntoClientRequest;
    use tokio_tungstenite::tungstenite::protocol::Role;

    use super::*;

    #[tokio::test]
    async fn a_viewer_sees_what_it_subscribed_to_and_bad_input_costs_a_status_message() {
        let column: Column = "4.velocity_rpm".parse().expect("a column");
        let server = Server::start("127.0.0.1:0", Options::default(), Channels::of(&[column])).expect("a free port");
        let mut request = format!("ws://{}", server.address()).into_client_request().expect("an address");
        request.headers_mut().insert("sec-websocket-protocol", "foxglove.sdk.v1".parse().expect("a value"));
        let (mut socket, answer) = connect_async(request).await.expect("let in");
        assert_eq!(answer.headers()["sec-websocket-protocol"], "foxglove.sdk.v1");
        let without = connect_async(format!("ws://{}", server.address())).await.expect_err("without a subprotocol");
        assert!(matches!(without, Error::Http(answer) if answer.status() == 400));
        let mut texts = Vec::new();
        for said in
            ["", "{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":9,\"channelId\":2},{\"id\":8,\"channelId\":99}]}"]
        {
            socket.send(Message::text(said)).await.expect("sent");
        }
        socket.send(Message::binary(vec![0xFF; 100])).await.expect("sent");
        while texts.len() < 5 {
            let text = socket.next().await.expect("open").expect("a message").into_text().expect("a text");
            texts.push(serde_json::from_str::<Value>(&text).expect("JSON"));
        }
        let ops: Vec<_> = texts.iter().map(|text| text["op"].as_str().expect("an operation")).collect();
        assert_eq!(ops, ["serverInfo", "advertise", "status", "status", "status"]);
        assert_eq!(texts[1]["channels"][2]["topic"], "/node/4");
        assert!(texts[3]["message"].as_str().expect("a text").contains("unknown channel 99"));
        assert!(server.is_watched());
        server.show(Batch { rows: vec![(Instant::from_nanos(7), vec![60.0])], ..Batch::default() });
        let mut data = Vec::new();
        while data.len() < 2 {
            data.push(socket.next().await.expect("open").expect("a message").into_data().to_vec());
        }
        // The time; then opcode, subscription and time of the message, the representation of CDR, and 60.0.
        assert_eq!(data[0], [&[2][..], &7_u64.to_le_bytes()].concat());
        let head = [&[1, 9, 0, 0, 0][..], &7_u64.to_le_bytes(), &[0, 1, 0, 0]].concat();
        assert_eq!(data[1], [head, 60_f64.to_le_bytes().to_vec()].concat());
        // A huge message ends this connection, and no other.
        socket.send(Message::text(" ".repeat(LARGEST_MESSAGE + 1))).await.expect("sent");
        let Some(Ok(Message::Close(Some(frame)))) = socket.next().await else { panic!("not closed") };
        assert_eq!(frame.code, CloseCode::Size);
        let taken = Server::start(&server.address().to_string(), Options::default(), Channels::of(&[]));
        assert_eq!(taken.err().expect("it is taken").kind(), io::ErrorKind::AddrInUse);
    }

    /// In a time of its own, over a pipe of 1 KiB.
    #[tokio::test(start_paused = true)]
    async fn a_viewer_that_reads_nothing_is_sent_away_after_its_time_and_one_that_reads_is_not() {
        let clients = Clients::new(Channels::of(&[]), "a".to_owned(), Arc::default());
        for reads in [false, true] {
            let (ours, theirs) = tokio::io::duplex(1024);
            let socket = WebSocketStream::from_raw_socket(ours, Role::Server, None).await;
            let client = clients.join();
            (0..MOST_WAITING).for_each(|_| assert!(client.say(" ".repeat(1024))));
            let mut viewer = WebSocketStream::from_raw_socket(theirs, Role::Client, None).await;
            let begin = tokio::time::Instant::now();
            let reading = async {
                while reads && viewer.next().await.is_some() {}
                std::future::pending::<()>().await
            };
            let ended = tokio::select! {
                () = talk(socket, &clients, &client) => true,
                () = reading => false,
                () = tokio::time::sleep(READING_PATIENCE * 10) => false,
            };
            assert_eq!(ended, !reads, "a viewer that reads: {reads}");
            if !reads {
                assert!((READING_PATIENCE..READING_PATIENCE * 2).contains(&begin.elapsed()), "{:?}", begin.elapsed());
            }
        }
    }

    /// Texts that fill the pipe many times.
    const MOST_WAITING: usize = 100;
}
