use crate::pdo::PdoNumber;

/// Some of the four PDOs of one direction, by position: a bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PdoSet(u8);

impl PdoSet {
    pub(super) const NONE: Self = Self(0);

    pub(super) const fn set(&mut self, position: usize, contained: bool) {
        let bit = 1 << position;
        self.0 = if contained { self.0 | bit } else { self.0 & !bit };
    }

    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    pub(super) const fn contains(self, position: usize) -> bool {
        self.0 >> position & 1 == 1
    }

    /// What is contained; nothing is left.
    pub(super) const fn take(&mut self) -> Self {
        core::mem::replace(self, Self::NONE)
    }

    /// The positions contained, ascending.
    #[inline]
    pub(super) fn iter(self) -> impl Iterator<Item = usize> {
        let mut rest = self.0;
        core::iter::from_fn(move || {
            let position = rest.trailing_zeros() as usize;
            rest &= rest.wrapping_sub(1);
            (position < PdoNumber::PREDEFINED).then_some(position)
        })
    }
}
