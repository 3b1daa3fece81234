//! Service data objects (CiA 301, 7.2.4): one entry of the object dictionary at a time, confirmed.
//!
//! [`wire`] is the eight bytes, [`server`] the device's side, [`client`] the other one. Both know expedited, segmented and
//! [block] transfer; a server that does not offer block transfer answers 0504 0001h.

pub mod block;
pub mod client;
pub mod parameter;
pub mod server;
pub mod wire;

pub use client::Client;
pub use server::Server;
