//! A drive's shaft as another simulator moves it: motion in, torque out.
//!
//! The importer owns the joint. At each step it says where the joint is, and the shaft is moved through the step by the rule that was chosen
//! ([`sim::Rule`]); out comes the mean torque of the drive over the step. Control periods keep their own times: a step that begins between
//! two of them moves the shaft through those that begin in it, and its angle is taken to where the joint is in the same part of a period.

use std::time::Duration;

use can::Instant;
use sim::{CouplingError, ExternalModel, Given, LoneShaft, Rule, VirtualDrive};

use crate::variable::{Causality, Reference, Value, Variable};

const LOAD_INERTIA: Reference = 8;
const ANGLE: Reference = 13;
const VELOCITY: Reference = 14;
/// Torque of the drive at the joint, behind all that is measured of a drive.
pub(crate) const TORQUE: Reference = 215;
const INERTIA: Reference = 216;
/// The most inertia that a joint may have, kg·m²: that of any machine of a world.
const MOST_KG_M2: f64 = 1e6;

/// A joint, as the importer has set it.
#[derive(Clone)]
pub(crate) struct Joint {
    rule: Rule,
    /// Of the drive, kg·m².
    inertia_kg_m2: f64,
    /// Of the importer, so far as it is known, kg·m².
    load_inertia_kg_m2: f64,
    angle_rad: f64,
    velocity_rad_s: f64,
    /// When the first control period begins after the shaft was taken over, and how long each is.
    periods: (Instant, Duration),
}

impl Joint {
    /// That of a drive; `None` with [`Rule::Torque`], where the drive owns its motion.
    ///
    /// # Errors
    /// The drive has no shaft that can be taken over.
    pub(crate) fn of(drive: &dyn VirtualDrive, rule: Rule) -> Result<Option<Self>, CouplingError> {
        if rule == Rule::Torque {
            return Ok(None);
        }
        let (inertia_kg_m2, load_inertia_kg_m2, angle_rad, velocity_rad_s) = (0.0, 0.0, 0.0, 0.0);
        let periods = (Instant::ZERO, Duration::from_nanos(1));
        let joint = Self { rule, inertia_kg_m2, load_inertia_kg_m2, angle_rad, velocity_rad_s, periods };
        // A drive says what it has in its first control period: a copy looks ahead.
        let mut copy = drive.clone_box();
        copy.set_power(true, Instant::ZERO);
        let mut shaft = LoneShaft::couple(&mut *copy, joint.model(), Instant::ZERO)?;
        shaft.settle(&mut *copy, Instant::from_millis(1));
        Ok(Some(Self { inertia_kg_m2: shaft.inertia_kg_m2(), ..joint }))
    }

    /// The joint as it stands now.
    pub(crate) fn model(&self) -> ExternalModel {
        let Some(model) = ExternalModel::new(self.rule, &[(self.angle_rad, self.load_inertia_kg_m2)]) else {
            unreachable!("it has one joint")
        };
        model
    }

    /// The shaft was taken over at the begin; its next control period.
    pub(crate) fn begin(&mut self, next_period: (Instant, Duration)) {
        self.periods = next_period;
    }

    /// The exchange that a step is, from `from` to `to`: how long, and angle and velocity of the joint. `None` if no control period begins in it.
    pub(crate) fn exchange(&self, from: Instant, to: Instant) -> Option<(Duration, [f64; 1], [f64; 1])> {
        let (first, period_ns) = (self.periods.0, self.periods.1.as_nanos() as u64);
        let begun = |at: Instant| if at < first { 0 } else { at.nanos_since(first) / period_ns + 1 };
        let (before, after) = (begun(from), begun(to));
        // What was set is of the begin of the step; of its end where the shaft follows.
        let (at, begun) = if self.rule == Rule::Interpolate { (to, after) } else { (from, before) };
        let beside_s = (at.as_nanos() as f64 - (begun * period_ns) as f64) * 1e-9;
        let angle_rad = self.angle_rad - self.velocity_rad_s * beside_s;
        let dt = Duration::from_nanos((after - before) * period_ns);
        (after > before).then_some((dt, [angle_rad], [self.velocity_rad_s]))
    }

    /// What the importer sets, and what it needs to know of the drive.
    pub(crate) fn variables(&self) -> Vec<Variable> {
        use Causality::{Input, Output, Parameter};
        let known = "inertia at the joint beside the drive's own, as far as it is known; 0 if it is not";
        let angle = "angle of the joint, many turns: where the shaft is when time begins";
        let mean = "torque of the drive at the joint less its friction, the mean of the last step";
        let own = "inertia of the drive at the joint: what has to be there beside the importer's own";
        let zero = || Value::Float64(0.0);
        vec![
            Variable::new(LOAD_INERTIA, "load_inertia", Parameter, zero(), known).in_unit("kg.m2"),
            Variable::new(ANGLE, "joint_angle", Input, zero(), angle).in_unit("rad"),
            Variable::new(VELOCITY, "joint_velocity", Input, zero(), "velocity of the joint").in_unit("rad/s"),
            Variable::new(TORQUE, "joint_torque", Output, zero(), mean).in_unit("N.m").of_last_step(),
            Variable::new(INERTIA, "joint_inertia", Output, Value::Float64(self.inertia_kg_m2), own)
                .in_unit("kg.m2")
                .of_last_step(),
        ]
    }

    /// What was set, and the drive's inertia.
    pub(crate) fn get(&self, reference: Reference) -> Option<Value> {
        Some(Value::Float64(match reference {
            LOAD_INERTIA => self.load_inertia_kg_m2,
            ANGLE => self.angle_rad,
            VELOCITY => self.velocity_rad_s,
            INERTIA => self.inertia_kg_m2,
            _ => return None,
        }))
    }

    /// Whether [`set`](Self::set) would take it.
    ///
    /// # Errors
    /// A number beyond all reason.
    pub(crate) fn check(&self, reference: Reference, number: f64) -> Result<(), String> {
        let checked = match reference {
            ANGLE => Given::Motion(&[number], &[]).check(),
            VELOCITY => Given::Motion(&[], &[number]).check(),
            LOAD_INERTIA if !(0.0..=MOST_KG_M2).contains(&number) => {
                return Err(format!("an inertia is 0 to {MOST_KG_M2:e} kg·m², not {number}"));
            }
            _ => Ok(()),
        };
        checked.map_err(|error| error.to_string())
    }

    /// Writes what the importer sets; it acts from the next step on.
    ///
    /// # Errors
    /// As of [`check`](Self::check).
    pub(crate) fn set(&mut self, reference: Reference, number: f64) -> Result<(), String> {
        self.check(reference, number)?;
        match reference {
            LOAD_INERTIA => self.load_inertia_kg_m2 = number,
            ANGLE => self.angle_rad = number,
            VELOCITY => self.velocity_rad_s = number,
            _ => {}
        }
        Ok(())
    }
}
