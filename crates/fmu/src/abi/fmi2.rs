//! The C functions of FMI 2.0 for co-simulation (`fmi2Functions.h`).

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::Path;

use super::held::{self, Log};
use super::status::{FmiStatus, Logger};
use super::values::{read, write};
use super::{call, slice, slice_mut, text, wrong};
use crate::config::Config;
use crate::fmi2::{VariableKind, folder, from_integer, integer, real};
use crate::instance::Mode;
use crate::variable::Value;

/// `fmi2CoSimulation` of `fmi2Type`.
const CO_SIMULATION: c_int = 1;
/// By this share of a step it may end beyond the stop time, which importers reach by adding up steps with their rounding.
const ROUNDED: f64 = 0.01;

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
) -> FmiStatus {
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

/// `fmi2SetupExperiment`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetupExperiment(
    handle: *mut c_void,
    _tolerance_defined: c_int,
    _tolerance: f64,
    start_time: f64,
    stop_time_defined: c_int,
    stop_time: f64,
) -> FmiStatus {
    call(handle, |held| {
        let stop = (stop_time_defined != 0).then_some(stop_time);
        if held.instance.mode() != Mode::Instantiated {
            return wrong(format!(
                "fmi2SetupExperiment in the mode {:?}; expected [Instantiated]",
                held.instance.mode()
            ));
        }
        if !start_time.is_finite() {
            return wrong(format!("the start time is {start_time} s; expected a number of seconds"));
        }
        if let Some(stop) = stop.filter(|stop| stop.is_nan() || *stop < start_time) {
            return wrong(format!("the stop time is {stop} s; expected the start time of {start_time} s or later"));
        }
        held.span_s = (start_time, stop);
        Ok(())
    })
}

/// `fmi2EnterInitializationMode`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2EnterInitializationMode(handle: *mut c_void) -> FmiStatus {
    call(handle, |held| held.instance.enter_initialization(held.span_s.0))
}

/// `fmi2DoStep`: always the whole step.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2DoStep(handle: *mut c_void, from: f64, step: f64, _no_set_state_prior: c_int) -> FmiStatus {
    call(handle, |held| {
        if let Some(stop) = held.span_s.1.filter(|stop| from + step > stop + ROUNDED * step) {
            return wrong(format!("a step from {from} s by {step} s is beyond the stop time of {stop} s"));
        }
        held.instance.step(from, step).map(drop)
    })
}

/// The name of the type of a value in FMI 2.0.
fn kind_of(value: &Value) -> &'static str {
    VariableKind::of(value).element()
}

/// `fmi2GetReal`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(h: *mut c_void, vr: *const u32, nvr: usize, values: *mut f64) -> FmiStatus {
    // SAFETY: handed on as it came.
    unsafe { read(h, (vr, nvr), (values, nvr), |value| real(&value), kind_of) }
}

/// `fmi2SetReal`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(h: *mut c_void, vr: *const u32, nvr: usize, values: *const f64) -> FmiStatus {
    // SAFETY: handed on as it came.
    unsafe { write(h, (vr, nvr), (values, nvr), |value| Ok(Value::Float64(value))) }
}

/// `fmi2GetInteger`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetInteger(h: *mut c_void, vr: *const u32, nvr: usize, values: *mut c_int) -> FmiStatus {
    // SAFETY: handed on as it came.
    unsafe { read(h, (vr, nvr), (values, nvr), |value| integer(&value), kind_of) }
}

/// `fmi2SetInteger`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetInteger(h: *mut c_void, vr: *const u32, nvr: usize, values: *const c_int) -> FmiStatus {
    // SAFETY: handed on as it came.
    unsafe { write(h, (vr, nvr), (values, nvr), from_integer) }
}

/// `fmi2GetBoolean`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBoolean(h: *mut c_void, vr: *const u32, nvr: usize, values: *mut c_int) -> FmiStatus {
    let take = |value| if let Value::Boolean(it) = value { Some(c_int::from(it)) } else { None };
    // SAFETY: handed on as it came.
    unsafe { read(h, (vr, nvr), (values, nvr), take, kind_of) }
}

