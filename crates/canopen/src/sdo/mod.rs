//! Service data objects (CiA 301, 7.2.4): one entry of the object dictionary at a time, confirmed.
//!
//! [`wire`] is the eight bytes, [`server`] the device's side, [`client`] the other one. Both know expedited and
//! segmented transfer. Block transfer is deliberately absent: a server answers 0504 0001h, and a client does not
//! ask for it.

pub mod client;
pub mod server;
pub mod wire;

pub use client::Client;
pub use server::Server;
