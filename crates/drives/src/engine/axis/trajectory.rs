//! Where the shaft is to be: a planned profile anchored to a position, moved on period by period.
//!
//! Units are counts and counts/s. The anchor is a wrapping 32-bit position, so a shaft may turn for ever; the
//! way since the anchor is in double precision, so a move over 2^31 counts ends exactly.

use motion::{Profile, jerk, scurve, trapezoid};

use super::ramp::Ramp;

/// A planned motion and how far it has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trajectory {
    origin: i32,
    fraction: f64,
    profile: Profile,
    elapsed_s: f64,
}

/// Where the shaft is to be at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrajectoryPoint {
    /// Whole counts.
    pub position: i32,
    /// Share of a count beyond `position`, 0 to 1.
    pub fraction: f64,
    /// Counts/s.
    pub velocity: f64,
    /// Counts/s².
    pub acceleration: f64,
}

impl TrajectoryPoint {
    /// At rest.
    pub const fn rest(position: i32) -> Self {
        Self { position, fraction: 0.0, velocity: 0.0, acceleration: 0.0 }
    }

    /// Moving.
    pub const fn moving(position: i32, velocity: f64) -> Self {
        Self { position, fraction: 0.0, velocity, acceleration: 0.0 }
    }
}

/// What a move keeps to, in counts and seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MoveLimits {
    /// Speed that a motion from rest begins with.
    pub start_speed: f64,
    /// Speed of the plateau.
    pub max_speed: f64,
    /// Speed that the motion ends from.
    pub end_speed: f64,
    /// It goes on with that speed past its target, in place of a step to rest.
    pub passes: bool,
    /// From the present speed to the plateau.
    pub acceleration: Ramp,
    /// From the plateau to the end speed.
    pub deceleration: Ramp,
}

impl Trajectory {
    /// At rest at a position.
    pub fn resting(position: i32) -> Self {
        Self { origin: position, fraction: 0.0, profile: scurve::velocity_change(0.0, 0.0, 0.0), elapsed_s: 0.0 }
    }

    /// Moving on as at `from`, for as long as nothing else is planned.
    pub fn steady(from: TrajectoryPoint) -> Self {
        Self::change_velocity(from, from.velocity, Ramp::NONE)
    }

    /// From `from` to the position `target`, the short way round if the counter wraps in between. With one ramp that is a
    /// rate the move is straight, and a time stands for the rate that reaches the plateau in it.
    pub fn move_to(from: TrajectoryPoint, target: i32, limits: &MoveLimits) -> Self {
        let MoveLimits { start_speed, max_speed, end_speed, .. } = *limits;
        let distance = f64::from(target.wrapping_sub(from.position)) - from.fraction;
        let velocity = from.velocity;
        let profile = match (limits.acceleration, limits.deceleration) {
            (Ramp::Time(acceleration_time_s), Ramp::Time(deceleration_time_s)) => scurve::PositionMove {
                distance,
                velocity,
                start_speed,
                max_speed,
                end_speed,
                acceleration_time_s,
                deceleration_time_s,
            }
            .plan(),
            (Ramp::Jerk(up), Ramp::Jerk(down)) => {
                let acceleration = from.acceleration;
                jerk::PositionMove { distance, velocity, acceleration, max_speed, end_speed, up, down }.plan()
            }
            (up, down) => trapezoid::PositionMove {
                distance,
                velocity,
                start_speed,
                max_speed,
                end_speed,
                acceleration: up.rate(max_speed),
                deceleration: down.rate(max_speed),
            }
            .plan(),
        };
        let profile = if limits.passes { profile.ending_at(end_speed.copysign(distance)) } else { profile };
        Self { origin: from.position, fraction: from.fraction, profile, elapsed_s: 0.0 }
    }

    /// From the velocity of `from` to `velocity`.
    ///
    /// Where the ramp is a time, an acceleration that already leads there goes on: the change is planned as the rest of a
    /// longer one that passes `from` with its acceleration. A host that sends a new target every 20 ms is followed smoothly
    /// so, where ever new beginnings of the S would hardly move. From rest it is the plain S of the time.
    pub fn change_velocity(from: TrajectoryPoint, velocity: f64, ramp: Ramp) -> Self {
        let beginning_here = |profile| Self { origin: from.position, fraction: from.fraction, profile, elapsed_s: 0.0 };
        let time_s = match ramp {
            Ramp::Time(time_s) => time_s,
            Ramp::Rate(rate) => return beginning_here(trapezoid::velocity_change(from.velocity, velocity, rate)),
            Ramp::Jerk(ref ramp) => {
                return beginning_here(jerk::velocity_change(from.velocity, from.acceleration, velocity, ramp));
            }
        };
        let (change, elapsed_s) = passing(velocity - from.velocity, from.acceleration, time_s);
        let profile = scurve::velocity_change(velocity - change, velocity, time_s);
        let passed = profile.at(elapsed_s).position;
        Self { origin: from.position, fraction: from.fraction - passed, profile, elapsed_s }
    }

