//! A run for those who watch it: the channels of a record over the Foxglove WebSocket protocol
//! (`foxglove.websocket.v1`, and `foxglove.sdk.v1`, in which newer clients name the same messages).
//!
//! [`Server`] has a thread of its own for its sockets, for the form of the messages and for everyone who is slow. A program
//! hands a [`recording::Batch`] over and goes on: that never waits. A viewer that reads too slowly loses its oldest
//! messages, and a status message says how many.
//!
//! Viewers only look: there is nothing here that changes a drive, so there is neither a password nor anything in a client's
//! messages but what it wants to see. Parameters, services, publishing and assets are not among the server's capabilities.

mod client;
mod clients;
mod handshake;
mod protocol;
mod server;
mod shared;

pub use server::{Options, Server};
