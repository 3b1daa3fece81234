//! A bus that is somewhere else: the trait that run loops work on, and what can go wrong.

use std::future::Future;
use std::io;
use std::path::PathBuf;

use can::{Bitrate, Frame, Instant};

use crate::socketcan::InterfaceProblem;
use crate::{Received, socketcand};

/// A CAN bus behind a socket, a serial line or a file. Own frames do not come back.
pub trait AsyncBus {
    /// Hands `frame` to the bus; completes when the connection has taken it, which is before the wire carries it.
    ///
    /// While the connection is lost (between [`Note::ConnectionLost`](crate::Note::ConnectionLost) and
    /// [`Note::ConnectionBack`](crate::Note::ConnectionBack)) the frame is lost too, as that of a controller that is off the
    /// bus: a station goes on and keeps its deadlines.
    ///
    /// Cancel-safe: a frame goes out whole or not at all.
    fn send(&mut self, frame: &Frame) -> impl Future<Output = Result<(), BusError>> + Send;

    /// The next frame of the others or note of the bus, and when it came: on a live bus by the clock given at opening,
    /// from a log its time stamp.
    ///
    /// Cancel-safe: nothing is lost.
    fn recv(&mut self) -> impl Future<Output = Result<(Instant, Received), BusError>> + Send;

    /// The next frame of the others; notes are passed over. Cancel-safe.
    fn recv_frame(&mut self) -> impl Future<Output = Result<(Instant, Frame), BusError>> + Send
    where
        Self: Send,
    {
        async {
            loop {
                if let (at, Received::Frame(frame)) = self.recv().await? {
                    return Ok((at, frame));
                }
            }
        }
    }
}

/// Why a bus cannot be opened or used any longer.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// No connection.
    #[error("cannot connect to {address}; is the server running, and is the port right?")]
    Connect {
        /// `HOST:PORT`.
        address: String,
        /// What the system said.
        source: io::Error,
    },
    /// No socket to hear others by.
    #[error("cannot listen at {address}; is the port taken by another program, and is there a network for it?")]
    Listen {
        /// The address on this machine, or the multicast group.
        address: String,
        /// What the system said.
        source: io::Error,
    },
    /// The serial device does not open.
    #[error("cannot open the serial device {path}; {}", serial_advice(source))]
    OpenSerial {
        /// The device.
        path: String,
        /// What the system said.
        source: tokio_serial::Error,
    },
    /// The peer is silent.
    #[error("{address} does not answer: waited for {expected}; is it a {protocol} peer?")]
    Silent {
        /// `HOST:PORT` or the device.
        address: String,
        /// What should have come.
        expected: &'static str,
        /// The protocol spoken.
        protocol: &'static str,
    },
    /// The peer refused a request.
    #[error("{address} refused '{request}': {said}")]
    Refused {
        /// `HOST:PORT` or the device.
        address: String,
        /// What was asked.
        request: String,
        /// What it said, or what to do.
        said: String,
    },
    /// The peer said something else than the protocol lets it say here.
    #[error("{address} said {received} where {expected} was expected; is it a socketcand server?")]
    Unexpected {
        /// `HOST:PORT`.
        address: String,
        /// What came.
        received: String,
        /// What should have come.
        expected: &'static str,
    },
    /// The peer sent what is not a message.
    #[error("{address} sent what is not a socketcand message")]
    Malformed {
        /// `HOST:PORT`.
        address: String,
        /// What is wrong with it.
        source: socketcand::Malformed,
    },
    /// The peer ended the connection.
    #[error("{address} closed the connection")]
    Closed {
        /// `HOST:PORT` or the device.
        address: String,
    },
    /// The connection broke.
    #[error("lost the connection to {address}")]
    Lost {
        /// `HOST:PORT` or the device.
        address: String,
        /// What the system said.
        source: io::Error,
    },
    /// The peer takes nothing any more.
    #[error(
        "{address} takes nothing: what was to be sent has waited for 1 s; does the adapter or the server still run?"
    )]
    Stuck {
        /// `HOST:PORT` or the device.
        address: String,
    },
    /// The peer, which has answered before, says nothing any more.
    #[error(
        "{address} says nothing any more: it was asked twice, and left each unanswered for 1 s; is the adapter still there?"
    )]
    FellSilent {
        /// `HOST:PORT` or the device.
        address: String,
    },
    /// A bus that was joined to another, and is slower.
    #[error(
        "it takes frames more slowly than they come: more than 16384 wait for it; is its bit rate lower, is it disturbed?"
    )]
    TooSlow,
    /// The thread of the bus is gone.
    #[error("the thread of the bus has ended before its time: a defect of this program")]
    ThreadEnded,
    /// slcan names nine bit rates only.
    #[error("slcan cannot select {bitrate}; it knows 10k, 20k, 50k, 100k, 125k, 250k, 500k, 800k and 1M")]
    NoSlcanBitrate {
        /// What was asked for.
        bitrate: Bitrate,
    },
    /// The log file does not open.
    #[error("cannot open the log {}", path.display())]
    OpenLog {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The log file cannot be read on.
    #[error("cannot read the log {}", path.display())]
    Log {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The log is over.
    #[error("the log {} ends here", path.display())]
    EndOfLog {
        /// The file.
        path: PathBuf,
    },
    /// A log takes no frames.
    #[error("{} is a log and read only; nothing can be sent to it", path.display())]
    ReadOnly {
        /// The file.
        path: PathBuf,
    },
    /// A CAN interface of Linux cannot be used.
    #[error(transparent)]
    Interface(InterfaceProblem),
    /// A virtual bus is part of the program that asks for it, not of this crate.
    #[error("a simulated bus is not reached through a connection; the program that wants it has to embed it")]
    Simulated,
}

impl BusError {
    /// Whether the connection is gone, and a new one may come about.
    pub(crate) const fn is_loss_of_connection(&self) -> bool {
        matches!(self, Self::Closed { .. } | Self::Lost { .. } | Self::Stuck { .. } | Self::FellSilent { .. })
    }
}

/// What to do about a serial device that does not open.
fn serial_advice(error: &tokio_serial::Error) -> &'static str {
    use tokio_serial::ErrorKind::{Io, NoDevice};
    match error.kind() {
        Io(io::ErrorKind::PermissionDenied) => {
            "this user may not access it: sudo usermod -aG dialout $USER, then log out and in again"
        }
        Io(io::ErrorKind::NotFound) => {
            "there is none of that name: is the adapter plugged in? ls /dev/ttyACM* /dev/ttyUSB* shows those that are"
        }
        NoDevice => "another program has it open: end that first (slcand, minicom, ModemManager)",
        _ => "is it a serial device, and is the adapter plugged in?",
    }
}

#[cfg(test)]
mod tests {
    use tokio_serial::ErrorKind;

    use super::*;

    #[test]
    fn a_serial_device_that_does_not_open_comes_with_what_to_do() {
        for (kind, advice) in [
            (ErrorKind::Io(io::ErrorKind::PermissionDenied), "usermod -aG dialout"),
            (ErrorKind::Io(io::ErrorKind::NotFound), "is the adapter plugged in?"),
            (ErrorKind::NoDevice, "another program has it open"),
            (ErrorKind::Unknown, "is it a serial device"),
        ] {
            let source = tokio_serial::Error::new(kind, "what the system says");
            let error = BusError::OpenSerial { path: "/dev/ttyACM0".into(), source }.to_string();
            assert!(error.contains("/dev/ttyACM0") && error.contains(advice), "{error}");
        }
    }
}
