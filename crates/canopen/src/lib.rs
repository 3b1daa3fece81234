//! CANopen (CiA 301) as passive state machines: one file per service.
//!
//! No I/O, no clock, no allocation. Frames and `now` go in; frames, deadlines and events come out.
//! What a device offers is data: a [`od::Table`] of object rows. [`od::Dictionary`] holds the values.
#![no_std]

mod abort;
mod cob_id;
mod mux;
mod node_id;
pub mod od;

pub use abort::AbortCode;
pub use cob_id::CobId;
pub use mux::Mux;
pub use node_id::NodeId;
