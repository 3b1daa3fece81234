//! Conversations with a node, in candump notation and virtual time.

mod bench;
mod client;
mod configuration;
mod device;
mod emcy;
mod events;
mod multiplex;
mod nmt;
mod robustness;
mod rpdo;
mod sdo;
mod sync;
mod tpdo;
mod traps;
