//! Straight from each target to the next in the time of one set-point, as interpolated position (CiA 402-2, clause 12)
//! asks for.
//!
//! A target further away than the highest speed allows is approached with that speed. Past its end a stretch rests.

use motion::interpolate::linear;

use super::trajectory::TrajectoryPoint;

/// A stretch under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Interpolation {
    from: TrajectoryPoint,
    target: i32,
    duration_s: f64,
    elapsed_s: f64,
}

impl Interpolation {
    /// At rest.
    pub(super) fn resting(position: i32) -> Self {
        Self { from: TrajectoryPoint::rest(position), target: position, duration_s: 0.0, elapsed_s: 0.0 }
    }

    /// From where it is to `target` in `time_s`, no faster than `max_speed` counts/s (0 for any speed).
    pub(super) fn lead_to(&mut self, target: i32, time_s: f64, max_speed: f64) {
        self.from = self.point();
        self.target = target;
        self.duration_s = if max_speed > 0.0 { (self.way().abs() / max_speed).max(time_s) } else { time_s };
        self.elapsed_s = 0.0;
    }

    pub(super) fn advance(&mut self, dt_s: f64) -> TrajectoryPoint {
        if !self.is_resting() {
            self.elapsed_s += dt_s;
        }
        self.point()
    }

    /// At the end of its stretch, but for the rounding of a sum of periods.
    pub(super) fn is_done(&self) -> bool {
        self.elapsed_s >= self.duration_s - 1e-9
    }

    /// Past the end of its stretch: nothing moves.
    pub(super) fn is_resting(&self) -> bool {
        self.elapsed_s > self.duration_s + 1e-9 || self.duration_s == 0.0
    }

    pub(super) fn point(&self) -> TrajectoryPoint {
        if self.is_resting() {
            return TrajectoryPoint::rest(self.target);
        }
        let at = linear(0.0, self.way(), self.duration_s, self.elapsed_s);
        let way = at.position + self.from.fraction;
        let whole = libm::floor(way);
        TrajectoryPoint {
            position: self.from.position.wrapping_add(whole as i64 as i32),
            fraction: way - whole,
            velocity: at.velocity,
            acceleration: 0.0,
        }
    }

    /// The zero of positions: what was `by` is 0 from now on.
    pub(super) fn shift(&mut self, by: i32) {
        self.from.position = self.from.position.wrapping_sub(by);
        self.target = self.target.wrapping_sub(by);
    }

    fn way(&self) -> f64 {
        f64::from(self.target.wrapping_sub(self.from.position)) - self.from.fraction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIME_S: f64 = 2e-3;
    const DT_S: f64 = 0.5e-3;

    #[test]
    fn a_target_each_2_ms_is_followed_at_its_slope_and_met_at_its_end() {
        let mut interpolation = Interpolation::resting(100);
        for k in 1..=50 {
            interpolation.lead_to(100 + 400 * k, TIME_S, 1e6);
            for quarter in 1..=4 {
                let point = interpolation.advance(DT_S);
                let expected = 100.0 + 400.0 * f64::from(k - 1) + 100.0 * f64::from(quarter);
                assert!((f64::from(point.position) + point.fraction - expected).abs() < 1e-6);
                assert!((point.velocity / 200_000.0 - 1.0).abs() < 1e-6);
            }
            assert!(interpolation.is_done());
        }
        assert_eq!(interpolation.advance(DT_S), TrajectoryPoint::rest(20_100));
    }

    #[test]
    fn a_far_target_takes_the_time_that_the_speed_limit_gives_it() {
        let mut interpolation = Interpolation::resting(0);
        interpolation.lead_to(-50_000, TIME_S, 1e6);
        let mut periods = 0;
        while !interpolation.is_done() {
            interpolation.advance(DT_S);
            periods += 1;
        }
        assert_eq!(periods, 100);
        assert_eq!(interpolation.advance(DT_S).position, -50_000);
    }
}
