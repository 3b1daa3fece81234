//! CAN over sockets, serial lines and log files, client and server side, and the loops that run stations on them.
//!
//! - [`AsyncBus`] is a bus that is somewhere else; [`BusSpec`] opens one from a text such as `socketcand://HOST:PORT/can0`.
//! - [`Hub`] serves a bus to other programs over socketcand and slcan.
//! - [`ModbusServer`] serves registers over Modbus TCP or RTU.
//! - [`run_station`] drives a passive [`can::Station`] on a bus, [`run_world`] a virtual world behind a hub.
//! - [`socketcand`], [`slcan`] and [`log`] are the wire formats, as pure codecs that any other program may use.
//!
//! This crate holds the only clock ([`WallClock`]) and the only sockets of the project. Everything else is sans-IO.
//!
//! ```no_run
//! use transport::{AsyncBus, BusSpec, WallClock};
//!
//! # async fn listen() -> Result<(), Box<dyn std::error::Error>> {
//! let bus: BusSpec = "socketcand://127.0.0.1:29536/can0".parse()?;
//! let mut bus = bus.open(&WallClock::start()).await?;
//! bus.send(&"000#0100".parse()?).await?; // NMT: start all nodes
//! let (at, frame) = bus.recv().await?;
//! # let _ = (at, frame);
//! # Ok(())
//! # }
//! ```
//!
//! Linux SocketCAN is deliberately absent so far: it needs a kernel module that few test machines have.

mod any_bus;
mod bus;
mod bus_spec;
mod clock;
mod hub;
mod link;
pub mod log;
pub mod modbus;
mod run;
pub mod slcan;
pub mod socketcand;
#[cfg(test)]
mod testing;
mod text;

pub use any_bus::AnyBus;
pub use bus::{AsyncBus, BusError};
pub use bus_spec::{BusSpec, ParseBusError, Protocol, ServeSpec};
pub use clock::{Sleep, WallClock};
pub use hub::{ClientId, Hub, HubError, HubEvent, HubOptions, LeaveReason, Listener};
pub use log::LogBus;
pub use modbus::{
    ModbusError, ModbusException, ModbusInquiry, ModbusMedium, ModbusRequest, ModbusServer, ModbusSession, ModbusSpec,
    RegisterAccess, RegisterAnswer,
};
pub use run::{Heard, RealTimeWorld, run_station, run_world};
pub use slcan::SlcanBus;
pub use socketcand::SocketcandBus;
