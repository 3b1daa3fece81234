//! A web front end to a CANopen bus: its nodes, the values of each drive, and its motion, for any number of
//! viewers and one operator.
//!
//! [`app`] is an [`axum::Router`] over a [`HostHandle`](host::HostHandle) that can be called without a socket; its handlers know
//! nothing of motion: what moves and what stops is the [`host`]'s.
//!
//! Not done here: opening a bus and a port, and running the two (`ferrodrive studio`).

mod access;
mod web;

pub use access::{Access, AccessError, Password, Token};
pub use web::{app, serve};