    /// One period on; returns the new point.
    pub fn advance(&mut self, dt_s: f64) -> TrajectoryPoint {
        if self.is_resting() {
            return self.point();
        }
        if self.is_done() {
            self.re_anchor();
        }
        self.elapsed_s += dt_s;
        self.point()
    }

    /// The present point.
    pub fn point(&self) -> TrajectoryPoint {
        let at = self.profile.at(self.elapsed_s);
        let way = at.position + self.fraction;
        let whole = libm::floor(way);
        TrajectoryPoint {
            position: self.origin.wrapping_add(whole as i64 as i32),
            fraction: way - whole,
            velocity: at.velocity,
            acceleration: at.acceleration,
        }
    }

    /// The plan has run out: the shaft rests, or goes on at the velocity that was planned.
    pub fn is_done(&self) -> bool {
        self.elapsed_s >= self.profile.duration()
    }

    /// The plan has run out and asks for standstill.
    pub fn is_resting(&self) -> bool {
        self.is_done() && self.profile.end().velocity == 0.0
    }

    /// The zero of position moves: what was `by` is 0 from now on.
    pub fn shift(&mut self, by: i32) {
        self.origin = self.origin.wrapping_sub(by);
    }

    /// The motion goes on as planned, from another place.
    pub fn place(&mut self, position: i32) {
        self.origin = position;
        self.fraction = -self.profile.at(self.elapsed_s).position;
    }

    /// A steady motion has no end: begin it anew where it is, so that its way stays small and exact.
    fn re_anchor(&mut self) {
        let now = self.point();
        let profile = scurve::velocity_change(now.velocity, now.velocity, 0.0);
        *self = Self { origin: now.position, fraction: now.fraction, profile, elapsed_s: 0.0 };
    }
}

