//! What one frame does in an SDO transfer, expedited, segmented or in blocks.

use canopen::{AbortCode, Mux};

/// Longest object that is put together; of a longer one the beginning is shown.
pub(super) const MAX_OBJECT: usize = 64 * 1024;

/// Who sent an SDO frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The master.
    Client,
    /// The device.
    Server,
}

/// What a frame does in an SDO transfer. Bytes are those of the whole object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SdoStep {
    /// The client asks for an object.
    Read(Mux),
    /// The object's value has come, in this frame or with this last segment.
    ReadDone(Mux, Vec<u8>),
    /// The client writes an object, or has sent its last segment.
    Write(Mux, Vec<u8>),
    /// The device has taken the value.
    WriteDone(Mux, Vec<u8>),
    /// A segmented transfer begins; the size is the sender's word.
    Begin(Mux, Option<u32>),
    /// A segment within a transfer, or its confirmation; bytes known so far.
    Segment(Mux, usize),
    /// One side gave up.
    Abort(Mux, AbortCode),
    /// A block transfer begins; the size is the sender's word.
    BlockBegin(Mux, Option<u32>),
    /// A segment of a block, counted from 1 within it; bytes known so far.
    BlockSegment(Mux, u8, usize),
    /// The receiver has the segments of a block up to this one; the sender repeats those behind it.
    BlockConfirmed(Mux, u8),
    /// The client may be sent the first block, or has taken the whole value.
    BlockAgreed(Mux),
    /// The value that was put together has another checksum than its sender said.
    BadChecksum {
        /// The object.
        mux: Mux,
        /// What the sender said.
        said: u16,
        /// That of the segments that were seen.
        found: u16,
    },
    /// A frame that belongs to no transfer that was seen to begin.
    Stray,
    /// A command specifier that the standard does not define.
    Other(u8),
}

impl SdoStep {
    /// The object that the frame is about, if that is known.
    pub const fn object(&self) -> Option<Mux> {
        match self {
            Self::Read(mux)
            | Self::ReadDone(mux, _)
            | Self::Write(mux, _)
            | Self::WriteDone(mux, _)
            | Self::Begin(mux, _)
            | Self::Segment(mux, _)
            | Self::BlockBegin(mux, _)
            | Self::BlockSegment(mux, ..)
            | Self::BlockConfirmed(mux, _)
            | Self::BlockAgreed(mux)
            | Self::BadChecksum { mux, .. }
            | Self::Abort(mux, _) => Some(*mux),
            Self::Stray | Self::Other(_) => None,
        }
    }

    /// True if the transfer is over with it, one way or the other.
    pub const fn is_end(&self) -> bool {
        matches!(self, Self::ReadDone(..) | Self::WriteDone(..) | Self::Abort(..) | Self::BadChecksum { .. })
    }

    /// A value that is known to be in the device now.
    pub(super) fn learned(&self) -> Option<(Mux, &[u8])> {
        match self {
            Self::ReadDone(mux, bytes) | Self::WriteDone(mux, bytes) => Some((*mux, bytes)),
            _ => None,
        }
    }
}
