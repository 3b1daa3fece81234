//! What a run is allowed to do, and which cases are wanted.

use std::time::Duration;

/// What a run is to do.
#[derive(Clone, Debug)]
pub struct Options {
    /// Run cases in which a motor is energised and moves.
    pub allow_motion: bool,
    /// Run cases that store parameters in the device's memory.
    pub allow_store: bool,
    /// These cases or groups only; all if empty.
    pub only: Vec<String>,
    /// Not these cases or groups.
    pub skip: Vec<String>,
    /// Longest wait for the answer to a frame.
    pub timeout: Duration,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            allow_motion: false,
            allow_store: false,
            only: Vec::new(),
            skip: Vec::new(),
            timeout: master::DEFAULT_TIMEOUT,
        }
    }
}
