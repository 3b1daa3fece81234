//! The C functions of FMI 2.0 for co-simulation (`fmi2Functions.h`).

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::Path;

use super::held::{self, Log};
use super::status::{ERROR, Logger, Status};
use super::values::{read, write};
use super::{call, carry_out, slice, slice_mut, text, wrong};
use crate::config::Config;
use crate::fmi2::{Kind, folder, from_integer, integer, real};
use crate::instance::Mode;
use crate::variable::Value;

/// `fmi2CoSimulation` of `fmi2Type`.
const CO_SIMULATION: c_int = 1;
/// By this much a sum of steps may be beyond the end, s.
const ROUNDED_S: f64 = 1e-9;

/// `fmi2CallbackFunctions`: memory and the end of steps are this library's own.
#[repr(C)]
pub struct Callbacks {
    logger: Logger,
    allocate_memory: *const c_void,
    free_memory: *const c_void,
    step_finished: *const c_void,
    environment: *mut c_void,
}

/// `fmi2GetTypesPlatform`: the types of the standard's own header.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

/// `fmi2GetVersion`: `2.0`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

/// `fmi2SetDebugLogging`: errors are always reported, and there is nothing else.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetDebugLogging(
    handle: *mut c_void,
    _on: c_int,
    _count: usize,
    _categories: *const c_void,
) -> Status {
    call(handle, |_| Ok(()))
}

/// `fmi2Instantiate`; null if the GUID is another FMU's or the resources do not describe one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    instance_name: *const c_char,
    kind: c_int,
    guid: *const c_char,
    resource_location: *const c_char,
    callbacks: *const Callbacks,
    _visible: c_int,
    _logging_on: c_int,
) -> *mut c_void {
    // SAFETY: texts and a structure by the importer's word.
    let (guid, location, callbacks) = unsafe { (text(guid), text(resource_location), slice(callbacks, 1)) };
    let name = match instance_name.is_null() {
        true => c"",
        // SAFETY: not null; ends with a zero by the importer's word.
        false => unsafe { CStr::from_ptr(instance_name) },
    };
    let log = match callbacks {
        Ok([it]) => Log::fmi2(it.environment, it.logger, name),
        _ => Log::fmi2(std::ptr::null_mut(), None, name),
    };
    held::make(log, || {
        if kind != CO_SIMULATION {
            return Err("this FMU is for co-simulation".to_owned());
        }
        let folder = folder(location.ok_or("the location of the resources is missing")?);
        let folder = folder.map_err(|error| error.to_string())?;
        let resources = Path::new(&folder);
        let config = Config::read(resources).map_err(|error| error.to_string())?;
        if !matches!(config, Config::Axis(_)) {
            return Err("this FMU is of FMI 3.0".to_owned());
        }
        held::checked(config, resources, guid, false)
    })
}

/// `fmi2FreeInstance`: what it moves is brought to rest before.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2FreeInstance(handle: *mut c_void) {
    if !handle.is_null() {
        // An instance that has panicked has nothing to bring to rest.
        let _ = call(handle, |held| held.instance.end());
        held::remove(handle);
    }
}

/// `fmi2SetupExperiment`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetupExperiment(
    handle: *mut c_void,
    _tolerance_defined: c_int,
    _tolerance: f64,
    start_time: f64,
    stop_time_defined: c_int,
    stop_time: f64,
) -> Status {
    call(handle, |held| {
        let stop = (stop_time_defined != 0).then_some(stop_time);
        if held.instance.mode() != Mode::Instantiated {
            return wrong(format!(
                "fmi2SetupExperiment in the mode {:?}; expected [Instantiated]",
                held.instance.mode()
            ));
        }
        if !start_time.is_finite() || stop.is_some_and(|stop| !(stop >= start_time)) {
            return wrong(format!("an experiment from {start_time} s to {stop_time} s is not possible"));
        }
        held.span_s = (start_time, stop);
        Ok(())
    })
}

/// `fmi2EnterInitializationMode`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2EnterInitializationMode(handle: *mut c_void) -> Status {
    call(handle, |held| held.instance.enter_initialization(held.span_s.0))
}

