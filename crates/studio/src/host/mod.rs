//! The one task that owns the network: it takes requests, moves drives, stops them, and publishes their state.
//!
//! Time is bus time, from the core of the master. Nothing here blocks: work is a set of futures that are polled together,
//! so that a stop never waits for anything slow. Each round handles stops first.

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
