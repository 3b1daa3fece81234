//! Overload: how long a motor may carry how much more than its rated current.
//!
//! An accumulator runs towards 1 at the inverse of the time that the present current is allowed, and back while the
//! current is below the limit; at 1 the motor is overloaded.

/// How overload is judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverloadLimits {
    /// Rated current, A; 0 switches the watch off.
    pub rated_a: f32,
    /// Multiple of the rated current at which overload begins; 0 switches the watch off.
    pub begins_at: f32,
    /// Allowed times by multiple of the rated current, ascending by current: (multiple, seconds). Straight between
    /// two points, flat outside. A time of 0 switches the watch off.
    pub curve: [(f32, f32); 3],
}

/// How much of the allowed time is used up, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Overload {
    used: f32,
}

/// A regulated current swings about its limit: what is this share below the beginning still counts.
const REGULATION_SHARE: f32 = 0.98;

impl Overload {
    /// One period; true while the motor is overloaded.
    pub fn update(&mut self, limits: &OverloadLimits, current_a: f32, dt_s: f32) -> bool {
        let multiple = current_a.abs() / limits.rated_a;
        let overloaded = multiple >= REGULATION_SHARE * limits.begins_at;
        let allowed_s = between(&limits.curve, multiple);
        if limits.rated_a <= 0.0 || limits.begins_at <= 0.0 || allowed_s <= 0.0 {
            self.used = 0.0;
        } else if overloaded {
            self.used = (self.used + dt_s / allowed_s).min(1.0);
        } else {
            self.used = (self.used - dt_s / allowed_s).max(0.0);
        }
        self.used >= 1.0
    }

    /// Forgets the past.
    pub fn reset(&mut self) {
        self.used = 0.0;
    }
}

/// The value at `x` of a curve through points ascending by `x`: straight between two of them, flat outside.
pub fn between(curve: &[(f32, f32); 3], x: f32) -> f32 {
    let [(first, first_y), .., (_, last_y)] = *curve;
    if x <= first {
        return first_y;
    }
    let between = curve.windows(2).find_map(|pair| match pair {
        [(low, low_y), (high, high_y)] if x <= *high => Some(low_y + (high_y - low_y) * (x - low) / (high - low)),
        _ => None,
    });
    between.unwrap_or(last_y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As a manual gives it: 20 s, 6 s and 4 s at once, twice and three times.
    const LIMITS: OverloadLimits =
        OverloadLimits { rated_a: 10.0, begins_at: 1.0, curve: [(1.0, 20.0), (2.0, 6.0), (3.0, 4.0)] };

    fn trip_time(limits: &OverloadLimits, current_a: f32) -> Option<f32> {
        let mut overload = Overload::default();
        (0..60_000).find(|_| overload.update(limits, current_a, 1e-3)).map(|ms| ms as f32 * 1e-3)
    }

    #[test]
    fn trips_after_the_times_of_the_note() {
        for (current_a, expected_s) in [(10.0, 20.0), (-20.0, 6.0), (30.0, 4.0), (15.0, 13.0), (50.0, 4.0)] {
            let time_s = trip_time(&LIMITS, current_a).unwrap();
            assert!((time_s - expected_s).abs() < 0.02 * expected_s, "{current_a} A: {time_s} s");
        }
    }

    #[test]
    fn never_trips_below_its_beginning_or_when_off() {
        assert_eq!(trip_time(&LIMITS, 9.7), None);
        assert_eq!(trip_time(&OverloadLimits { begins_at: 2.0, ..LIMITS }, 19.0), None);
        assert_eq!(trip_time(&OverloadLimits { begins_at: 0.0, ..LIMITS }, 99.0), None);
        assert_eq!(trip_time(&OverloadLimits { curve: [(1.0, 0.0); 3], ..LIMITS }, 99.0), None);
    }

    #[test]
    fn a_rest_gives_time_back() {
        let mut overload = Overload::default();
        for _ in 0..5 {
            assert!(!(0..5000).any(|_| overload.update(&LIMITS, 20.0, 1e-3)), "5 s of 6 s");
            (0..20_000).for_each(|_| assert!(!overload.update(&LIMITS, 0.0, 1e-3)));
        }
    }
}
