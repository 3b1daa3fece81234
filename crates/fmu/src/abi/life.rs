//! From instantiation to the end: modes, steps, states.

use std::ffi::{c_char, c_void};
use std::path::Path;

use super::held::{self, Log};
use super::status::{ERROR, FmiStatus, LogMessage};
use super::{call, carry_out, put, text};
use crate::config::Config;

/// The functions that are the same in both versions, by their names there.
macro_rules! life {
    ($exit_initialization:ident, $terminate:ident, $reset:ident, $free:ident) => {
        #[doc = concat!("`", stringify!($exit_initialization), "`.")]
        #[unsafe(no_mangle)]
        pub extern "C" fn $exit_initialization(handle: *mut c_void) -> FmiStatus {
            call(handle, |held| held.instance.exit_initialization())
        }

        #[doc = concat!("`", stringify!($terminate), "`.")]
        #[unsafe(no_mangle)]
        pub extern "C" fn $terminate(handle: *mut c_void) -> FmiStatus {
            call(handle, |held| held.instance.terminate())
        }

        #[doc = concat!("`", stringify!($reset), "`: also after a panic.")]
        #[unsafe(no_mangle)]
        pub extern "C" fn $reset(handle: *mut c_void) -> FmiStatus {
            carry_out(handle, |held| {
                held.instance.reset().map_err(|error| (ERROR, error.to_string()))?;
                (held.is_broken, held.span_s) = (false, (0.0, None));
                Ok(())
            })
        }

        #[doc = concat!("`", stringify!($free), "`.")]
        #[unsafe(no_mangle)]
        pub extern "C" fn $free(handle: *mut c_void) {
            held::remove(handle);
        }
    };
}

life!(fmi2ExitInitializationMode, fmi2Terminate, fmi2Reset, fmi2FreeInstance);
life!(fmi3ExitInitializationMode, fmi3Terminate, fmi3Reset, fmi3FreeInstance);

/// `fmi3GetVersion`: `3.0`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// `fmi3SetDebugLogging`: errors are always reported, and there is nothing else.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetDebugLogging(
    handle: *mut c_void,
    _on: u8,
    _count: usize,
    _categories: *const c_void,
) -> FmiStatus {
    call(handle, |_| Ok(()))
}

/// `fmi3InstantiateCoSimulation`; null if the token is another FMU's or the resources do not describe one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    _instance_name: *const c_char,
    token: *const c_char,
    resource_path: *const c_char,
    _visible: u8,
    _logging_on: u8,
    event_mode_used: u8,
    _early_return_allowed: u8,
    _intermediate: *const u32,
    _intermediate_count: usize,
    environment: *mut c_void,
    log_message: LogMessage,
    _intermediate_update: *const c_void,
) -> *mut c_void {
    let log = Log::new(environment, log_message);
    // SAFETY: texts by the importer's word.
    let (token, resources) = unsafe { (text(token), text(resource_path)) };
    held::make(log, || {
        let resources = Path::new(resources.ok_or("the path of the resources is missing")?);
        let config = Config::read(resources).map_err(|error| error.to_string())?;
        if matches!(config, Config::Axis(_)) {
            return Err("this FMU is of FMI 2.0".to_owned());
        }
        held::checked(config, resources, token, event_mode_used != 0)
    })
}

/// `fmi3EnterInitializationMode`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterInitializationMode(
    handle: *mut c_void,
    _tolerance_defined: u8,
    _tolerance: f64,
    start_time: f64,
    _stop_time_defined: u8,
    _stop_time: f64,
) -> FmiStatus {
    call(handle, |held| held.instance.enter_initialization(start_time))
}

/// `fmi3EnterEventMode`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterEventMode(handle: *mut c_void) -> FmiStatus {
    call(handle, |held| held.instance.enter_event())
}

/// `fmi3EnterStepMode`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterStepMode(handle: *mut c_void) -> FmiStatus {
    call(handle, |held| held.instance.enter_step())
}

/// `fmi3EvaluateDiscreteStates`: outputs change with `fmi3UpdateDiscreteStates` alone.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3EvaluateDiscreteStates(handle: *mut c_void) -> FmiStatus {
    call(handle, |_| Ok(()))
}

/// `fmi3UpdateDiscreteStates`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3UpdateDiscreteStates(
    handle: *mut c_void,
    needs_update: *mut u8,
    terminate: *mut u8,
    nominals_changed: *mut u8,
    states_changed: *mut u8,
    next_event_defined: *mut u8,
    next_event: *mut f64,
) -> FmiStatus {
    call(handle, |held| {
        let again = held.instance.update()?;
        // SAFETY: places for results by the importer's word.
        unsafe {
            put(needs_update, again.into());
            put(terminate, 0);
            put(nominals_changed, 0);
            put(states_changed, 0);
            put(next_event_defined, 0);
            put(next_event, 0.0);
        }
        Ok(())
    })
}

/// `fmi3DoStep`: always the whole step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    handle: *mut c_void,
    from: f64,
    step: f64,
    _no_set_state_prior: u8,
    event_needed: *mut u8,
    terminate: *mut u8,
    early_return: *mut u8,
    last_time: *mut f64,
) -> FmiStatus {
    call(handle, |held| {
        let stepped = held.instance.step(from, step)?;
        // SAFETY: places for results by the importer's word.
        unsafe {
            put(event_needed, stepped.needs_event.into());
            put(terminate, 0);
            put(early_return, 0);
            put(last_time, stepped.time_s);
        }
        Ok(())
    })
}
