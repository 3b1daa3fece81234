//! A velocity that is followed along ramps, as profile velocity (CiA 402-2, clause 16) asks for.

use super::ramp::Ramp;
use super::trajectory::{Trajectory, TrajectoryPoint};

/// Speeds in counts/s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VelocityRamps {
    /// A motion from rest begins with this speed.
    pub start_speed: f64,
    /// No target is faster.
    pub max_speed: f64,
    /// Of a change to a higher speed.
    pub acceleration: Ramp,
    /// Of a change to a lower speed.
    pub deceleration: Ramp,
}

impl VelocityRamps {
    /// The same without limits of the jerk.
    #[must_use]
    pub const fn without_jerk(self) -> Self {
        Self { acceleration: self.acceleration.without_jerk(), deceleration: self.deceleration.without_jerk(), ..self }
    }
}

/// What the trajectory leads to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Speed {
    /// End of the ramp under way; `None` when the trajectory is not of this mode yet.
    heading_for: Option<f64>,
}

impl Speed {
    /// Plans anew when the target (counts/s) has changed or a ramp down to zero has ended on the way to the other
    /// direction.
    #[inline]
    pub(super) fn update(&mut self, target: f64, trajectory: &mut Trajectory, ramps: &VelocityRamps) {
        let target = target.clamp(-ramps.max_speed, ramps.max_speed);
        if self.heading_for != Some(target) {
            self.plan(target, trajectory, ramps);
        }
    }

    fn plan(&mut self, target: f64, trajectory: &mut Trajectory, ramps: &VelocityRamps) {
        let now = trajectory.point();
        // One rate for both ways is one straight line through zero.
        let straight =
            ramps.acceleration == ramps.deceleration && matches!(ramps.acceleration, Ramp::Rate(_) | Ramp::Jerk(_));
        let reverses = now.velocity * target < 0.0 && !straight;
        let next = if reverses { 0.0 } else { target };
        if self.heading_for == Some(next) && !(trajectory.is_done() && now.velocity != next) {
            return;
        }
        self.heading_for = Some(next);
        let faster = next.abs() > now.velocity.abs();
        let ramp = if faster { ramps.acceleration } else { ramps.deceleration };
        *trajectory = Trajectory::change_velocity(self.from(now, next, ramps), next, ramp);
    }

    /// The trajectory has been put elsewhere: plan anew.
    pub(super) fn restart(&mut self) {
        self.heading_for = None;
    }

    /// A motion from rest begins at the start speed.
    fn from(&self, now: TrajectoryPoint, next: f64, ramps: &VelocityRamps) -> TrajectoryPoint {
        let start = ramps.start_speed.min(next.abs());
        if now.velocity == 0.0 && start > 0.0 {
            TrajectoryPoint { velocity: start.copysign(next), acceleration: 0.0, ..now }
        } else {
            now
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RAMPS: VelocityRamps = VelocityRamps {
        start_speed: 0.0,
        max_speed: 5000.0,
        acceleration: Ramp::Time(0.5),
        deceleration: Ramp::Time(0.2),
    };

    struct SpeedBench {
        mode: Speed,
        trajectory: Trajectory,
    }

    impl SpeedBench {
        fn new() -> Self {
            Self { mode: Speed::default(), trajectory: Trajectory::resting(0) }
        }

        /// Seconds until the velocity is there, and the point then.
        fn time_to(&mut self, target: f64, ramps: &VelocityRamps) -> f64 {
            for period in 1..10_000 {
                self.mode.update(target, &mut self.trajectory, ramps);
                if self.trajectory.advance(1e-3).velocity == target.clamp(-ramps.max_speed, ramps.max_speed) {
                    return f64::from(period) * 1e-3;
                }
            }
            f64::INFINITY
        }
    }

    fn close(time_s: f64, expected_s: f64) -> bool {
        (time_s - expected_s).abs() < 3e-3
    }

    #[test]
    fn speeding_up_and_slowing_down_take_their_times_whatever_the_change() {
        let mut bench = SpeedBench::new();
        assert!(close(bench.time_to(1000.0, &RAMPS), 0.5));
        assert!(close(bench.time_to(1100.0, &RAMPS), 0.5));
        assert!(close(bench.time_to(100.0, &RAMPS), 0.2));
        assert!(close(bench.time_to(0.0, &RAMPS), 0.2));
    }

    #[test]
    fn a_reversal_slows_down_first_and_then_speeds_up() {
        let mut bench = SpeedBench::new();
        bench.time_to(1000.0, &RAMPS);
        assert!(close(bench.time_to(-1000.0, &RAMPS), 0.7));
    }

    #[test]
    fn rates_take_the_time_of_the_change_and_a_reversal_by_one_rate_is_straight() {
        let (up, down) = (Ramp::Rate(1000.0), Ramp::Rate(2000.0));
        for (down, reversal_s) in [(up, 2.0), (down, 1.5)] {
            let ramps = VelocityRamps { acceleration: up, deceleration: down, ..RAMPS };
            let mut bench = SpeedBench::new();
            assert!(close(bench.time_to(1000.0, &ramps), 1.0));
            let time_s = bench.time_to(-1000.0, &ramps);
            assert!(close(time_s, reversal_s), "{down:?}: {time_s} s");
        }
    }

    #[test]
    fn targets_are_held_to_the_highest_speed() {
        let mut bench = SpeedBench::new();
        bench.time_to(9999.0, &RAMPS);
        assert_eq!(bench.trajectory.point().velocity, 5000.0);
    }

    #[test]
    fn a_motion_from_rest_begins_with_the_start_speed() {
        let mut bench = SpeedBench::new();
        let ramps = VelocityRamps { start_speed: 70.0, ..RAMPS };
        bench.mode.update(-1000.0, &mut bench.trajectory, &ramps);
        assert_eq!(bench.trajectory.point().velocity, -70.0);
        bench.mode.update(-1000.0, &mut bench.trajectory, &ramps);
        assert!(bench.trajectory.advance(0.25).velocity < -400.0);
    }

    #[test]
    fn no_time_is_a_step() {
        let mut bench = SpeedBench::new();
        let ramps = VelocityRamps { acceleration: Ramp::NONE, ..RAMPS };
        assert!(bench.time_to(1000.0, &ramps) <= 2e-3);
    }
}
