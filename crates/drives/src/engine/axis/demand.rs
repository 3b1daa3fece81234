//! What passes between an axis and its control loops, in counts, seconds and amperes.

use super::trajectory::TrajectoryPoint;

/// What the control loops are to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Demand {
    /// Nothing: the power stage is off.
    Off,
    /// Be at a position.
    Position(TrajectoryPoint),
    /// Turn at a velocity.
    Velocity(TrajectoryPoint),
    /// Pull with a current, A.
    Torque(f32),
}

/// What the shaft does, in counts and counts/s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Feedback {
    /// Actual position.
    pub position: i32,
    /// Actual velocity.
    pub velocity: f64,
    /// Torque-producing current, A.
    pub current_a: f32,
    /// Slower than the drive's threshold of standstill.
    pub standing: bool,
}

/// The loop that a demand closes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Control {
    /// Position, with the velocity fed forward.
    #[default]
    Position,
    /// Velocity alone: a load may push the shaft away.
    Velocity,
}

impl Control {
    /// The demand for a point of a trajectory.
    pub(super) const fn demand(self, point: TrajectoryPoint) -> Demand {
        match self {
            Self::Position => Demand::Position(point),
            Self::Velocity => Demand::Velocity(point),
        }
    }
}
