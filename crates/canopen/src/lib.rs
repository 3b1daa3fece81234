//! CANopen (CiA 301) as passive state machines: one file per service.
//!
//! No I/O, no clock, no allocation. Frames and `now` go in; frames, deadlines and events come out.
//! What a device offers is data: a [`od::Table`] of object rows. [`od::Dictionary`] holds the values,
//! [`node::Node`] joins all services of a device over them, [`sdo::Client`] is the other side of an SDO channel.
#![no_std]

mod abort;
mod cob_id;
pub mod connection_set;
pub mod emcy;
pub mod heartbeat;
mod mux;
pub mod nmt;
pub mod node;
mod node_id;
pub mod od;
pub mod pdo;
pub mod sdo;
pub mod sync;
pub mod time_stamp;

pub use abort::AbortCode;
pub use cob_id::CobId;
pub use emcy::EmcyErrorCode;
pub use mux::Mux;
pub use nmt::{NmtCommand, NmtState};
pub use node::{Node, NodeEvent, NodeProfile};
pub use node_id::NodeId;
