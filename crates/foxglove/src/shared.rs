//! What the server's thread shares with the program that has the data.

use std::sync::atomic::{AtomicU64, AtomicUsize};

/// See the [module](self).
#[derive(Default)]
pub(crate) struct Shared {
    pub(crate) subscriptions: AtomicUsize,
    /// Samples, frames and events that did not find room on their way to the thread.
    pub(crate) lost: AtomicU64,
}
