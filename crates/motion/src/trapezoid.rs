//! Profiles of constant acceleration and deceleration, for drives that are given them in units/s² (the M joint
//! motors' objects 6083h and 6084h in r/min/s).

use crate::profile::{self, MoveLimits, Profile, Shape, SpeedChange, sane, sane_speed};

/// Change of velocity from `from` to `to` (units/s) at `acceleration` (units/s²); zero acceleration is a step.
pub fn velocity_change(from: f64, to: f64, acceleration: f64) -> Profile {
    let (from, to) = (sane(from), sane(to));
    profile::velocity_change(Shape::Linear, from, to, (to - from).abs() * pace(acceleration))
}

/// A move from one position to another.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PositionMove {
    /// Signed way to go, in units.
    pub distance: f64,
    /// Present velocity, units/s, signed.
    pub velocity: f64,
    /// Speed that a motion from rest begins with, units/s.
    pub start_speed: f64,
    /// Speed of the plateau, units/s. With zero the motion only comes to rest, short of its distance.
    pub max_speed: f64,
    /// Speed that the motion ends from, units/s.
    pub end_speed: f64,
    /// Units/s²; zero means without a ramp.
    pub acceleration: f64,
    /// Units/s²; zero means without a ramp.
    pub deceleration: f64,
}

impl PositionMove {
    /// Plans the move; see [`scurve::PositionMove::plan`](crate::scurve::PositionMove::plan) for odd inputs.
    pub fn plan(&self) -> Profile {
        let max_speed = sane_speed(self.max_speed);
        let limits = MoveLimits {
            start_speed: sane_speed(self.start_speed).min(max_speed),
            max_speed,
            end_speed: sane_speed(self.end_speed).min(max_speed),
            acceleration: SpeedChange::Pace(pace(self.acceleration)),
            deceleration_pace: pace(self.deceleration),
            stopping_pace: pace(self.deceleration),
        };
        profile::position_move(Shape::Linear, sane(self.distance), sane(self.velocity), limits)
    }
}

/// Slowest ramp that is planned, units/s²: keeps the arithmetic finite.
const SLOWEST: f64 = 1e-6;

/// Seconds per unit of speed; zero acceleration has none.
fn pace(acceleration: f64) -> f64 {
    let acceleration = sane(acceleration).abs();
    if acceleration == 0.0 { 0.0 } else { 1.0 / acceleration.max(SLOWEST) }
}
