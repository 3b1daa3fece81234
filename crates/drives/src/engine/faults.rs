//! Faults of a drive: a const table, and what is present, confirmed and latched of it.
//!
//! A fault is a row of the drive's table. Its cause has to be present for its debounce time to be confirmed;
//! once confirmed the fault stays latched until a reset finds the cause gone.

pub use devices::faults::{FaultRow, error_register};

/// A set of faults: bit *n* is row *n* of the drive's table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaultSet(pub u32);

impl FaultSet {
    /// No fault.
    pub const NONE: Self = Self(0);

    /// The fault of one row.
    pub const fn row(row: usize) -> Self {
        Self(1 << row)
    }

    /// This set and, if `present`, one more row.
    #[must_use]
    pub const fn with(self, row: usize, present: bool) -> Self {
        Self(self.0 | (present as u32) << row)
    }

    /// True if there is none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// True if row `row` is in it.
    pub const fn has(self, row: usize) -> bool {
        self.0 >> row & 1 == 1
    }

    /// The rows in it, ascending.
    pub fn rows(self) -> impl Iterator<Item = usize> {
        let mut left = self.0;
        core::iter::from_fn(move || {
            let row = left.trailing_zeros();
            left &= left.wrapping_sub(1);
            (row < u32::BITS).then_some(row as usize)
        })
    }
}

/// True if a reading is above a limit. A reading that is not a number counts as above.
#[allow(clippy::neg_cmp_op_on_partial_ord, reason = "NaN is not at most anything")]
#[inline]
pub fn exceeds(value: f32, limit: f32) -> bool {
    !(value <= limit)
}

/// The same for a fault that, once latched, ends only `hysteresis` below the limit.
#[inline]
pub fn exceeds_with_hysteresis(value: f32, limit: f32, hysteresis: f32, latched: bool) -> bool {
    exceeds(value, if latched { limit - hysteresis } else { limit })
}

/// True if a reading is near its nominal value.
#[inline]
pub fn within(value: f32, nominal: f32, tolerance: f32) -> bool {
    (value - nominal).abs() <= tolerance
}

/// Debounce counters and the latch, for a table of `N` rows.
#[derive(Clone, Debug)]
pub struct FaultMonitor<const N: usize> {
    table: &'static [FaultRow; N],
    debounce: &'static [u16; N],
    present_for: [u16; N],
    present: FaultSet,
    latched: FaultSet,
}

/// Alike: the same counted and the same latched, of the same table.
impl<const N: usize> PartialEq for FaultMonitor<N> {
    fn eq(&self, other: &Self) -> bool {
        core::ptr::eq(self.table, other.table)
            && self.present_for == other.present_for
            && (self.present, self.latched) == (other.present, other.latched)
    }
}

impl<const N: usize> FaultMonitor<N> {
    /// Nothing present, nothing latched. `debounce` is how many supervision periods the cause of each row must last.
    pub const fn new(table: &'static [FaultRow; N], debounce: &'static [u16; N]) -> Self {
        Self { table, debounce, present_for: [0; N], present: FaultSet::NONE, latched: FaultSet::NONE }
    }

    /// Takes in which causes are present now, once each supervision period; returns what is newly latched.
    #[inline]
    pub fn observe(&mut self, present: FaultSet) -> FaultSet {
        self.observe_for(present, 1)
    }

    /// The same once in so many supervision periods.
    #[inline]
    pub fn observe_for(&mut self, present: FaultSet, periods: u16) -> FaultSet {
        if present.is_empty() && self.present.is_empty() {
            return FaultSet::NONE;
        }
        self.count(present, periods)
    }

    /// Latches a fault at once; true if it is new.
    pub fn raise(&mut self, row: usize) -> bool {
        let new = !self.latched.has(row);
        self.latched = self.latched.with(row, true);
        new
    }

    /// Forgets the faults whose cause is gone; true if none is left.
    pub fn reset(&mut self) -> bool {
        self.latched = FaultSet(self.latched.0 & self.present.0);
        self.latched.is_empty()
    }

    /// The cause of one fault has been taken away, and the fault clears itself; the others stay.
    pub fn release(&mut self, row: usize) {
        self.present = FaultSet(self.present.0 & !FaultSet::row(row).0);
        self.latched = FaultSet(self.latched.0 & !FaultSet::row(row).0);
    }

    /// The cause of one fault has been taken away; true if the fault was latched.
    pub fn forget(&mut self, row: usize) -> bool {
        self.present = FaultSet(self.present.0 & !FaultSet::row(row).0);
        self.latched.has(row)
    }

    /// A row of the table.
    pub const fn row(&self, row: usize) -> &'static FaultRow {
        &self.table[row]
    }

    /// The latched faults.
    pub const fn latched(&self) -> FaultSet {
        self.latched
    }

    /// The causes present at the last observation.
    pub const fn present(&self) -> FaultSet {
        self.present
    }

    /// The codes of all latched faults, or-ed: for drives whose fault code is a bit field.
    pub fn code_bits(&self) -> u16 {
        self.latched.rows().fold(0, |bits, row| bits | self.table[row].code)
    }

    /// The error register 1001h: the bits of all latched faults, and bit 0 when there is any.
    pub fn error_register(&self) -> u8 {
        let generic = if self.latched.is_empty() { 0 } else { error_register::GENERIC };
        self.latched.rows().fold(generic, |bits, row| bits | self.table[row].error_register)
    }

    fn count(&mut self, present: FaultSet, periods: u16) -> FaultSet {
        let mut new = FaultSet::NONE;
        for (row, debounce) in self.debounce.iter().enumerate() {
            let lasts = &mut self.present_for[row];
            *lasts = if present.has(row) { lasts.saturating_add(periods) } else { 0 };
            let confirmed = *lasts > 0 && *lasts >= *debounce;
            new = new.with(row, confirmed && !self.latched.has(row));
        }
        self.present = present;
        self.latched = FaultSet(self.latched.0 | new.0);
        new
    }
}

/// The debounce times of a table of `N` faults, in supervision periods: those named by their rows, and 1 for all others.
pub(crate) const fn debounces<const N: usize>(named: &[(usize, u16)]) -> [u16; N] {
    let mut all = [1; N];
    let mut i = 0;
    while i < named.len() {
        all[named[i].0] = named[i].1;
        i += 1;
    }
    all
}
