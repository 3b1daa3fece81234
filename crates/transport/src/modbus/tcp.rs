//! Modbus TCP: one task a client. What is not Modbus ends its connection: there is no telling where the next request
//! would begin. When all places are taken, the client that has been idle for longest makes room for the next.

use std::sync::Arc;
use std::time::Duration;

use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::task::{AbortHandle, JoinSet};

use super::request::ModbusRequest;
use super::service;
use super::session::{ModbusMedium, ModbusSession};
use crate::{Vitals, WallClock};

/// Clients served at a time.
const MAX_CLIENTS: usize = 64;

/// Pause after a failed accept (out of file descriptors).
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// A client that is served.
struct Client {
    task: AbortHandle,
    vitals: Arc<Vitals>,
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
        if clients.len() >= MAX_CLIENTS
            && let Some(place) = Vitals::least(clients.iter().map(|client| &*client.vitals))
        {
            clients.remove(place).task.abort();
        }
        let vitals = Arc::new(Vitals::new(clock.now()));
        let task = tasks.spawn(serve_client(stream, requests.clone(), clock.clone(), Arc::clone(&vitals)));
        clients.push(Client { task, vitals });
    }
}

async fn serve_client<T>(stream: TcpStream, requests: mpsc::Sender<T>, clock: WallClock, vitals: Arc<Vitals>)
where
    T: From<ModbusRequest> + Send + 'static,
{
    // An option that fails costs some latency, not the connection.
    let _ = stream.set_nodelay(true);
    let heard = || vitals.spoke(clock.now());
    let session = ModbusSession::new(ModbusMedium::Tcp);
    // A client that does not speak Modbus, or is gone, is not reported.
    let _ = service::serve(stream, session, &requests, &clock, Duration::ZERO, heard).await;
}
