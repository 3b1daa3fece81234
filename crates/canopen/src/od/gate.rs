use super::{AccessBits, Entry};

/// What a written value has to pass, resolved from the row at compile time: one subtraction, one comparison and one bit,
/// whatever the row's type, limits and list are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Gate {
    /// Which bits of a cell the type uses.
    mask: u32,
    /// The cell of the smallest value taken.
    low: u32,
    /// How many more there are above it. Counted modulo the type's width, so that signed types need no care.
    span: u32,
    /// Bit n: the value n above the smallest is listed. All set where nothing is listed.
    listed: u32,
}

impl Gate {
    /// Of no row: nothing passes.
    pub(super) const CLOSED: Self = Self { mask: u32::MAX, low: 0, span: 0, listed: 0 };

    /// The same, but nothing passes: the row itself has to be asked.
    pub(super) const fn closed(self) -> Self {
        Self { mask: self.mask, ..Self::CLOSED }
    }

    /// Closed, and the row itself has to be asked, where nothing may be written, of reals, and where a list's values lie too
    /// far apart for the bits. Limits that move with a resolution are those at 1, which are the narrowest: beyond them the row is
    /// asked.
    pub(super) const fn of(row: &Entry) -> Self {
        let mask = row.data_type.mask();
        let is_cell = row.data_type.is_integer() && row.data_type.fits_cell();
        if !AccessBits::of(row).is_writable() || !is_cell {
            return Self { mask, ..Self::CLOSED };
        }
        let (mut low, mut high) = row.data_type.range();
        if let Some((min, max)) = row.integer_limits() {
            low = if min > low { min } else { low };
            high = if max < high { max } else { high };
        }
        let (low, high, listed) = if row.values.is_empty() { (low, high, u32::MAX) } else { listed(row, low, high) };
        if low > high {
            return Self { mask, ..Self::CLOSED };
        }
        Self { mask, low: row.data_type.raw(low), span: (high - low) as u32, listed }
    }

    /// Of a value that is longer than a cell: no cell passes, and its `capacity` bytes stand at `offset`.
    pub(super) const fn of_long(offset: u32, capacity: u32) -> Self {
        Self { mask: 0, low: offset, span: capacity, listed: 0 }
    }

    /// Where the bytes of a value stand that is longer than a cell.
    pub(super) const fn long_place(&self) -> core::ops::Range<usize> {
        let start = self.low as usize;
        start..start + self.span as usize
    }

    /// Which bits of a cell the type uses; none where the value is longer.
    #[inline]
    pub(super) const fn mask(&self) -> u32 {
        self.mask
    }

    /// True if the row may be written and takes this cell. If not, the row knows why, or knows better.
    #[inline]
    pub(super) const fn admits(&self, cell: u32) -> bool {
        let above = cell.wrapping_sub(self.low) & self.mask;
        above <= self.span && self.listed.wrapping_shr(above) & 1 == 1
    }
}

/// The smallest and the largest of a row's listed values within `low` and `high`, and a bit for each of them above the
/// smallest. Nothing (a smallest above the largest) where there is none, or where they lie too far apart.
const fn listed(row: &Entry, low: i64, high: i64) -> (i64, i64, u32) {
    let (mut smallest, mut largest, mut i) = (i64::MAX, i64::MIN, 0);
    while i < row.values.len() {
        let value = row.values[i].0;
        if low <= value && value <= high {
            smallest = if value < smallest { value } else { smallest };
            largest = if value > largest { value } else { largest };
        }
        i += 1;
    }
    if smallest > largest || largest - smallest >= u32::BITS as i64 {
        return (1, 0, 0);
    }
    let mut bits = 0;
    i = 0;
    while i < row.values.len() {
        let value = row.values[i].0;
        if smallest <= value && value <= largest {
            bits |= 1 << (value - smallest);
        }
        i += 1;
    }
    (smallest, largest, bits)
}

#[cfg(test)]
mod tests {
    use super::super::{Access, DataType, ValueRange};
    use super::*;

    const TYPES: [DataType; 9] = [
        DataType::Boolean,
        DataType::Integer24,
        DataType::Unsigned24,
        DataType::Integer8,
        DataType::Integer16,
        DataType::Integer32,
        DataType::Unsigned8,
        DataType::Unsigned16,
        DataType::Unsigned32,
    ];

    /// Asks of every cell of a narrow type, and of those about every bound of a wide one.
    fn assert_agrees(row: &Entry, only_if_it_says_so: bool) {
        let (gate, mask) = (Gate::of(row), row.data_type.mask());
        let ends =
            [0, mask, mask / 2, 0x8000_0000, row.data_type.raw(row.integer_limits().map_or(0, |limits| limits.0))];
        let bounds = ends.into_iter().chain(row.integer_limits().map(|limits| row.data_type.raw(limits.1)));
        let near =
            bounds.flat_map(|bound| (0..200_u32).map(move |off| bound.wrapping_add(off).wrapping_sub(100) & mask));
        let narrow = if mask < 0x1_0000 { mask } else { 0 };
        for cell in (0..=narrow).chain(near) {
            let taken = row.check_value(row.data_type.value(cell)).is_ok();
            let said = gate.admits(cell);
            assert!(said == taken || (only_if_it_says_so && !said), "{:?} {cell:#X}: {said}", row.data_type);
        }
    }

    #[test]
    fn a_gate_admits_what_limits_and_lists_accept() {
        static LISTS: [&[(i64, &str)]; 5] =
            [&[], &[(0, ""), (1, ""), (3, ""), (4, "")], &[(7, "")], &[(-3, ""), (5, "")], &[(100, ""), (131, "")]];
        let limits = [None, Some((0, 100)), Some((-100, 100)), Some((3, 3)), Some((-1000, 1000)), Some((5, 4))];
        for data_type in TYPES {
            for values in LISTS {
                for limits in limits {
                    let mut row = Entry::new(0x2000, 0, data_type, Access::ReadWrite, "", "").values(values);
                    row.limits = limits.map(|(min, max)| ValueRange::Integer(min, max));
                    assert_agrees(&row, false);
                }
            }
        }
    }

    #[test]
    fn a_list_that_is_too_wide_for_the_bits_is_left_to_the_row() {
        let row = Entry::new(0x2000, 0, DataType::Integer16, Access::ReadWrite, "", "");
        let row = row.values(&[(0, ""), (32, ""), (-32768, "")]);
        assert!(!Gate::of(&row).admits(0) && row.check_value(0).is_ok());
        assert_agrees(&row, true);
    }

    #[test]
    fn nothing_passes_to_a_row_that_may_not_be_written() {
        for access in [Access::ReadOnly, Access::Const] {
            let gate = Gate::of(&Entry::new(0x2000, 0, DataType::Unsigned8, access, "", ""));
            assert!((0..=255).all(|cell| !gate.admits(cell)));
        }
    }
}
