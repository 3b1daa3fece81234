//! Pages in a browser: their messages, what they are sent, and what their views ask for. What carries it is the front end's: a
//! WebSocket and requests, or a worker of the page itself.

mod conversation;
mod message;
mod power_states;

pub use conversation::{Said, Word, serve};
pub use power_states::power_states;
