//! What a download has to pass besides its row: conditions of the firmware, by slot.

use super::{MAX_ROWS, Slot, View};
use crate::AbortCode;

/// What must hold for a download besides type, access and range: sees all values, refuses with an abort code.
///
/// The second argument is the raw cell to be written. Nothing is stored when the check fails.
pub type Check = fn(&View<'_>, u32) -> Result<(), AbortCode>;

/// A condition on downloads to one object.
#[derive(Clone, Copy, Debug)]
pub enum Condition {
    /// This function must agree.
    Check(Check),
    /// The value that is there is taken; to any other this function must agree.
    Change(Check),
    /// The application is asked, and may take its time: [`NodeEvent::Asked`](crate::NodeEvent::Asked). SDO only; what an RPDO
    /// brings is not asked about.
    Ask,
}

/// Why a peer's value is not stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// The application has to be asked; all else is in order.
    Ask,
    /// For this reason.
    Abort(AbortCode),
}

impl From<AbortCode> for Refusal {
    fn from(code: AbortCode) -> Self {
        Self::Abort(code)
    }
}

impl Refusal {
    /// The same where the owner is not asked.
    #[inline(always)]
    pub(super) fn unasked(result: Result<(), Self>) -> Result<(), AbortCode> {
        match result {
            Ok(()) | Err(Self::Ask) => Ok(()),
            Err(Self::Abort(code)) => Err(code),
        }
    }
}

/// The conditions of a firmware on downloads to its objects. Built at compile time, so that a download finds its own
/// with one access:
///
/// ```
/// use canopen::AbortCode;
/// use canopen::od::{Access, Condition, Conditions, DataType, Entry, Index, Slot, Table, View, condition_numbers};
///
/// static ROWS: [Entry; 1] = [Entry::new(0x2000, 0, DataType::Unsigned8, Access::ReadWrite, "even_number", "")];
/// static INDEX: Index<1> = Index::of(&ROWS);
/// static TABLE: Table = Table::new(&ROWS, &INDEX);
///
/// fn even(_: &View<'_>, raw: u32) -> Result<(), AbortCode> {
///     if raw % 2 == 0 { Ok(()) } else { Err(AbortCode::INVALID_VALUE) }
/// }
/// static LIST: [(Slot, Condition); 1] = [(TABLE.slot(0x2000, 0), Condition::Check(even))];
/// static NUMBERS: [u16; 1] = condition_numbers(&LIST);
/// static CONDITIONS: Conditions = Conditions::new(&LIST, &NUMBERS);
/// ```
#[derive(Debug)]
pub struct Conditions {
    list: &'static [(Slot, Condition)],
    /// By slot: 0 for none, else one more than the place in the list.
    numbers: &'static [u16],
}

impl Conditions {
    /// No object has one.
    pub const NONE: &'static Self = &Self { list: &[], numbers: &[] };

    /// The conditions of `list`, with `numbers` = [`condition_numbers`]`(list)`.
    pub const fn new(list: &'static [(Slot, Condition)], numbers: &'static [u16]) -> Self {
        Self { list, numbers }
    }

    /// By slot: 0 where there is no condition.
    #[inline(always)]
    pub(super) const fn numbers(&self) -> &'static [u16] {
        self.numbers
    }

    /// The condition of a number, and whose it is.
    #[inline(always)]
    pub(super) fn numbered(&self, number: u16) -> Option<(Slot, Condition)> {
        self.list.get(usize::from(number).wrapping_sub(1)).copied()
    }

    /// The condition on writes to a row, if there is one.
    pub(super) fn of(&self, slot: Slot) -> Option<Condition> {
        self.numbered(*self.numbers.get(slot.position())?).map(|(_, condition)| condition)
    }
}

/// Where in `list` the condition of each of `N` rows stands; for a `static` beside the list.
///
/// # Panics
/// At compile time if a row is named twice.
pub const fn condition_numbers<const N: usize>(list: &[(Slot, Condition)]) -> [u16; N] {
    const { assert!(N <= MAX_ROWS, "each row may have a condition, and each condition has a number") };
    let mut numbers = [0; N];
    let mut i = 0;
    while i < list.len() {
        let position = list[i].0.position();
        assert!(numbers[position] == 0, "two conditions on one object");
        numbers[position] = i as u16 + 1;
        i += 1;
    }
    numbers
}
