//! socketcand: CAN over TCP as text messages in angle brackets.
//!
//! Source: `doc/protocol.md` of the linux-can/socketcand project. Here are its raw mode and the way there; the broadcast
//! manager (`add`, `subscribe`, `filter`, ..), control mode, ISO-TP and the UDP beacon are deliberately absent, and a
//! server answers that to a client that asks.

mod client;
mod codec;
mod session;

pub use client::SocketcandBus;
pub use codec::{Decoder, MAX_MESSAGE_LENGTH, Malformed, Message, Request, ServerReply};
pub(crate) use session::SocketcandSession;

/// The port that socketcand listens on by default.
pub const DEFAULT_PORT: u16 = 29_536;
