//! The nodes of the bus: how they are found and read, their faults, and the frames that they send.

mod discovery;
mod faults;
pub(crate) mod heard_ids;
pub(crate) mod known_node;
pub(crate) mod meter;
