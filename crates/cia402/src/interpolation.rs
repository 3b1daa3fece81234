//! Interpolated position: how set-points become a path, objects 60C0h to 60C4h. Source: CiA 402-2, interpolated position
//! mode.

/// Interpolation sub mode, object 60C0h. Open: makers have modes of their own below 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct InterpolationSubMode(pub i16);

impl InterpolationSubMode {
    /// Straight from set-point to set-point.
    pub const LINEAR: Self = Self(0);
    /// Cubic spline. The number is a maker's, and common (CiA 402-2 leaves -1 downwards to makers).
    pub const CUBIC: Self = Self(-1);
}

/// Interpolation time period, object 60C2h: `value * 10^index` seconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InterpolationPeriod {
    /// 60C2h:01.
    pub value: u8,
    /// 60C2h:02, -128 to 63.
    pub index: i8,
}

impl Default for InterpolationPeriod {
    /// The standard's default: 1 * 10^-3 s.
    fn default() -> Self {
        Self { value: 1, index: -3 }
    }
}

impl InterpolationPeriod {
    /// In nanoseconds; `None` if it is invalid or out of range (or not whole: below a nanosecond).
    pub const fn nanos(self) -> Option<u64> {
        let exponent = self.index as i32 + 9;
        if self.value == 0 || exponent < 0 || exponent > 18 {
            return None;
        }
        (self.value as u64).checked_mul(10_u64.pow(exponent as u32))
    }
}

/// What interpolation data configuration, object 60C4h, allows: a queue of set-points or one that is overwritten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferOrganisation {
    /// 60C4h:03 = 0: first in, first out.
    Fifo,
    /// 60C4h:03 = 1: a ring that a position of its own points into.
    Ring,
}

impl BufferOrganisation {
    /// By the value of 60C4h:03; `None` for reserved values.
    pub const fn of(value: u8) -> Option<Self> {
        match value {
            0 => Some(Self::Fifo),
            1 => Some(Self::Ring),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_period_is_value_times_ten_to_the_index() {
        let nanos = |value, index| InterpolationPeriod { value, index }.nanos();
        assert_eq!(InterpolationPeriod::default().nanos(), Some(1_000_000));
        assert_eq!(nanos(2, -3), Some(2_000_000));
        assert_eq!(nanos(250, -6), Some(250_000));
        assert_eq!(nanos(1, 0), Some(1_000_000_000));
        assert_eq!(nanos(18, 9), Some(18_000_000_000_000_000_000));
        assert_eq!(nanos(7, -9), Some(7));
    }

    #[test]
    fn what_is_no_period_is_none() {
        let nanos = |value, index| InterpolationPeriod { value, index }.nanos();
        assert_eq!([nanos(0, -3), nanos(1, -10), nanos(1, -128), nanos(255, 8), nanos(1, 63)], [None; 5]);
    }
}
