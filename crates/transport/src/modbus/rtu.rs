//! Modbus RTU on a serial line. A line that fails is opened again.

use std::time::Duration;

use tokio::sync::mpsc;
use tokio_serial::{SerialPortBuilder, SerialStream};

use super::request::ModbusRequest;
use super::service;
use super::session::{ModbusMedium, ModbusSession};
use crate::WallClock;

/// Pause before a line that failed is opened again.
const REOPEN_PAUSE: Duration = Duration::from_millis(500);

/// Silence that ends a frame, besides the 3.5 characters of the standard (serial line, 2.5.1.1). Guess: adapters on USB
/// gather bytes for 16 ms, and a busy machine sleeps as long again; masters wait for an answer several times this.
const BUFFERING: Duration = Duration::from_millis(50);

/// Serves a line until it is dropped.
pub(super) async fn serve<T>(
    place: SerialPortBuilder,
    baud: u32,
    opened: SerialStream,
    requests: mpsc::Sender<T>,
    clock: WallClock,
) where
    T: From<ModbusRequest> + Send + 'static,
{
    let mut line = Some(opened);
    loop {
        if let Some(line) = line.take() {
            let session = ModbusSession::new(ModbusMedium::SerialLine);
            let _ = service::serve(line, session, &requests, &clock, silence(baud), || {}).await;
        }
        clock.sleep(REOPEN_PAUSE).await;
        line = SerialStream::open(&place).ok();
    }
}

/// 3.5 characters of 10 bits, and what is buffered on the way.
fn silence(baud: u32) -> Duration {
    BUFFERING + Duration::from_secs_f64(35.0 / f64::from(baud))
}
