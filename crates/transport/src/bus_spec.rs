//! The texts behind `--bus` and `--serve`: what was typed, and what it means.

use std::fmt;
use std::net::IpAddr;
use std::path::PathBuf;
use std::str::FromStr;

use can::Bitrate;

use crate::any_bus::{AnyBus, BusKind};
use crate::reconnect::Reconnecting;
use crate::slcan_bus::SlcanPlace;
use crate::{BusError, CannelloniBus, LogBus, UdpMulticastBus, WallClock, socketcand, udp_multicast};

/// Line speed of a serial adapter unless `?baud=` says otherwise. USB adapters ignore it.
const DEFAULT_BAUD: u32 = 115_200;

/// How far frames to a multicast group go unless `?hops=` says otherwise: as python-can has it, the own network.
const DEFAULT_HOPS: u8 = 1;

/// Longest interface name on Linux (IFNAMSIZ without its terminating zero).
const MAX_INTERFACE_LENGTH: usize = 15;

/// A bus as named on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BusSpec {
    /// `sim`, `sim:FILE.toml`: an embedded virtual bus.
    Sim {
        /// The machine file; `None` for the standard three drives.
        file: Option<PathBuf>,
    },
    /// `can0`: a Linux SocketCAN interface.
    SocketCan {
        /// Its name.
        interface: String,
    },
    /// `socketcand://HOST:PORT/can0`; port 29536 and bus can0 may be left out.
    Socketcand {
        /// `HOST:PORT`.
        address: String,
        /// The server's name for the bus.
        bus: String,
    },
    /// `slcan:///dev/ttyACM0?bitrate=500k&baud=115200`: a serial adapter.
    SlcanSerial {
        /// The device.
        path: String,
        /// Bit rate to select; `None` leaves the adapter as it is.
        bitrate: Option<Bitrate>,
        /// Line speed.
        baud: u32,
    },
    /// `slcan://HOST:PORT?bitrate=500k`: slcan over TCP.
    SlcanTcp {
        /// `HOST:PORT`.
        address: String,
        /// Bit rate to select; `None` leaves the peer as it is.
        bitrate: Option<Bitrate>,
    },
    /// `cannelloni://HOST:PORT?local=PORT`: a cannelloni peer, over UDP.
    Cannelloni {
        /// `HOST:PORT`.
        address: String,
        /// The port of this machine that the peer sends to; without `?local=` the same as the peer's.
        local_port: u16,
    },
    /// `udp_multicast://239.74.163.2:43113?hops=1`: python-can's bus of that name; the port may be left out.
    UdpMulticast {
        /// The multicast group.
        group: IpAddr,
        /// Its port.
        port: u16,
        /// How far frames go: 1 for the own network, 0 for this machine.
        hops: u8,
    },
    /// `log:FILE`: a candump log, read only.
    Log {
        /// The file.
        path: PathBuf,
    },
}

impl BusSpec {
    /// Opens the bus. [`BusSpec::Sim`] is not opened here but embedded by the caller.
    pub async fn open(&self, clock: &WallClock) -> Result<AnyBus, BusError> {
        Ok(AnyBus(match self {
            Self::Sim { .. } => return Err(BusError::Simulated),
            #[cfg(target_os = "linux")]
            Self::SocketCan { interface } => BusKind::SocketCan(crate::SocketCanBus::open(interface, clock)?),
            #[cfg(not(target_os = "linux"))]
            Self::SocketCan { interface } => {
                let problem = crate::InterfaceProblem::NotLinux { name: interface.clone() };
                return Err(BusError::Interface(problem));
            }
            Self::Socketcand { address, bus } => {
                BusKind::Socketcand(Reconnecting::open((address.clone(), bus.clone()), clock).await?)
            }
            Self::SlcanSerial { path, bitrate, baud } => {
                let place = SlcanPlace { address: path.clone(), baud: Some(*baud), bitrate: *bitrate };
                BusKind::Slcan(Reconnecting::open(place, clock).await?)
            }
            Self::SlcanTcp { address, bitrate } => {
                let place = SlcanPlace { address: address.clone(), baud: None, bitrate: *bitrate };
                BusKind::Slcan(Reconnecting::open(place, clock).await?)
            }
            Self::Cannelloni { address, local_port } => {
                BusKind::Cannelloni(CannelloniBus::open(address, *local_port, clock).await?)
            }
            Self::UdpMulticast { group, port, hops } => {
                BusKind::UdpMulticast(UdpMulticastBus::open(*group, *port, *hops, clock)?)
            }
            Self::Log { path } => BusKind::Log(LogBus::open(path)?),
        }))
    }
}

