//! Variables and clocks, by type.

use std::ffi::{c_char, c_void};

use super::status::FmiStatus;
use super::{call, slice, slice_mut, wrong};
use crate::call::Called;
use crate::instance::Interval;
use crate::variable::Value;

/// Values and references are as many, as no variable here is an array.
fn check_counts(references: usize, values: usize) -> Called<()> {
    if references == values {
        return Ok(());
    }
    wrong(format!("{references} variables and {values} values; each variable has one value"))
}

/// Reads variables of one type into `values`.
pub(super) unsafe fn read<T>(
    handle: *mut c_void,
    references: (*const u32, usize),
    values: (*mut T, usize),
    take: impl Fn(Value) -> Option<T>,
    kind_of: fn(&Value) -> &'static str,
) -> FmiStatus {
    call(handle, |held| {
        check_counts(references.1, values.1)?;
        // SAFETY: arrays of these counts by the importer's word.
        let (references, values) = unsafe { (slice(references.0, references.1)?, slice_mut(values.0, values.1)?) };
        for (reference, place) in references.iter().zip(values) {
            let value = held.instance.get(*reference)?;
            let kind = kind_of(&value);
            let Some(value) = take(value) else { return wrong(format!("variable {reference} is of type {kind}")) };
            *place = value;
        }
        Ok(())
    })
}

/// Writes variables of one type: all of them or, if one is refused, none.
pub(super) unsafe fn write<T: Copy>(
    handle: *mut c_void,
    references: (*const u32, usize),
    values: (*const T, usize),
    give: impl Fn(T) -> Called<Value>,
) -> FmiStatus {
    call(handle, |held| {
        check_counts(references.1, values.1)?;
        // SAFETY: arrays of these counts by the importer's word.
        let (references, values) = unsafe { (slice(references.0, references.1)?, slice(values.0, values.1)?) };
        let pairs = references.iter().zip(values);
        if references.len() > 1 {
            pairs.clone().try_for_each(|(reference, value)| held.instance.check(*reference, &give(*value)?))?;
        }
        pairs.clone().try_for_each(|(reference, value)| held.instance.set(*reference, give(*value)?))
    })
}

/// The two functions of a type that variables have.
macro_rules! of_type {
    ($get:ident, $set:ident, $c:ty, $kind:ident) => {
        #[doc = concat!("`", stringify!($get), "`.")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(
            h: *mut c_void,
            vr: *const u32,
            nvr: usize,
            values: *mut $c,
            n: usize,
        ) -> FmiStatus {
            // SAFETY: handed on as it came.
            unsafe {
                read(
                    h,
                    (vr, nvr),
                    (values, n),
                    |value| if let Value::$kind(it) = value { Some(it) } else { None },
                    Value::type_name,
                )
            }
        }

        #[doc = concat!("`", stringify!($set), "`.")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(
            h: *mut c_void,
            vr: *const u32,
            nvr: usize,
            values: *const $c,
            n: usize,
        ) -> FmiStatus {
            // SAFETY: handed on as it came.
            unsafe { write(h, (vr, nvr), (values, n), |value| Ok(Value::$kind(value))) }
        }
    };
}

of_type!(fmi3GetFloat64, fmi3SetFloat64, f64, Float64);
of_type!(fmi3GetInt64, fmi3SetInt64, i64, Int64);
of_type!(fmi3GetUInt8, fmi3SetUInt8, u8, UInt8);
of_type!(fmi3GetUInt16, fmi3SetUInt16, u16, UInt16);
of_type!(fmi3GetUInt32, fmi3SetUInt32, u32, UInt32);
of_type!(fmi3GetUInt64, fmi3SetUInt64, u64, UInt64);

/// The two functions of a type that no variable has.
macro_rules! of_no_variable {
    ($get:ident, $set:ident, $c:ty) => {
        #[doc = concat!("`", stringify!($get), "`: no variable has this type.")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(
            h: *mut c_void,
            vr: *const u32,
            nvr: usize,
            values: *mut $c,
            n: usize,
        ) -> FmiStatus {
            // SAFETY: handed on as it came.
            unsafe { read(h, (vr, nvr), (values, n), |_| None, Value::type_name) }
        }

        #[doc = concat!("`", stringify!($set), "`: no variable has this type.")]
        #[unsafe(no_mangle)]
        pub extern "C" fn $set(
            h: *mut c_void,
            _vr: *const u32,
            nvr: usize,
            _values: *const $c,
            _n: usize,
        ) -> FmiStatus {
            call(h, |_| if nvr == 0 { Ok(()) } else { wrong(concat!("no variable for ", stringify!($set))) })
        }
    };
}

of_no_variable!(fmi3GetFloat32, fmi3SetFloat32, f32);
of_no_variable!(fmi3GetInt8, fmi3SetInt8, i8);
of_no_variable!(fmi3GetInt16, fmi3SetInt16, i16);
of_no_variable!(fmi3GetInt32, fmi3SetInt32, i32);
of_no_variable!(fmi3GetString, fmi3SetString, *const c_char);

/// `fmi3GetBoolean`. A `bool` of C is a byte here, so that any byte of an importer's is a value.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetBoolean(
    h: *mut c_void,
    vr: *const u32,
    nvr: usize,
    values: *mut u8,
    n: usize,
) -> FmiStatus {
    let take = |value| if let Value::Boolean(it) = value { Some(u8::from(it)) } else { None };
    // SAFETY: handed on as it came.
    unsafe { read(h, (vr, nvr), (values, n), take, Value::type_name) }
}

