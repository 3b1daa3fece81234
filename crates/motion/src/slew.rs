//! Linear ramp of a set-point, such as the torque slope 6087h in mA/s.

/// State: the present value of the ramp.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Slew {
    /// The ramp's present value.
    pub value: f32,
}

impl Slew {
    /// Moves towards the target by at most `rate` units per second, and returns the new value.
    ///
    /// A rate of zero (or not a number) stands still; an infinite rate jumps.
    #[inline]
    pub fn toward(&mut self, target: f32, rate: f32, dt_s: f32) -> f32 {
        let step = (rate * dt_s).max(0.0);
        let left = target - self.value;
        self.value = if left.abs() <= step { target } else { self.value + step.copysign(left) };
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ramp_takes_the_difference_over_the_rate_and_ends_exactly() {
        let mut slew = Slew { value: -1.0 };
        let mut periods = 0;
        while slew.value != 2.0 {
            slew.toward(2.0, 300.0, 1e-3);
            periods += 1;
        }
        assert!((10..=11).contains(&periods), "{periods}");
    }

    #[test]
    fn a_rate_of_zero_stands_still_and_an_infinite_one_jumps() {
        let mut slew = Slew::default();
        assert_eq!(slew.toward(1.0, 0.0, 1e-3), 0.0);
        assert_eq!(slew.toward(1.0, f32::NAN, 1e-3), 0.0);
        assert_eq!(slew.toward(1.0, f32::INFINITY, 1e-3), 1.0);
    }
}
