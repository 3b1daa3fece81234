//! What the axes of a group may do, and when a set-point breaks it.

use core::fmt;
use core::ops::RangeInclusive;

use crate::units::Shown;

/// What an axis of a group may do. Every field has to be stated: a group without limits moves nothing. Angles are turns of the
/// output shaft, from the drive's own zero on.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisLimits {
    /// Where its set-points may be (software limits), in turns; `None` for an axis that turns without end.
    pub range_turns: Option<RangeInclusive<f64>>,
    /// Highest speed, in turns/s.
    pub velocity_turns_s: f64,
    /// Highest acceleration and deceleration, in turns/s^2.
    pub acceleration_turns_s2: f64,
    /// Highest jerk, in turns/s^3. The jerk of a stream is its producer's: see [`super::Stream`].
    pub jerk_turns_s3: f64,
    /// How far the shaft may be from its set-point before the group is stopped, in turns.
    pub following_error_turns: f64,
}

/// Where an axis is on its path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathPoint {
    /// In turns.
    pub position_turns: f64,
    /// In turns/s.
    pub velocity_turns_s: f64,
    /// In turns/s^2.
    pub acceleration_turns_s2: f64,
}

/// What a limit is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// In turns.
    Position,
    /// In turns/s.
    Velocity,
    /// In turns/s^2.
    Acceleration,
    /// In turns/s^3.
    Jerk,
    /// In turns.
    FollowingError,
}

/// Why nothing was moved. Axes count from 1, as in the group.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PathError {
    /// One value for each axis.
    #[error("{given} values were given for a group of {axes} axes: give one for each, in the order of the group")]
    Count {
        /// How many were given.
        given: usize,
        /// How many are expected.
        axes: usize,
    },
    /// A set-point is infinite or not a number.
    #[error("the set-point of axis {axis} is {value}: expected a finite number. Nothing was moved")]
    NoNumber {
        /// Which axis.
        axis: usize,
        /// What was given.
        value: f64,
    },
    /// A limit that allows nothing or that bounds nothing.
    #[error(
        "the limit of axis {axis} for {quantity} is {} {}: state a finite number above 0", degrees(*value), quantity.unit()
    )]
    BadLimit {
        /// Which axis.
        axis: usize,
        /// Of what.
        quantity: Quantity,
        /// What was given.
        value: f64,
    },
    /// Software limits that leave no place, or that are not numbers.
    #[error("the software limits of axis {axis} are {} to {} deg: state the lower one first, both finite", degrees(*low), degrees(*high))]
    BadRange {
        /// Which axis.
        axis: usize,
        /// The lower one.
        low: f64,
        /// The upper one.
        high: f64,
    },
    /// A position outside the software limits.
    #[error(
        "axis {axis} would be at {} deg, outside its software limits of {} to {} deg. Nothing was moved: \
         choose a position within, or change the limits", degrees(*at_turns), degrees(*low), degrees(*high)
    )]
    OutOfRange {
        /// Which axis.
        axis: usize,
        /// The position.
        at_turns: f64,
        /// The lower limit.
        low: f64,
        /// The upper limit.
        high: f64,
    },
    /// A position that its drive cannot count to.
    #[error(
        "axis {axis} would go to {} deg, and its drive counts positions of 32 bits, up to {} deg either way. Nothing was moved: \
         choose a position within", degrees(*to_turns), degrees(*most_turns)
    )]
    BeyondCounts {
        /// Which axis.
        axis: usize,
        /// The position, or the way to it.
        to_turns: f64,
        /// The most that it counts.
        most_turns: f64,
    },
    /// The points of a stream are too far apart, or turn too sharply.
    #[error(
        "axis {axis} would need {quantity} of {} {unit}, and its limit is {} {unit}: let the path take \
         longer, or change the limit", degrees(*needed), degrees(*limit), unit = quantity.unit()
    )]
    TooFast {
        /// Which axis.
        axis: usize,
        /// Of what.
        quantity: Quantity,
        /// What the points ask for.
        needed: f64,
        /// What is allowed.
        limit: f64,
    },
    /// The move takes longer than the time that it was given.
    #[error("the move takes {} s within its limits, and {} s were given: give more time, or raise a limit",
        Shown(*needed_s), Shown(*given_s))]
    TooLittleTime {
        /// What it takes.
        needed_s: f64,
        /// What was given.
        given_s: f64,
    },
    /// The planner found no way. The text is its own.
    #[error("no path within the limits was found ({0}). Nothing was moved: check positions and limits")]
    NoPath(String),
}

