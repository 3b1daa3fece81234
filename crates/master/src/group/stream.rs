//! Points of a path that come while it is being moved: a bounded queue between their producer and the cycles.
//!
//! In: a point of all axes for each cycle, checked against the limits when it is given. Out: the point of a cycle. A producer
//! that is late finds the group going on at its last speed for some cycles, and then brought to rest within its limits. The
//! points of cycles that have passed are left out, so that the path keeps its time; a path that cannot be joined again within the
//! limits is not.

use core::time::Duration;
use std::collections::VecDeque;

use super::error::GroupError;
use super::limits::{AxisLimits, PathError, PathPoint, Quantity};
use crate::units::Turns;

/// How a stream is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamOptions {
    /// Points that are kept at most, 1 to 60000.
    pub capacity: usize,
    /// Points that have to be there before the first one is sent: what a producer may be late later on. At most the capacity.
    pub prefill: usize,
    /// Cycles in a row without a point through which the group goes on at its last speed, before it is stopped. It knows
    /// nothing of its path meanwhile: as many as there are in 100 ms at most, or one.
    pub grace: u32,
}

impl Default for StreamOptions {
    /// A quarter of a second at 1 ms, sent once 10 points are there; two cycles of grace.
    fn default() -> Self {
        Self { capacity: 250, prefill: 10, grace: 2 }
    }
}

/// The most points that a stream keeps: a minute at 1 ms.
const MOST_POINTS: usize = 60_000;

/// The longest time for which a group may go on without a point, in seconds; one cycle in any case.
const LONGEST_GRACE_S: f64 = 0.1;

impl StreamOptions {
    /// That they bound what they are to bound, for cycles of this length.
    pub(super) fn check(&self, period_s: f64) -> Result<(), GroupError> {
        let longest_grace = ((LONGEST_GRACE_S / period_s).round() as usize).max(1);
        let options = [
            ("capacity", self.capacity, 1, MOST_POINTS),
            ("prefill", self.prefill, 0, self.capacity),
            ("grace", self.grace as usize, 0, longest_grace),
        ];
        match options.into_iter().find(|(_, given, least, most)| !(least..=most).contains(&given)) {
            Some((option, given, least, most)) => Err(GroupError::StreamOption { option, given, least, most }),
            None => Ok(()),
        }
    }
}

/// Points on their way.
///
/// Speeds and accelerations are those between neighbouring points, and held to the limits when a point is given. The jerk is
/// its producer's: third differences of points with few digits are mostly rounding.
#[derive(Clone, Debug)]
pub struct Stream {
    options: StreamOptions,
    period_s: f64,
    /// Positions in turns, one after the other for each point.
    queue: VecDeque<f64>,
    axes: usize,
    /// The last point that was given.
    last: Vec<PathPoint>,
    /// Room for the point that is being checked.
    next: Vec<PathPoint>,
    begun: bool,
    ended: bool,
    /// Cycles in a row without a point.
    late: u32,
    /// Points of cycles that passed without them, still to be left out.
    owed: u64,
    /// Points that were left out because they came late.
    dropped: u64,
}

/// What a cycle gets of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Due {
    /// Not begun: hold.
    Wait,
    /// Its point is in `points`.
    Point,
    /// None was there: `points` goes on at the last speed.
    Late,
    /// None was there for too long.
    Underrun,
    /// Points have come again after so many cycles, and the path cannot be joined again within its limits.
    OutOfReach { cycles: u32 },
    /// The last point has been sent.
    End,
}

/// Which point of a path its group would not take, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct RefusedPoint {
    /// Its number, from 0.
    pub point: usize,
    /// Why.
    pub error: PathError,
}

/// Holds a path that is known as a whole to the limits of its axes, before there is a group: a point for each of these cycles, the first
/// of them where the axes stand.
///
/// # Errors
/// The first point that breaks one.
pub fn check_path<P: AsRef<[Turns]>>(
    points: impl IntoIterator<Item = P>,
    limits: &[AxisLimits],
    period: Duration,
) -> Result<(), RefusedPoint> {
    let mut points = points.into_iter().peekable();
    let rest = |Turns(at): &Turns| PathPoint { position_turns: *at, ..PathPoint::default() };
    let from: Vec<_> = points.peek().into_iter().flat_map(|first| first.as_ref()).map(rest).collect();
    Stream::new(&from, period.as_secs_f64(), StreamOptions::default()).check_all(points, limits)
}

