//! How a host makes the present position the origin: two values of 260Ah, one after the other, which never stay there
//! ("M Robot Joint Motor CanOpen Manual", 5.04).

use super::assumptions::SET_ORIGIN;

/// 260Ah, and what was asked for by it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Origin {
    /// 260Ah without the two values.
    gear_numerator: u16,
    /// The first of them has been written.
    asked: bool,
    /// The encoder takes the present position as origin with the next control period.
    due: bool,
}

/// What a write to 260Ah was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OriginWrite {
    /// A numerator of the gear.
    Numerator,
    /// The first of the two values.
    First,
    /// The second, behind the first.
    Second,
}

impl Origin {
    pub(super) const fn new(gear_numerator: u16) -> Self {
        Self { gear_numerator, asked: false, due: false }
    }

    /// What stays in 260Ah.
    pub(super) const fn gear_numerator(&self) -> u16 {
        self.gear_numerator
    }

    pub(super) fn write(&mut self, value: u16) -> OriginWrite {
        let [first, second] = SET_ORIGIN;
        let armed = core::mem::replace(&mut self.asked, value == first);
        if value == first {
            return OriginWrite::First;
        }
        if armed && value == second {
            return OriginWrite::Second;
        }
        self.gear_numerator = value;
        OriginWrite::Numerator
    }

    pub(super) fn make(&mut self) {
        self.due = true;
    }

    pub(super) const fn is_due(&self) -> bool {
        self.due
    }

    /// The encoder is commanded now, if it is to be.
    pub(super) fn take(&mut self) -> bool {
        core::mem::take(&mut self.due)
    }
}
