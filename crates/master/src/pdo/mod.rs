//! PDO configuration as a transaction (CiA 301, 7.5.2.35 to 7.5.2.38).
//!
//! In: what a PDO shall carry and when it shall be sent. The device is written to in the only order that the standard
//! allows (invalidate, clear the mapping, entries, count, transmission type, timers, validate), every value is read
//! back, and on any failure the PDO is put back as it was. The master then sends or receives it by the new mapping.
//! Saving to the device's memory is deliberately not part of it: see [`crate::drive`].

mod all;
mod config;
mod error;
mod foreseen;
mod former;
mod node;
mod signal;
mod silence;
mod transaction;
mod values;
mod when;

pub use config::{PdoConfig, TimerUnits, TransmissionType};
pub use error::{PdoError, SignalError};
pub(crate) use former::FormerPdo;
pub use silence::{Silence, Situation, why_silent};
pub use values::{PdoUnfit, most_objects, record_of, values_off};
