//! CAN over sockets and serial lines, client and server side, and the loops that run stations on them.
//!
//! - [`AsyncBus`] is a bus that is somewhere else; [`BusSpec`] opens one from a text such as `socketcand://HOST:PORT/can0`.
//! - A bus gives frames and [`Note`]s: the state of its controller, errors on the wire, a connection that went away.
//! - [`Hub`] serves a bus to other programs over socketcand and slcan.
//! - [`ModbusServer`] serves registers over Modbus TCP or RTU.
//! - [`run_station`] drives a passive [`can::Station`] on a bus, [`run_world`] a virtual world behind a hub.
//! - [`socketcand`], [`cannelloni`] and [`udp_multicast`] are the wire formats, as pure codecs that any other program may use.
//!
//! This crate holds the only clock ([`WallClock`]) and the sockets of all buses. Below the programs everything else is sans-IO.
//!
//! A bus that is served, and a program that reaches it:
//!
//! ```
//! use can::{Bitrate, Frame};
//! use transport::{AsyncBus, BusSpec, Hub, HubEvent, HubOptions, WallClock};
//!
//! # async fn served() -> Result<(), Box<dyn std::error::Error>> {
//! let clock = WallClock::start();
//! let place = "socketcand://127.0.0.1:0".parse()?; // any free port
//! let mut hub = Hub::bind(&[place], HubOptions::default(), &clock).await?;
//! let address = hub.listeners()[0].to_string();
//!
//! // The program: NMT "start all nodes", then wait for what others say.
//! let program = async {
//!     let spec: BusSpec = format!("{address}/can0").parse()?;
//!     let mut bus = spec.open(&clock).await?;
//!     bus.send(&"000#0100".parse()?).await?;
//!     let (_at, frame) = bus.recv_frame().await?;
//!     Ok::<Frame, Box<dyn std::error::Error>>(frame)
//! };
//!
//! // The bus: it hears the program's frame, and answers with a node's boot-up.
//! let bus = async {
//!     loop {
//!         if let HubEvent::Frame { client, frame } = hub.next_event().await {
//!             hub.broadcast(&frame, clock.now(), Some(client)); // the wire took it
//!             return hub.broadcast(&Frame::new(can::CanId::standard(0x701), &[0]), clock.now(), None);
//!         }
//!     }
//! };
//! let (heard, ()) = tokio::join!(program, bus);
//! assert_eq!(heard?, "701#00".parse()?);
//! # Ok(())
//! # }
//! # tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(served()).unwrap();
//! ```

mod any_bus;
mod bus;
mod bus_spec;
pub mod cannelloni;
mod clock;
mod datagrams;
mod hub;
mod link;
mod log_bus;
pub mod modbus;
mod note;
mod raw_id;
pub mod realtime;
mod reconnect;
mod run;
mod slcan_bus;
mod slcan_session;
mod socketcan;
pub mod socketcand;
mod tcp;
#[cfg(test)]
mod testing;
pub mod udp_multicast;
mod vitals;

pub use any_bus::AnyBus;
pub use bus::{AsyncBus, BusError};
pub use bus_spec::{BusSpec, ParseBusError, Protocol, ServeSpec};
pub use cannelloni::CannelloniBus;
pub use clock::{Sleep, WallClock};
pub use hub::{ClientId, Hub, HubError, HubEvent, HubOptions, LeaveReason, Listener};
pub use log_bus::LogBus;
pub use modbus::{
    ModbusError, ModbusException, ModbusInquiry, ModbusMedium, ModbusRequest, ModbusServer, ModbusSession, ModbusSpec,
    RegisterAccess, RegisterAnswer,
};
pub use note::{BusNotes, ControllerState, ErrorCounters, ErrorFrame, ErrorKind, ErrorKinds, Note, Received};
pub use run::{BusThread, BusThreadError, Heard, RealTimeWorld, run_station, run_world, waker_of};
pub use slcan_bus::SlcanBus;
#[cfg(target_os = "linux")]
pub use socketcan::SocketCanBus;
pub use socketcan::{InterfaceProblem, can_interfaces};
pub use socketcand::SocketcandBus;
pub use udp_multicast::UdpMulticastBus;
pub use vitals::Vitals;