/// Why a text names no bus.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{text}' is not a {what}: {reason}")]
pub struct ParseBusError {
    text: String,
    what: &'static str,
    reason: String,
}

impl ParseBusError {
    pub(crate) fn new(text: &str, what: &'static str, reason: String) -> Self {
        Self { text: text.to_owned(), what, reason }
    }
}

impl FromStr for BusSpec {
    type Err = ParseBusError;

    fn from_str(text: &str) -> Result<Self, ParseBusError> {
        let parsed = match text.split_once(':') {
            None if text == "sim" => Ok(Self::Sim { file: None }),
            None => parse_interface(text),
            Some(("sim", file)) => path(file).map(|file| Self::Sim { file: Some(file) }),
            Some(("log", file)) => path(file).map(|path| Self::Log { path }),
            Some(("socketcand", rest)) => parse_socketcand(rest),
            Some(("slcan", rest)) => parse_slcan(rest),
            Some(("cannelloni", rest)) => parse_cannelloni(rest),
            Some(("udp_multicast", rest)) => parse_udp_multicast(rest),
            Some(_) => Err(BUS_FORMS.to_owned()),
        };
        parsed.map_err(|reason| ParseBusError { text: text.to_owned(), what: "bus", reason })
    }
}

const BUS_FORMS: &str = "expected sim, sim:FILE.toml, can0, socketcand://HOST:PORT/can0, slcan:///dev/ttyACM0?bitrate=500k, \
                         slcan://HOST:PORT, cannelloni://HOST:PORT, udp_multicast://239.74.163.2 or log:FILE";

fn path(text: &str) -> Result<PathBuf, String> {
    if text.is_empty() { Err("the file name is missing".to_owned()) } else { Ok(PathBuf::from(text)) }
}

/// Whether this is what Windows calls a serial port: `COM3`.
fn is_com_port(name: &str) -> bool {
    let is_com = name.get(..3).is_some_and(|start| start.eq_ignore_ascii_case("COM"));
    is_com && name.len() > 3 && name[3..].bytes().all(|byte| byte.is_ascii_digit())
}

fn parse_interface(name: &str) -> Result<BusSpec, String> {
    if is_com_port(name) {
        return Err(format!(
            "it is a serial port of Windows; an adapter there that speaks slcan is slcan://{name}?bitrate=500k; one of \
             another kind is reached through a server, socketcand://HOST:PORT/can0"
        ));
    }
    let allowed = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'_' | b'-');
    match name.as_bytes() {
        [b'a'..=b'z' | b'A'..=b'Z', rest @ ..]
            if rest.len() < MAX_INTERFACE_LENGTH && rest.iter().copied().all(allowed) =>
        {
            Ok(BusSpec::SocketCan { interface: name.to_owned() })
        }
        _ => Err(BUS_FORMS.to_owned()),
    }
}

fn parse_socketcand(rest: &str) -> Result<BusSpec, String> {
    let form = "expected socketcand://HOST:PORT/can0";
    let rest = rest.strip_prefix("//").ok_or(form)?;
    let (address, bus) = rest.split_once('/').unwrap_or((rest, "can0"));
    let wrong = |byte: u8| !byte.is_ascii_graphic() || matches!(byte, b'<' | b'>' | b'/');
    if bus.is_empty() || bus.bytes().any(wrong) {
        return Err(format!("'{bus}' cannot be the name of a bus; {form}"));
    }
    Ok(BusSpec::Socketcand { address: parse_address(address, Some(socketcand::DEFAULT_PORT))?, bus: bus.to_owned() })
}