/// `fmi2SetBoolean`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetBoolean(h: *mut c_void, vr: *const u32, nvr: usize, values: *const c_int) -> FmiStatus {
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
) -> FmiStatus {
    call(handle, |held| {
        // SAFETY: arrays of this count by the importer's word.
        let (references, values) = unsafe { (slice(references, count)?, slice_mut(values, count)?) };
        held.texts.clear();
        for (reference, place) in references.iter().zip(values) {
            let text = match held.instance.get(*reference)? {
                Value::String(text) => CString::new(text).unwrap_or_default(),
                other => return wrong(format!("variable {reference} is of type {}", kind_of(&other))),
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
pub extern "C" fn fmi2SetString(h: *mut c_void, _vr: *const u32, nvr: usize, _values: *const c_void) -> FmiStatus {
    call(h, |_| if nvr == 0 { Ok(()) } else { wrong("no variable for fmi2SetString") })
}

#[cfg(test)]
mod tests {
    use std::ptr::{null, null_mut};
    use std::sync::Mutex;

    use tempfile::TempDir;

    use super::super::life::{fmi2ExitInitializationMode, fmi2FreeInstance, fmi2Reset, fmi2Terminate};
    use super::super::states;
    use super::super::status::{ERROR, FATAL, OK};
    use super::*;
    use crate::config::{AxisConfig, DriveConfig, FILE, TargetKind};

    /// A folder of resources, its URI and its token.
    fn resources() -> (TempDir, CString, CString) {
        let drive = DriveConfig::new("zlac8030l@4,timing=ideal,fidelity=mechanical");
        let config = Config::Axis(AxisConfig { mode: TargetKind::Velocity, drive });
        // A space in its name has to be written as %20.
        let folder = tempfile::Builder::new().prefix("an fmu ").tempdir().unwrap();
        std::fs::write(folder.path().join(FILE), config.text()).unwrap();
        let uri = format!("file://{}", folder.path().display()).replace(' ', "%20");
        let guid = crate::xml::token(&config, folder.path());
        (folder, CString::new(uri).unwrap(), CString::new(guid).unwrap())
    }

    fn instantiate(kind: c_int, guid: &CStr, uri: &CStr) -> *mut c_void {
        // SAFETY: texts that live as long as the call; there are no callbacks.
        unsafe { fmi2Instantiate(c"it".as_ptr(), kind, guid.as_ptr(), uri.as_ptr(), null(), 0, 0) }
    }

    #[test]
    fn an_instance_is_made_for_co_simulation_of_this_fmu() {
        let (_resources, uri, guid) = resources();
        for (kind, guid, uri) in
            [(0, &*guid, &*uri), (1, c"of another", &*uri), (1, &*guid, c"file:///nowhere"), (1, &*guid, c"http://x/y")]
        {
            assert!(instantiate(kind, guid, uri).is_null());
        }
        let handle = instantiate(CO_SIMULATION, &guid, &uri);
        assert!(!handle.is_null());
        assert_eq!(fmi2EnterInitializationMode(handle), OK);
        assert_eq!(fmi2SetupExperiment(handle, 0, 0.0, 0.0, 0, 0.0), ERROR);
        fmi2FreeInstance(handle);
        assert_eq!(fmi2ExitInitializationMode(handle), ERROR);
        fmi2FreeInstance(handle);
        fmi2FreeInstance(null_mut());
    }

    /// One call with arguments of no sense, but for memory, which is the importer's word.
    fn any_call(handle: *mut c_void, mut random: impl FnMut(u32) -> u32) -> FmiStatus {
        let references = [random(30), 200 + random(20), 400 + random(8), random(u32::MAX)].map(|it| it % 1_000);
        let reals = [0.0, 1.0, -3.0, f64::NAN, f64::INFINITY, 1e300, 1e-3, -1e-3];
        let real = reals[random(8) as usize];
        let (mut read, mut whole, mut text) = ([real; 4], [random(u32::MAX) as c_int; 4], [null(); 4]);
        let count = random(5) as usize;
        let (vr, n) = (if random(10) == 0 { null() } else { references.as_ptr() }, count);
        // SAFETY: arrays of four values, of which as many are meant or fewer, or null.
        unsafe {
            match random(18) {
                0 => fmi2GetReal(handle, vr, n, read.as_mut_ptr()),
                1 => fmi2SetReal(handle, vr, n, read.as_ptr()),
                2 => fmi2GetInteger(handle, vr, n, whole.as_mut_ptr()),
                3 => fmi2SetInteger(handle, vr, n, whole.as_ptr()),
                4 => fmi2GetBoolean(handle, vr, n, whole.as_mut_ptr()),
                5 => fmi2SetBoolean(handle, vr, n, whole.as_ptr()),
                6 => fmi2GetString(handle, vr, n, text.as_mut_ptr()),
                7 => fmi2SetString(handle, vr, n, null()),
                8 => fmi2DoStep(handle, real, reals[random(8) as usize], 0),
                9 => fmi2SetupExperiment(handle, 0, 0.0, real, 1, reals[random(8) as usize]),
                10 if random(20) == 0 => fmi2Terminate(handle),
                10 => fmi2EnterInitializationMode(handle),
                11 => fmi2ExitInitializationMode(handle),
                12 if random(20) == 0 => fmi2Reset(handle),
                13 => fmi2GetReal(handle, vr, n, null_mut()),
                14 => super::super::unsupported::fmi2CancelStep(handle),
                // A step that makes sense where time stands.
                _ => {
                    let mut now = [0.0];
                    match fmi2GetReal(handle, [0].as_ptr(), 1, now.as_mut_ptr()) {
                        OK => fmi2DoStep(handle, now[0], 1e-4, 0),
                        status => status,
                    }
                }
            }
        }
    }

    /// What an importer has of states: two that it may hold, one that was freed, and bytes.
    struct States {
        held: [*mut c_void; 2],
        freed: *mut c_void,
        bytes: Vec<u8>,
    }

    /// One call of a function of states, which of them, and how it ends: a state that is held, was freed or never was, bytes as they
    /// were written or with one changed, room for all of them or too little.
    fn any_call_of_states(
        handle: *mut c_void,
        it: &mut States,
        mut random: impl FnMut(u32) -> u32,
    ) -> (usize, FmiStatus) {
        let place = random(2) as usize;
        let state = [it.held[place], it.held[place], it.freed, random(u32::MAX) as *mut c_void][random(4) as usize];
        let call = random(6) as usize;
        // SAFETY: places for a pointer and a size, and as much room as is meant.
        let status = unsafe {
            match call {
                0 => states::fmi2GetFMUstate(handle, &raw mut it.held[place]),
                1 => states::fmi2SetFMUstate(handle, state),
                2 => {
                    it.freed = it.held[place];
                    states::fmi2FreeFMUstate(handle, &raw mut it.held[place])
                }
                3 => states::fmi2SerializedFMUstateSize(handle, state, &mut 0),
                4 => {
                    let mut size = 0;
                    states::fmi2SerializedFMUstateSize(handle, state, &raw mut size);
                    let mut room = vec![0; size.saturating_sub(random(2) as usize)];
                    let status = states::fmi2SerializeFMUstate(handle, state, room.as_mut_ptr(), room.len());
                    if status == OK {
                        it.bytes = room;
                    }
                    status
                }
                _ => {
                    let mut bytes = it.bytes.clone();
                    if random(2) == 0 && bytes.len() > 4 {
                        let changed = 4 + random(bytes.len() as u32 - 4) as usize;
                        bytes[changed] ^= 1 << random(8);
                        // As the writer of other bytes would: what they mean decides.
                        let sum = crc32fast::hash(&bytes[4..]).to_le_bytes();
                        bytes[..4].copy_from_slice(&sum);
                    }
                    states::fmi2FreeFMUstate(handle, &raw mut it.held[place]);
                    states::fmi2DeSerializeFMUstate(handle, bytes.as_ptr(), bytes.len(), &raw mut it.held[place])
                }
            }
        };
        (call, status)
    }

    #[test]
    fn ten_thousand_calls_of_no_sense_are_taken_or_end_with_an_error() {
        let (_resources, uri, guid) = resources();
        let handle = instantiate(CO_SIMULATION, &guid, &uri);
        let mut random = sim::Prng::new(1);
        let mut states = States { held: [null_mut(); 2], freed: null_mut(), bytes: Vec::new() };
        let (mut seen, mut seen_of_states) = ([0; 5], [[0; 5]; 6]);
        let mut below = |below| (random.next_u64() % u64::from(below)) as u32;
        for _ in 0..10_000 {
            let status = if below(20) == 0 {
                let (call, status) = any_call_of_states(handle, &mut states, &mut below);
                seen_of_states[call][status as usize] += 1;
                status
            } else {
                any_call(handle, &mut below)
            };
            assert!(matches!(status, OK | ERROR), "{status}");
            seen[status as usize] += 1;
        }
        assert!(seen[OK as usize] > 1_000 && seen[ERROR as usize] > 1_000 && seen[FATAL as usize] == 0, "{seen:?}");
        // Each function of states has done its work; but to get and to free one, which ask for nothing, each has refused as well.
        let all = seen_of_states.iter().enumerate();
        let both =
            |(call, it): (usize, &[u32; 5])| it[OK as usize] > 5 && (it[ERROR as usize] > 5 || matches!(call, 0 | 2));
        assert!(all.into_iter().all(both), "{seen_of_states:?}");
        // It is as good as new.
        assert_eq!((fmi2Reset(handle), fmi2EnterInitializationMode(handle)), (OK, OK));
        assert_eq!((fmi2ExitInitializationMode(handle), fmi2DoStep(handle, 0.0, 1e-3, 0)), (OK, OK));
        fmi2FreeInstance(handle);
    }

    #[test]
    fn a_step_ends_at_the_stop_time() {
        let (_resources, uri, guid) = resources();
        let handle = instantiate(CO_SIMULATION, &guid, &uri);
        assert_eq!(fmi2SetupExperiment(handle, 0, 0.0, 5.0, 1, 4.0), ERROR);
        assert_eq!(fmi2SetupExperiment(handle, 0, 0.0, 5.0, 1, 5.002), OK);
        assert_eq!((fmi2EnterInitializationMode(handle), fmi2ExitInitializationMode(handle)), (OK, OK));
        let steps = [5.0, 5.001, 5.002].map(|from| fmi2DoStep(handle, from, 1e-3, 0));
        assert_eq!(steps, [OK, OK, ERROR]);
        fmi2FreeInstance(handle);
    }

    /// The importer adds up a million steps of 1 ms, and is 0.19 µs late; here the last two are taken.
    #[test]
    fn the_last_of_a_million_steps_is_taken() {
        let (_resources, uri, guid) = resources();
        let handle = instantiate(CO_SIMULATION, &guid, &uri);
        let before_last_s = (1..1_000_000).fold(2_000.0, |time_s, _| time_s + 1e-3);
        assert!(before_last_s + 1e-3 > 3_000.0 + 1e-7);
        assert_eq!(fmi2SetupExperiment(handle, 0, 0.0, before_last_s - 1e-3, 1, 3_000.0), OK);
        assert_eq!((fmi2EnterInitializationMode(handle), fmi2ExitInitializationMode(handle)), (OK, OK));
        assert_eq!(fmi2DoStep(handle, before_last_s - 1e-3, 1e-3, 0), OK);
        assert_eq!(fmi2DoStep(handle, before_last_s, 1e-3, 0), OK);
        assert_eq!(fmi2DoStep(handle, before_last_s + 1e-3, 1e-3, 0), ERROR);
        fmi2FreeInstance(handle);
    }

    /// FMI 2.0.5, 2.1.3: fmi2Error is of a call that was not carried out; not of one that was by half.
    #[test]
    fn of_several_values_all_are_taken_or_none() {
        let (_resources, uri, guid) = resources();
        let handle = instantiate(CO_SIMULATION, &guid, &uri);
        assert_eq!((fmi2EnterInitializationMode(handle), fmi2ExitInitializationMode(handle)), (OK, OK));
        let read = || {
            let mut values = [f64::NAN; 3];
            // SAFETY: three references, three places.
            unsafe { assert_eq!(fmi2GetReal(handle, [10, 11, 23].as_ptr(), 3, values.as_mut_ptr()), OK) };
            values
        };
        let before = read();
        // Not a number, a torque and a voltage beyond what the model takes, an output, a Boolean, a parameter, none.
        for (reference, value) in [(23, f64::NAN), (10, 1e9), (11, 1e9), (200, 1.0), (20, 1.0), (7, 0.01), (99, 0.0)] {
            let (references, values) = ([10, 11, 23, reference], [1.0, 40.0, 2.0, value]);
            // SAFETY: four references, four values.
            let status = unsafe { fmi2SetReal(handle, references.as_ptr(), 4, values.as_ptr()) };
            assert_eq!((status, read()), (ERROR, before), "{reference}");
        }
        // SAFETY: three references, three values.
        unsafe { assert_eq!(fmi2SetReal(handle, [10, 11, 23].as_ptr(), 3, [1.0, 40.0, 2.0].as_ptr()), OK) };
        assert_eq!(read(), [1.0, 40.0, 2.0]);
        fmi2FreeInstance(handle);
    }

    #[test]
    fn an_experiment_that_is_not_possible_says_what_is() {
        static SAID: Mutex<Vec<String>> = Mutex::new(Vec::new());
        unsafe extern "C" fn log(_: *mut c_void, _: FmiStatus, _: *const c_char, message: *const c_char) {
            // SAFETY: a text of the caller's.
            SAID.lock().unwrap().push(unsafe { CStr::from_ptr(message) }.to_string_lossy().into_owned());
        }
        let (_resources, uri, _) = resources();
        let folder = folder(uri.to_str().unwrap()).unwrap();
        let instance = crate::instance::Instance::new(folder.as_ref(), false).unwrap();
        let handle = held::add(held::LoggedInstance::new(instance, Log::new(null_mut(), Some(log))));
        assert_eq!(fmi2SetupExperiment(handle, 0, 0.0, f64::NAN, 0, 0.0), ERROR);
        assert_eq!(fmi2SetupExperiment(handle, 0, 0.0, 5.0, 1, 4.0), ERROR);
        assert_eq!(fmi2EnterInitializationMode(handle), OK);
        assert_eq!(fmi2SetupExperiment(handle, 0, 0.0, 0.0, 0, 0.0), ERROR);
        let said = std::mem::take(&mut *SAID.lock().unwrap());
        let expected = [
            "the start time is NaN s; expected a number of seconds",
            "the stop time is 4 s; expected the start time of 5 s or later",
            "fmi2SetupExperiment in the mode Initialization; expected [Instantiated]",
        ];
        assert_eq!(said, expected);
        fmi2FreeInstance(handle);
    }
}
