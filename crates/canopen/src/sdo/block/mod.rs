//! SDO block transfer (CiA 301, 7.2.4.3.9 to 7.2.4.3.16): up to 127 segments are confirmed by one frame, and what was lost of
//! them comes again.
//!
//! [`wire`] is the eight bytes, [`checksum`] the CRC over a value. `Sender` and `Receiver` are the two ends of the data,
//! whichever of them is client and server.

mod checksum;
mod invalid;
mod receiver;
mod sender;
pub mod wire;

pub use checksum::checksum;
pub(super) use invalid::Invalid;
pub(super) use receiver::Receiver;
pub(super) use sender::{Sender, Sent};

/// Most segments of a block.
pub const MAX_BLOCK_SIZE: u8 = 127;

/// The longest that the segment of a block takes on the wire: a frame of 130 bits at 10 kbit/s, the slowest bit rate of CiA 301. What
/// a sender hands out may wait for so long before the receiver has it.
pub(super) const SEGMENT_TIME_NS: u64 = 13_000_000;

/// Whether a block may have as many segments.
pub(super) const fn is_block_size(segments: u8) -> bool {
    matches!(segments, 1..=MAX_BLOCK_SIZE)
}
