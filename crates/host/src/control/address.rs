//! Where a control connection is: a TCP address or a path.

use std::fmt;
use std::net::IpAddr;
use std::path::PathBuf;
use std::str::FromStr;

/// A place to listen at, or to connect to. Prints as `control://127.0.0.1:4000` or `control+unix:///run/bench.sock`, which is
/// read back.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ControlAddress {
    /// `HOST:PORT`.
    Tcp(String),
    /// A Unix socket.
    Unix(PathBuf),
}

/// A text that names no place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?} is not an address of a control connection; expected HOST:PORT, as in 127.0.0.1:4000, or the path of a Unix socket, as in /tmp/bench.sock"
)]
pub struct NoAddress(String);

impl ControlAddress {
    /// Whether only programs of this machine can reach it.
    pub fn is_local(&self) -> bool {
        match self {
            Self::Unix(_) => true,
            Self::Tcp(address) => {
                let host = address.rsplit_once(':').map_or(address.as_str(), |(host, _)| host);
                let host = host.trim_start_matches('[').trim_end_matches(']');
                host == "localhost" || host.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
            }
        }
    }
}

impl FromStr for ControlAddress {
    type Err = NoAddress;

    fn from_str(text: &str) -> Result<Self, NoAddress> {
        let path = text.strip_prefix("control+unix://").or_else(|| text.strip_prefix("unix:"));
        if let Some(path) = path.or_else(|| text.contains('/').then_some(text).filter(|text| !text.contains("://"))) {
            let usable = !path.is_empty() && !path.ends_with('/');
            return usable.then(|| Self::Unix(path.into())).ok_or_else(|| NoAddress(text.to_owned()));
        }
        let address = text.strip_prefix("control://").unwrap_or(text);
        let (host, port) = address.rsplit_once(':').ok_or_else(|| NoAddress(text.to_owned()))?;
        let plain = !host.is_empty() && !host.contains(['/', ' ']) && port.parse::<u16>().is_ok();
        // Without brackets the end of an IPv6 address is ambiguous.
        let whole = !host.contains(':') || host.starts_with('[') && host.ends_with(']');
        (plain && whole).then(|| Self::Tcp(address.to_owned())).ok_or_else(|| NoAddress(text.to_owned()))
    }
}

impl fmt::Display for ControlAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(address) => write!(f, "control://{address}"),
            Self::Unix(path) => write!(f, "control+unix://{}", path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_as_they_are_printed() {
        for (text, printed, local) in [
            ("127.0.0.1:4000", "control://127.0.0.1:4000", true),
            ("control://localhost:0", "control://localhost:0", true),
            ("[::1]:4000", "control://[::1]:4000", true),
            ("0.0.0.0:4000", "control://0.0.0.0:4000", false),
            ("bench.example:4000", "control://bench.example:4000", false),
            ("/tmp/bench.sock", "control+unix:///tmp/bench.sock", true),
            ("unix:bench.sock", "control+unix://bench.sock", true),
            ("./bench.sock", "control+unix://./bench.sock", true),
        ] {
            let address: ControlAddress = text.parse().unwrap();
            assert_eq!((address.to_string().as_str(), address.is_local()), (printed, local));
            assert_eq!(printed.parse(), Ok(address));
        }
        for text in
            ["", "4000", "127.0.0.1", "127.0.0.1:", ":4000", "127.0.0.1:70000", "::1:4000", "http://a:1", "/tmp/"]
        {
            assert_eq!(text.parse::<ControlAddress>(), Err(NoAddress(text.to_owned())), "{text}");
        }
    }
}
