//! What an axis can be asked to do.

use super::demand::Control;
use super::homing::HomingParameters;
use super::ramp::Ramp;
use super::speed::VelocityRamps;
use super::trajectory::{MoveLimits, TrajectoryPoint};

/// What the shaft is to do. Positions are counts, speeds counts/s, currents A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Task {
    /// Come to rest and stay. Given again it goes on, with the ramp last given.
    Hold {
        /// The loop.
        control: Control,
        /// Of a shaft that still turns.
        ramp: Ramp,
    },
    /// Go to a position. Given again it is planned anew, from where the shaft is to be by now.
    Move {
        /// The position, the short way round if the counter wraps in between.
        target: i32,
        /// Speeds and ramps.
        limits: MoveLimits,
    },
    /// Turn. To be given every period; planned anew when the velocity is another.
    Speed {
        /// Signed.
        velocity: f64,
        /// Speeds and ramps.
        ramps: VelocityRamps,
    },
    /// Pull. To be given every period.
    Torque {
        /// Signed.
        current_a: f32,
        /// A/s; 0 follows at once.
        slope_a_s: f32,
    },
    /// Be at a position after a time, straight. Given again it is the next set-point; after the last the shaft is held.
    Interpolate {
        /// The position.
        target: i32,
        /// s.
        time_s: f64,
        /// A position further away than this allows takes longer; 0 for any speed.
        max_speed: f64,
    },
    /// Follow a set-point that the host has planned. To be given every period.
    Cyclic(Cyclic),
    /// Find the home position. Given again it begins anew.
    Home(HomingParameters),
}

/// A set-point of this very period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cyclic {
    /// A position, with the velocity and acceleration to feed forward.
    Position(TrajectoryPoint),
    /// A velocity; its position does not matter.
    Velocity(TrajectoryPoint),
    /// A current, A.
    Torque(f32),
}

/// A stop, which lies over a task: when it is taken away the task goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// By which ramp it comes to rest, or whether it coasts.
    pub braking: Braking,
    /// The position stays on the planned way; or else it is given up, and the shaft held where it comes to rest.
    pub on_path: bool,
    /// What is done with a shaft that has come to rest.
    pub end: StopEnd,
    /// How long after its ramp the shaft may still turn before it is held all the same, s: a load that drives it may never
    /// let it rest.
    pub patience_s: f64,
}

/// How fast a stop is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Braking {
    /// Along a ramp.
    Ramp(Ramp),
    /// As fast as the current limit allows.
    CurrentLimit,
    /// The power stage is off, and the shaft coasts.
    Coast,
}

/// What is done with a shaft that has been stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopEnd {
    /// It is held.
    Hold,
    /// It is let go.
    LetGo,
}

/// How far a stop has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopState {
    /// The shaft is being brought to rest.
    Braking,
    /// It stands and is held.
    Held,
    /// The power stage is off.
    Free,
}
