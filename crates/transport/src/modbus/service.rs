//! The task that serves one connection or line: bytes to the session, its requests to the owner of the registers, and the
//! answers back.

use std::io;
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::sync::{mpsc, oneshot};

use super::request::{ModbusException, ModbusRequest, RegisterAnswer};
use super::session::{ModbusInquiry, ModbusSession};
use crate::WallClock;

/// Read at once, in bytes: two of the longest requests.
const READ_SIZE: usize = 512;

/// Serves `stream` until it ends, fails, or brings what is not Modbus. A silence on a line lasts `silence`; `heard` is
/// called for each request.
pub(super) async fn serve<T, S>(
    mut stream: S,
    mut session: ModbusSession,
    requests: &mpsc::Sender<T>,
    clock: &WallClock,
    silence: Duration,
    heard: impl Fn(),
) -> io::Result<()>
where
    T: From<ModbusRequest> + Send,
    S: AsyncRead + AsyncWrite + Unpin,
{
    let mut bytes = [0; READ_SIZE];
    let mut out = Vec::new();
    loop {
        while let Some(inquiry) = session.next_request() {
            heard();
            let answer = ask(requests, &inquiry).await;
            out.clear();
            inquiry.respond(answer, &mut out);
            stream.write_all(&out).await?;
        }
        if session.is_over() {
            return Ok(());
        }
        tokio::select! {
            read = stream.read(&mut bytes) => match read? {
                0 => return Ok(()),
                read => session.receive(&bytes[..read]),
            },
            () = clock.sleep(silence), if session.awaits_silence() => session.handle_silence(),
        }
    }
}

/// The answer of the owner of the registers, who may be gone.
async fn ask<T: From<ModbusRequest>>(requests: &mpsc::Sender<T>, inquiry: &ModbusInquiry) -> RegisterAnswer {
    let (answer, answered) = oneshot::channel();
    let (unit, broadcast, access) = (inquiry.unit(), inquiry.is_broadcast(), inquiry.access().clone());
    let _ = requests.send(ModbusRequest { unit, broadcast, access, answer }.into()).await;
    answered.await.unwrap_or(Some(Err(ModbusException::ServerDeviceFailure)))
}
