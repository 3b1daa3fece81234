//! Why rows make no table.

use core::fmt;

/// Why rows make no table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableError {
    /// The row at this position has the index and sub-index of the one before it, or smaller ones.
    NotAscending {
        /// From 0.
        position: usize,
    },
    /// More than [`MAX_ROWS`](super::MAX_ROWS).
    TooManyRows,
    /// The index is not as long as the rows.
    OtherLength,
    /// The values longer than a cell have 4 GiB or more.
    TooManyBytes,
}

impl fmt::Display for TableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotAscending { position } => {
                write!(f, "row {position} does not come after the one before it by index and sub-index")
            }
            Self::TooManyRows => write!(f, "more than {} rows", super::MAX_ROWS),
            Self::OtherLength => f.write_str("the index is not as long as the rows"),
            Self::TooManyBytes => f.write_str("strings and domains of 4 GiB or more"),
        }
    }
}

impl core::error::Error for TableError {}
