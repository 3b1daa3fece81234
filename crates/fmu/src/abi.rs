//! The C functions of FMI 3.0 (`fmi3Functions.h`) and of FMI 2.0 (`fmi2Functions.h`), as an importer finds them in the library.
//!
//! An instance is a number to its importer, and a lock here: a pointer that was freed, or never was one, is an error and not a
//! crash. A panic ends the call with `fmi3Fatal`. What is read or written through pointers is checked for null and size; that
//! as much memory stands behind them as their counts say is the importer's word, as in every C interface.
#![allow(unsafe_code, reason = "a C interface: pointers come in and go out")]
#![allow(unreachable_pub, reason = "the library's symbols, not the crate's items")]
#![allow(clippy::missing_safety_doc, reason = "the standard's: pointers are valid for the counts beside them")]

mod fmi2;
mod held;
mod life;
mod states;
mod status;
mod unsupported;
mod values;

use std::ffi::{CStr, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::PoisonError;

use crate::call::{CallError, Called};
use held::{LoggedInstance, instance};
use status::{DEFECT, ERROR, FATAL, FmiStatus, OK};

/// Carries out a call on an instance; what goes wrong is reported to the importer's log. After a panic the instance is of no use
/// until it is reset.
fn call(handle: *mut c_void, work: impl FnOnce(&mut LoggedInstance) -> Called<()>) -> FmiStatus {
    carry_out(handle, |held| {
        if held.is_broken {
            return Err((FATAL, "an earlier call ended with Fatal; Reset makes the instance anew".to_owned()));
        }
        work(held).map_err(|error| (ERROR, error.to_string()))
    })
}

/// The same, also after a panic.
fn carry_out(
    handle: *mut c_void,
    work: impl FnOnce(&mut LoggedInstance) -> Result<(), (FmiStatus, String)>,
) -> FmiStatus {
    let Some(instance) = instance(handle) else { return ERROR };
    let (log, done) = {
        // No panic leaves this block: the lock is never poisoned.
        let mut held = instance.lock().unwrap_or_else(PoisonError::into_inner);
        let done = catch_unwind(AssertUnwindSafe(|| work(&mut held))).unwrap_or_else(|_| {
            held.is_broken = true;
            Err((FATAL, DEFECT.to_owned()))
        });
        (held.log.clone(), done)
    };
    // Without the lock: the importer may call in again.
    match done {
        Ok(()) => OK,
        Err((status, what)) => {
            log.say(status, &what);
            status
        }
    }
}

fn wrong<T>(what: impl Into<String>) -> Called<T> {
    Err(CallError(what.into()))
}

/// What stands behind a pointer of the importer's.
unsafe fn slice<'a, T>(pointer: *const T, count: usize) -> Called<&'a [T]> {
    check(pointer, count)?;
    // SAFETY: not null, aligned and of a possible size; valid by the importer's word.
    Ok(if count == 0 { &[] } else { unsafe { std::slice::from_raw_parts(pointer, count) } })
}

/// What an importer wants written.
unsafe fn slice_mut<'a, T>(pointer: *mut T, count: usize) -> Called<&'a mut [T]> {
    check(pointer, count)?;
    // SAFETY: as above.
    Ok(if count == 0 { &mut [] } else { unsafe { std::slice::from_raw_parts_mut(pointer, count) } })
}

fn check<T>(pointer: *const T, count: usize) -> Called<()> {
    let fits = count.checked_mul(size_of::<T>()).is_some_and(|bytes| bytes <= isize::MAX as usize);
    if count > 0 && (pointer.is_null() || !pointer.is_aligned() || !fits) {
        return wrong(format!("an array of {count} values has no place: its pointer is null, odd, or it is too large"));
    }
    Ok(())
}

/// Writes one result, unless the importer does not want it.
unsafe fn put<T>(pointer: *mut T, value: T) {
    if !pointer.is_null() && pointer.is_aligned() {
        // SAFETY: not null and aligned; valid by the importer's word.
        unsafe { pointer.write(value) };
    }
}

/// A text of the importer's; `None` for null and for what is not UTF-8.
unsafe fn text<'a>(pointer: *const c_char) -> Option<&'a str> {
    if pointer.is_null() {
        return None;
    }
    // SAFETY: not null; ends with a zero by the importer's word.
    unsafe { CStr::from_ptr(pointer) }.to_str().ok()
}

#[cfg(test)]
mod tests {
    use std::ptr::{null, null_mut};
    use std::sync::Mutex;

    use super::*;
    use crate::config::{BusConfig, Config, TxClock};
    use crate::instance::Instance;

    /// What was said, and by whom.
    static SAID: Mutex<Vec<(usize, FmiStatus, String)>> = Mutex::new(Vec::new());

    /// A log of an importer that reads time from the instance that has something to say.
    unsafe extern "C" fn log(place: *mut c_void, status: FmiStatus, category: *const c_char, message: *const c_char) {
        let mut time = [f64::NAN];
        // SAFETY: the place of the test's handle, which outlives the call; texts of the caller's.
        let (handle, message, category) =
            unsafe { (*place.cast::<*mut c_void>(), CStr::from_ptr(message), CStr::from_ptr(category)) };
        if !handle.is_null() {
            // SAFETY: one reference, one place.
            let read = unsafe { values::fmi3GetFloat64(handle, &crate::xml::TIME, 1, time.as_mut_ptr(), 1) };
            assert!(read == OK || read == FATAL);
        }
        let said = format!("{}: {}", category.to_string_lossy(), message.to_string_lossy());
        SAID.lock().unwrap().push((place as usize, status, said));
    }

    fn bus(place: &mut *mut c_void, message: status::LogMessage) {
        let config = BusConfig { nodes: 2, bitrate: 500_000, clock: TxClock::Countdown };
        let instance = Instance::of(Config::Bus(config), ".".as_ref(), false).unwrap();
        let log = held::Log::new(std::ptr::from_mut(place).cast(), message);
        *place = held::add(LoggedInstance::new(instance, log));
    }

    #[test]
    fn an_importer_may_call_in_from_its_log() {
        let mut handle = null_mut();
        bus(&mut handle, Some(log));
        assert_eq!(life::fmi3EnterStepMode(handle), ERROR);
        let place = &raw const handle as usize;
        let said = SAID.lock().unwrap();
        let (_, status, text) = said.iter().find(|(by, ..)| *by == place).unwrap();
        assert_eq!(*status, ERROR);
        assert!(text.starts_with("logStatusError: fmi3EnterStepMode in the mode Instantiated"), "{text}");
        drop(said);
        life::fmi3FreeInstance(handle);
    }

    #[test]
    fn after_a_panic_an_instance_answers_fatal_until_it_is_reset() {
        let mut handle = null_mut();
        bus(&mut handle, None);
        assert_eq!(call(handle, |_| panic!("a test's own")), FATAL);
        assert_eq!(life::fmi3EnterInitializationMode(handle, 0, 0.0, 0.0, 0, 0.0), FATAL);
        assert_eq!(life::fmi3Reset(handle), OK);
        assert_eq!(life::fmi3EnterInitializationMode(handle, 0, 0.0, 0.0, 0, 0.0), OK);
        life::fmi3FreeInstance(handle);
        assert_eq!(life::fmi3Reset(handle), ERROR);
    }

    #[test]
    fn a_panic_is_reported_as_fatal() {
        let mut handle = null_mut();
        bus(&mut handle, Some(report));
        assert_eq!(call(handle, |_| panic!("a test's own")), FATAL);
        // To free it does not fail.
        life::fmi2FreeInstance(handle);
        assert_eq!(*REPORTED.lock().unwrap(), [(FATAL, DEFECT.to_owned())]);
    }

    /// FMI 3.0, 2.2.4: fmi3Error is of a call that was not carried out; not of one that was by half.
    #[test]
    fn of_several_values_all_are_taken_or_none() {
        let mut handle = null_mut();
        bus(&mut handle, None);
        assert_eq!(life::fmi3EnterInitializationMode(handle, 0, 0.0, 0.0, 0, 0.0), OK);
        assert_eq!(life::fmi3ExitInitializationMode(handle), OK);
        let (data, sizes, mut size, mut read) = ([0x55; 4], [4, 4], [9], [null()]);
        // Tx_Data is an output, and Rx_Data is not a clock.
        let (references, values) = ([1001, 1003], [data.as_ptr(), data.as_ptr()]);
        // SAFETY: two references, sizes and values; one of each to be read; one place for a clock.
        unsafe {
            assert_eq!(
                values::fmi3SetBinary(handle, references.as_ptr(), 2, sizes.as_ptr(), values.as_ptr(), 2),
                ERROR
            );
            assert_eq!(values::fmi3GetBinary(handle, &1001, 1, size.as_mut_ptr(), read.as_mut_ptr(), 1), OK);
            assert_eq!(size, [0]);
            let mut ticks = [9];
            assert_eq!(values::fmi3SetClock(handle, [1002, 1001].as_ptr(), 2, [1, 1].as_ptr()), ERROR);
            assert_eq!(values::fmi3GetClock(handle, &1002, 1, ticks.as_mut_ptr()), OK);
            assert_eq!(ticks, [0]);
        }
        life::fmi3FreeInstance(handle);
    }

    static REPORTED: Mutex<Vec<(FmiStatus, String)>> = Mutex::new(Vec::new());

    unsafe extern "C" fn report(_: *mut c_void, status: FmiStatus, category: *const c_char, message: *const c_char) {
        // SAFETY: texts of the caller's.
        let (category, message) = unsafe { (CStr::from_ptr(category), CStr::from_ptr(message)) };
        assert_eq!(category, c"logStatusFatal");
        REPORTED.lock().unwrap().push((status, message.to_string_lossy().into_owned()));
    }

    #[test]
    fn a_state_of_another_instance_is_refused() {
        let (mut first, mut second) = (null_mut(), null_mut());
        bus(&mut first, None);
        bus(&mut second, None);
        let (mut of_first, mut of_second) = (null_mut(), null_mut());
        // SAFETY: a place for a pointer each.
        unsafe {
            assert_eq!(states::fmi3GetFMUState(first, &raw mut of_first), OK);
            assert_eq!(states::fmi3GetFMUState(second, &raw mut of_second), OK);
        }
        assert_eq!(states::fmi3SetFMUState(first, of_second), ERROR);
        assert_eq!(states::fmi3SetFMUState(second, of_first), ERROR);
        assert_eq!(states::fmi3SetFMUState(first, of_first), OK);
        life::fmi3FreeInstance(first);
        life::fmi3FreeInstance(second);
    }
}
