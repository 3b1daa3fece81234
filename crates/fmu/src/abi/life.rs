//! From instantiation to the end: modes, steps, states.

use std::ffi::{c_char, c_void};
use std::path::Path;

use super::held::{self, Held, Log};
use super::status::{ERROR, FATAL, LogMessage, Status};
use super::{DEFECT, call, carry_out, put, slice, slice_mut, text, wrong};
use crate::config::Config;
use crate::instance::Instance;
use crate::state::SavedState;
use crate::xml;

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
) -> Status {
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
    let made = std::panic::catch_unwind(|| {
        let resources = Path::new(resources.ok_or("the path of the resources is missing")?);
        let config = Config::read(resources).map_err(|error| error.to_string())?;
        let expected = xml::token(&config, resources);
        if token != Some(expected.as_str()) {
            return Err(format!("the instantiation token is {}; expected {expected}", token.unwrap_or("missing")));
        }
        Instance::of(config, resources, event_mode_used != 0).map_err(|error| error.to_string())
    });
    match made {
        Ok(Ok(instance)) => held::add(Held::new(instance, log)),
        Ok(Err(error)) => {
            log.say(ERROR, &error);
            std::ptr::null_mut()
        }
        Err(_) => {
            log.say(FATAL, DEFECT);
            std::ptr::null_mut()
        }
    }
}

/// `fmi3FreeInstance`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3FreeInstance(handle: *mut c_void) {
    held::remove(handle);
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
) -> Status {
    call(handle, |held| held.instance.enter_initialization(start_time))
}

/// `fmi3ExitInitializationMode`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3ExitInitializationMode(handle: *mut c_void) -> Status {
    call(handle, |held| held.instance.exit_initialization())
}

/// `fmi3EnterEventMode`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterEventMode(handle: *mut c_void) -> Status {
    call(handle, |held| held.instance.enter_event())
}

/// `fmi3EnterStepMode`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterStepMode(handle: *mut c_void) -> Status {
    call(handle, |held| held.instance.enter_step())
}

/// `fmi3Terminate`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3Terminate(handle: *mut c_void) -> Status {
    call(handle, |held| held.instance.terminate())
}

/// `fmi3Reset`: also after a panic.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3Reset(handle: *mut c_void) -> Status {
    carry_out(handle, |held| {
        held.instance.reset().map_err(|error| (ERROR, error.to_string()))?;
        held.is_broken = false;
        Ok(())
    })
}

/// `fmi3EvaluateDiscreteStates`: outputs change with `fmi3UpdateDiscreteStates` alone.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3EvaluateDiscreteStates(handle: *mut c_void) -> Status {
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
) -> Status {
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
) -> Status {
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

/// `fmi3GetFMUState`: a state that was handed out before is written anew.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(handle: *mut c_void, state: *mut *mut c_void) -> Status {
    call(handle, |held| {
        // SAFETY: a place for a pointer by the importer's word.
        let place = unsafe { slice_mut(state, 1)? };
        held.states.remove(&(place[0] as usize));
        let saved = SavedState::of(&held.instance);
        place[0] = held.keep(saved) as *mut c_void;
        Ok(())
    })
}

/// `fmi3SetFMUState`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetFMUState(handle: *mut c_void, state: *mut c_void) -> Status {
    call(handle, |held| match held.states.get(&(state as usize)) {
        Some(saved) => {
            saved.restore(&mut held.instance);
            Ok(())
        }
        None => wrong("no state of this instance"),
    })
}

/// `fmi3FreeFMUState`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(handle: *mut c_void, state: *mut *mut c_void) -> Status {
    call(handle, |held| {
        if !state.is_null() {
            // SAFETY: a place for a pointer by the importer's word.
            let place = unsafe { slice_mut(state, 1)? };
            held.states.remove(&(place[0] as usize));
            place[0] = std::ptr::null_mut();
        }
        Ok(())
    })
}

/// `fmi3SerializedFMUStateSize`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializedFMUStateSize(
    handle: *mut c_void,
    state: *mut c_void,
    size: *mut usize,
) -> Status {
    call(handle, |held| {
        let Some(saved) = held.states.get(&(state as usize)) else { return wrong("no state of this instance") };
        // SAFETY: a place for a result by the importer's word.
        unsafe { put(size, saved.bytes().len()) };
        Ok(())
    })
}

/// `fmi3SerializeFMUState`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializeFMUState(
    handle: *mut c_void,
    state: *mut c_void,
    bytes: *mut u8,
    size: usize,
) -> Status {
    call(handle, |held| {
        let Some(saved) = held.states.get(&(state as usize)) else { return wrong("no state of this instance") };
        let written = saved.bytes();
        if written.len() > size {
            return wrong(format!("the state has {} bytes, and there is room for {size}", written.len()));
        }
        // SAFETY: room for as many bytes by the importer's word.
        let room = unsafe { slice_mut(bytes, size)? };
        room[..written.len()].copy_from_slice(&written);
        Ok(())
    })
}

/// `fmi3DeserializeFMUState`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DeserializeFMUState(
    handle: *mut c_void,
    bytes: *const u8,
    size: usize,
    state: *mut *mut c_void,
) -> Status {
    call(handle, |held| {
        // SAFETY: as many bytes, and a place for a pointer, by the importer's word.
        let (bytes, place) = unsafe { (slice(bytes, size)?, slice_mut(state, 1)?) };
        let saved = SavedState::from_bytes(bytes, &held.instance)?;
        place[0] = held.keep(saved) as *mut c_void;
        Ok(())
    })
}
