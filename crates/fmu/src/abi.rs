//! The C functions of FMI 3.0 (`fmi3Functions.h`), as an importer finds them in the library.
//!
//! An instance is a number to its importer, and a lock here: a pointer that was freed, or never was one, is an error and not a
//! crash. A panic ends the call with `fmi3Fatal`. What is read or written through pointers is checked for null and size; that
//! as much memory stands behind them as their counts say is the importer's word, as in every C interface.
#![allow(unsafe_code, reason = "a C interface: pointers come in and go out")]
#![allow(unreachable_pub, reason = "the library's symbols, not the crate's items")]
#![allow(clippy::missing_safety_doc, reason = "the standard's: pointers are valid for the counts beside them")]

mod held;
mod life;
mod status;
mod unsupported;
mod values;

use std::ffi::{CStr, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::PoisonError;

use crate::call::{CallError, Called};
use held::{Held, instance};
use status::{ERROR, FATAL, OK, Status};

/// What the importer reads of a panic.
const DEFECT: &str = "a defect of Ferrodrive; please report it with what was called";

/// Carries out a call on an instance; what goes wrong is reported to the importer's log. After a panic the instance is of no use
/// until it is reset.
fn call(handle: *mut c_void, work: impl FnOnce(&mut Held) -> Called<()>) -> Status {
    carry_out(handle, |held| {
        if held.is_broken {
            return Err((FATAL, "an earlier call ended with fmi3Fatal; fmi3Reset makes the instance anew".to_owned()));
        }
        work(held).map_err(|error| (ERROR, error.to_string()))
    })
}

/// The same, also after a panic.
fn carry_out(handle: *mut c_void, work: impl FnOnce(&mut Held) -> Result<(), (Status, String)>) -> Status {
    let Some(instance) = instance(handle) else { return ERROR };
    let (log, done) = {
        // No panic leaves this block: the lock is never poisoned.
        let mut held = instance.lock().unwrap_or_else(PoisonError::into_inner);
        let done = catch_unwind(AssertUnwindSafe(|| work(&mut held))).unwrap_or_else(|_| {
            held.is_broken = true;
            Err((FATAL, DEFECT.to_owned()))
        });
        (held.log, done)
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
