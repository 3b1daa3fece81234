//! What calls end with, and where messages go: types of `fmi3FunctionTypes.h` and `fmi2FunctionTypes.h`.

use std::ffi::{c_char, c_void};

/// `fmi3Status`, and `fmi2Status`.
pub(super) type FmiStatus = i32;
pub(super) const OK: FmiStatus = 0;
pub(super) const ERROR: FmiStatus = 3;
pub(super) const FATAL: FmiStatus = 4;

/// What the importer reads of a panic.
pub(super) const DEFECT: &str = "a defect of Ferrodrive; please report it with what was called";

/// `fmi3LogMessageCallback`.
pub(super) type LogMessage = Option<unsafe extern "C" fn(*mut c_void, FmiStatus, *const c_char, *const c_char)>;

/// `fmi2CallbackLogger`: component environment, name of the instance, status, category, message as of `printf`.
pub(super) type Logger =
    Option<unsafe extern "C" fn(*mut c_void, *const c_char, FmiStatus, *const c_char, *const c_char, ...)>;
