//! The host: who owns the network of a CANopen bus, lets people and programs move drives, and stops what is not held any more.
//!
//! [`Host`] owns the master's [`Network`](master::Network) and everything that moves: it takes requests from a bounded channel,
//! carries them out, and publishes its state. It has no clock, no thread and no socket: its time is that of the bus, so
//! that the same host runs in virtual time in a test. A front end (a browser's page, a terminal) holds a [`HostHandle`]; it sends
//! [`Command`]s in a [`Session`](session::Session) and shows what the host publishes.
//!
//! Every motion has to be held: a jog by a message every 100 ms ([`JOG_SPAN`]), any other by a front end that
//! shows that it is there ([`PRESENCE_SPAN`]), and both by its connection. A motion that is not held is quick-stopped.
//!
//! Nothing here blocks: work is a set of futures that are polled together, so that a stop never waits for anything slow. Each
//! round handles stops first.
//!
//! The host appends to two logs that any session may read: the last frames of the bus, raw and decoded on request
//! ([`trace`]), and a [`timeline`] of the drives.

mod answer;
pub mod around;
pub mod capture;
pub mod clients;
pub mod command;
mod commands;
pub mod console;
pub mod control;
pub mod events;
pub mod group_follow;
mod help;
mod lines;
mod motion;
pub mod network;
mod nodes;
pub mod page;
mod parameters;
mod pdo;
mod run;
pub mod session;
mod snapshot;
mod state;
pub mod stopping;
pub mod test_motion;
#[cfg(test)]
mod tests;
pub mod timeline;
pub mod trace;
pub mod tune;
mod wire;
mod work;
mod world;

pub use answer::{Answer, Trouble};
pub use command::{Command, NodeCommand};
pub use parameters::journals::Journals;
pub use session::{DeadMan, HostHandle, LocalClient, SessionId, Shown};
pub use snapshot::{BusView, DriveView, FaultView, News, NodeView, Snapshot, Step};
pub use state::{Host, JOG_SPAN, PRESENCE_SPAN, Setting};
pub use wire::{Health, Wire};
pub use world::door::{WorldAsks, WorldDoor, world_door};
