//! Frames as the Linux kernel has them: `struct can_frame` of 16 bytes and `struct canfd_frame` of 72.
//!
//! Source: the kernel's `include/uapi/linux/can.h`. Numbers are in the machine's own order of bytes.

use can::{CanId, Frame};

/// Bytes of a classical frame (`CAN_MTU`).
pub(super) const CLASSIC_LENGTH: usize = 16;

/// Bytes of an FD frame (`CANFD_MTU`).
pub(super) const FD_LENGTH: usize = 72;

const EXTENDED: u32 = 0x8000_0000;
const REMOTE: u32 = 0x4000_0000;
const ERROR: u32 = 0x2000_0000;
const EXTENDED_MASK: u32 = 0x1FFF_FFFF;
const STANDARD_MASK: u32 = 0x7FF;

/// Where the data begin, in both forms.
const DATA: usize = 8;

/// One message of the kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum KernelMessage {
    /// A classical frame.
    Frame(Frame),
    /// An error message: its class, and what stands behind it.
    Error { class: u32, data: [u8; 8] },
    /// An FD frame, of which only these are kept.
    Fd { id: CanId, length: u8 },
}

/// The message that `bytes` are; `None` if their length is that of neither form.
pub(super) fn parse(bytes: &[u8]) -> Option<KernelMessage> {
    let word = u32::from_ne_bytes(*bytes.first_chunk()?);
    let id = if word & EXTENDED != 0 {
        CanId::extended(word & EXTENDED_MASK)
    } else {
        CanId::standard((word & STANDARD_MASK) as u16)
    };
    match bytes.len() {
        FD_LENGTH => Some(KernelMessage::Fd { id, length: bytes[4] }),
        CLASSIC_LENGTH if word & ERROR != 0 => {
            Some(KernelMessage::Error { class: word & EXTENDED_MASK, data: *bytes.last_chunk()? })
        }
        CLASSIC_LENGTH => {
            let length = bytes[4].min(8);
            let data = &bytes[DATA..DATA + usize::from(length)];
            let frame = if word & REMOTE != 0 { Frame::remote(id, length) } else { Frame::new(id, data) };
            Some(KernelMessage::Frame(frame))
        }
        _ => None,
    }
}

/// The kernel's form of `frame`.
pub(super) fn emit(frame: &Frame) -> [u8; CLASSIC_LENGTH] {
    let extended = if frame.id().is_extended() { EXTENDED } else { 0 };
    let remote = if frame.is_remote() { REMOTE } else { 0 };
    let mut bytes = [0; CLASSIC_LENGTH];
    bytes[..4].copy_from_slice(&(frame.id().raw() | extended | remote).to_ne_bytes());
    bytes[4] = frame.dlc();
    bytes[DATA..DATA + frame.data().len()].copy_from_slice(frame.data());
    bytes
}

/// Identifier and mask (`struct can_filter`) of a filter for `id`: data and remote frames, of its form alone.
pub(super) fn filter(id: CanId) -> (u32, u32) {
    match id.as_standard() {
        Some(raw) => (u32::from(raw), EXTENDED | STANDARD_MASK),
        None => (id.raw() | EXTENDED, EXTENDED | EXTENDED_MASK),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    fn bytes(id: u32, length: u8, data: [u8; 8]) -> [u8; CLASSIC_LENGTH] {
        let mut bytes = [0; CLASSIC_LENGTH];
        bytes[..4].copy_from_slice(&id.to_ne_bytes());
        bytes[4] = length;
        bytes[8..].copy_from_slice(&data);
        bytes
    }

    /// What `linux/can.h` says of each.
    #[test]
    fn the_kernels_form_is_read_and_written() {
        let frame = |text: &str| KernelMessage::Frame(text.parse().unwrap());
        let data = [0x40, 0x41, 0x60, 0, 0, 0, 0, 0];
        for (id, length, expected) in [
            (0x604, 8, frame("604#4041600000000000")),
            (0x604, 3, frame("604#404160")),
            (0x8000_0604, 0, frame("00000604#")),
            (0x9FFF_FFFF, 1, frame("1FFFFFFF#40")),
            (0x2000_0088, 8, KernelMessage::Error { class: 0x88, data }),
        ] {
            let bytes = bytes(id, length, data);
            assert_eq!(parse(&bytes), Some(expected), "{id:08X}");
        }
        assert_eq!(parse(&bytes(0x4000_0184, 4, [0; 8])), Some(frame("184#R4")));
        assert_eq!(emit(&"184#R4".parse().unwrap()), bytes(0x4000_0184, 4, [0; 8]));
        assert_eq!(emit(&"00000604#40".parse().unwrap()), bytes(0x8000_0604, 1, [0x40, 0, 0, 0, 0, 0, 0, 0]));
        let mut fd = [0; FD_LENGTH];
        fd[..4].copy_from_slice(&0x123_u32.to_ne_bytes());
        fd[4] = 64;
        assert_eq!(parse(&fd), Some(KernelMessage::Fd { id: CanId::standard(0x123), length: 64 }));
    }

    /// As `Documentation/networking/can.rst`, 4.1.1, has it: a frame fits where `received & mask == filter & mask`.
    #[test]
    fn a_filter_fits_the_frames_of_its_identifier_and_form_alone() {
        let fits = |id: CanId, frame: &str| {
            let (value, mask) = filter(id);
            let received = u32::from_ne_bytes(*emit(&frame.parse().unwrap()).first_chunk().unwrap());
            received & mask == value & mask
        };
        let (standard, extended) = (CanId::standard(0x604), CanId::extended(0x604));
        assert!(fits(standard, "604#40") && fits(standard, "604#R"));
        assert!(!fits(standard, "605#40") && !fits(standard, "00000604#40"));
        assert!(fits(extended, "00000604#40") && fits(extended, "00000604#R"));
        assert!(!fits(extended, "604#40") && !fits(extended, "00000605#"));
    }

    #[test]
    fn what_is_written_is_read_and_nothing_else_panics() {
        let mut random = Random::new(29);
        for _ in 0..2_000 {
            let frame = random.frame();
            assert_eq!(parse(&emit(&frame)), Some(KernelMessage::Frame(frame)));
            let length = random.below(80);
            let noise: Vec<u8> = (0..length).map(|_| random.next() as u8).collect();
            assert_eq!(parse(&noise).is_some(), matches!(length, CLASSIC_LENGTH | FD_LENGTH));
        }
    }
}
