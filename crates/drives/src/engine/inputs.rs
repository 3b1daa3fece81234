//! Digital inputs: debounce of `N` lines. What a line does is the drive's table of functions.
//!
//! The first look takes the levels as they are: a drive that starts knows of no level that a line could bounce from, and one
//! taken for low would be an active one where the polarity is reversed.

/// Debounced levels; bit *n* is input *n*.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs<const N: usize> {
    levels: u16,
    differs_for: [u16; N],
    seen: bool,
}

impl<const N: usize> Default for Inputs<N> {
    fn default() -> Self {
        Self { levels: 0, differs_for: [0; N], seen: false }
    }
}

impl<const N: usize> Inputs<N> {
    /// Takes in the raw levels, once each period; a change of a line counts once it has lasted `periods`.
    pub fn update(&mut self, raw: [bool; N], periods: u8) -> u16 {
        self.update_each(raw, [u16::from(periods); N])
    }

    /// The same with a debounce time of its own for each line.
    pub fn update_each(&mut self, raw: [bool; N], periods: [u16; N]) -> u16 {
        if !self.seen {
            self.seen = true;
            self.levels = raw.iter().rev().fold(0, |levels, level| levels << 1 | u16::from(*level));
        }
        for (n, (differs_for, periods)) in self.differs_for.iter_mut().zip(periods).enumerate() {
            if raw[n] == (self.levels >> n & 1 == 1) {
                *differs_for = 0;
                continue;
            }
            *differs_for = differs_for.saturating_add(1);
            if *differs_for >= periods {
                self.levels ^= 1 << n;
                *differs_for = 0;
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
        assert_eq!(inputs.update([false, false], 2), 0);
        assert_eq!(inputs.update([true, false], 2), 0);
        assert_eq!(inputs.update([false, false], 2), 0);
        assert_eq!(inputs.update([true, true], 2), 0);
        assert_eq!(inputs.update([true, true], 2), 0b11);
    }

    #[test]
    fn the_first_look_takes_the_levels_as_they_are() {
        for raw in [[false, true, false], [true, true, false], [false, false, true]] {
            let mut inputs = Inputs::<3>::default();
            let levels = inputs.update(raw, 20);
            assert_eq!([0, 1, 2].map(|n| levels >> n & 1 == 1), raw);
            assert_eq!(inputs.update([false; 3], 20), levels, "from then on a change has to last");
        }
    }

    #[test]
    fn a_bouncing_line_does_not_hold_up_its_neighbour() {
        let mut inputs = Inputs::<2>::default();
        inputs.update([false, false], 2);
        let levels = [true, false, true, false].map(|bounce| inputs.update_each([bounce, true], [2, 3]));
        assert_eq!(levels, [0, 0, 0b10, 0b10]);
    }
}
