//! The parts that drives are made of. Each takes plain values and knows no object of any drive.
//!
//! ```text
//! controlword, mode -> cia402 (who may move) -> axis (one shaft) -> Demand -> actuator (loops) -> duty cycles
//!                                                     ^                          |
//!                                                     +-------- Feedback --------+ <- sensors
//! ```
//!
//! What differs between drives comes in as parameters: plain structs in physical units, filled in by the drive from
//! its dictionary. A drive whose motor is moved by other rules than those of CiA 402 uses [`axis`] without [`cia402`].

pub mod actuator;
pub mod axis;
pub mod cia402;
mod communication_errors;
pub mod device;
pub mod faults;
pub mod host_watchdog;
pub mod inputs;
pub mod storage;
