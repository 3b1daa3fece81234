//! What the two ZLTECH drives have in common: one maker's firmware, with the same way of storing parameters and the same
//! meaning of most CiA 402 objects.
//!
//! Sources: "ZLAC8030L quick start guide V1.00" and "ZLIM42-C user manual V1.03". What differs stands in the drive's own folder.

mod parameters;
mod shell;
mod storage;
pub(crate) mod terminals;

pub(crate) use parameters::{Holding, ProfileObjects};
pub(crate) use shell::Shell;
pub(crate) use storage::{mark_if_saving, register_command};
