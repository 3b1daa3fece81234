//! Modbus TCP: one task a client. What is no Modbus ends its connection: there is no telling where the next request
//! would begin. When all places are taken, whoever has been idle for longest makes room for the next.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::task::{AbortHandle, JoinSet};

use super::request::ModbusRequest;
use super::service;
use super::session::{ModbusMedium, ModbusSession};
use crate::WallClock;

/// Clients served at a time.
const MAX_CLIENTS: usize = 64;

/// Pause after a failed accept (out of file descriptors).
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// A client that is served.
struct Client {
    task: AbortHandle,
    /// When it last sent a whole request, or came, in nanoseconds of the clock.
    heard_at: Arc<AtomicU64>,
}

/// Serves clients until it is dropped, which ends their connections too.
pub(super) async fn serve<T>(listener: TcpListener, requests: mpsc::Sender<T>, clock: WallClock)
where
    T: From<ModbusRequest> + Send + 'static,
{
    let mut tasks = JoinSet::new();
    let mut clients: Vec<Client> = Vec::new();
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            clock.sleep(ACCEPT_PAUSE).await;
            continue;
        };
        while tasks.try_join_next().is_some() {}
        clients.retain(|client| !client.task.is_finished());
        if clients.len() >= MAX_CLIENTS {
            end_the_longest_idle(&mut clients);
        }
        let heard_at = Arc::new(AtomicU64::new(clock.now().as_nanos()));
        let task = tasks.spawn(serve_client(stream, requests.clone(), clock.clone(), Arc::clone(&heard_at)));
        clients.push(Client { task, heard_at });
    }
}

fn end_the_longest_idle(clients: &mut Vec<Client>) {
    let heard_at = |at: &usize| clients[*at].heard_at.load(Ordering::Relaxed);
    if let Some(at) = (0..clients.len()).min_by_key(heard_at) {
        clients.remove(at).task.abort();
    }
}

async fn serve_client<T>(stream: TcpStream, requests: mpsc::Sender<T>, clock: WallClock, heard_at: Arc<AtomicU64>)
where
    T: From<ModbusRequest> + Send + 'static,
{
    // An option that fails costs some latency, not the connection.
    let _ = stream.set_nodelay(true);
    let heard = || heard_at.store(clock.now().as_nanos(), Ordering::Relaxed);
    let session = ModbusSession::new(ModbusMedium::Tcp);
    // A client that speaks no Modbus, or is gone, is no news to anybody.
    let _ = service::serve(stream, session, &requests, &clock, Duration::ZERO, heard).await;
}
