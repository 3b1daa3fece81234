//! Frames out of raw bytes, most of them for the identifiers that matter.

use can::{CanId, Frame};

/// A frame out of ten bytes: the first picks one of `ids`, the second the kind and the length, which may be too short for
/// what is sent there; missing bytes are 0.
pub(super) fn selected_frame(chunk: &[u8], ids: &[u16]) -> Frame {
    let byte = |at: usize| chunk.get(at).copied().unwrap_or(0);
    let data: [u8; 8] = std::array::from_fn(|at| byte(at + 2));
    let id = CanId::standard(ids[usize::from(byte(0)) % ids.len()]);
    if byte(1) & 0x80 != 0 {
        return Frame::remote(id, byte(1) % 9);
    }
    Frame::new(id, &data[..usize::from(byte(1) % 9)])
}
