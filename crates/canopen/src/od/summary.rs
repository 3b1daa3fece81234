use super::Entry;

/// What every request must know of a row, in one byte: an upload needs no more of it, a download its [`Gate`](super::Gate)
/// too. Rows are wide; the summaries of a whole table take a few cache lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AccessBits(u8);

/// Bytes of a cell that the type leaves zero.
const UNUSED_BYTES: u8 = 0b11;
const LONG: u8 = 1 << 2;
const READABLE: u8 = 1 << 3;
const WRITABLE: u8 = 1 << 4;
const COMMUNICATION: u8 = 1 << 5;

impl AccessBits {
    /// Of no row: nothing is allowed.
    pub(super) const NONE: Self = Self(0);

    pub(super) const fn of(row: &Entry) -> Self {
        let is_long = !row.data_type.fits_cell();
        let unused = if is_long { 0 } else { MAX_SIZE - row.data_type.size() as u8 };
        Self(
            unused
                | flag(LONG, is_long)
                | flag(READABLE, row.access.is_readable())
                | flag(WRITABLE, row.access.is_writable() && (!is_long || row.stored_bytes() > 0))
                | flag(COMMUNICATION, row.is_communication()),
        )
    }

    /// Bytes on the wire of a number.
    #[inline]
    pub(crate) const fn size(self) -> u8 {
        MAX_SIZE - (self.0 & UNUSED_BYTES)
    }

    /// Not in a cell.
    #[inline]
    pub(crate) const fn is_long(self) -> bool {
        self.0 & LONG != 0
    }

    /// SDO upload is allowed.
    #[inline]
    pub(crate) const fn is_readable(self) -> bool {
        self.0 & READABLE != 0
    }

    /// SDO upload is allowed, of a cell.
    #[inline]
    pub(crate) const fn is_readable_cell(self) -> bool {
        self.0 & (READABLE | LONG) == READABLE
    }

    /// SDO download is allowed, to a cell.
    #[inline]
    pub(crate) const fn is_writable_cell(self) -> bool {
        self.0 & (WRITABLE | LONG) == WRITABLE
    }

    /// SDO download is allowed.
    #[inline]
    pub(crate) const fn is_writable(self) -> bool {
        self.0 & WRITABLE != 0
    }

    /// Of the communication profile area, or not in a cell: a write does more than store a cell.
    #[inline]
    pub(crate) const fn is_special(self) -> bool {
        self.0 & (COMMUNICATION | LONG) != 0
    }

    /// Of the communication profile area, 1000h to 1FFFh.
    #[inline]
    pub(crate) const fn is_communication(self) -> bool {
        self.0 & COMMUNICATION != 0
    }
}

/// Bytes of a cell.
const MAX_SIZE: u8 = 4;

const fn flag(bit: u8, set: bool) -> u8 {
    if set { bit } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::super::{Access, DataType};
    use super::*;

    #[test]
    fn a_summary_says_what_the_row_says() {
        for data_type in [DataType::Integer8, DataType::Unsigned16, DataType::Integer32] {
            for access in [Access::ReadOnly, Access::WriteOnly, Access::ReadWrite, Access::Const] {
                let row = Entry::new(0x2000, 0, data_type, access, "", "");
                let summary = AccessBits::of(&row);
                assert_eq!(usize::from(summary.size()), data_type.size());
                assert_eq!(summary.is_readable(), access.is_readable());
                assert_eq!(summary.is_writable(), access.is_writable());
                assert!(!summary.is_long() && !summary.is_communication());
            }
        }
    }

    #[test]
    fn a_constant_text_is_readable_only() {
        let summary = AccessBits::of(&Entry::new(0x1008, 0, DataType::VisibleString, Access::ReadWrite, "", ""));
        assert!(summary.is_long() && summary.is_communication() && summary.is_readable());
        assert!(!summary.is_writable());
    }
}
