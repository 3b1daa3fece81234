//! A tuning in plain values, with units in the names: as Python and a page give it.

use std::path::PathBuf;
use std::time::Duration;

use master::cyclic::CyclicOptions;
use serde::Deserialize;
use tune::{Objective, Turned};
use words::failure::Failure;

use super::{Bounds, RampRequest, Request};

/// Longest time for the transaction with proposed values.
const WITHIN: Duration = Duration::from_secs(60);

/// What gains are to reach, and what the motion of the measurement keeps to.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Order {
    /// The objective: where the gain of the speed loop falls to one; the phase margin without it.
    pub bandwidth_hz: Option<f64>,
    /// The objective: what is to be left there.
    pub phase_margin_deg: f64,
    /// The gain of the position loop too.
    #[serde(default)]
    pub position: bool,
    /// Highest speed of the motor's shaft; that which is usual for the model without it.
    pub speed_rpm: Option<f64>,
    /// Most current that the speed loop may ask for meanwhile.
    pub current_a: f64,
    /// Farthest that the motor's shaft may turn from where it stands.
    pub travel_turns: f64,
    /// Time from one sample to the next; the shortest that drive and bus keep up with without it.
    #[serde(default)]
    pub period_ms: Option<f64>,
    /// Torque per ampere, where the motor is not the model's own.
    pub torque_constant_nm_a: Option<f64>,
}

impl Order {
    /// A phase margin of 40° for the speed loop, with what is usual of all else.
    pub(super) fn usual() -> Self {
        let Bounds { current_a, travel_turns, .. } = Bounds::default();
        Self {
            bandwidth_hz: None,
            phase_margin_deg: 40.0,
            position: false,
            speed_rpm: None,
            current_a,
            travel_turns,
            period_ms: None,
            torque_constant_nm_a: None,
        }
    }

    /// The request, with this usual speed.
    ///
    /// # Errors
    /// What is out of range, and what is not.
    pub fn request(&self, usual_rpm: f64, cyclic: CyclicOptions, journal: Option<PathBuf>) -> Result<Request, Failure> {
        let request = Request {
            objective: self.bandwidth_hz.map_or(Objective::PhaseMargin(self.phase_margin_deg), Objective::Bandwidth),
            with_position: self.position,
            period: self.period_ms.map(|period_ms| time("a period", period_ms)).transpose()?,
            bounds: Bounds {
                speed_rpm: self.speed_rpm.map_or(usual_rpm, f64::abs),
                current_a: self.current_a.abs(),
                travel_turns: self.travel_turns,
            },
            cyclic,
            torque_constant_nm_a: self.torque_constant_nm_a,
            journal,
            on_kept: |_| (),
            apply: false,
            within: WITHIN,
        };
        request.check().map(|()| request)
    }
}

/// What a stepper turns, and how fast it is to be.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadOrder {
    /// Inertia of what it turns, without its rotor.
    pub inertia_kg_m2: f64,
    /// Dry friction of that.
    pub friction_nm: f64,
    /// What pushes its shaft in one direction, such as a weight.
    pub load_nm: f64,
    /// Speed that is to be reached.
    pub speed_rpm: f64,
    /// How many times the torque that is needed there is to be.
    pub margin: f64,
    /// Time in which the speed is to be reached; the shortest that keeps the margin without it.
    pub ramp_ms: Option<f64>,
}

impl LoadOrder {
    /// The request; nothing is written for it.
    ///
    /// # Errors
    /// What is out of range, and what is not.
    pub fn request(&self) -> Result<RampRequest, Failure> {
        let request = RampRequest {
            load: Turned {
                inertia_kg_m2: self.inertia_kg_m2,
                dry_nm: self.friction_nm,
                viscous_nm_s: 0.0,
                load_nm: self.load_nm,
            },
            speed_rpm: self.speed_rpm,
            margin: self.margin,
            ramp: self.ramp_ms.map(|ramp_ms| time("a ramp", ramp_ms)).transpose()?,
            journal: None,
            on_kept: |_| (),
            apply: false,
            within: WITHIN,
        };
        request.check().map(|()| request)
    }
}

fn time(what: &str, ms: f64) -> Result<Duration, Failure> {
    Duration::try_from_secs_f64(ms / 1e3)
        .map_err(|_| Failure::usage(format!("expected {what} of 0 ms or more, got {ms} ms")))
}
