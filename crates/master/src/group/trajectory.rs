//! Jerk-limited paths of several axes that begin and end together.
//!
//! In: where each axis is on its path, where it is to come to rest, and its limits. Out: position, velocity and acceleration
//! of each axis at any time. The way of a single axis is the time-optimal one of Berscheid and Kroeger, "Jerk-limited
//! Real-time Trajectory Generation with Arbitrary Target States" (RSS 2021), from crate `rsruckig`; axes with a shorter way
//! are slowed down until all take the same time. What that crate says is checked here: it takes infinite limits and returns
//! errors as values.

use core::time::Duration;

use rsruckig::prelude::{
    ControlInterface, InputParameter, Ruckig, RuckigResult, Synchronization, ThrowErrorHandler,
    Trajectory as RuckigTrajectory,
};
use rsruckig::util::integrate;

use super::limits::{AxisLimits, PathError, PathPoint};

/// A number of axes that is known only at run time.
const DYNAMIC: usize = 0;

/// No cycle is shorter; the planner wants one, and does not use it for whole paths.
const ANY_CYCLE_S: f64 = 0.001;

/// A path of several axes to rest.
#[derive(Clone, Debug)]
pub struct Trajectory {
    path: RuckigTrajectory<DYNAMIC>,
}

impl Trajectory {
    /// The way of each axis from where it is to a position at rest; all of them end at the same time. With `within`, they
    /// take that time instead of the shortest one.
    ///
    /// # Errors
    /// [`PathError`].
    pub fn to_rest_at(
        from: &[PathPoint],
        to_turns: &[f64],
        limits: &[AxisLimits],
        within: Option<Duration>,
    ) -> Result<Self, PathError> {
        check(from, limits)?;
        if to_turns.len() != limits.len() {
            return Err(PathError::Count { given: to_turns.len(), axes: limits.len() });
        }
        for (axis, (to, limits)) in (1..).zip(to_turns.iter().zip(limits)) {
            limits.check_position(axis, *to)?;
        }
        let mut input = input(from, limits);
        for (axis, to) in to_turns.iter().enumerate() {
            input.target_position[axis] = *to;
        }
        input.minimum_duration = within.map(|time| time.as_secs_f64());
        let trajectory = Self::plan(&input)?;
        let needed_s = trajectory.duration_s();
        match input.minimum_duration {
            // A minimum that can be met exactly is met to rounding.
            Some(given_s) if needed_s > given_s + 1e-6 => Err(PathError::TooLittleTime { needed_s, given_s }),
            _ => Ok(trajectory),
        }
    }

    /// Each axis comes to rest as soon as its limits allow, wherever that is: a controlled stop.
    ///
    /// # Errors
    /// [`PathError`].
    pub fn to_rest(from: &[PathPoint], limits: &[AxisLimits]) -> Result<Self, PathError> {
        check(from, limits)?;
        let mut input = input(from, limits);
        input.control_interface = ControlInterface::Velocity;
        input.synchronization = Synchronization::None;
        Self::plan(&input)
    }

    fn plan(input: &InputParameter<DYNAMIC>) -> Result<Self, PathError> {
        let axes = Some(input.degrees_of_freedom);
        let mut path = RuckigTrajectory::new(axes);
        let mut planner = Ruckig::<DYNAMIC, ThrowErrorHandler>::new(axes, ANY_CYCLE_S);
        match planner.calculate(input, &mut path) {
            Ok(RuckigResult::Working | RuckigResult::Finished) if path.duration.is_finite() => Ok(Self { path }),
            Ok(result) => Err(PathError::NoPath(format!("{result:?}"))),
            Err(error) => Err(PathError::NoPath(error.to_string())),
        }
    }

    /// How long it takes until the last axis rests, in seconds.
    pub const fn duration_s(&self) -> f64 {
        self.path.duration
    }

    /// Where each axis is at this time. Before the beginning and after the end it is where it was, and where it is going.
    /// Allocates nothing. Axes beyond the room that is given are left out.
    pub fn at(&self, time_s: f64, points: &mut [PathPoint]) {
        let mut section = 0;
        self.path.state_to_integrate_from(time_s.max(0.0), &mut section, |axis, t_s, p, v, a, j| {
            let (position_turns, velocity_turns_s, acceleration_turns_s2) = integrate(t_s, p, v, a, j);
            if let Some(point) = points.get_mut(axis) {
                *point = PathPoint { position_turns, velocity_turns_s, acceleration_turns_s2 };
            }
        });
    }
}

fn check(from: &[PathPoint], limits: &[AxisLimits]) -> Result<(), PathError> {
    if from.len() != limits.len() || limits.is_empty() {
        return Err(PathError::Count { given: from.len(), axes: limits.len() });
    }
    for (axis, (point, limits)) in (1..).zip(from.iter().zip(limits)) {
        limits.check(axis)?;
        let PathPoint { position_turns, velocity_turns_s, acceleration_turns_s2 } = *point;
        // An axis may stand outside its software limits: then it may come back.
        let strange = [position_turns, velocity_turns_s, acceleration_turns_s2].into_iter().find(|x| !x.is_finite());
        if let Some(value) = strange {
            return Err(PathError::NoNumber { axis, value });
        }
    }
    Ok(())
}

