//! python-can's `udp_multicast`: a bus of all programs of a network that joined the same multicast group.
//!
//! Source: `can/interfaces/udp_multicast` of python-can 4.6. There is neither arbitration nor acknowledgement: a frame is heard by the programs
//! that are there.

mod bus;
mod codec;

pub use bus::UdpMulticastBus;
pub use codec::{Item, MalformedDatagram, emit, parse};

/// python-can's port.
pub const DEFAULT_PORT: u16 = 43_113;
