use crate::AbortCode;

/// What is wrong with a segment, a confirmation or the end of the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::sdo) enum Invalid {
    /// A number that the block does not have.
    Sequence(u8),
    /// A block of so many segments.
    BlockSize(u8),
    /// Confirmation after confirmation, and nothing new in any.
    Stalled,
    /// More bytes, this many at least, than there is room for or were declared.
    TooLong(usize),
    /// The bytes are not those that the sender formed its checksum of.
    Checksum,
}

impl Invalid {
    /// As which it is reported to the other side.
    pub(in crate::sdo) const fn abort_code(self) -> AbortCode {
        match self {
            Self::Sequence(_) => AbortCode::INVALID_SEQUENCE_NUMBER,
            Self::BlockSize(_) => AbortCode::INVALID_BLOCK_SIZE,
            Self::Stalled => AbortCode::GENERAL,
            Self::TooLong(_) => AbortCode::TOO_LONG,
            Self::Checksum => AbortCode::CRC_ERROR,
        }
    }
}
