//! What of a tuning is drawn.

use serde::Serialize;
use tune::{Complex, Line, Mechanics};

use super::{StepResponse, Trial};

/// Curves of a tuning, in time.
#[derive(Clone, Debug, Serialize)]
pub struct Curves {
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
    /// As it was measured of the twin; `None` of a capture, which has none.
    pub twin: Option<GainAndPhase>,
}

impl ResponseRow {
    /// What was measured at one frequency, what the model is there, and the twin.
    pub(super) fn of(line: &Line, model: &Mechanics, twin: Option<Complex<f64>>) -> Self {
        Self {
            hz: line.hz,
            coherence: line.coherence,
            drive: line.plant.into(),
            model: model.response(line.omega()).into(),
            twin: twin.map(GainAndPhase::from),
        }
    }
}

impl From<Complex<f64>> for GainAndPhase {
    fn from(value: Complex<f64>) -> Self {
        Self { db: 20.0 * value.norm().log10(), deg: value.arg().to_degrees() }
    }
}

/// A point of a frequency response.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GainAndPhase {
    /// Magnitude, in dB of 1 (rad/s)/A.
    pub db: f64,
    /// Phase from -180 to 180 degrees.
    pub deg: f64,
}
