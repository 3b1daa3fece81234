//! S-shaped profiles from acceleration and deceleration *times*, as the ZL drives plan them.
//!
//! The times are those of the velocity change from the present to the target speed (ZLAC8030L quick start guide
//! V1.00, objects 6083h and 6084h, "S-shaped acceleration time"). Velocity runs as two joined parabolas, so the
//! acceleration is continuous and peaks in the middle at `2 * dv / T`, twice its mean.
//!
//! A move too short for its full speed keeps the pace of the full change, with a lower peak and shorter times: no
//! manual states it, but the alternative, the full times for any short move, would take a second for one count.

use crate::profile::{self, MoveLimits, Profile, Shape, SpeedChange, pace, sane, sane_speed, sane_time};

/// Change of velocity from `from` to `to` (units/s) in `time_s`. Zero time is a step.
pub fn velocity_change(from: f64, to: f64, time_s: f64) -> Profile {
    profile::velocity_change(Shape::Parabolic, sane(from), sane(to), sane_time(time_s))
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
    /// Time from the present (or start) speed to the plateau.
    pub acceleration_time_s: f64,
    /// Time from the plateau to the end speed.
    pub deceleration_time_s: f64,
}

impl PositionMove {
    /// Plans the move. Any input gives a finite plan: what is not a number counts as zero, signs of speeds are
    /// dropped, a start or end speed above the plateau counts as the plateau.
    pub fn plan(&self) -> Profile {
        let distance = sane(self.distance);
        let velocity = sane(self.velocity);
        let max_speed = sane_speed(self.max_speed);
        let start_speed = sane_speed(self.start_speed).min(max_speed);
        let end_speed = sane_speed(self.end_speed).min(max_speed);

        let deceleration_time_s = sane_time(self.deceleration_time_s);
        // A stop takes its share of the time from the plateau to rest.
        let stopping_pace = pace(deceleration_time_s, max_speed, 0.0).unwrap_or(0.0);
        let limits = MoveLimits {
            start_speed,
            max_speed,
            end_speed,
            acceleration: SpeedChange::Time(sane_time(self.acceleration_time_s)),
            deceleration_pace: pace(deceleration_time_s, max_speed, end_speed).unwrap_or(stopping_pace),
            stopping_pace,
        };
        profile::position_move(Shape::Parabolic, distance, velocity, limits)
    }
}
