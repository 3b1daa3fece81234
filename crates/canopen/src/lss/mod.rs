//! Layer setting services (CiA 305): node-ID and bit rate of devices that are found by their LSS address, not by a node-ID.
//!
//! [`Request`] goes from the master to all slaves on 7E5h, [`Reply`] back on 7E4h. [`Client`] asks one thing at a time,
//! [`FastScan`] finds a device without a node-ID of which nothing is known, [`Search`] every device of a make, [`Server`] is a device's part. Deliberately not here: when a device
//! takes its new node-ID or bit rate, which is its owner's.

mod client;
mod fast_scan;
mod search;
mod server;
mod wire;
mod words;

pub use client::{Client, TIMEOUT};
pub use fast_scan::FastScan;
pub use search::Search;
pub use server::{Action, Server};
pub use wire::{Address, BIT_RATES_KBIT, Bound, Outcome, Part, Reply, Request, UNCONFIGURED};
