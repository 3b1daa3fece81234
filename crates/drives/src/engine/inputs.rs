//! Digital inputs: debounce of `N` lines. What a line does is the drive's table of functions.

/// Debounced levels; bit *n* is input *n*.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inputs<const N: usize> {
    levels: u16,
    differs_for: u8,
}

impl<const N: usize> Inputs<N> {
    /// Takes in the raw levels, once each period; a change counts once it has lasted `periods`.
    pub fn update(&mut self, raw: [bool; N], periods: u8) -> u16 {
        let raw = raw.iter().enumerate().fold(0, |bits, (n, level)| bits | u16::from(*level) << n);
        if raw == self.levels {
            self.differs_for = 0;
        } else {
            self.differs_for = self.differs_for.saturating_add(1);
            if self.differs_for >= periods {
                (self.levels, self.differs_for) = (raw, 0);
            }
        }
        self.levels
    }

    /// The debounced levels.
    pub const fn levels(&self) -> u16 {
        self.levels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_counts_once_it_has_lasted() {
        let mut inputs = Inputs::<2>::default();
        assert_eq!(inputs.update([true, false], 2), 0);
        assert_eq!(inputs.update([false, false], 2), 0);
        assert_eq!(inputs.update([true, true], 2), 0);
        assert_eq!(inputs.update([true, true], 2), 0b11);
    }
}
