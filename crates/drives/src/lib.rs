//! Firmware of real CANopen motor drives, from their manuals.
//!
//! A drive here is what runs on the drive's microcontroller: sensors and frames go in, power-stage commands and frames
//! come out. It knows nothing of physics, of a simulator or of a clock; [`Firmware`] is the whole contract.
//! [`engine`] holds the parts that all drives are made of; a drive's own folder holds what is particular to it, mostly
//! as tables, and `zltech` what only the two drives of one maker share. What a drive is to its host, its
//! objects, faults and units, is described in crate `devices`.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod communication;
pub mod engine;
mod firmware;
pub mod mjoint;
pub mod node;
mod register_error;
mod row;
pub mod servo;
pub mod zlac8030l;
pub mod zlim42c;
mod zltech;

pub use firmware::{Firmware, Report};
pub use register_error::RegisterError;
