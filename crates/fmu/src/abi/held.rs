//! The instances that importers hold, by number.

use std::collections::HashMap;
use std::ffi::{CStr, CString, c_void};
use std::panic::{AssertUnwindSafe, UnwindSafe};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use super::status::{DEFECT, ERROR, FATAL, FmiStatus, LogMessage, Logger};
use crate::config::Config;
use crate::instance::Instance;
use crate::state::SavedState;
use crate::xml;

/// An instance with what belongs to its importer.
pub(super) struct LoggedInstance {
    pub(super) instance: Instance,
    pub(super) log: Log,
    /// A call panicked in the middle.
    pub(super) is_broken: bool,
    /// States that were handed out, by number.
    pub(super) states: HashMap<usize, SavedState>,
    /// From when to when the importer wants to simulate, s (FMI 2.0).
    pub(super) span_s: (f64, Option<f64>),
    /// Texts that the last call handed out (FMI 2.0).
    pub(super) texts: Vec<CString>,
}

/// Where messages go.
#[derive(Clone)]
pub(super) struct Log {
    /// The importer's own pointer, as a number: it goes back as it came.
    environment: usize,
    message: Message,
}

/// The importer's function for messages, by the version of FMI.
#[derive(Clone)]
enum Message {
    Fmi3(LogMessage),
    /// With the name of the instance.
    Fmi2(Logger, Arc<CStr>),
}

/// The instances, and the number of the last.
#[derive(Default)]
struct Instances {
    last: usize,
    held: ByNumber<LoggedInstance>,
}

type ByNumber<T> = HashMap<usize, Arc<Mutex<T>>>;

/// The number of the last state, of whatever instance: a state of another one is not mistaken for one's own.
static LAST_STATE: AtomicUsize = AtomicUsize::new(0);
static INSTANCES: LazyLock<Mutex<Instances>> = LazyLock::new(Mutex::default);

impl Log {
    pub(super) fn new(environment: *mut c_void, message: LogMessage) -> Self {
        Self { environment: environment as usize, message: Message::Fmi3(message) }
    }

    /// By FMI 2.0, of an instance of this name.
    pub(super) fn fmi2(environment: *mut c_void, logger: Logger, name: &CStr) -> Self {
        Self { environment: environment as usize, message: Message::Fmi2(logger, name.into()) }
    }

    /// A message of a call that ends with `status`.
    pub(super) fn say(&self, status: FmiStatus, what: &str) {
        let what = what.replace('\0', " ");
        let category = if status == FATAL { c"logStatusFatal" } else { c"logStatusError" };
        let environment = self.environment as *mut c_void;
        match &self.message {
            Message::Fmi3(Some(message)) => {
                let text = CString::new(what).unwrap_or_default();
                // SAFETY: the importer's function with the importer's pointer and texts that live as long as the call.
                unsafe { message(environment, status, category.as_ptr(), text.as_ptr()) };
            }
            Message::Fmi2(Some(logger), name) => {
                // It is a format of `printf`, to which nothing is handed.
                let text = CString::new(what.replace('%', "%%")).unwrap_or_default();
                // SAFETY: as above.
                unsafe { logger(environment, name.as_ptr(), status, category.as_ptr(), text.as_ptr()) };
            }
            Message::Fmi3(None) | Message::Fmi2(None, _) => {}
        }
    }
}

/// An instance of what is described in the resources, if the importer means that one.
pub(super) fn checked(
    config: Config,
    resources: &Path,
    token: Option<&str>,
    has_event_mode: bool,
) -> Result<Instance, String> {
    let expected = xml::token(&config, resources);
    if token != Some(expected.as_str()) {
        return Err(format!("the instantiation token is {}; expected {expected}", token.unwrap_or("missing")));
    }
    Instance::of(config, resources, has_event_mode).map_err(|error| error.to_string())
}

/// Makes an instance and gives its handle; null if that fails, for which there is a message.
pub(super) fn make(log: Log, work: impl FnOnce() -> Result<Instance, String> + UnwindSafe) -> *mut c_void {
    match std::panic::catch_unwind(work) {
        Ok(Ok(instance)) => return add(LoggedInstance::new(instance, log)),
        Ok(Err(error)) => log.say(ERROR, &error),
        Err(_) => log.say(FATAL, DEFECT),
    }
    std::ptr::null_mut()
}

impl LoggedInstance {
    pub(super) fn new(instance: Instance, log: Log) -> Self {
        Self { instance, log, is_broken: false, states: HashMap::new(), span_s: (0.0, None), texts: Vec::new() }
    }

    /// Keeps a state, and gives its number.
    pub(super) fn keep(&mut self, state: SavedState) -> usize {
        let number = LAST_STATE.fetch_add(1, Ordering::Relaxed) + 1;
        self.states.insert(number, state);
        number
    }
}

/// Adds an instance and gives its handle.
pub(super) fn add(held: LoggedInstance) -> *mut c_void {
    let mut instances = INSTANCES.lock().unwrap_or_else(PoisonError::into_inner);
    instances.last += 1;
    let number = instances.last;
    instances.held.insert(number, Arc::new(Mutex::new(held)));
    number as *mut c_void
}

/// The instance of a handle.
pub(super) fn instance(handle: *mut c_void) -> Option<Arc<Mutex<LoggedInstance>>> {
    INSTANCES.lock().unwrap_or_else(PoisonError::into_inner).held.get(&(handle as usize)).cloned()
}

/// Frees an instance.
pub(super) fn remove(handle: *mut c_void) {
    free(&INSTANCES, |all| all.held.remove(&(handle as usize)));
}

/// Takes something out of what is locked, and drops it when the lock is free. A panic there has no call to end with `Fatal`, and must
/// not leave a C function: it is written to the process's error output by the panic itself.
fn free<T, U>(all: &Mutex<T>, take: impl FnOnce(&mut T) -> Option<U>) {
    let taken = take(&mut all.lock().unwrap_or_else(PoisonError::into_inner));
    let _ = std::panic::catch_unwind(AssertUnwindSafe(|| drop(taken)));
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;

    static ALL: Mutex<Vec<Last>> = Mutex::new(Vec::new());
    static WAS_FREE: AtomicBool = AtomicBool::new(false);

    /// What an instance may do when it ends.
    struct Last;

    impl Drop for Last {
        fn drop(&mut self) {
            WAS_FREE.store(ALL.try_lock().is_ok(), Ordering::Relaxed);
            panic!("a test's own");
        }
    }

    #[test]
    fn the_end_of_an_instance_holds_up_no_other_and_its_panic_ends_there() {
        ALL.lock().unwrap().push(Last);
        free(&ALL, Vec::pop);
        assert!(WAS_FREE.load(Ordering::Relaxed));
        assert!(ALL.lock().unwrap().is_empty());
    }
}
