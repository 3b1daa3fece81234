//! The bus, its surroundings and its events. One program: a file each.

mod block_on;
mod bus;
mod commands;
mod common;
mod coupled;
mod crowd;
mod device_timing;
mod energies;
mod events;
mod external;
mod faults;
mod fidelity;
mod loads;
mod rest;
mod stores;
mod threads;
mod turmoil;
