//! Who works through the jobs of a network.

use std::sync::{Arc, Mutex};

use crate::live::Live;
use crate::world::Shared;

/// A world or a thread.
pub(crate) enum Runner {
    /// A world, while somebody moves it.
    World(Arc<Shared>),
    /// The thread of a real bus; `None` once it is closed.
    Live(Mutex<Option<Live>>),
}