fn parse_slcan(rest: &str) -> Result<BusSpec, String> {
    let rest = rest
        .strip_prefix("//")
        .ok_or("expected slcan:///dev/ttyACM0?bitrate=500k, slcan://COM3?bitrate=500k or slcan://HOST:PORT")?;
    let (place, options) = rest.split_once('?').unwrap_or((rest, ""));
    let mut bitrate = None;
    let mut baud = None;
    for option in options.split('&').filter(|option| !option.is_empty()) {
        match option.split_once('=') {
            Some(("bitrate", value)) => bitrate = Some(value.parse().map_err(|error| format!("{error}"))?),
            Some(("baud", value)) => {
                let value: u32 = value.parse().map_err(|_| format!("'{value}' is not a line speed"))?;
                baud = Some(value);
            }
            _ => return Err(format!("unknown option '{option}'; known are bitrate=500k and baud=115200")),
        }
    }
    if place.starts_with('/') || is_com_port(place) {
        return Ok(BusSpec::SlcanSerial { path: place.to_owned(), bitrate, baud: baud.unwrap_or(DEFAULT_BAUD) });
    }
    if !place.contains(':') {
        return Err("expected HOST:PORT, a device with three slashes such as slcan:///dev/ttyACM0, or a port of Windows such as slcan://COM3".to_owned());
    }
    if baud.is_some() {
        return Err("baud is for serial devices, not for TCP".to_owned());
    }
    Ok(BusSpec::SlcanTcp { address: parse_address(place, None)?, bitrate })
}

fn parse_cannelloni(rest: &str) -> Result<BusSpec, String> {
    let rest = rest.strip_prefix("//").ok_or("expected cannelloni://HOST:PORT?local=PORT")?;
    let (place, option) = rest.split_once('?').unwrap_or((rest, ""));
    let address = parse_address(place, None)?;
    let port = |text: &str| text.parse::<u16>().map_err(|_| format!("'{text}' is not a port; a port is 0 to 65535"));
    let local_port = match option.split_once('=') {
        None if option.is_empty() => port(address.rsplit(':').next().unwrap_or_default())?,
        Some(("local", value)) => port(value)?,
        _ => return Err(format!("unknown option '{option}'; known is local=PORT")),
    };
    Ok(BusSpec::Cannelloni { address, local_port })
}

fn parse_udp_multicast(rest: &str) -> Result<BusSpec, String> {
    let rest = rest.strip_prefix("//").ok_or("expected udp_multicast://239.74.163.2:43113")?;
    let (place, option) = rest.split_once('?').unwrap_or((rest, ""));
    let address = parse_address(place, Some(udp_multicast::DEFAULT_PORT))?;
    let (host, port) = address.rsplit_once(':').unwrap_or((&address, ""));
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    let group = bare.parse::<IpAddr>().ok().filter(IpAddr::is_multicast).ok_or_else(|| {
        format!("'{bare}' is not a multicast group; python-can's are 239.74.163.2 and [ff15:7079:7468:6f6e:6465:6d6f:6d63:6173]")
    })?;
    let port = port.parse().map_err(|_| format!("'{port}' is not a port"))?;
    let hops = match option.split_once('=') {
        None if option.is_empty() => DEFAULT_HOPS,
        Some(("hops", value)) => value.parse().map_err(|_| format!("'{value}' is not a number of hops, 0 to 255"))?,
        _ => return Err(format!("unknown option '{option}'; known is hops=1 (0 stays in this machine)")),
    };
    Ok(BusSpec::UdpMulticast { group, port, hops })
}

/// `HOST:PORT`, where HOST may be `[::1]`.
pub(crate) fn parse_address(text: &str, default_port: Option<u16>) -> Result<String, String> {
    let bracketed_alone = text.starts_with('[') && text.ends_with(']');
    let (host, port) = match text.rsplit_once(':').filter(|_| !bracketed_alone) {
        Some((host, port)) => {
            let digits = port.bytes().all(|byte| byte.is_ascii_digit());
            let number = port.parse::<u16>().ok().filter(|_| digits);
            (host, number.ok_or_else(|| format!("'{port}' is not a port; a port is 0 to 65535"))?)
        }
        None => (text, default_port.ok_or("the port is missing; expected HOST:PORT")?),
    };
    let bare = host.strip_prefix('[').and_then(|host| host.strip_suffix(']'));
    let well_formed = match bare {
        Some(bare) => bare.contains(':') && bare.bytes().all(|byte| byte.is_ascii_hexdigit() || b":.%".contains(&byte)),
        None => !host.is_empty() && host.bytes().all(|byte| byte.is_ascii_alphanumeric() || b".-_".contains(&byte)),
    };
    if well_formed { Ok(format!("{host}:{port}")) } else { Err(format!("'{host}' is not a host name or address")) }
}

