//! Firmware of real CANopen motor drives, from their manuals.
//!
//! A drive here is what runs on the drive's microcontroller: sensors and frames go in, power-stage commands and frames
//! come out. It knows nothing of physics, of a simulator or of a clock; [`Firmware`] is the whole contract,
//! beside [`Resting`] for one that may be left alone while nothing changes.
//! [`engine`] holds the parts that all drives are made of; a drive's own folder holds what is particular to it, mostly
//! as tables, and `zltech` what only the two drives of one maker share. What a drive is to its host, its
//! objects, faults and units, is described in crate `devices`.
//!
//! ```
//! use can::{Instant, Station};
//! use core::time::Duration;
//! use drives::Firmware;
//! use drives::zlac8030l::{Hardware, Sensors, Zlac8030l};
//!
//! // A drive as delivered on a bench without a motor: every 50 µs the pins are read, every frame is handed in.
//! let mut drive = Zlac8030l::new();
//! let mut now = Instant::ZERO;
//! drive.power_on(&Hardware::default(), now);
//! let mut sent = Vec::new();
//! for period in 0..20_000 {
//!     if period == 10_000 {
//!         drive.handle_frame(&"604#4000100000000000".parse()?, now); // read 1000h, the device type
//!     }
//!     drive.handle_timeout(now);
//!     let _duty_cycles = drive.tick(&Sensors { bus_v: 48.0, ..Sensors::default() }, now);
//!     sent.extend(core::iter::from_fn(|| drive.poll_transmit()));
//!     now = now + Duration::from_nanos(Zlac8030l::CONTROL_PERIOD_NS);
//! }
//! assert_eq!(sent[0], "704#00".parse()?); // boot-up
//! assert!(sent.contains(&"584#4300100092010400".parse()?)); // 00040192h: a drive of CiA 402
//! # Ok::<(), can::ParseFrameError>(())
//! ```
#![no_std]

#[cfg(test)]
extern crate std;

pub mod communication;
pub mod engine;
mod fidelity;
mod firmware;
pub mod mjoint;
pub mod node;
mod register_error;
mod resting;
mod row;
pub mod servo;
pub mod zlac8030l;
pub mod zlim42c;
mod zltech;

pub use fidelity::{Fidelity, ParseFidelityError};
pub use firmware::{Firmware, Report};
pub use register_error::RegisterError;
pub use resting::Resting;