/// `fmi2ExitInitializationMode`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2ExitInitializationMode(handle: *mut c_void) -> Status {
    call(handle, |held| held.instance.exit_initialization())
}

/// `fmi2Terminate`: what the drive moves is brought to rest.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2Terminate(handle: *mut c_void) -> Status {
    call(handle, |held| held.instance.terminate())
}

/// `fmi2Reset`: also after a panic.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2Reset(handle: *mut c_void) -> Status {
    carry_out(handle, |held| {
        held.instance.reset().map_err(|error| (ERROR, error.to_string()))?;
        (held.is_broken, held.span_s) = (false, (0.0, None));
        Ok(())
    })
}

/// `fmi2DoStep`: always the whole step.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2DoStep(handle: *mut c_void, from: f64, step: f64, _no_set_state_prior: c_int) -> Status {
    call(handle, |held| {
        if let Some(stop) = held.span_s.1.filter(|stop| from + step > stop + ROUNDED_S) {
            return wrong(format!("a step from {from} s by {step} s is beyond the stop time of {stop} s"));
        }
        held.instance.step(from, step).map(drop)
    })
}

/// The name of the type of a value in FMI 2.0.
fn kind_of(value: &Value) -> &'static str {
    Kind::of(value).element()
}

/// `fmi2GetReal`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(h: *mut c_void, vr: *const u32, nvr: usize, values: *mut f64) -> Status {
    // SAFETY: handed on as it came.
    unsafe { read(h, (vr, nvr), (values, nvr), |value| real(&value), kind_of) }
}

/// `fmi2SetReal`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(h: *mut c_void, vr: *const u32, nvr: usize, values: *const f64) -> Status {
    // SAFETY: handed on as it came.
    unsafe { write(h, (vr, nvr), (values, nvr), |value| Ok(Value::Float64(value))) }
}

/// `fmi2GetInteger`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetInteger(h: *mut c_void, vr: *const u32, nvr: usize, values: *mut c_int) -> Status {
    // SAFETY: handed on as it came.
    unsafe { read(h, (vr, nvr), (values, nvr), |value| integer(&value), kind_of) }
}

/// `fmi2SetInteger`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetInteger(h: *mut c_void, vr: *const u32, nvr: usize, values: *const c_int) -> Status {
    // SAFETY: handed on as it came.
    unsafe { write(h, (vr, nvr), (values, nvr), from_integer) }
}

/// `fmi2GetBoolean`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBoolean(h: *mut c_void, vr: *const u32, nvr: usize, values: *mut c_int) -> Status {
    let take = |value| if let Value::Boolean(it) = value { Some(c_int::from(it)) } else { None };
    // SAFETY: handed on as it came.
    unsafe { read(h, (vr, nvr), (values, nvr), take, kind_of) }
}

/// `fmi2SetBoolean`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetBoolean(h: *mut c_void, vr: *const u32, nvr: usize, values: *const c_int) -> Status {
    // SAFETY: handed on as it came.
    unsafe { write(h, (vr, nvr), (values, nvr), |value| Ok(Value::Boolean(value != 0))) }
}

/// `fmi2GetString`: what is handed out lives until the next call of this function.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetString(
    handle: *mut c_void,
    references: *const u32,
    count: usize,
    values: *mut *const c_char,
) -> Status {
    call(handle, |held| {
        // SAFETY: arrays of this count by the importer's word.
        let (references, values) = unsafe { (slice(references, count)?, slice_mut(values, count)?) };
        held.texts.clear();
        for (reference, place) in references.iter().zip(values) {
            let text = match held.instance.get(*reference)? {
                Value::String(text) => CString::new(text).unwrap_or_default(),
                other => return wrong(format!("variable {reference} is a {}", kind_of(&other))),
            };
            // The text stays where it is when its owner moves.
            *place = text.as_ptr();
            held.texts.push(text);
        }
        Ok(())
    })
}

/// `fmi2SetString`: no variable that can be set is a text.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetString(h: *mut c_void, _vr: *const u32, nvr: usize, _values: *const c_void) -> Status {
    call(h, |_| if nvr == 0 { Ok(()) } else { wrong("no variable for fmi2SetString") })
}