/// The S-shaped change of duration `time_s` whose rest is `rest` at the moment its acceleration is `acceleration`:
/// its whole change, and the time of that moment.
///
/// With x the share of the time passed, the S reaches `2x²` of the change at a slope of `4x` in its first half, and lacks
/// `2y²` at a slope of `4y`, `y = 1 - x`, in its second.
fn passing(rest: f64, acceleration: f64, time_s: f64) -> (f64, f64) {
    let slope = acceleration * time_s;
    if rest == 0.0 || slope * rest <= 0.0 {
        return (rest, 0.0);
    }
    if slope.abs() >= 4.0 * rest.abs() {
        // Second half: rest = 2 c y², slope = 4 c y.
        let y = 2.0 * rest / slope;
        return (slope / (4.0 * y), time_s * (1.0 - y));
    }
    // First half: rest = c (1 - 2x²), slope = 4 c x.
    let change = 0.5 * (rest + libm::sqrt(rest * rest + 0.5 * slope * slope).copysign(rest));
    (change, time_s * slope / (4.0 * change))
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 0.5e-3;

    #[test]
    fn a_velocity_change_takes_its_time_and_half_of_it_is_half_way() {
        let mut trajectory = Trajectory::change_velocity(TrajectoryPoint::rest(0), 1000.0, Ramp::Time(0.5));
        let mut points = std::vec::Vec::new();
        while !trajectory.is_done() {
            points.push(trajectory.advance(DT_S));
        }
        assert!((999..=1001).contains(&points.len()), "{}", points.len());
        assert!((points[499].velocity - 500.0).abs() < 1.0);
        assert!(trajectory.advance(DT_S).velocity == 1000.0 && !trajectory.is_resting());
    }

    #[test]
    fn a_changed_target_neither_jumps_in_velocity_nor_in_acceleration_nor_in_position() {
        for elapsed in [0, 100, 400, 600, 950] {
            let mut trajectory = Trajectory::change_velocity(TrajectoryPoint::rest(7), 1000.0, Ramp::Time(0.5));
            for _ in 0..elapsed {
                trajectory.advance(DT_S);
            }
            let before = trajectory.point();
            let after = Trajectory::change_velocity(before, 1500.0, Ramp::Time(0.5)).point();
            assert!((after.velocity - before.velocity).abs() < 1e-6, "{elapsed}");
            assert!((after.acceleration - before.acceleration).abs() < 1e-3, "{elapsed}");
            let way = f64::from(after.position - before.position) + after.fraction - before.fraction;
            assert!(way.abs() < 1e-6, "{elapsed}");
        }
    }

    #[test]
    fn a_target_that_rises_with_every_message_is_followed() {
        // 50 counts/s more each 20 ms, for 2 s: the velocity follows with a lag of less than the ramp's time.
        let mut trajectory = Trajectory::resting(0);
        let mut target = 0.0;
        for period in 0..4000 {
            if period % 40 == 0 {
                target += 50.0;
                trajectory = Trajectory::change_velocity(trajectory.point(), target, Ramp::Time(0.5));
            }
            trajectory.advance(DT_S);
        }
        let lag_s = (target - trajectory.point().velocity) / 2500.0;
        assert!((0.0..0.5).contains(&lag_s), "{lag_s}");
    }

    #[test]
    fn no_velocity_overshoots_a_target_that_comes_nearer() {
        let mut trajectory = Trajectory::change_velocity(TrajectoryPoint::rest(0), 1000.0, Ramp::Time(0.5));
        for _ in 0..500 {
            trajectory.advance(DT_S);
        }
        let mut trajectory = Trajectory::change_velocity(trajectory.point(), 510.0, Ramp::Time(0.5));
        while !trajectory.is_done() {
            assert!(trajectory.advance(DT_S).velocity <= 510.0 + 1e-6);
        }
    }

    #[test]
    fn a_move_across_the_wrap_of_the_counter_ends_on_its_target() {
        let ramp = Ramp::Time(0.1);
        let limits = MoveLimits { max_speed: 1e5, acceleration: ramp, deceleration: ramp, ..Default::default() };
        let mut trajectory = Trajectory::move_to(TrajectoryPoint::rest(i32::MAX - 10), i32::MIN + 10, &limits);
        while !trajectory.is_resting() {
            trajectory.advance(DT_S);
        }
        assert_eq!(trajectory.point().position, i32::MIN + 10);
    }

    #[test]
    fn straight_ramps_take_the_time_of_their_trapezoid() {
        // 1000 counts at most 1000 counts/s and 2000 counts/s²: 0.5 s up, 0.5 s level, 0.5 s down.
        let up = Ramp::Rate(2000.0);
        for down in [Ramp::Rate(2000.0), Ramp::Time(0.5)] {
            let limits = MoveLimits { max_speed: 1000.0, acceleration: up, deceleration: down, ..Default::default() };
            let mut trajectory = Trajectory::move_to(TrajectoryPoint::rest(-200), 800, &limits);
            let mut periods = 0;
            while !trajectory.is_resting() {
                trajectory.advance(DT_S);
                periods += 1;
            }
            assert!((f64::from(periods) * DT_S - 1.5).abs() < 2.0 * DT_S, "{periods}");
            assert_eq!(trajectory.point().position, 800);
        }
        let mut trajectory = Trajectory::change_velocity(TrajectoryPoint::rest(0), -500.0, up);
        for _ in 0..500 {
            trajectory.advance(DT_S);
        }
        assert!(trajectory.is_done() && trajectory.point().velocity == -500.0);
        for step in [Ramp::NONE, Ramp::Rate(0.0)] {
            let stepped = Trajectory::change_velocity(TrajectoryPoint::rest(0), 500.0, step);
            assert!(step.is_none() && stepped.point().velocity == 500.0);
        }
    }

    #[test]
    fn a_motion_goes_on_from_another_place_as_it_was_planned() {
        let mut trajectory = Trajectory::change_velocity(TrajectoryPoint::rest(0), 1000.0, Ramp::Time(0.5));
        (0..300).for_each(|_| _ = trajectory.advance(DT_S));
        let before = trajectory.point();
        trajectory.place(70_000);
        assert_eq!(trajectory.point(), TrajectoryPoint { position: 70_000, fraction: 0.0, ..before });
        assert!(trajectory.advance(DT_S).velocity > before.velocity);
    }

    #[test]
    fn a_steady_motion_stays_exact_for_hours() {
        let mut trajectory = Trajectory::change_velocity(TrajectoryPoint::rest(0), 2000.0, Ramp::Time(0.0));
        for _ in 0..2_000_000 {
            trajectory.advance(DT_S);
        }
        assert!((trajectory.point().position - 2_000_000).abs() <= 1);
    }
}
