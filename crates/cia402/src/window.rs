//! Windows with a time: when a target counts as reached, and when a following error counts. Source: CiA 402-2, objects
//! 6065h to 6068h (position), 606Dh and 606Eh (velocity reached), 606Fh and 6070h (standstill).
//!
//! Pure: what was is an argument, what is comes back. Time is in milliseconds, the unit of the objects; a caller with a
//! finer period gives fractions.

/// A window and the time that a value has to be in it, or outside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Window {
    /// Half its width, in user units; `u32::MAX` for one that is switched off.
    pub half_width: u32,
    /// The time, ms.
    pub time_ms: u16,
}

impl Window {
    /// The value of 6065h and 6067h that switches the function off.
    pub const OFF: u32 = u32::MAX;

    /// True unless the window is switched off.
    pub const fn is_on(self) -> bool {
        self.half_width != Self::OFF
    }

    /// True if a deviation of this size lies within. The border is within. A window that is off holds everything.
    pub const fn holds(self, deviation: i64) -> bool {
        !self.is_on() || deviation.unsigned_abs() <= self.half_width as u64
    }
}

/// How long a condition has held without a break.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dwell {
    /// It held at the last look.
    held: bool,
    /// Since the first look at which it held, at the last one.
    held_ms: f64,
}

impl Dwell {
    /// Takes in whether the condition holds now, `dt_ms` after the last time; true once it has held for `time_ms`.
    /// A time of 0 answers at once.
    pub fn update(&mut self, holds: bool, time_ms: u16, dt_ms: f64) -> bool {
        let since_ms = if self.held { self.held_ms + dt_ms } else { 0.0 };
        *self = Self { held: holds, held_ms: if holds { since_ms.min(LONGEST_MS) } else { 0.0 } };
        self.has_lasted(time_ms)
    }

    /// At the last look the condition had held for this long.
    pub fn has_lasted(&self, time_ms: u16) -> bool {
        self.held && self.held_ms + ROUNDING_MS >= f64::from(time_ms)
    }

    /// Nothing about it has changed since `earlier` but the time that it counts, and for a window of `time_ms` that decides nothing
    /// any more.
    pub fn is_as_decided_as(&self, earlier: &Self, time_ms: u16) -> bool {
        self.held == earlier.held && (!self.held || earlier.has_lasted(time_ms))
    }

    /// The condition has been for `looks` more times, `dt_ms` apart, as it was at the last one. The same as so many
    /// [updates](Self::update), to the last bit, if so many times `dt_ms` are a sum without rounding.
    pub fn last_on(&mut self, looks: u64, dt_ms: f64) {
        if self.held {
            self.held_ms = (self.held_ms + looks as f64 * dt_ms).min(LONGEST_MS);
        }
    }

    /// Forgets how long the condition has held: the time of the window starts at 0 again.
    pub fn restart(&mut self) {
        *self = Self::default();
    }
}

/// No time of an object is longer.
const LONGEST_MS: f64 = u16::MAX as f64 + 1.0;
/// Periods that add up to a whole time are not to fall short of it by rounding.
const ROUNDING_MS: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_border_is_within_and_a_window_that_is_off_holds_all() {
        let window = Window { half_width: 10, time_ms: 0 };
        assert!(window.holds(10) && window.holds(-10) && !window.holds(11) && !window.holds(-11));
        let off = Window { half_width: Window::OFF, time_ms: 0 };
        assert!(off.holds(i64::MAX) && off.holds(i64::MIN) && !off.is_on());
        assert!(Window::default().holds(0) && !Window::default().holds(1), "a window of 0 wants the exact value");
        assert!(!Window { half_width: Window::OFF - 1, time_ms: 0 }.holds(i64::from(u32::MAX)));
    }

    #[test]
    fn a_condition_counts_after_its_time_without_a_break() {
        // Five periods of 1 ms: true at the sixth look, 5 ms after the first.
        let mut dwell = Dwell::default();
        for look in 0..10 {
            assert_eq!(dwell.update(true, 5, 1.0), look >= 5, "look {look}");
        }
        assert!(!dwell.update(false, 5, 1.0));
        for look in 0..10 {
            assert_eq!(dwell.update(true, 5, 1.0), look >= 5, "look {look} after the break");
        }
    }

    #[test]
    fn periods_that_add_up_to_the_time_are_enough_whatever_their_length() {
        for parts in [1_u32, 3, 7, 20, 1000] {
            let mut dwell = Dwell::default();
            let dt_ms = 1.0 / f64::from(parts);
            let looks = (0..100 * parts).find(|_| dwell.update(true, 50, dt_ms)).unwrap();
            assert_eq!(looks, 50 * parts, "{parts} a millisecond");
        }
    }

    #[test]
    fn looks_that_are_left_out_count_as_those_that_are_made() {
        for (held, looks) in [(true, 0), (true, 1), (true, 999), (true, 1_000_000), (false, 7)] {
            let mut one_by_one = Dwell::default();
            one_by_one.update(held, 10, 0.5);
            let mut left_out = one_by_one;
            (0..looks).for_each(|_| _ = one_by_one.update(held, 10, 0.5));
            left_out.last_on(looks, 0.5);
            assert_eq!(left_out, one_by_one, "{held}, {looks}");
        }
        let mut dwell = Dwell::default();
        (0..=19).for_each(|_| _ = dwell.update(true, 10, 0.5));
        let before = dwell;
        dwell.update(true, 10, 0.5);
        assert!(!dwell.is_as_decided_as(&before, 10), "9.5 ms went over into 10");
        let before = dwell;
        dwell.update(true, 10, 0.5);
        assert!(dwell.is_as_decided_as(&before, 10) && !dwell.is_as_decided_as(&Dwell::default(), 10));
        assert!(Dwell::default().is_as_decided_as(&Dwell::default(), 10));
    }

    #[test]
    fn no_time_answers_at_once() {
        assert!(Dwell::default().update(true, 0, 1.0));
        assert!(!Dwell::default().update(false, 0, 1.0));
    }
}
