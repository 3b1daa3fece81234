//! Modbus TCP: a header of transaction, protocol, length and unit before each PDU (MODBUS Messaging on TCP/IP V1.0b,
//! clause 3.1.3). What has no such header ends its connection: there is no telling where the next one would begin.

use std::io;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::pdu::{self, MAX_PDU_LENGTH};
use super::{ModbusException, ModbusRequest, ask};
use crate::WallClock;

/// Clients served at a time; more wait until one leaves.
const MAX_CLIENTS: usize = 64;

/// Pause after a failed accept (out of file descriptors): the clients that are there go on.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// What stands before a PDU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Number that the client gave the request; the response repeats it.
    pub transaction: u16,
    /// Bytes of the PDU, 1 to [`MAX_PDU_LENGTH`].
    pub length: u16,
    /// Unit identifier.
    pub unit: u8,
}

impl Header {
    /// Its bytes.
    pub const SIZE: usize = 7;

    /// From the wire; `None` for another protocol, or a length that no PDU has.
    pub fn parse(bytes: [u8; Self::SIZE]) -> Option<Self> {
        let [t0, t1, p0, p1, l0, l1, unit] = bytes;
        // The length counts the unit identifier.
        let length = u16::from_be_bytes([l0, l1]).wrapping_sub(1);
        let sound = [p0, p1] == [0, 0] && (1..=MAX_PDU_LENGTH).contains(&usize::from(length));
        sound.then_some(Self { transaction: u16::from_be_bytes([t0, t1]), length, unit })
    }

    /// To the wire.
    pub fn emit(self) -> [u8; Self::SIZE] {
        let ([t0, t1], [l0, l1]) = (self.transaction.to_be_bytes(), self.length.wrapping_add(1).to_be_bytes());
        [t0, t1, 0, 0, l0, l1, self.unit]
    }
}

/// Serves clients until it is dropped, which ends their connections too.
pub(super) async fn serve<T>(listener: TcpListener, requests: mpsc::Sender<T>, clock: WallClock)
where
    T: From<ModbusRequest> + Send + 'static,
{
    let mut clients = JoinSet::new();
    loop {
        tokio::select! {
            accepted = listener.accept(), if clients.len() < MAX_CLIENTS => match accepted {
                Ok((stream, _)) => drop(clients.spawn(serve_client(stream, requests.clone()))),
                Err(_) => clock.sleep(ACCEPT_PAUSE).await,
            },
            Some(_) = clients.join_next() => {}
        }
    }
}

/// Answers one request after the other; an error is the end of the connection.
async fn serve_client<T: From<ModbusRequest>>(mut stream: TcpStream, requests: mpsc::Sender<T>) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let mut buffer = [0; MAX_PDU_LENGTH];
    loop {
        let mut header = [0; Header::SIZE];
        stream.read_exact(&mut header).await?;
        let header = Header::parse(header).ok_or(io::ErrorKind::InvalidData)?;
        let request = &mut buffer[..usize::from(header.length)];
        stream.read_exact(request).await?;
        let no_unit = || pdu::response(request, &Err(ModbusException::GatewayTargetFailedToRespond));
        let response = ask(&requests, header.unit, false, request).await.unwrap_or_else(no_unit);
        let header = Header { length: response.len() as u16, ..header };
        let frame = [&header.emit(), &*response].concat();
        stream.write_all(&frame).await?;
    }
}
