//! A gateway from text to CANopen: the ASCII mapping of CiA 309-3, without sockets.
//!
//! A [`Session`] is one client's connection: lines go in, lines come out, and what a drive on the bus sends unasked
//! becomes lines too. The owner of the connection hands lines over, and asks at its end which nodes the client may have set
//! in motion ([`Session::moved`]).
//!
//! The text of CiA 309-3 was not at hand. Commands, order of words and error codes are those that gateways and clients in the
//! field agree on; `docs/handbook/gateway.md` lists them, with what is not supported.

mod data_type;
mod refusal;
mod request;
mod session;

pub use data_type::GatewayType;
pub use refusal::Refusal;
pub use request::{GatewayCommand, GatewayRequest, Unreadable};
pub use session::Session;

/// Longest line that a client may send, in bytes; a longer one is refused and passed over.
pub const MAX_LINE: usize = 64 * 1024;
