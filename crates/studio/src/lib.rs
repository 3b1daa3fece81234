//! A web front end to a CANopen bus: its nodes, the values of each drive, and its motion, for any number of
//! viewers and one operator.
//!
//! [`Host`] owns the master's [`Network`](master::Network) and everything that moves: it takes requests from a bounded channel,
//! carries them out, and publishes its state. It has no clock, no thread and no socket: its time is that of the bus, so
//! that the same host runs in virtual time in a test. [`app`] is the web part, an [`axum::Router`] that can be called
//! without a socket; its handlers know nothing of motion.
//!
//! Every motion has to be held: a jog by a message every 100 ms ([`JOG_SPAN`]), any other by a page that
//! shows that it is there ([`PRESENCE_SPAN`]), and both by its connection. A motion that is not held is quick-stopped.
//!
//! The host appends to two logs that any page may read: the last frames of the bus, raw and decoded on request,
//! and a timeline of the drives.
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
