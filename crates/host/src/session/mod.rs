//! Sessions: who looks, who has control, by which channels they talk to the host, and what lapses when they fall silent.

pub(crate) mod authority;
mod dead_man;
pub(crate) mod handle;
mod local_client;

pub use authority::{Authority, Refusal, SessionId};
pub use dead_man::DeadMan;
pub use handle::{HostHandle, Inbox, Request, Session, StateUpdate, channel};
pub use local_client::{LocalClient, Shown};
