//! What the two ZLTECH drives have in common: one maker's firmware, with the same identity, the same communication
//! objects, the same way of storing parameters and the same meaning of most CiA 402 objects.
//!
//! Sources: "ZLAC8030L quick start guide V1.00" and "ZLIM42-C user manual V1.03". What differs, and be it the number of an
//! object, stands in the drive's own folder.

pub(crate) mod communication;
mod model;
mod parameters;
mod storage;
pub(crate) mod terminals;
pub(crate) mod values;

pub(crate) use model::{IDENTITY, PDO_RULES, RAMPS, node_profile, parameter_storage};
pub(crate) use parameters::ProfileObjects;
pub(crate) use storage::{note_write, register_command};
