//! What a served client's protocol looks like to the hub: a passive state machine over bytes and frames.

use std::time::Duration;

use can::{Frame, Instant};

/// One client's side of the protocol. Sans-IO: bytes come in, replies and frames go out as bytes.
pub(crate) trait Session: Send {
    /// Consumes `input` until it yields a frame for the bus (`Some`), or is used up, or too many replies wait to be
    /// written, or the client is to be disconnected.
    fn receive(&mut self, input: &mut &[u8]) -> Option<Frame>;

    /// Whether the client wants to hear frames now.
    fn is_listening(&self) -> bool;

    /// Appends the next reply, which must go out before any further frame and in a segment of its own; `None` when there
    /// is none. The duration is how long frames must stay away from it, unless the client speaks before.
    fn next_reply(&mut self, out: &mut Vec<u8>) -> Option<Duration>;

    /// Appends a frame that was on the bus at `at`; nothing if the client does not listen.
    fn deliver(&mut self, at: Instant, frame: &Frame, out: &mut Vec<u8>);

    /// Appends what the protocol has for an error frame that was on the bus at `at`, of this class in Linux's messages
    /// (`CAN_ERR_*`); nothing if it has nothing, or the client does not listen.
    fn deliver_error(&mut self, at: Instant, class: u32, out: &mut Vec<u8>);

    /// Whether to disconnect once the replies are written.
    fn is_over(&self) -> bool;
}

/// Replies that may wait to be written before no more requests are read: a client that only asks and never reads stops
/// itself.
pub(crate) const MAX_WAITING_REPLIES: usize = 64;
