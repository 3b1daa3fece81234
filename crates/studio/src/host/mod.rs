//! The one task that owns the network: it takes requests, moves drives, stops them, and publishes what it knows.
//!
//! Time is that of the bus, told by the master's core. Nothing here waits: work is a set of futures that are polled together,
//! so that a stop is never behind something slow. What comes first in each round is what stops.

mod changes;
mod commands;
mod faults;
mod group;
mod group_run;
mod guarding;
mod heard_ids;
mod help;
mod homing;
mod journals;
mod known_node;
mod meter;
mod nodes;
mod object_rows;
mod parameters;
mod pdo;
mod pdo_load;
mod pdo_rows;
mod run;
mod speed_limit;
mod state;
mod stopping;
#[cfg(test)]
mod tests;
mod trace;
mod transactions;
mod work;
mod world;

pub use journals::Journals;
pub use state::{Host, JOG_SPAN, PRESENCE_SPAN, Setting};
