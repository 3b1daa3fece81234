//! Modbus TCP: one task a client. What is no Modbus ends its connection: there is no telling where the next request
//! would begin.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc};
use tokio_modbus::server::tcp::Server;

use super::ModbusRequest;
use super::service::{Medium, Registers};
use crate::WallClock;

/// Clients served at a time; more wait until one leaves.
const MAX_CLIENTS: usize = 64;

/// Pause after a failed accept (out of file descriptors).
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Serves clients until it is dropped, which ends their connections too.
pub(super) async fn serve<T>(listener: TcpListener, requests: mpsc::Sender<T>, clock: WallClock)
where
    T: From<ModbusRequest> + Send + 'static,
{
    let places = Arc::new(Semaphore::new(MAX_CLIENTS));
    let server = Server::new(listener);
    let connected = |stream: TcpStream, _: SocketAddr| {
        let (requests, places) = (requests.clone(), places.clone());
        async move {
            // An option that fails costs some latency, not the connection.
            let _ = stream.set_nodelay(true);
            let place = places.acquire_owned().await.ok();
            Ok(Some((Registers { requests, medium: Medium::Tcp, _place: place }, stream)))
        }
    };
    loop {
        // A client that speaks no Modbus, or is gone, is no news to anybody.
        let _ = server.serve(&connected, |_| {}).await;
        clock.sleep(ACCEPT_PAUSE).await;
    }
}
