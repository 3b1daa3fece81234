//! The parts that drives are made of. Each takes plain values and knows no object of any drive.
//!
//! ```text
//! controlword -> power -+                      sensors -> servo (shaft) -+
//!                       +-> axis (mode, stop) -> Demand -> servo (loops) -> duty cycles
//! targets --> modes ----+
//! ```
//!
//! What differs between drives comes in as parameters: plain structs in physical units, filled in by the drive from
//! its dictionary.

pub mod axis;
pub mod bleeder;
mod communication_errors;
pub mod demand;
pub mod device;
pub mod faults;
pub mod host_watchdog;
pub mod inputs;
pub mod modes;
pub mod overload;
pub mod power;
pub mod servo;
pub mod stepper;
pub mod stop;
pub mod storage;
pub mod tracking;
pub mod trajectory;