fn input(from: &[PathPoint], limits: &[AxisLimits]) -> InputParameter<DYNAMIC> {
    let mut input = InputParameter::new(Some(limits.len()));
    for (axis, (point, limits)) in from.iter().zip(limits).enumerate() {
        input.current_position[axis] = point.position_turns;
        input.current_velocity[axis] = point.velocity_turns_s;
        input.current_acceleration[axis] = point.acceleration_turns_s2;
        input.max_velocity[axis] = limits.velocity_turns_s;
        input.max_acceleration[axis] = limits.acceleration_turns_s2;
        input.max_jerk[axis] = limits.jerk_turns_s3;
    }
    input
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits(velocity: f64, acceleration: f64, jerk: f64) -> AxisLimits {
        AxisLimits {
            range_turns: Some(-100.0..=100.0),
            velocity_turns_s: velocity,
            acceleration_turns_s2: acceleration,
            jerk_turns_s3: jerk,
            following_error_turns: 0.1,
        }
    }

    fn rest(position_turns: f64) -> PathPoint {
        PathPoint { position_turns, ..PathPoint::default() }
    }

    /// From rest to rest with all seven sections, the time is L/V + V/A + A/J (Biagiotti and Melchiorri, "Trajectory Planning
    /// for Automatic Machines and Robots", 3.4).
    #[test]
    fn the_time_of_a_long_move_is_that_of_the_double_s_profile() {
        let (v, a, j) = (2.0, 5.0, 40.0);
        let path = Trajectory::to_rest_at(&[rest(0.0)], &[10.0], &[limits(v, a, j)], None).unwrap();
        assert!((path.duration_s() - (10.0 / v + v / a + a / j)).abs() < 1e-9, "{}", path.duration_s());
    }

    #[test]
    fn all_axes_end_together_within_their_limits() {
        let limits = [limits(2.0, 5.0, 40.0), limits(1.0, 9.0, 100.0), limits(3.0, 4.0, 30.0)];
        let (from, to) = ([0.0, 1.0, -2.0], [3.0, 0.5, 4.0]);
        let path = Trajectory::to_rest_at(&from.map(rest), &to, &limits, None).unwrap();
        let alone = |axis: usize| {
            let (from, to, limits) = (&[rest(from[axis])], &[to[axis]], &limits[axis..=axis]);
            Trajectory::to_rest_at(from, to, limits, None).unwrap().duration_s()
        };
        let slowest = [0, 1, 2].map(alone).into_iter().fold(0.0, f64::max);
        assert!((path.duration_s() - slowest).abs() < 1e-9, "{} {slowest}", path.duration_s());
        let mut before = [PathPoint::default(); 3];
        path.at(0.0, &mut before);
        let steps = 4000;
        let dt_s = path.duration_s() / f64::from(steps);
        for step in 1..=steps {
            let mut points = [PathPoint::default(); 3];
            path.at(f64::from(step) * dt_s, &mut points);
            for (axis, (point, limits)) in points.iter().zip(&limits).enumerate() {
                let jerk = (point.acceleration_turns_s2 - before[axis].acceleration_turns_s2) / dt_s;
                assert!(point.velocity_turns_s.abs() <= limits.velocity_turns_s + 1e-9);
                assert!(point.acceleration_turns_s2.abs() <= limits.acceleration_turns_s2 + 1e-9);
                assert!(jerk.abs() <= limits.jerk_turns_s3 + 1e-6, "{jerk}");
                // No axis waits at the end for the others.
                let early = step < steps - 40 && step > 40;
                assert!(!early || point.velocity_turns_s.abs() > 1e-6, "axis {axis} rests in step {step}");
            }
            before = points;
        }
        for (point, to) in before.iter().zip(to) {
            assert!((point.position_turns - to).abs() < 1e-9 && point.velocity_turns_s.abs() < 1e-9);
        }
    }

    /// From speed v with deceleration a and jerk j, both reached: the way is v/2 (v/a + a/j).
    #[test]
    fn a_stop_takes_the_way_of_the_closed_form() {
        let (v, a, j) = (2.0, 5.0, 40.0);
        let moving = PathPoint { velocity_turns_s: v, ..rest(1.0) };
        let path = Trajectory::to_rest(&[moving], &[limits(v, a, j)]).unwrap();
        let mut end = [PathPoint::default()];
        path.at(path.duration_s(), &mut end);
        assert!((path.duration_s() - (v / a + a / j)).abs() < 1e-9);
        assert!((end[0].position_turns - 1.0 - v / 2.0 * (v / a + a / j)).abs() < 1e-9, "{end:?}");
    }

    #[test]
    fn a_time_is_kept_or_refused() {
        let limits = [limits(2.0, 5.0, 40.0)];
        let path = Trajectory::to_rest_at(&[rest(0.0)], &[10.0], &limits, Some(Duration::from_secs(9))).unwrap();
        assert!((path.duration_s() - 9.0).abs() < 1e-6);
        let error = Trajectory::to_rest_at(&[rest(0.0)], &[10.0], &limits, Some(Duration::from_secs(2))).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the move takes 5.525 s within its limits, and 2 s were given: give more time, or raise a limit"
        );
    }

    #[test]
    fn what_cannot_be_moved_is_refused_with_the_reason() {
        let good = limits(2.0, 5.0, 40.0);
        let refused = |to: f64, limits: &AxisLimits| {
            Trajectory::to_rest_at(&[rest(0.0)], &[to], core::slice::from_ref(limits), None).unwrap_err().to_string()
        };
        for value in [f64::NAN, f64::INFINITY, -1e300] {
            assert!(refused(value, &good).contains("expected a finite number"), "{}", refused(value, &good));
        }
        assert_eq!(
            refused(100.5, &good),
            "axis 1 would be at 36180 deg, outside its software limits of -36000 to 36000 deg. Nothing was moved: choose a \
             position within, or change the limits"
        );
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = refused(1.0, &AxisLimits { jerk_turns_s3: value, ..good.clone() });
            assert!(error.starts_with("the limit of axis 1 for a jerk is"), "{error}");
        }
        let error = refused(1.0, &AxisLimits { range_turns: Some(2.0..=1.0), ..good });
        assert!(error.contains("state the lower one first"), "{error}");
    }
}
