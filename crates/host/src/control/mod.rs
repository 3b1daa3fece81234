//! The control connection of a served world, as values: lines go in, lines come out. `docs/control.md` is its page and
//! `docs/control.schema.json` its schema.
//!
//! A client sends requests, one a line, each a JSON object; a line that does not begin with `{` is a world command as on
//! standard input. Each gets one answer, with the request's `id`. What a client has subscribed to comes between the answers:
//! events when they happen, values at a rate of the world's own time.
//!
//! [`Control`] holds the clients of one world. The owner of the sockets calls [`Control::join`], [`Control::handle`]
//! and [`Control::leave`], moves the world no further than [`Control::next_sample`], and calls [`Control::publish`]
//! after each move. Lines for a client go to its [`Sink`]; an [`Outbox`] behind it keeps them within bounds.

mod address;
mod answer;
mod clients;
mod id;
mod lines;
mod outbox;
mod request;
mod subscription;

pub use address::{ControlAddress, NoAddress};
pub use answer::{ControlError, ERROR_KINDS};
pub use clients::{ClientNumber, Control, Outcome, PROTOCOL, Pending, Sink};
pub use id::Id;
pub use lines::{LineBuffer, MAX_LINE_LENGTH, ReadLine};
pub use outbox::{Class, Outbox};
pub use request::{Message, REQUESTS, Request};
pub use subscription::{Channel, Values};
