//! In which control period what is done: supervision, and the time base of the interpolation (mode 7).

use super::assumptions::{INTERPOLATION_PERIODS, SUPERVISION_DIVIDER};

/// Control periods and supervision periods, counted.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Rhythm {
    periods: u8,
    /// Supervision periods in the present 2 ms.
    base_periods: u8,
}

impl Rhythm {
    /// Once each tick: true in each that ends so many.
    #[inline]
    pub(super) fn is_supervision_due(&mut self, divider: u8) -> bool {
        self.periods += 1;
        let due = self.periods >= divider;
        if due {
            self.periods = 0;
        }
        due
    }

    /// Once each supervision period of an interpolation: true when its time base begins anew.
    pub(super) fn is_base_over(&mut self) -> bool {
        self.base_periods = (self.base_periods + 1) % INTERPOLATION_PERIODS;
        self.base_periods == 0
    }

    /// SYNC starts the time base over. On the way a SYNC that comes a control period early or late does not move the loops.
    /// From rest all axes begin in the next control period, wherever in their own rhythm they are.
    pub(super) fn synchronise(&mut self, at_rest: bool) {
        self.base_periods = 0;
        if at_rest || (1..SUPERVISION_DIVIDER - 1).contains(&self.periods) {
            self.periods = SUPERVISION_DIVIDER - 1;
        }
    }
}