impl fmt::Display for BusSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let option = |bitrate: &Option<Bitrate>| bitrate.map(|rate| format!("?bitrate={rate}")).unwrap_or_default();
        match self {
            Self::Sim { file: None } => f.write_str("sim"),
            Self::Sim { file: Some(file) } => write!(f, "sim:{}", file.display()),
            Self::SocketCan { interface } => f.write_str(interface),
            Self::Socketcand { address, bus } => write!(f, "socketcand://{address}/{bus}"),
            Self::SlcanTcp { address, bitrate } => write!(f, "slcan://{address}{}", option(bitrate)),
            Self::SlcanSerial { path, bitrate, baud: DEFAULT_BAUD } => write!(f, "slcan://{path}{}", option(bitrate)),
            Self::SlcanSerial { path, bitrate: None, baud } => write!(f, "slcan://{path}?baud={baud}"),
            Self::SlcanSerial { path, bitrate, baud } => write!(f, "slcan://{path}{}&baud={baud}", option(bitrate)),
            Self::Cannelloni { address, local_port } => {
                write!(f, "cannelloni://{address}")?;
                let same = address.rsplit(':').next() == Some(local_port.to_string().as_str());
                if same { Ok(()) } else { write!(f, "?local={local_port}") }
            }
            Self::UdpMulticast { group, port, hops } => {
                write!(f, "udp_multicast://{}", std::net::SocketAddr::new(*group, *port))?;
                if *hops == DEFAULT_HOPS { Ok(()) } else { write!(f, "?hops={hops}") }
            }
            Self::Log { path } => write!(f, "log:{}", path.display()),
        }
    }
}

/// The protocol of a listener.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Protocol {
    /// socketcand.
    Socketcand,
    /// slcan over TCP.
    Slcan,
}

impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Socketcand => "socketcand",
            Self::Slcan => "slcan",
        })
    }
}

/// Where to serve a bus: `socketcand://127.0.0.1:29536` or `slcan://127.0.0.1:3000`; port 0 lets the system choose.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ServeSpec {
    /// The protocol.
    pub protocol: Protocol,
    /// `HOST:PORT`.
    pub address: String,
}

impl FromStr for ServeSpec {
    type Err = ParseBusError;

    fn from_str(text: &str) -> Result<Self, ParseBusError> {
        let parsed = match text.split_once("://") {
            Some(("socketcand", address)) => {
                parse_address(address, None).map(|address| (Protocol::Socketcand, address))
            }
            Some(("slcan", address)) => parse_address(address, None).map(|address| (Protocol::Slcan, address)),
            _ => Err("expected socketcand://HOST:PORT or slcan://HOST:PORT".to_owned()),
        };
        match parsed {
            Ok((protocol, address)) => Ok(Self { protocol, address }),
            Err(reason) => Err(ParseBusError { text: text.to_owned(), what: "place to serve a bus at", reason }),
        }
    }
}

