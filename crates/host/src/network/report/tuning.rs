//! What a tuning found of a node and proposed, before and after: from what `ferrodrive tune --json` has printed, or of a session.

use canopen::NodeId;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A tuning in a report. Torques and inertia are those at the motor's shaft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tuning {
    /// Its node-ID.
    pub node: u8,
    /// Its model.
    pub model: String,
    /// Inertia of all that turns.
    pub inertia_kg_m2: f64,
    /// Dry friction.
    pub dry_friction_nm: f64,
    /// Viscous friction.
    pub viscous_friction_nm_s: f64,
    /// Where the motor moves least, if the load swings.
    pub anti_resonance_hz: Option<f64>,
    /// Where it moves most.
    pub resonance_hz: Option<f64>,
    /// How far the twin is from what was measured.
    pub twin_off: f64,
    /// Values before, and proposed.
    pub gains: Vec<TunedGain>,
    /// Margins of the speed loop with the drive's gains.
    pub before: TunedLoop,
    /// Margins of the speed loop with those that are proposed.
    pub after: TunedLoop,
    /// Margins of the position loop, if it was asked for.
    pub position: Option<TunedLoop>,
    /// Error of a step and a load on the twin, r/min s, before and after.
    pub twin_error: [f64; 2],
    /// The same of a step on the drive, where it was tried there.
    pub drive_error: Option<[f64; 2]>,
    /// The drive has the proposed values.
    pub applied: bool,
    /// What else is to be known.
    pub notes: Vec<String>,
    /// The picture of it, as SVG; empty of a file.
    #[serde(skip)]
    pub picture: String,
}

/// An object of a proposal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TunedGain {
    /// Such as `201Dh:00`.
    pub object: String,
    /// Its name.
    pub name: String,
    /// What it had.
    pub before: i64,
    /// What is proposed.
    pub after: i64,
}

/// How far a loop is from being unstable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TunedLoop {
    /// Where its gain falls to one for the last time.
    pub crossover_hz: f64,
    /// Least phase where it is one.
    pub phase_deg: f64,
    /// Largest sensitivity.
    pub sensitivity: f64,
    /// Nyquist's criterion.
    pub stable: bool,
}

impl Tuning {
    /// What `ferrodrive tune NODE --json` has printed, of this node.
    ///
    /// # Errors
    /// In a sentence: it is something else, or that of another node.
    pub fn of_json(text: &str, node: NodeId) -> Result<Self, String> {
        let value: Value = serde_json::from_str(text.trim()).map_err(|error| format!("it is not JSON: {error}"))?;
        if value.get("gains").is_none() {
            return Err("it is not what `ferrodrive tune NODE --json` prints of a drive with gains".to_owned());
        }
        let tuning: Self = serde_json::from_value(value).map_err(|error| error.to_string())?;
        if tuning.node == node.raw() {
            return Ok(tuning);
        }
        Err(format!("it is of node {} ({}), not of node {node}", tuning.node, tuning.model))
    }
}
