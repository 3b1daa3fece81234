use crate::od::Storage;

/// Some of the PDOs of one direction, by position: a bit each.
#[derive(Clone)]
pub(super) struct PdoSet<S: Storage>(S::Words);

impl<S: Storage> PdoSet<S> {
    /// None of `count`.
    pub(super) fn none(count: usize) -> Self {
        Self(S::words(count))
    }

    #[inline]
    pub(super) fn set(&mut self, position: usize, contained: bool) {
        let (word, bit) = (&mut self.0.as_mut()[position / WORD], 1 << (position % WORD));
        *word = if contained { *word | bit } else { *word & !bit };
    }

    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.0.as_ref().iter().fold(0, |all, word| all | word) == 0
    }

    #[inline]
    pub(super) fn contains(&self, position: usize) -> bool {
        self.0.as_ref()[position / WORD] >> (position % WORD) & 1 == 1
    }

    /// Takes the one position that is contained, if no other is.
    #[inline(always)]
    pub(super) fn take_only(&mut self) -> Option<usize> {
        let mut words = self.0.as_mut().iter_mut().enumerate().filter(|(_, word)| **word != 0);
        let (number, word) = words.next()?;
        if !word.is_power_of_two() || words.next().is_some() {
            return None;
        }
        let position = number * WORD + word.trailing_zeros() as usize;
        *word = 0;
        Some(position)
    }

    /// Nothing is left.
    pub(super) fn clear(&mut self) {
        self.0.as_mut().fill(0);
    }

    /// The first position at `from` or behind it that is contained: a loop over a set may change it.
    #[inline]
    pub(super) fn next(&self, from: usize) -> Option<usize> {
        let words = self.0.as_ref();
        let mut number = from / WORD;
        let mut word = words.get(number)? & (u64::MAX << (from % WORD));
        loop {
            if word != 0 {
                return Some(number * WORD + word.trailing_zeros() as usize);
            }
            number += 1;
            word = *words.get(number)?;
        }
    }
}

/// Bits of a word.
const WORD: usize = u64::BITS as usize;
