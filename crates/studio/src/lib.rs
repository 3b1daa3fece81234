//! A web front end to a CANopen bus: who is on the bus, what each drive says of itself, and moving it, by any number of
//! people who look and one who moves.
//!
//! [`Host`] owns the master's [`Network`](master::Network) and everything that moves: it takes requests from a bounded channel,
//! carries them out, and publishes what it knows. It has no clock, no thread and no socket: its time is that of the bus, so
//! that the same host runs in virtual time in a test. [`app`] is the web part, an [`axum::Router`] that can be called
//! without a socket; its handlers hold no knowledge of motion.
//!
//! Every motion hangs on somebody who holds it: a jog on a message every 100 ms ([`JOG_SPAN`]), any other on a page that
//! shows that it is there ([`PRESENCE_SPAN`]), and both on its connection. What is not held is quick-stopped.
//!
//! Beside the host stand what it only adds to and any page reads: the last frames of the bus, raw and put into words when asked
//! for, and a timeline of what has happened to the drives.
//!
//! Not done here: opening a bus and a port, and running the two (`ferrodrive studio`).

mod access;
mod authority;
mod dead_man;
mod glossary;
mod handle;
mod host;
mod local_client;
mod message;
mod snapshot;
mod timeline;
mod trace;
mod web;
mod wire;
mod world;

pub use access::{Access, AccessError, Password, Token};
pub use dead_man::DeadMan;
pub use handle::HostHandle;
pub use host::{Host, JOG_SPAN, Journals, PRESENCE_SPAN, Setting};
pub use local_client::{LocalClient, Shown};
pub use trace::BusFrame;
pub use web::{app, serve};
pub use wire::{Health, Wire};
pub use world::{Around, Changed, WorldAsks, WorldDoor, world_door};
