//! A CANopen master: a sans-IO core, an async face, and intents for drives in physical units.
//!
//! [`core::Core`] is a passive state machine (CiA 301): SDO clients, NMT, heartbeat and EMCY watch, SYNC and PDOs
//! for 127 nodes. [`Network`] shares one between a runner and any number of tasks. Nothing here reads a clock,
//! opens a socket or starts a thread: a runner (a simulated world, a transport loop) brings frames and time.

pub mod core;
pub mod decode;
pub mod drive;
mod error;
pub mod identify;
mod network;
pub mod pdo;
pub mod units;

pub use drive::Drive;
pub use error::{Access, Error, Hints};
pub use network::{DEFAULT_TIMEOUT, Elapsed, Network, Node, NodeView, Sleep, Wait, join_all};
