//! CAN of the Linux kernel: an interface such as `can0` or `vcan0` as a bus.
//!
//! [`wire`] and [`error_class`] are the kernel's forms without a kernel, [`interface`] what the system reports of its interfaces,
//! [`socket`] the only place that calls it, [`bus`] what comes of it: an interface that goes down and comes back.

#[cfg(target_os = "linux")]
mod bus;
mod error_class;
mod interface;
#[cfg(target_os = "linux")]
mod socket;
#[cfg(target_os = "linux")]
mod wire;

#[cfg(target_os = "linux")]
pub use bus::SocketCanBus;
pub(crate) use error_class::{class_of, notes_of};
pub use interface::{InterfaceProblem, can_interfaces};
