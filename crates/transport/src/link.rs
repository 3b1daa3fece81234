//! A client's end of a byte stream, TCP or serial, with the buffers that make sending and receiving cancel-safe.

use std::fmt;
use std::future::Future;
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_serial::{SerialPortBuilderExt, SerialStream};

use crate::{BusError, WallClock, tcp};

/// How long a TCP connection may take to come about. Shorter than the system's own minutes, longer than a bad network.
const CONNECT_PATIENCE: Duration = Duration::from_secs(5);

/// Read at once, in bytes: some 30 frames.
const READ_SIZE: usize = 2048;

pub(crate) struct Link {
    address: String,
    stream: Box<dyn Stream>,
    input: Vec<u8>,
    consumed: usize,
    output: Vec<u8>,
}

trait Stream: AsyncRead + AsyncWrite + Unpin + Send {}
impl Stream for TcpStream {}
impl Stream for SerialStream {}

impl fmt::Debug for Link {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Link").field("address", &self.address).finish_non_exhaustive()
    }
}

impl Link {
    pub(crate) async fn connect(address: &str, clock: &WallClock) -> Result<Self, BusError> {
        let failed = |source| BusError::Connect { address: address.to_owned(), source };
        let stream = tokio::select! {
            stream = TcpStream::connect(address) => stream.map_err(failed)?,
            () = clock.sleep(CONNECT_PATIENCE) => return Err(failed(std::io::ErrorKind::TimedOut.into())),
        };
        // A frame waits for nobody: CANopen is a conversation of small messages.
        tcp::send_at_once(&stream).map_err(failed)?;
        Ok(Self::new(address, Box::new(stream)))
    }

    pub(crate) fn open_serial(path: &str, baud: u32) -> Result<Self, BusError> {
        let opened = tokio_serial::new(path, baud).open_native_async();
        let stream = opened.map_err(|source| BusError::OpenSerial { path: path.to_owned(), source })?;
        Ok(Self::over_serial(path, stream))
    }

    pub(crate) fn over_serial(path: &str, stream: SerialStream) -> Self {
        Self::new(path, Box::new(stream))
    }

    fn new(address: &str, stream: Box<dyn Stream>) -> Self {
        Self { address: address.to_owned(), stream, input: Vec::new(), consumed: 0, output: Vec::new() }
    }

    pub(crate) fn address(&self) -> String {
        self.address.clone()
    }

    /// Takes from what has been received: `take` advances the slice over what it uses up.
    pub(crate) fn take<T>(&mut self, take: impl FnOnce(&mut &[u8]) -> T) -> T {
        let mut unread = &self.input[self.consumed..];
        let result = take(&mut unread);
        self.consumed = self.input.len() - unread.len();
        result
    }

    /// Receives some bytes. Cancel-safe.
    pub(crate) async fn fill(&mut self) -> Result<(), BusError> {
        self.input.drain(..self.consumed);
        self.consumed = 0;
        self.input.reserve(READ_SIZE);
        match self.stream.read_buf(&mut self.input).await {
            Ok(0) => Err(BusError::Closed { address: self.address() }),
            Ok(_) => Ok(()),
            Err(source) => Err(self.lost(source)),
        }
    }

    /// Sends what `emit` appends, whole or not at all. Cancel-safe: what is left goes out first next time.
    pub(crate) async fn send(&mut self, emit: impl FnOnce(&mut Vec<u8>)) -> Result<(), BusError> {
        self.flush().await?;
        emit(&mut self.output);
        self.flush().await
    }

    async fn flush(&mut self) -> Result<(), BusError> {
        while !self.output.is_empty() {
            match self.stream.write(&self.output).await {
                Ok(0) => return Err(BusError::Closed { address: self.address() }),
                Ok(written) => drop(self.output.drain(..written)),
                Err(source) => return Err(self.lost(source)),
            }
        }
        Ok(())
    }

    fn lost(&self, source: std::io::Error) -> BusError {
        BusError::Lost { address: self.address(), source }
    }
}

/// `future`, unless it takes longer than `patience`: then `None`.
pub(crate) async fn within<T>(clock: &WallClock, patience: Duration, future: impl Future<Output = T>) -> Option<T> {
    tokio::select! {
        result = future => Some(result),
        () = clock.sleep(patience) => None,
    }
}
