//! What calls end with, and where messages go: types of `fmi3FunctionTypes.h`.

use std::ffi::{c_char, c_void};

/// `fmi3Status`.
pub(super) type Status = i32;
pub(super) const OK: Status = 0;
pub(super) const ERROR: Status = 3;
pub(super) const FATAL: Status = 4;

/// `fmi3LogMessageCallback`.
pub(super) type LogMessage = Option<unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char)>;
