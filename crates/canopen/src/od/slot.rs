//! The numbers of rows in a table.

/// Most rows of a table: one number does not stand for a row.
pub const MAX_ROWS: usize = u16::MAX as usize;

/// The number of a row in its table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Slot(u16);

impl Slot {
    /// The row at a position that a table has.
    pub(crate) const fn at(position: usize) -> Self {
        Self(position as u16)
    }

    /// The row's position, from 0.
    pub const fn position(self) -> usize {
        self.0 as usize
    }
}
