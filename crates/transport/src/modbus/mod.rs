//! Modbus registers served to other programs, over TCP or a serial line ("MODBUS Application Protocol Specification
//! V1.1b3", "MODBUS Messaging on TCP/IP Implementation Guide V1.0b", "MODBUS over Serial Line V1.02").
//!
//! Function codes 03h and 04h read (the registers are the same to both), 06h and 10h write; any other is answered with
//! exception 01, and a request whose length or quantity contradicts itself with exception 03. The server knows no
//! registers: each request goes as a [`ModbusRequest`] to the owner of them, and the connection waits for the answer, so
//! that a client's requests keep their order. A unit that does not exist gets exception 0Bh over TCP, where this end is the
//! gateway to the units, and silence on a serial line. [`ModbusSession`] is all of that without sockets.

mod adu;
mod line;
mod mbap;
mod pdu;
mod request;
mod rtu;
mod service;
mod session;
mod tcp;

use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::str::FromStr;

use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio::task::AbortHandle;
use tokio_serial::SerialStream;

pub use self::request::{ModbusException, ModbusRequest, RegisterAccess, RegisterAnswer};
pub use self::session::{ModbusInquiry, ModbusMedium, ModbusSession};
use crate::bus_spec::parse_address;
use crate::{ParseBusError, WallClock};

/// Line speed unless `?baud=` says otherwise.
const DEFAULT_BAUD: u32 = 115_200;

/// Where to serve registers: `modbus://127.0.0.1:1502` (the scheme may be left out, port 0 lets the system choose) or
/// `rtu:///dev/ttyUSB0?baud=115200` (8 data bits, no parity, 1 stop bit).
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ModbusSpec {
    /// Modbus TCP.
    Tcp {
        /// `HOST:PORT`.
        address: String,
    },
    /// Modbus RTU on a serial line.
    Rtu {
        /// The device.
        path: String,
        /// Bits a second.
        baud: u32,
    },
}

impl FromStr for ModbusSpec {
    type Err = ParseBusError;

    fn from_str(text: &str) -> Result<Self, ParseBusError> {
        let parsed = match text.split_once("://") {
            None => parse_address(text, None).map(|address| Self::Tcp { address }),
            Some(("modbus", address)) => parse_address(address, None).map(|address| Self::Tcp { address }),
            Some(("rtu", place)) => parse_rtu(place),
            Some(_) => Err("expected HOST:PORT, modbus://HOST:PORT or rtu:///dev/ttyUSB0?baud=115200".to_owned()),
        };
        parsed.map_err(|reason| ParseBusError::new(text, "place to serve Modbus at", reason))
    }
}

fn parse_rtu(place: &str) -> Result<ModbusSpec, String> {
    let (path, options) = place.split_once('?').unwrap_or((place, ""));
    if !path.starts_with('/') {
        return Err("expected a device with three slashes such as rtu:///dev/ttyUSB0?baud=115200".to_owned());
    }
    let mut baud = DEFAULT_BAUD;
    for option in options.split('&').filter(|option| !option.is_empty()) {
        let value = option.strip_prefix("baud=").ok_or_else(|| format!("unknown option '{option}'; known is baud="))?;
        let parsed = value.parse().ok().filter(|baud| *baud > 0);
        baud = parsed.ok_or_else(|| format!("'{value}' is not a line speed"))?;
    }
    Ok(ModbusSpec::Rtu { path: path.to_owned(), baud })
}

impl fmt::Display for ModbusSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp { address } => write!(f, "modbus://{address}"),
            Self::Rtu { path, baud } => write!(f, "rtu://{path}?baud={baud}"),
        }
    }
}

/// Why registers are not served.
#[derive(Debug, thiserror::Error)]
#[error("cannot serve {place}")]
pub struct ModbusError {
    place: ModbusSpec,
    source: io::Error,
}

/// Serves registers at one place by tasks of the current tokio runtime; dropping it ends them.
#[derive(Debug)]
pub struct ModbusServer {
    place: ModbusSpec,
    task: AbortHandle,
}

impl ModbusServer {
    /// Listens at `place` from now on; requests go to `requests`.
    pub async fn bind<T>(place: &ModbusSpec, requests: mpsc::Sender<T>, clock: &WallClock) -> Result<Self, ModbusError>
    where
        T: From<ModbusRequest> + Send + 'static,
    {
        let failed = |source| ModbusError { place: place.clone(), source };
        let clock = clock.clone();
        match place {
            ModbusSpec::Tcp { address } => {
                let listener = TcpListener::bind(address).await.map_err(failed)?;
                let address: SocketAddr = listener.local_addr().map_err(failed)?;
                let task = tokio::spawn(tcp::serve(listener, requests, clock)).abort_handle();
                Ok(Self { place: ModbusSpec::Tcp { address: address.to_string() }, task })
            }
            ModbusSpec::Rtu { path, baud } => {
                let line = tokio_serial::new(path.as_str(), *baud);
                let opened = SerialStream::open(&line).map_err(|error| failed(error.into()))?;
                let task = tokio::spawn(rtu::serve(line, *baud, opened, requests, clock)).abort_handle();
                Ok(Self { place: place.clone(), task })
            }
        }
    }

    /// Where it listens, with the real port.
    pub fn place(&self) -> &ModbusSpec {
        &self.place
    }
}

impl Drop for ModbusServer {
    fn drop(&mut self) {
        self.task.abort();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_and_printed_back() {
        for (text, printed) in [
            ("127.0.0.1:1502", "modbus://127.0.0.1:1502"),
            ("modbus://[::1]:0", "modbus://[::1]:0"),
            ("rtu:///dev/ttyUSB0", "rtu:///dev/ttyUSB0?baud=115200"),
            ("rtu:///dev/ttyS1?baud=19200", "rtu:///dev/ttyS1?baud=19200"),
        ] {
            assert_eq!(text.parse::<ModbusSpec>().unwrap().to_string(), printed);
        }
        for text in ["", "1502", "host", "tcp://a:1", "rtu://ttyS0", "rtu:///dev/x?baud=0", "rtu:///dev/x?parity=e"] {
            let error = text.parse::<ModbusSpec>().unwrap_err().to_string();
            assert!(error.contains("is not a place to serve Modbus at"), "{error}");
        }
    }
}