impl fmt::Display for ServeSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}://{}", self.protocol, self.address)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_documented_form_is_read_and_printed_back() {
        let socketcand = |address: &str, bus: &str| BusSpec::Socketcand { address: address.into(), bus: bus.into() };
        for (text, spec) in [
            ("sim", BusSpec::Sim { file: None }),
            ("sim:two:axes.toml", BusSpec::Sim { file: Some("two:axes.toml".into()) }),
            ("vcan0", BusSpec::SocketCan { interface: "vcan0".into() }),
            ("socketcand://localhost:29536/can0", socketcand("localhost:29536", "can0")),
            ("socketcand://[::1]:7/vcan1", socketcand("[::1]:7", "vcan1")),
            ("slcan://10.0.0.1:3000", BusSpec::SlcanTcp { address: "10.0.0.1:3000".into(), bitrate: None }),
            (
                "cannelloni://10.0.0.2:20000",
                BusSpec::Cannelloni { address: "10.0.0.2:20000".into(), local_port: 20_000 },
            ),
            (
                "cannelloni://[::1]:20000?local=20001",
                BusSpec::Cannelloni { address: "[::1]:20000".into(), local_port: 20_001 },
            ),
            (
                "udp_multicast://239.74.163.2:43113",
                BusSpec::UdpMulticast { group: [239, 74, 163, 2].into(), port: 43_113, hops: 1 },
            ),
            (
                "udp_multicast://[ff15::1]:5000?hops=0",
                BusSpec::UdpMulticast { group: [0xFF15, 0, 0, 0, 0, 0, 0, 1].into(), port: 5_000, hops: 0 },
            ),
            ("log:a/b.log", BusSpec::Log { path: "a/b.log".into() }),
            (
                "slcan:///dev/ttyACM0?bitrate=500k",
                BusSpec::SlcanSerial { path: "/dev/ttyACM0".into(), bitrate: Some(Bitrate::K500), baud: 115_200 },
            ),
            (
                "slcan://COM3?bitrate=500k",
                BusSpec::SlcanSerial { path: "COM3".into(), bitrate: Some(Bitrate::K500), baud: 115_200 },
            ),
            (
                "slcan:///dev/ttyS1?bitrate=1M&baud=57600",
                BusSpec::SlcanSerial { path: "/dev/ttyS1".into(), bitrate: Some(Bitrate::M1), baud: 57_600 },
            ),
        ] {
            assert_eq!(text.parse(), Ok(spec.clone()), "{text}");
            assert_eq!(spec.to_string(), text);
        }
        assert_eq!("socketcand://drive.local".parse(), Ok(socketcand("drive.local:29536", "can0")));
        assert_eq!("socketcand://[::1]".parse(), Ok(socketcand("[::1]:29536", "can0")));
    }

    #[test]
    fn what_is_no_bus_is_refused_with_the_reason() {
        for (text, reason) in [
            ("", "expected sim,"),
            ("can 0", "expected sim,"),
            ("0can", "expected sim,"),
            ("a-name-that-is-too-long", "expected sim,"),
            ("tcp://localhost:1", "expected sim,"),
            ("COM3", "a serial port of Windows; an adapter there that speaks slcan is slcan://COM3?bitrate=500k"),
            ("slcan:COM3", "slcan://COM3?bitrate=500k"),
            ("sim:", "file name is missing"),
            ("log:", "file name is missing"),
            ("socketcand:localhost", "expected socketcand://HOST:PORT/can0"),
            ("socketcand://:29536/can0", "'' is not a host name"),
            ("socketcand://a:99999/can0", "'99999' is not a port"),
            ("socketcand://a:+1/can0", "'+1' is not a port"),
            ("socketcand://a:1/", "cannot be the name of a bus"),
            ("socketcand://a:1/x > y", "cannot be the name of a bus"),
            ("socketcand://::1:5/can0", "'::1' is not a host name"),
            ("slcan://ttyACM0", "a device with three slashes"),
            ("slcan://host:1?bitrate=2M", "bit rate must be"),
            ("slcan://host:1?baud=9600", "baud is for serial devices"),
            ("slcan:///dev/ttyS0?parity=none", "unknown option 'parity=none'"),
            ("slcan:///dev/ttyS0?bitrate=fast", "bit rate must be"),
            ("cannelloni://host", "the port is missing"),
            ("cannelloni://host:1?local=x", "'x' is not a port"),
            ("cannelloni://host:1?remote=2", "unknown option 'remote=2'"),
            ("udp_multicast://127.0.0.1", "'127.0.0.1' is not a multicast group"),
            ("udp_multicast://239.1.2.3?hops=256", "'256' is not a number of hops"),
            ("udp_multicast://239.1.2.3?ttl=1", "unknown option 'ttl=1'"),
        ] {
            let error = text.parse::<BusSpec>().unwrap_err().to_string();
            assert!(error.contains(reason) && error.contains(&format!("'{text}'")), "{error}");
        }
    }

    #[test]
    fn serve_specs_are_read_and_printed_back() {
        for text in ["socketcand://127.0.0.1:29536", "slcan://[::]:0"] {
            assert_eq!(text.parse::<ServeSpec>().unwrap().to_string(), text);
        }
        for text in ["", "can0", "socketcand://127.0.0.1", "tcp://127.0.0.1:1", "socketcand://127.0.0.1:1/can0"] {
            assert!(text.parse::<ServeSpec>().is_err(), "{text}");
        }
    }

    #[tokio::test]
    async fn what_cannot_be_opened_here_says_so() {
        let clock = WallClock::start();
        // No machine has it, and few have CAN in their kernel.
        let error = "nosuchcan".parse::<BusSpec>().unwrap().open(&clock).await.unwrap_err();
        assert!(matches!(error, BusError::Interface(_)) && error.to_string().contains("nosuchcan"), "{error}");
        assert!(matches!(BusSpec::Sim { file: None }.open(&clock).await, Err(BusError::Simulated)));
    }
}
