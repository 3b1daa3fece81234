//! Frames as text and as bits on the wire.

use can::Frame;

pub(super) const TEXT_SAMPLES: &[&[u8]] = &[
    b"604#2B40600006000000",
    b"704#00",
    b"000#0104",
    b"1FFFFFFF#",
    b"080#",
    b"584#R",
    b"123#R8",
    b"7FF#0102030405060708",
];

pub(super) const LENGTH_SAMPLES: &[&[u8]] = &[b"\x04\x06\0\0\x2B\x40\x60\0\0\0\0\0", b"\0\0\0\0\0\0\0\0"];

/// Candump text: a frame that parses prints as text that parses to the same frame.
pub(super) fn text(data: &[u8]) {
    let Ok(text) = str::from_utf8(data) else { return };
    if let Ok(frame) = text.parse::<Frame>() {
        let printed = frame.to_string();
        assert_eq!(printed.parse::<Frame>(), Ok(frame), "{text:?} printed as {printed:?}");
        assert!(usize::from(frame.dlc()) <= can::MAX_DATA_LENGTH, "{text:?}");
    }
}

/// The length of a frame on the wire: at least the bare bits, at most one stuff bit for every four of them.
pub(super) fn length(data: &[u8]) {
    let Some((&[a, b, c, d], data)) = data.split_first_chunk::<4>() else { return };
    let raw = u32::from_le_bytes([a, b, c, d]);
    let id = if raw >> 31 == 0 {
        can::CanId::standard(u16::try_from(raw & 0x7FF).unwrap_or_default())
    } else {
        can::CanId::extended(raw & 0x1FFF_FFFF)
    };
    let data = &data[..data.len().min(can::MAX_DATA_LENGTH)];
    let frame = Frame::new(id, data);
    // ISO 11898-1: start bit to CRC is 34 bits and the data, 54 for an extended identifier; CRC delimiter,
    // acknowledge and end of frame are 10 more, which are not stuffed.
    let stuffable = if id.is_extended() { 54 } else { 34 } + 8 * u32::from(frame.dlc());
    let bare = stuffable + 10;
    let bits = can::frame_bits(&frame);
    assert!((bare..=bare + (stuffable - 1) / 4).contains(&bits), "{frame}: {bits} bits, bare {bare}");
}