/// `fmi3SetBoolean`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetBoolean(
    h: *mut c_void,
    vr: *const u32,
    nvr: usize,
    values: *const u8,
    n: usize,
) -> FmiStatus {
    // SAFETY: handed on as it came.
    unsafe { write(h, (vr, nvr), (values, n), |value| Ok(Value::Boolean(value != 0))) }
}

/// `fmi3GetBinary`: what is handed out lives until the next call that changes the instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetBinary(
    handle: *mut c_void,
    references: *const u32,
    count: usize,
    sizes: *mut usize,
    values: *mut *const u8,
    value_count: usize,
) -> FmiStatus {
    call(handle, |held| {
        check_counts(count, value_count)?;
        // SAFETY: arrays of these counts by the importer's word.
        let references = unsafe { slice(references, count)? };
        // SAFETY: as above.
        let (sizes, values) = unsafe { (slice_mut(sizes, value_count)?, slice_mut(values, value_count)?) };
        for ((reference, size), value) in references.iter().zip(sizes).zip(values) {
            let Some(bytes) = held.instance.sent(*reference) else {
                return wrong(format!("variable {reference} is not a Binary"));
            };
            (*size, *value) = (bytes.len(), bytes.as_ptr());
        }
        Ok(())
    })
}

/// `fmi3SetBinary`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetBinary(
    handle: *mut c_void,
    references: *const u32,
    count: usize,
    sizes: *const usize,
    values: *const *const u8,
    value_count: usize,
) -> FmiStatus {
    call(handle, |held| {
        check_counts(count, value_count)?;
        // SAFETY: arrays of these counts by the importer's word.
        let references = unsafe { slice(references, count)? };
        // SAFETY: as above.
        let (sizes, values) = unsafe { (slice(sizes, value_count)?, slice(values, value_count)?) };
        let given = references.iter().zip(sizes.iter().zip(values)).map(|(reference, (size, value))| {
            // SAFETY: as many bytes by the importer's word.
            let value = Value::Binary(unsafe { slice(*value, *size)? }.to_vec());
            held.instance.check(*reference, &value)?;
            Ok((*reference, value))
        });
        let given = given.collect::<Called<Vec<_>>>()?;
        given.into_iter().try_for_each(|(reference, value)| held.instance.set(reference, value))
    })
}

/// `fmi3GetClock`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetClock(
    h: *mut c_void,
    references: *const u32,
    count: usize,
    values: *mut u8,
) -> FmiStatus {
    call(h, |held| {
        // SAFETY: arrays of this count by the importer's word.
        let (references, values) = unsafe { (slice(references, count)?, slice_mut(values, count)?) };
        for (reference, place) in references.iter().zip(values) {
            *place = held.instance.clock(*reference)?.into();
        }
        Ok(())
    })
}

/// `fmi3SetClock`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetClock(
    h: *mut c_void,
    references: *const u32,
    count: usize,
    values: *const u8,
) -> FmiStatus {
    call(h, |held| {
        // SAFETY: arrays of this count by the importer's word.
        let (references, values) = unsafe { (slice(references, count)?, slice(values, count)?) };
        references.iter().try_for_each(|reference| held.instance.may_tick(*reference).map(drop))?;
        let mut pairs = references.iter().zip(values);
        pairs.try_for_each(|(reference, ticks)| held.instance.set_clock(*reference, *ticks != 0))
    })
}

/// `fmi3IntervalQualifier`, and the interval in ns.
fn qualified(interval: Interval) -> (i32, u64) {
    match interval {
        Interval::NotKnown => (0, 0),
        Interval::In(nanos) => (2, nanos),
    }
}

/// `fmi3GetIntervalDecimal`, in seconds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetIntervalDecimal(
    handle: *mut c_void,
    references: *const u32,
    count: usize,
    intervals: *mut f64,
    qualifiers: *mut i32,
) -> FmiStatus {
    call(handle, |held| {
        // SAFETY: arrays of this count by the importer's word.
        let references = unsafe { slice(references, count)? };
        // SAFETY: as above.
        let (intervals, qualifiers) = unsafe { (slice_mut(intervals, count)?, slice_mut(qualifiers, count)?) };
        for ((reference, interval), qualifier) in references.iter().zip(intervals).zip(qualifiers) {
            let (is, nanos) = qualified(held.instance.interval(*reference)?);
            (*qualifier, *interval) = (is, nanos as f64 / 1e9);
        }
        Ok(())
    })
}

/// `fmi3GetIntervalFraction`, in nanoseconds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetIntervalFraction(
    handle: *mut c_void,
    references: *const u32,
    count: usize,
    counters: *mut u64,
    resolutions: *mut u64,
    qualifiers: *mut i32,
) -> FmiStatus {
    call(handle, |held| {
        // SAFETY: arrays of this count by the importer's word.
        let (references, counters) = unsafe { (slice(references, count)?, slice_mut(counters, count)?) };
        // SAFETY: as above.
        let (resolutions, qualifiers) = unsafe { (slice_mut(resolutions, count)?, slice_mut(qualifiers, count)?) };
        let places = counters.iter_mut().zip(resolutions).zip(qualifiers);
        for (reference, ((counter, resolution), qualifier)) in references.iter().zip(places) {
            (*qualifier, *counter) = qualified(held.instance.interval(*reference)?);
            *resolution = 1_000_000_000;
        }
        Ok(())
    })
}
