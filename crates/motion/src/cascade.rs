//! Position loop around a velocity loop around a current set-point.
//!
//! ```text
//! velocity* = clamp(kp_position * position error + k_velocity * planned velocity)
//! current*  = clamp(PI(velocity* - velocity) + k_acceleration * planned acceleration + k_friction * velocity*)
//! ```
//!
//! The position error is an argument, not two positions: integers of counts are subtracted before they become an
//! `f32`, so nothing is lost far from zero. The position loop is proportional only; with the velocity feed-forward
//! at one it follows a profile without lag, and the velocity loop's integral holds against a load.

use crate::limits::symmetric;
use crate::pid::{Pi, PiGains};

/// Gains of both loops, in radians of the motor's shaft and amperes of q current.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CascadeGains {
    /// Velocity per position error, 1/s.
    pub position_per_s: f32,
    /// Share of the planned velocity that is fed forward, 1 for no lag.
    pub velocity_feed_forward: f32,
    /// Velocity controller: A/(rad/s) and A/rad.
    pub velocity: PiGains,
    /// Current per planned acceleration, A/(rad/s²): inertia over torque constant for no lag.
    pub acceleration_feed_forward: f32,
    /// Current per demanded velocity, A/(rad/s): viscous friction over torque constant.
    pub friction_feed_forward: f32,
    /// Highest velocity the position loop may ask for.
    pub velocity_limit_rad_s: f32,
}

/// What the planner asks for, relative to what is measured.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PositionDemand {
    /// Planned position less measured position.
    pub error_rad: f32,
    /// Planned velocity.
    pub velocity_rad_s: f32,
    /// Planned acceleration.
    pub acceleration_rad_s2: f32,
}

/// What a velocity mode asks for.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct VelocityDemand {
    /// Planned velocity.
    pub velocity_rad_s: f32,
    /// Planned acceleration.
    pub acceleration_rad_s2: f32,
}

/// State of the cascade.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cascade {
    /// The velocity controller.
    pub velocity: Pi,
}

impl Cascade {
    /// One period of position control; returns the current set-point in A, within `current_limit_a`.
    #[inline]
    pub fn position(
        &mut self,
        gains: &CascadeGains,
        demand: &PositionDemand,
        velocity_rad_s: f32,
        current_limit_a: f32,
        dt_s: f32,
    ) -> f32 {
        let wanted = gains.position_per_s * demand.error_rad + gains.velocity_feed_forward * demand.velocity_rad_s;
        let inner = VelocityDemand {
            velocity_rad_s: symmetric(wanted, gains.velocity_limit_rad_s),
            acceleration_rad_s2: demand.acceleration_rad_s2,
        };
        self.velocity(gains, &inner, velocity_rad_s, current_limit_a, dt_s)
    }

    /// One period of velocity control; returns the current set-point in A, within `current_limit_a`.
    #[inline]
    pub fn velocity(
        &mut self,
        gains: &CascadeGains,
        demand: &VelocityDemand,
        velocity_rad_s: f32,
        current_limit_a: f32,
        dt_s: f32,
    ) -> f32 {
        let feed_forward = gains.acceleration_feed_forward * demand.acceleration_rad_s2
            + gains.friction_feed_forward * demand.velocity_rad_s;
        let error = demand.velocity_rad_s - velocity_rad_s;
        self.velocity.update(&gains.velocity, error, feed_forward, current_limit_a.max(0.0), dt_s)
    }

    /// Forgets the past, or takes over at a current that already flows so that the change of mode is not felt.
    pub fn reset(&mut self, current_a: f32) {
        self.velocity.integral = current_a;
    }
}
