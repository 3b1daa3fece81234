use core::fmt;
use core::time::Duration;

use crate::{AbortCode, Mux};

/// Why a transfer failed. It is over; the server was sent an abort where it may still be waiting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The server refused.
    Aborted {
        /// The entry.
        mux: Mux,
        /// Its reason.
        code: AbortCode,
    },
    /// No reply in time.
    TimedOut {
        /// The entry.
        mux: Mux,
    },
    /// A reply for another entry.
    WrongMux {
        /// The entry asked for.
        expected: Mux,
        /// The entry in the reply.
        received: Mux,
    },
    /// A reply that does not belong to the request.
    UnexpectedReply {
        /// The entry.
        mux: Mux,
        /// Its first byte.
        command: u8,
    },
    /// A segment came twice, or one was lost.
    ToggleBit {
        /// The entry.
        mux: Mux,
    },
    /// The value is longer than the buffer.
    BufferTooSmall {
        /// The entry.
        mux: Mux,
        /// Bytes needed, as far as known.
        needed: usize,
    },
    /// The server sent another number of bytes than it had declared.
    LengthMismatch {
        /// The entry.
        mux: Mux,
        /// Bytes declared.
        declared: usize,
        /// Bytes received.
        received: usize,
    },
    /// A segment without a byte said that more follow: such an upload need not end.
    EmptySegment {
        /// The entry.
        mux: Mux,
        /// Bytes received before it.
        received: usize,
    },
    /// A block of a number of segments that there is not.
    BlockSize {
        /// The entry.
        mux: Mux,
        /// What the server asked for.
        segments: u8,
    },
    /// A segment, or a confirmation of one, with a number that the block does not have.
    SequenceNumber {
        /// The entry.
        mux: Mux,
        /// The number.
        sequence: u8,
    },
    /// The bytes of a block upload are not those of which the server formed its checksum.
    Checksum {
        /// The entry.
        mux: Mux,
    },
    /// The server confirms block after block, and nothing new in any.
    Stalled {
        /// The entry.
        mux: Mux,
        /// Bytes confirmed before.
        confirmed: usize,
    },
    /// Each segment was in time, and yet the upload did not end.
    Endless {
        /// The entry.
        mux: Mux,
        /// Bytes received.
        received: usize,
        /// Time that it was given.
        limit: Duration,
    },
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Aborted { mux, code } => write!(f, "{mux}: the device aborted with {code}"),
            Self::TimedOut { mux } => write!(f, "{mux}: no reply from the device in time"),
            Self::WrongMux { expected, received } => write!(f, "{expected}: the reply was for {received}"),
            Self::UnexpectedReply { mux, command } => {
                write!(f, "{mux}: the reply {command:02X}h does not fit the request")
            }
            Self::ToggleBit { mux } => write!(f, "{mux}: a segment was repeated or lost (toggle bit)"),
            Self::BufferTooSmall { mux, needed } => write!(f, "{mux}: the value has at least {needed} bytes, too many"),
            Self::LengthMismatch { mux, declared, received } => {
                write!(f, "{mux}: {declared} bytes declared but {received} received")
            }
            Self::EmptySegment { mux, received } => {
                write!(f, "{mux}: after {received} bytes came a segment without data that announced more")
            }
            Self::BlockSize { mux, segments } => {
                write!(f, "{mux}: expected a block size of 1 to 127 segments, got {segments}")
            }
            Self::SequenceNumber { mux, sequence } => {
                write!(f, "{mux}: a block of segments does not have the number {sequence}")
            }
            Self::Checksum { mux } => write!(f, "{mux}: the checksum (CRC) is not that of the bytes received"),
            Self::Stalled { mux, confirmed } => {
                write!(
                    f,
                    "{mux}: {confirmed} bytes are confirmed, and the next ones are not taken however often they are sent"
                )
            }
            Self::Endless { mux, received, limit } => {
                write!(
                    f,
                    "{mux}: {received} bytes came in {} s and no end of them; a longer time-out allows for more",
                    limit.as_secs()
                )
            }
        }
    }
}

impl core::error::Error for Failure {}

impl Failure {
    /// What to report to the server; `None` where it has ended the transfer itself.
    pub(super) const fn abort_code(&self) -> Option<AbortCode> {
        match self {
            Self::Aborted { .. } => None,
            Self::TimedOut { .. } | Self::Endless { .. } => Some(AbortCode::TIMED_OUT),
            Self::WrongMux { .. } | Self::EmptySegment { .. } | Self::Stalled { .. } => Some(AbortCode::GENERAL),
            Self::UnexpectedReply { .. } => Some(AbortCode::UNKNOWN_COMMAND),
            Self::ToggleBit { .. } => Some(AbortCode::TOGGLE_BIT),
            Self::BufferTooSmall { .. } => Some(AbortCode::OUT_OF_MEMORY),
            Self::LengthMismatch { .. } => Some(AbortCode::LENGTH_MISMATCH),
            Self::BlockSize { .. } => Some(AbortCode::INVALID_BLOCK_SIZE),
            Self::SequenceNumber { .. } => Some(AbortCode::INVALID_SEQUENCE_NUMBER),
            Self::Checksum { .. } => Some(AbortCode::CRC_ERROR),
        }
    }
}
