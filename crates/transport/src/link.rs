//! A client's end of a byte stream, TCP or serial, with the buffers that make sending and receiving cancel-safe.

use std::fmt;
use std::future::Future;
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_serial::{ClearBuffer, SerialPort, SerialPortBuilderExt, SerialStream};

use crate::{BusError, WallClock, tcp};

/// How long a TCP connection may take to come about. Shorter than the system's own minutes, longer than a bad network.
const CONNECT_PATIENCE: Duration = Duration::from_secs(5);

/// How long bytes may wait for a peer that takes none. A station is deaf so long; a line of 9600 baud needs 30 ms for a frame.
const SEND_PATIENCE: Duration = Duration::from_secs(1);

/// Read at once, in bytes: some 30 frames.
const READ_SIZE: usize = 2048;

pub(crate) struct Link {
    address: String,
    stream: Box<dyn Stream>,
    input: Vec<u8>,
    consumed: usize,
    output: Vec<u8>,
    clock: WallClock,
}

trait Stream: AsyncRead + AsyncWrite + Unpin + Send {
    /// Called after each read.
    fn has_read(&self) {}

    /// Throws away what the system still has to send: closing would wait for it.
    fn discard_output(&self) {}
}

impl Stream for TcpStream {
    fn has_read(&self) {
        tcp::acknowledge_at_once(self);
    }
}

impl Stream for SerialStream {
    fn discard_output(&self) {
        // Fails where the device is gone, and with it what was to be sent.
        let _ = self.clear(ClearBuffer::Output);
    }
}

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
        // A frame is sent at once: CANopen is a conversation of small messages.
        tcp::send_at_once(&stream).map_err(failed)?;
        tcp::notice_loss(&stream).map_err(failed)?;
        Ok(Self::new(address, Box::new(stream), clock))
    }

    pub(crate) fn open_serial(path: &str, baud: u32, clock: &WallClock) -> Result<Self, BusError> {
        let opened = tokio_serial::new(path, baud).open_native_async();
        let stream = opened.map_err(|source| BusError::OpenSerial { path: path.to_owned(), source })?;
        Ok(Self::over_serial(path, stream, clock))
    }

    pub(crate) fn over_serial(path: &str, stream: SerialStream, clock: &WallClock) -> Self {
        Self::new(path, Box::new(stream), clock)
    }

    fn new(address: &str, stream: Box<dyn Stream>, clock: &WallClock) -> Self {
        let (input, output) = (Vec::new(), Vec::new());
        Self { address: address.to_owned(), stream, input, consumed: 0, output, clock: clock.clone() }
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
            Ok(_) => {
                self.stream.has_read();
                Ok(())
            }
            Err(source) => Err(self.lost(source)),
        }
    }

    /// Sends what `emit` appends, whole or not at all. Cancel-safe: what is left goes out first next time. A peer that takes
    /// nothing for a second is given up.
    pub(crate) async fn send(&mut self, emit: impl FnOnce(&mut Vec<u8>)) -> Result<(), BusError> {
        let clock = self.clock.clone();
        let sent = async {
            self.flush().await?;
            emit(&mut self.output);
            self.flush().await
        };
        if let Some(result) = within(&clock, SEND_PATIENCE, sent).await {
            return result;
        }
        self.stream.discard_output();
        Err(BusError::Stuck { address: self.address() })
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
        biased;
        result = future => Some(result),
        () = clock.sleep(patience) => None,
    }
}
