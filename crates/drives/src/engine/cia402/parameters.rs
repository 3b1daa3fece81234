//! How a [`PowerDrive`](super::PowerDrive) is set, and what it shows.

use cia402::{HaltOption, QuickStopOption, StopRamp};

use super::power::DisableOptions;
use super::stop::ExternalStop;
use crate::engine::axis::{Cyclic, HomingParameters, MoveLimits, Ramp, VelocityRamps};

/// How the axis is set.
#[derive(Clone, Copy, Debug)]
pub struct Parameters {
    /// Speeds and ramps of position moves; the deceleration is also that of a slow-down.
    pub moves: MoveLimits,
    /// Speeds and ramps of velocity changes.
    pub velocity: VelocityRamps,
    /// Of a quick stop.
    pub quick_stop_ramp: Ramp,
    /// Slope of the torque, A/s; 0 for none.
    pub torque_slope_a_s: f32,
    /// 605Ah; also of the external stop and of the watch over the host.
    pub quick_stop: QuickStopOption,
    /// 605Bh and 605Ch.
    pub disable: DisableOptions,
    /// 605Dh.
    pub halt: HaltOption,
    /// What the option codes call the current limit or the voltage limit: how the drive does that.
    pub emergency_stop: StopRamp,
    /// How a limit switch stops a motion towards it; `None` lets it pass. Homing has rules of its own.
    pub limit_stop: Option<StopRamp>,
    /// Homing.
    pub homing: HomingParameters,
    /// How an external stop ends.
    pub external_stop: ExternalStop,
    /// Tolerances of the status.
    pub tolerances: Tolerances,
    /// When a mode that is asked for takes effect while the shaft is driven.
    pub mode_change: ModeChange,
}

/// When a mode that is asked for takes effect on a shaft that is driven (CiA 402-2 leaves it to the drive; 6061h shows it).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModeChange {
    /// Once it stands.
    AtStandstill,
    /// At once: the mode takes the shaft over as it turns.
    Turning,
}

/// When a target counts as reached.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tolerances {
    /// Counts.
    pub position: u32,
    /// Counts/s.
    pub velocity: f64,
    /// A.
    pub current_a: f32,
}

/// What the host wants of the modes that follow something at all times.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Targets {
    /// Profile velocity and velocity mode, counts/s.
    pub velocity: f64,
    /// Profile torque, A.
    pub current_a: f32,
    /// Interpolated position and the cyclic synchronous modes: the set-point of this period; `None` holds the shaft.
    pub cyclic: Option<Cyclic>,
}

/// What the statusword shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status {
    /// The mode's target is reached; while stopping: the motor stands.
    pub target_reached: bool,
    /// Set-point acknowledge.
    pub acknowledged: bool,
    /// The deviation of position is within its tolerance.
    pub in_position: bool,
    /// The motor stands.
    pub standing: bool,
    /// The motor turns, or is to.
    pub running: bool,
    /// The external stop acts.
    pub external_stop: bool,
    /// The last homing found its home position.
    pub homing_attained: bool,
    /// The last homing ended without.
    pub homing_error: bool,
    /// A limit switch stops the motion, or has ended the last move before its target.
    pub limit_active: bool,
}