/// The queue has no room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Full;

impl Stream {
    /// From points at which the axes are, for cycles of this length.
    pub(super) fn new(from: &[PathPoint], period_s: f64, options: StreamOptions) -> Self {
        let axes = from.len();
        let queue = VecDeque::with_capacity(options.capacity.saturating_mul(axes));
        let (last, next) = (from.to_vec(), from.to_vec());
        Self { options, period_s, queue, axes, last, next, begun: false, ended: false, late: 0, owed: 0, dropped: 0 }
    }

    /// Points that are waiting.
    pub fn queued(&self) -> usize {
        self.queue.len() / self.axes.max(1)
    }

    /// Points for which there is room.
    pub fn room(&self) -> usize {
        self.options.capacity.saturating_sub(self.queued())
    }

    /// Points that came after their cycle and were left out.
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Cycles without a point after which it is an underrun.
    pub(super) const fn grace(&self) -> u32 {
        self.options.grace
    }

    /// Takes a point, or nothing of it.
    pub(super) fn push(&mut self, point: &[Turns], limits: &[AxisLimits]) -> Result<Result<(), Full>, PathError> {
        if point.len() == self.axes && self.room() == 0 {
            return Ok(Err(Full));
        }
        self.check_next(point, limits)?;
        self.queue.extend(point.iter().map(|Turns(at)| *at));
        Ok(Ok(()))
    }

    /// Holds a point to the limits, as the one behind the last; one that breaks them changes nothing.
    pub(super) fn check_next(&mut self, point: &[Turns], limits: &[AxisLimits]) -> Result<(), PathError> {
        if point.len() != self.axes {
            return Err(PathError::Count { given: point.len(), axes: self.axes });
        }
        for (index, (Turns(at), limits)) in point.iter().zip(limits).enumerate() {
            self.next[index] = self.check(index, *at, limits)?;
        }
        self.last.copy_from_slice(&self.next);
        Ok(())
    }

    /// Holds all these points to the limits, one after the other.
    pub(super) fn check_all<P: AsRef<[Turns]>>(
        &mut self,
        points: impl IntoIterator<Item = P>,
        limits: &[AxisLimits],
    ) -> Result<(), RefusedPoint> {
        let mut points = (0..).zip(points);
        let refused = |(point, at): (usize, P)| {
            self.check_next(at.as_ref(), limits).map_err(|error| RefusedPoint { point, error })
        };
        points.try_for_each(refused)
    }

    fn check(&self, index: usize, at_turns: f64, limits: &AxisLimits) -> Result<PathPoint, PathError> {
        let axis = index + 1;
        limits.check_position(axis, at_turns)?;
        let before = self.last[index];
        let velocity_turns_s = (at_turns - before.position_turns) / self.period_s;
        let acceleration_turns_s2 = (velocity_turns_s - before.velocity_turns_s) / self.period_s;
        let bounds = [
            (Quantity::Velocity, velocity_turns_s.abs(), limits.velocity_turns_s),
            (Quantity::Acceleration, acceleration_turns_s2.abs(), limits.acceleration_turns_s2),
        ];
        for (quantity, needed, limit) in bounds {
            // A path at its limit passes it by rounding.
            if needed > limit * (1.0 + 1e-6) {
                return Err(PathError::TooFast { axis, quantity, needed, limit });
            }
        }
        Ok(PathPoint { position_turns: at_turns, velocity_turns_s, acceleration_turns_s2 })
    }

    /// No point follows those that are queued.
    pub(super) const fn end(&mut self) {
        self.ended = true;
    }

    /// The point of this cycle; `points` are those of the cycle before.
    pub(super) fn take(&mut self, points: &mut [PathPoint], limits: &[AxisLimits]) -> Due {
        if !self.begun {
            // A short path may have fewer points than are waited for.
            if self.queued() < self.options.prefill.max(1) && !self.ended {
                return Due::Wait;
            }
            self.begun = true;
        }
        while self.owed > 0 && !self.queue.is_empty() {
            self.queue.drain(..self.axes);
            self.owed -= 1;
            self.dropped += 1;
        }
        if self.queue.is_empty() {
            return self.miss(points);
        }
        if self.late > 0 && !self.is_in_reach(points, limits) {
            return Due::OutOfReach { cycles: self.late };
        }
        self.late = 0;
        for (point, at_turns) in points.iter_mut().zip(self.queue.drain(..self.axes)) {
            let velocity_turns_s = (at_turns - point.position_turns) / self.period_s;
            let acceleration_turns_s2 = (velocity_turns_s - point.velocity_turns_s) / self.period_s;
            *point = PathPoint { position_turns: at_turns, velocity_turns_s, acceleration_turns_s2 };
        }
        Due::Point
    }

