//! CAN as plain data: classical CAN frames (ISO 11898-1), time and the passive-station contract.
//!
//! Nothing here does I/O, reads a clock or allocates. Every other crate of the project speaks in
//! these types: [`Frame`] is what a bus carries, [`Instant`] is when, [`Station`] is who.
//! CAN FD is deliberately absent: none of the drives has it.
#![no_std]

mod bitrate;
mod frame;
mod id;
mod instant;
mod length;
mod station;

pub use bitrate::Bitrate;
pub use frame::{Frame, FrameKind, MAX_DATA_LENGTH, ParseFrameError};
pub use id::CanId;
pub use instant::Instant;
pub use length::{ERROR_FRAME_BITS, INTERFRAME_SPACE_BITS, frame_bits};
pub use station::Station;
