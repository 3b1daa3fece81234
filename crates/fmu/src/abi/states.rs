//! States that are handed out and taken back: the same in both versions of FMI.

use std::ffi::c_void;

use super::status::FmiStatus;
use super::{call, put, slice, slice_mut, wrong};
use crate::state::SavedState;

/// The six functions of a version, by their names there.
macro_rules! states {
    ($get:ident, $set:ident, $free:ident, $size:ident, $serialize:ident, $deserialize:ident) => {
        #[doc = concat!("`", stringify!($get), "`: a state that was handed out before is written anew.")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(handle: *mut c_void, state: *mut *mut c_void) -> FmiStatus {
            call(handle, |held| {
                // SAFETY: a place for a pointer by the importer's word.
                let place = unsafe { slice_mut(state, 1)? };
                held.states.remove(&(place[0] as usize));
                let saved = SavedState::of(&held.instance)?;
                place[0] = held.keep(saved) as *mut c_void;
                Ok(())
            })
        }

        #[doc = concat!("`", stringify!($set), "`.")]
        #[unsafe(no_mangle)]
        pub extern "C" fn $set(handle: *mut c_void, state: *mut c_void) -> FmiStatus {
            call(handle, |held| match held.states.get(&(state as usize)) {
                Some(saved) => saved.restore(&mut held.instance),
                None => wrong("no state of this instance"),
            })
        }

        #[doc = concat!("`", stringify!($free), "`.")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $free(handle: *mut c_void, state: *mut *mut c_void) -> FmiStatus {
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

        #[doc = concat!("`", stringify!($size), "`.")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $size(handle: *mut c_void, state: *mut c_void, size: *mut usize) -> FmiStatus {
            call(handle, |held| {
                let Some(saved) = held.states.get(&(state as usize)) else { return wrong("no state of this instance") };
                // SAFETY: a place for a result by the importer's word.
                unsafe { put(size, saved.bytes()?.len()) };
                Ok(())
            })
        }

        #[doc = concat!("`", stringify!($serialize), "`.")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $serialize(
            handle: *mut c_void,
            state: *mut c_void,
            bytes: *mut u8,
            size: usize,
        ) -> FmiStatus {
            call(handle, |held| {
                let Some(saved) = held.states.get(&(state as usize)) else { return wrong("no state of this instance") };
                let written = saved.bytes()?;
                if written.len() > size {
                    return wrong(format!("the state has {} bytes, and there is room for {size}", written.len()));
                }
                // SAFETY: room for as many bytes by the importer's word.
                let room = unsafe { slice_mut(bytes, size)? };
                room[..written.len()].copy_from_slice(&written);
                Ok(())
            })
        }

        #[doc = concat!("`", stringify!($deserialize), "`.")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $deserialize(
            handle: *mut c_void,
            bytes: *const u8,
            size: usize,
            state: *mut *mut c_void,
        ) -> FmiStatus {
            call(handle, |held| {
                // SAFETY: as many bytes, and a place for a pointer, by the importer's word.
                let (bytes, place) = unsafe { (slice(bytes, size)?, slice_mut(state, 1)?) };
                let saved = SavedState::from_bytes(bytes, &held.instance)?;
                place[0] = held.keep(saved) as *mut c_void;
                Ok(())
            })
        }
    };
}

states!(
    fmi3GetFMUState,
    fmi3SetFMUState,
    fmi3FreeFMUState,
    fmi3SerializedFMUStateSize,
    fmi3SerializeFMUState,
    fmi3DeserializeFMUState
);
states!(
    fmi2GetFMUstate,
    fmi2SetFMUstate,
    fmi2FreeFMUstate,
    fmi2SerializedFMUstateSize,
    fmi2SerializeFMUstate,
    fmi2DeSerializeFMUstate
);
