//! The loops that join passive machines to real time: a station to a bus (in the thread that asks, or in one of its own in
//! real time), a virtual world to a hub.

mod station;
mod thread;
mod world;

pub use station::{run_station, waker_of};
pub use thread::{BusThread, BusThreadError};
pub use world::{Heard, RealTimeWorld, run_world};
