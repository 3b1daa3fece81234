//! CAN as plain data: classical CAN frames (ISO 11898-1), time and the passive-station contract.
//!
//! Nothing here does I/O, reads a clock or allocates. Every other crate of the project speaks in
//! these types: [`Frame`] is what a bus carries, [`Instant`] is when, [`Station`] is who.
//! CAN FD is deliberately absent: none of the drives has it.
//!
//! ```
//! use can::{CanId, Frame, Instant, Station};
//! use core::time::Duration;
//!
//! // Frames print and parse as candump has them, and know their length on the wire, every stuff bit included.
//! let enable: Frame = "604#2B40600006000000".parse()?;
//! assert_eq!((enable.id(), enable.data()[0]), (CanId::standard(0x604), 0x2B));
//! assert!(can::frame_bits(&enable) + can::INTERFRAME_SPACE_BITS <= 135);
//!
//! /// Sends SYNC every 10 ms.
//! struct Clock {
//!     next: Instant,
//!     is_due: bool,
//! }
//!
//! impl Station for Clock {
//!     fn handle_frame(&mut self, _: &Frame, _: Instant) {}
//!     fn handle_timeout(&mut self, now: Instant) {
//!         if now >= self.next {
//!             (self.is_due, self.next) = (true, self.next + Duration::from_millis(10));
//!         }
//!     }
//!     fn poll_transmit(&mut self) -> Option<Frame> {
//!         core::mem::take(&mut self.is_due).then(|| Frame::new(CanId::standard(0x80), &[]))
//!     }
//!     fn poll_timeout(&self) -> Option<Instant> {
//!         Some(self.next)
//!     }
//! }
//!
//! // The owner of a station decides what time it is. Here a second passes at once.
//! let mut clock = Clock { next: Instant::ZERO, is_due: false };
//! let mut sent = 0;
//! while let Some(next) = clock.poll_timeout().filter(|next| *next < Instant::from_secs(1)) {
//!     clock.handle_timeout(next);
//!     sent += core::iter::from_fn(|| clock.poll_transmit()).count();
//! }
//! assert_eq!(sent, 100);
//! # Ok::<(), can::ParseFrameError>(())
//! ```
#![no_std]

mod bitrate;
mod duration;
mod frame;
mod id;
mod instant;
mod length;
mod station;
mod tap;

pub use bitrate::Bitrate;
pub use duration::{DURATION_UNITS, ParseDurationError, parse_duration, parse_duration_in};
pub use frame::{Frame, FrameKind, MAX_DATA_LENGTH, ParseFrameError};
pub use id::CanId;
pub use instant::Instant;
pub use length::{ERROR_FRAME_BITS, INTERFRAME_SPACE_BITS, fewest_frame_bits, frame_bits, most_frame_bits};
pub use station::Station;
pub use tap::{BusFrame, Listen, Tap};
