//! The instances that importers hold, by number.

use std::collections::HashMap;
use std::ffi::{CString, c_void};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use super::status::{ERROR, LogMessage};
use crate::instance::Instance;
use crate::state::SavedState;

/// An instance with what belongs to its importer.
pub(super) struct Held {
    pub(super) instance: Instance,
    pub(super) log: Log,
    /// Texts that were handed out: they live until the next ones.
    pub(super) texts: Vec<CString>,
    /// States that were handed out, by number.
    pub(super) states: HashMap<usize, SavedState>,
    next_state: usize,
}

/// Where messages go.
pub(super) struct Log {
    /// The importer's own pointer, as a number: it goes back as it came.
    environment: usize,
    message: LogMessage,
}

/// The instances, and the number of the next.
#[derive(Default)]
struct Instances {
    last: usize,
    held: HashMap<usize, Arc<Mutex<Held>>>,
}

static INSTANCES: LazyLock<Mutex<Instances>> = LazyLock::new(Mutex::default);

impl Log {
    pub(super) fn new(environment: *mut c_void, message: LogMessage) -> Self {
        Self { environment: environment as usize, message }
    }

    pub(super) fn error(&self, what: &str) {
        let Some(message) = self.message else { return };
        let text = CString::new(what.replace('\0', " ")).unwrap_or_default();
        // SAFETY: the importer's function with the importer's pointer and texts that live as long as the call.
        unsafe { message(self.environment as *mut c_void, ERROR, c"logStatusError".as_ptr(), text.as_ptr()) };
    }
}

impl Held {
    pub(super) fn new(instance: Instance, log: Log) -> Self {
        Self { instance, log, texts: Vec::new(), states: HashMap::new(), next_state: 0 }
    }

    /// Keeps a state, and gives its number.
    pub(super) fn keep(&mut self, state: SavedState) -> usize {
        self.next_state += 1;
        self.states.insert(self.next_state, state);
        self.next_state
    }
}

/// Adds an instance and gives its handle.
pub(super) fn add(held: Held) -> *mut c_void {
    let mut instances = INSTANCES.lock().unwrap_or_else(PoisonError::into_inner);
    instances.last += 1;
    let number = instances.last;
    instances.held.insert(number, Arc::new(Mutex::new(held)));
    number as *mut c_void
}

/// The instance of a handle.
pub(super) fn instance(handle: *mut c_void) -> Option<Arc<Mutex<Held>>> {
    INSTANCES.lock().unwrap_or_else(PoisonError::into_inner).held.get(&(handle as usize)).cloned()
}

/// Frees an instance.
pub(super) fn remove(handle: *mut c_void) {
    INSTANCES.lock().unwrap_or_else(PoisonError::into_inner).held.remove(&(handle as usize));
}
