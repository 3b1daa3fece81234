//! Between set-points that arrive every period: interpolated position mode (CiA 402, object 60C0h).
//!
//! The interpolation runs from one set-point to the next, so the motion is one period late; cubic uses one more
//! set-point on either side and is therefore two periods late.

use crate::profile::Point;

/// Straight from one set-point to the next over a period; `time_s` is held to `0..=period_s`.
pub fn linear(from: f64, to: f64, period_s: f64, time_s: f64) -> Point {
    let x = share(period_s, time_s);
    let velocity = if period_s > 0.0 { (to - from) / period_s } else { 0.0 };
    Point { position: from + (to - from) * x, velocity, acceleration: 0.0 }
}

/// A cubic through `from` and `to` whose slopes there are those of the neighbours' chords (Catmull-Rom): position
/// and velocity are continuous from period to period.
pub fn cubic(before: f64, from: f64, to: f64, after: f64, period_s: f64, time_s: f64) -> Point {
    if period_s <= 0.0 {
        return Point { position: to, ..Point::default() };
    }
    let x = share(period_s, time_s);
    // Slopes per period at both ends.
    let (m0, m1) = (0.5 * (to - before), 0.5 * (after - from));
    let chord = to - from;
    // p = from + m0 x + a x^2 + b x^3 with p(1) = to, p'(1) = m1.
    let a = 3.0 * chord - 2.0 * m0 - m1;
    let b = m0 + m1 - 2.0 * chord;
    Point {
        position: from + x * (m0 + x * (a + x * b)),
        velocity: (m0 + x * (2.0 * a + x * 3.0 * b)) / period_s,
        acceleration: (2.0 * a + 6.0 * b * x) / (period_s * period_s),
    }
}

/// Share of the period gone, 0 to 1; without a period the end.
fn share(period_s: f64, time_s: f64) -> f64 {
    if period_s > 0.0 { (time_s / period_s).clamp(0.0, 1.0) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_goes_through_both_set_points() {
        assert_eq!(linear(10.0, 14.0, 0.002, 0.0).position, 10.0);
        assert_eq!(linear(10.0, 14.0, 0.002, 0.0005).position, 11.0);
        assert_eq!(linear(10.0, 14.0, 0.002, 0.1), Point { position: 14.0, velocity: 2000.0, acceleration: 0.0 });
    }

    #[test]
    fn cubic_reproduces_a_parabola_exactly_and_joins_smoothly() {
        let parabola = |t: f64| 3.0 + 2.0 * t + 5.0 * t * t;
        let period_s = 0.5;
        let sample = |k: i32| parabola(f64::from(k) * period_s);
        for step in 0..=10 {
            let t = f64::from(step) * 0.05;
            let point = cubic(sample(-1), sample(0), sample(1), sample(2), period_s, t);
            assert!((point.position - parabola(t)).abs() < 1e-12);
            assert!((point.velocity - (2.0 + 10.0 * t)).abs() < 1e-12);
            assert!((point.acceleration - 10.0).abs() < 1e-10);
        }
        let end = cubic(0.0, 1.0, 4.0, 2.0, 1.0, 1.0);
        let start = cubic(1.0, 4.0, 2.0, 7.0, 1.0, 0.0);
        assert_eq!((end.position, end.velocity), (start.position, start.velocity));
    }

    #[test]
    fn no_period_gives_the_target_and_no_infinity() {
        assert_eq!(linear(1.0, 2.0, 0.0, 0.0), Point { position: 2.0, velocity: 0.0, acceleration: 0.0 });
        assert_eq!(cubic(0.0, 1.0, 2.0, 3.0, 0.0, 0.0).position, 2.0);
    }
}
