//! Frames between Python and a world: python-can's message as five plain values.

use can::{CanId, Frame};
use pyo3::prelude::*;

use crate::failure::bad_value;

/// A frame as it crosses the border: identifier, whether it has 29 bits, whether it is a remote frame, its length, its
/// bytes.
pub(crate) type Plain = (u32, bool, bool, u8, Vec<u8>);

/// The frame of these values.
pub(crate) fn frame((id, extended, remote, dlc, data): Plain) -> PyResult<Frame> {
    let most = if extended { CanId::MAX_EXTENDED } else { CanId::MAX_STANDARD.into() };
    if id > most {
        return Err(bad_value(format!("{id:X}h is not an identifier; expected 0 to {most:X}h")));
    }
    if data.len() > 8 || dlc > 8 {
        return Err(bad_value(format!(
            "{} bytes do not fit a frame of classical CAN; expected 0 to 8",
            data.len().max(dlc.into())
        )));
    }
    let id = if extended { CanId::extended(id) } else { CanId::standard(id as u16) };
    Ok(if remote { Frame::remote(id, dlc) } else { Frame::new(id, &data) })
}

/// The values of a frame.
pub(crate) fn plain(frame: &Frame) -> Plain {
    let id = frame.id();
    let data = if frame.is_remote() { Vec::new() } else { frame.data().to_vec() };
    (id.raw(), id.is_extended(), frame.is_remote(), frame.dlc(), data)
}
