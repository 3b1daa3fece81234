//! Who works through the jobs of a network.

use std::sync::{Arc, Mutex, PoisonError};

use crate::live::Live;
use crate::world::Shared;

/// A world or a thread.
pub(crate) enum Runner {
    /// A world, while a caller moves it.
    World(Arc<Shared>),
    /// The thread of a real bus; `None` once it is closed.
    Live(Mutex<Option<Live>>),
}

impl Runner {
    /// Asks the thread of a real bus that is open.
    pub(crate) fn with_live<T>(&self, ask: impl FnOnce(&Live) -> T) -> Option<T> {
        match self {
            Self::World(_) => None,
            Self::Live(live) => live.lock().unwrap_or_else(PoisonError::into_inner).as_ref().map(ask),
        }
    }
}
