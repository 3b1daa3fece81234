//! What of a tuning is drawn.

use serde::Serialize;

use super::{StepResponse, Trial};

/// Curves of a tuning.
#[derive(Clone, Debug, Serialize)]
pub struct Curves {
    /// Speed per current demand, by ascending frequencies; empty for a drive that is measured by SDO, which is too slow for it.
    pub response: Vec<ResponseRow>,
    /// The twin with the gains that the drive had, and with those proposed.
    pub twin: [Trial; 2],
    /// A step of the drive, before and after, once the values were tried there.
    pub drive: Option<[StepResponse; 2]>,
}

/// One frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ResponseRow {
    /// The frequency.
    pub hz: f64,
    /// Share of speed and current of the drive that follows from the excitation, 0 to 1.
    pub coherence: f64,
    /// As it was measured.
    pub drive: GainAndPhase,
    /// Of the model of one or two masses.
    pub model: GainAndPhase,
    /// As it was measured of the twin.
    pub twin: GainAndPhase,
}

/// A point of a frequency response.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GainAndPhase {
    /// Magnitude, in dB of 1 (rad/s)/A.
    pub db: f64,
    /// Phase from -180 to 180 degrees.
    pub deg: f64,
}