impl PathError {
    /// The axis that it is about, from 1, where it is about one.
    pub const fn axis(&self) -> Option<usize> {
        match self {
            Self::NoNumber { axis, .. }
            | Self::BadLimit { axis, .. }
            | Self::BadRange { axis, .. }
            | Self::OutOfRange { axis, .. }
            | Self::BeyondCounts { axis, .. }
            | Self::TooFast { axis, .. } => Some(*axis),
            Self::Count { .. } | Self::TooLittleTime { .. } | Self::NoPath(_) => None,
        }
    }
}

/// Turns as they are shown: in degrees, as machine files and the command line have them.
pub(super) const fn degrees(turns: f64) -> Shown {
    Shown(turns * 360.0)
}

impl Quantity {
    /// The unit in which its values are shown.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Position | Self::FollowingError => "deg",
            Self::Velocity => "deg/s",
            Self::Acceleration => "deg/s^2",
            Self::Jerk => "deg/s^3",
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Position => "a position",
            Self::Velocity => "a velocity",
            Self::Acceleration => "an acceleration",
            Self::Jerk => "a jerk",
            Self::FollowingError => "a following error",
        })
    }
}

/// The largest number of turns, and of turns/s and so on, that is taken for a real one: a planner's sums stay exact to a
/// thousandth of a count.
const MOST: f64 = 1e9;

impl AxisLimits {
    /// Conservative defaults: 30 r/min, 60 (r/min)/s reached within 100 ms, a lag of 0.2
    /// turns, no software limits.
    pub const fn careful() -> Self {
        Self {
            range_turns: None,
            velocity_turns_s: 0.5,
            acceleration_turns_s2: 1.0,
            jerk_turns_s3: 10.0,
            following_error_turns: 0.2,
        }
    }

    /// That each limit is one. The axis is for the message and counts from 1.
    ///
    /// # Errors
    /// [`PathError::BadLimit`], [`PathError::BadRange`].
    pub fn check(&self, axis: usize) -> Result<(), PathError> {
        let values = [
            (Quantity::Velocity, self.velocity_turns_s),
            (Quantity::Acceleration, self.acceleration_turns_s2),
            (Quantity::Jerk, self.jerk_turns_s3),
            (Quantity::FollowingError, self.following_error_turns),
        ];
        // Not `value <= 0.0`: NaN is not above 0 either.
        if let Some((quantity, value)) = values.into_iter().find(|(_, value)| !(*value > 0.0 && *value < MOST)) {
            return Err(PathError::BadLimit { axis, quantity, value });
        }
        match &self.range_turns {
            Some(range) if !(range.start() < range.end() && range.start().abs() < MOST && range.end().abs() < MOST) => {
                Err(PathError::BadRange { axis, low: *range.start(), high: *range.end() })
            }
            _ => Ok(()),
        }
    }

    /// That a set-point is a number and within the software limits.
    ///
    /// # Errors
    /// [`PathError::NoNumber`], [`PathError::OutOfRange`].
    pub fn check_position(&self, axis: usize, at_turns: f64) -> Result<(), PathError> {
        if at_turns.is_nan() || at_turns.abs() >= MOST {
            return Err(PathError::NoNumber { axis, value: at_turns });
        }
        match &self.range_turns {
            Some(range) if !range.contains(&at_turns) => {
                Err(PathError::OutOfRange { axis, at_turns, low: *range.start(), high: *range.end() })
            }
            _ => Ok(()),
        }
    }
}
