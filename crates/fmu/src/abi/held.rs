//! The instances that importers hold, by number.

use std::collections::HashMap;
use std::ffi::{CString, c_void};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use super::status::{FATAL, LogMessage, Status};
use crate::instance::Instance;
use crate::state::SavedState;

/// An instance with what belongs to its importer.
pub(super) struct Held {
    pub(super) instance: Instance,
    pub(super) log: Log,
    /// A call panicked in the middle.
    pub(super) is_broken: bool,
    /// States that were handed out, by number.
    pub(super) states: HashMap<usize, SavedState>,
}

/// Where messages go.
#[derive(Clone, Copy)]
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

/// The number of the last state, of whatever instance: a state of another one is not mistaken for one's own.
static LAST_STATE: AtomicUsize = AtomicUsize::new(0);
static INSTANCES: LazyLock<Mutex<Instances>> = LazyLock::new(Mutex::default);

impl Log {
    pub(super) fn new(environment: *mut c_void, message: LogMessage) -> Self {
        Self { environment: environment as usize, message }
    }

    /// A message of a call that ends with `status`.
    pub(super) fn say(&self, status: Status, what: &str) {
        let Some(message) = self.message else { return };
        let text = CString::new(what.replace('\0', " ")).unwrap_or_default();
        let category = if status == FATAL { c"logStatusFatal" } else { c"logStatusError" };
        // SAFETY: the importer's function with the importer's pointer and texts that live as long as the call.
        unsafe { message(self.environment as *mut c_void, status, category.as_ptr(), text.as_ptr()) };
    }
}

impl Held {
    pub(super) fn new(instance: Instance, log: Log) -> Self {
        Self { instance, log, is_broken: false, states: HashMap::new() }
    }

    /// Keeps a state, and gives its number.
    pub(super) fn keep(&mut self, state: SavedState) -> usize {
        let number = LAST_STATE.fetch_add(1, Ordering::Relaxed) + 1;
        self.states.insert(number, state);
        number
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
