//! Modbus RTU. Bytes that are no request are passed over; a line that fails, or brings nothing else for long, is opened
//! again.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;
use tokio_modbus::server::rtu::Server;
use tokio_serial::{SerialPortBuilder, SerialStream};

use super::ModbusRequest;
use super::service::{Medium, Registers};
use crate::WallClock;

/// Pause before a line that failed is opened again.
const REOPEN_PAUSE: Duration = Duration::from_millis(500);

/// Serves a line until it is dropped.
pub(super) async fn serve<T>(
    place: SerialPortBuilder,
    opened: SerialStream,
    requests: mpsc::Sender<T>,
    clock: WallClock,
) where
    T: From<ModbusRequest> + Send + 'static,
{
    let registers = Arc::new(Registers { requests, medium: Medium::SerialLine, _place: None });
    let mut line = Some(opened);
    loop {
        if let Some(line) = line.take() {
            let _ = Server::new(line).serve_forever(registers.clone()).await;
        }
        clock.sleep(REOPEN_PAUSE).await;
        line = SerialStream::open(&place).ok();
    }
}