    /// Whether the step to the first point that waits, and the one behind it, are within the limits. The points were held to
    /// each other when they were given, and not to where the group has gone meanwhile.
    fn is_in_reach(&self, points: &[PathPoint], limits: &[AxisLimits]) -> bool {
        let within = |needed: f64, limit: f64| needed.abs() <= limit * (1.0 + 1e-6);
        points.iter().zip(limits).enumerate().all(|(axis, (point, limits))| {
            let at_turns = self.queue[axis];
            let velocity = (at_turns - point.position_turns) / self.period_s;
            let after = match self.queue.get(self.axes + axis) {
                Some(next) => (next - at_turns) / self.period_s,
                None => self.last[axis].velocity_turns_s,
            };
            within(velocity, limits.velocity_turns_s)
                && within((velocity - point.velocity_turns_s) / self.period_s, limits.acceleration_turns_s2)
                && within((after - velocity) / self.period_s, limits.acceleration_turns_s2)
        })
    }

    fn miss(&mut self, points: &mut [PathPoint]) -> Due {
        if self.ended {
            return Due::End;
        }
        if self.late >= self.options.grace {
            return Due::Underrun;
        }
        self.late += 1;
        self.owed += 1;
        for point in points {
            point.position_turns += point.velocity_turns_s * self.period_s;
            point.acceleration_turns_s2 = 0.0;
        }
        Due::Late
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.001;

    fn limits() -> AxisLimits {
        AxisLimits {
            range_turns: Some(-1.0..=1.0),
            velocity_turns_s: 2.0,
            acceleration_turns_s2: 1000.0,
            jerk_turns_s3: 1e6,
            following_error_turns: 0.1,
        }
    }

    fn stream(prefill: usize) -> (Stream, [PathPoint; 1]) {
        let from = [PathPoint::default()];
        (Stream::new(&from, PERIOD_S, StreamOptions { capacity: 4, prefill, grace: 2 }), from)
    }

    fn push(stream: &mut Stream, at: f64) -> Result<Result<(), Full>, PathError> {
        stream.push(&[Turns(at)], &[limits()])
    }

    #[test]
    fn points_come_out_as_they_went_in_once_enough_are_there() {
        let (mut stream, mut points) = stream(2);
        push(&mut stream, 0.001).unwrap().unwrap();
        assert_eq!(stream.take(&mut points, &[limits()]), Due::Wait);
        push(&mut stream, 0.002).unwrap().unwrap();
        for expected in [0.001, 0.002] {
            assert_eq!(stream.take(&mut points, &[limits()]), Due::Point);
            assert_eq!(points[0].position_turns, expected);
            assert!((points[0].velocity_turns_s - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn options_that_bound_nothing_are_refused() {
        let refused = |options: StreamOptions| options.check(PERIOD_S).unwrap_err().to_string();
        let good = StreamOptions::default();
        good.check(PERIOD_S).unwrap();
        assert_eq!(
            refused(StreamOptions { grace: 101, ..good }),
            "a stream's grace of 101 is out of range, expected 0 to 100: nothing is moved. Cycles without a point are bounded by 100 ms, and \
             points that are waited for by the capacity"
        );
        assert!(
            refused(StreamOptions { capacity: 0, ..good })
                .contains("capacity of 0 is out of range, expected 1 to 60000")
        );
        // More than there is room for would never be there.
        assert!(
            refused(StreamOptions { prefill: 251, ..good })
                .contains("prefill of 251 is out of range, expected 0 to 250")
        );
        // A cycle of grace at any period.
        StreamOptions { grace: 1, ..good }.check(0.1).unwrap();
        assert!(StreamOptions { grace: 2, ..good }.check(0.1).is_err());
    }

    #[test]
    fn a_late_producer_is_waited_for_at_speed_and_keeps_its_time() {
        let (mut stream, mut points) = stream(1);
        push(&mut stream, 0.001).unwrap().unwrap();
        let mut seen = Vec::new();
        for cycle in 0..6 {
            // The points of cycles 1 and 2 come with those of cycle 3 and 4.
            if cycle == 3 {
                for at in [0.002, 0.003, 0.004, 0.005] {
                    push(&mut stream, at).unwrap().unwrap();
                }
            }
            seen.push((stream.take(&mut points, &[limits()]), (points[0].position_turns * 1e6).round()));
        }
        use Due::{Late, Point};
        let expected = [(Point, 1e3), (Late, 2e3), (Late, 3e3), (Point, 4e3), (Point, 5e3), (Late, 6e3)];
        assert_eq!(seen, expected);
        assert_eq!(stream.dropped(), 2);
    }

    #[test]
    fn a_producer_that_stays_away_is_an_underrun_and_one_that_ends_is_not() {
        let (mut stream, mut points) = stream(1);
        push(&mut stream, 0.001).unwrap().unwrap();
        let dues: Vec<_> = (0..4).map(|_| stream.take(&mut points, &[limits()])).collect();
        assert_eq!(dues, [Due::Point, Due::Late, Due::Late, Due::Underrun]);
        stream.end();
        assert_eq!(stream.take(&mut points, &[limits()]), Due::End);
    }

    #[test]
    fn what_breaks_a_limit_is_refused_and_leaves_the_stream_as_it_was() {
        let (mut stream, _) = stream(1);
        assert_eq!(
            push(&mut stream, 0.003).unwrap_err().to_string(),
            "axis 1 would need a velocity of 1080 deg/s, and its limit is 720 deg/s: let the path take longer, or change \
             the limit"
        );
        push(&mut stream, 0.001).unwrap().unwrap();
        let error = push(&mut stream, 0.0005).unwrap_err();
        // From 1 turn/s to -0.5 turns/s in a millisecond.
        assert!(
            matches!(error, PathError::TooFast { quantity: Quantity::Acceleration, needed, .. } if (needed - 1500.0).abs() < 1e-6)
        );
        assert!(matches!(push(&mut stream, f64::NAN), Err(PathError::NoNumber { axis: 1, .. })));
        assert_eq!(stream.queued(), 1);
        for at in [0.002, 0.003, 0.004] {
            push(&mut stream, at).unwrap().unwrap();
        }
        assert_eq!(push(&mut stream, 0.005), Ok(Err(Full)));
    }

    #[test]
    fn a_path_that_was_left_while_it_braked_is_not_joined_beyond_the_limits() {
        let (mut stream, mut points) = stream(1);
        // 1 turn/s, then braking by 0.5 turns/s in each millisecond: 500 turns/s2, half of the limit.
        push(&mut stream, 0.001).unwrap().unwrap();
        assert_eq!(stream.take(&mut points, &[limits()]), Due::Point);
        for _ in 0..2 {
            assert_eq!(stream.take(&mut points, &[limits()]), Due::Late);
        }
        for at in [0.0015, 0.0015, 0.0015] {
            push(&mut stream, at).unwrap().unwrap();
        }
        // From 3 mm of way at 1 turn/s back to 1.5 in a cycle: 2500 turns/s2.
        let before = points;
        assert_eq!(stream.take(&mut points, &[limits()]), Due::OutOfReach { cycles: 2 });
        assert_eq!(points, before, "nothing of it is sent");
    }

    #[test]
    fn a_path_that_has_bent_little_meanwhile_is_joined_again() {
        let (mut stream, mut points) = stream(1);
        push(&mut stream, 0.001).unwrap().unwrap();
        assert_eq!(stream.take(&mut points, &[limits()]), Due::Point);
        assert_eq!(stream.take(&mut points, &[limits()]), Due::Late);
        // 100 turns/s2 in two cycles: 0.1 turns/s a cycle; it would be at 0.0029, 0.0037.
        for at in [0.0019, 0.0027, 0.0035] {
            push(&mut stream, at).unwrap().unwrap();
        }
        assert_eq!(stream.take(&mut points, &[limits()]), Due::Point);
        assert_eq!(points[0].position_turns, 0.0027);
        assert!(points[0].acceleration_turns_s2.abs() <= 1000.0, "{points:?}");
    }
}
