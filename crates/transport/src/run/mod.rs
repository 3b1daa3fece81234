//! The loops that join passive machines to real time: a station to a bus, a virtual world to a hub.

mod station;
mod world;

pub use station::run_station;
pub use world::{Heard, RealTimeWorld, run_world};
