//! Waiting for what must come: for as long as it takes on a machine that is busy.

use std::time::{Duration, Instant};

/// A watchdog against hangs, which no test is about: what has not come by then does not come.
pub const PATIENCE: Duration = Duration::from_secs(600);

/// Between two looks.
const LOOK: Duration = Duration::from_millis(20);

/// Polls until there is a value, and returns it. `Err` is what is there instead, for the message of a timeout.
#[track_caller]
pub fn wait_for<T>(what: &str, mut look: impl FnMut() -> Result<T, String>) -> T {
    // The watchdog's.
    let begin = Instant::now();
    loop {
        match look() {
            Ok(found) => return found,
            // The watchdog's.
            Err(instead) => assert!(begin.elapsed() < PATIENCE, "waited for {what}: {instead}"),
        }
        // Looked at again and again.
        std::thread::sleep(LOOK);
    }
}

/// The same of what is so or not.
#[track_caller]
pub fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    wait_for(what, || if is_so() { Ok(()) } else { Err("it is not so".to_owned()) });
}
