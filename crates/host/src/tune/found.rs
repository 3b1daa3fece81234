//! What was found of a drive, from what was measured.

use devices::{Loops, Quantity, Scale};
use sim::MotorData;
use tune::{BackEmf, Friction, Loop, Mechanics, Response, Unusable};

use super::bench::Measurement;
use super::setup::Setup;

/// What a drive and its load are.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The measured frequency response, per actual current where the current loop is known.
    /// `None` of a drive that is known by readings.
    pub response: Option<Response>,
    /// One or two masses.
    pub mechanics: Mechanics,
    /// What the speed loop sees: the same per current demand. What the current loop lets through of the back-emf damps it.
    pub plant: Mechanics,
    /// Currents that steady motion takes.
    pub friction: Friction,
    /// The speed loop with the drive's own gains: those that it was measured with may have been lower.
    pub own: Loop,
    /// The share of the drive's own gains with which it was measured.
    pub gain_share: f64,
    /// Samples that were put between their neighbours: they did not come in their cycle.
    pub filled: usize,
    /// How many times larger inertia and gains are than they seem by the samples: 1 where those are close enough.
    pub larger: f64,
    /// Torque per ampere: the motor's, from its data.
    pub torque_constant_nm_a: f64,
}

impl Found {
    /// From what was measured.
    ///
    /// # Errors
    /// Why nothing can be said of it.
    pub fn of(
        measured: &Measurement,
        setup: &Setup,
        loops: &Loops,
        (motor, torque_constant_nm_a): (&MotorData, f64),
    ) -> Result<Self, Unusable> {
        let response = tune::response(&measured.samples, Some(&measured.excitation))?;
        let value = |quantity: Quantity| match quantity.scale {
            Scale::PerCount(worth) => setup.had(quantity.object).map(|raw| raw as f64 * worth),
            _ => None,
        };
        let filter_s = loops.speed_filter.and_then(value).unwrap_or(0.0);
        let plant = tune::identify(&response)?;
        let around = tune::identify_loop(&response, &plant, filter_s)?;
        let (proportional, integral) = setup.shares(measured.gain_share);
        let own =
            Loop { proportional: around.proportional / proportional, integral: around.integral / integral, ..around };
        let current = loops.current.and_then(|(kp, ki)| value(kp).zip(value(ki)));
        let response = current.map_or_else(
            || response.clone(),
            |(proportional, integral)| response.without(&back_emf(motor, torque_constant_nm_a, proportional, integral)),
        );
        Ok(Self {
            mechanics: tune::identify(&response)?,
            plant,
            friction: tune::fit_friction(&measured.runs)?,
            response: Some(response),
            own,
            gain_share: measured.gain_share,
            filled: measured.filled,
            larger: 1.0,
            torque_constant_nm_a,
        })
    }

    /// The same with so many times the inertia, moved by so many times the current: one that was seen too small by its samples.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let scaled = |it: Mechanics| Mechanics { gain: it.gain / factor, ..it };
        let own =
            Loop { proportional: self.own.proportional * factor, integral: self.own.integral * factor, ..self.own };
        let (mechanics, plant) = (scaled(self.mechanics), scaled(self.plant));
        Self { mechanics, plant, own, larger: self.larger * factor, ..self.clone() }
    }

    /// Inertia of all that turns, at the motor's shaft.
    pub fn inertia_kg_m2(&self) -> f64 {
        self.mechanics.inertia_kg_m2(self.torque_constant_nm_a)
    }

    /// Dry friction at the motor's shaft.
    pub fn dry_nm(&self) -> f64 {
        self.friction.dry_a * self.torque_constant_nm_a
    }

    /// Viscous friction at the motor's shaft.
    pub fn viscous_nm_s(&self) -> f64 {
        self.friction.viscous_a_s_rad * self.torque_constant_nm_a
    }

    /// The highest frequency up to which the shaft was seen to follow, Hz; infinite where it is described and not measured.
    pub fn seen_hz(&self) -> f64 {
        self.response.as_ref().map_or(f64::INFINITY, Response::seen_hz)
    }

    /// What comes late in the speed loop, from the current that it asks for to the speed that it compares, its filter apart.
    pub fn loop_delay_s(&self) -> f64 {
        self.plant.delay_s + self.own.seen_late_s
    }
}

/// Of the model's own motor, or of one with another torque per ampere: both are by the same magnets.
fn back_emf(motor: &MotorData, torque_constant_nm_a: f64, proportional: f64, integral: f64) -> BackEmf {
    let windings = &motor.windings;
    BackEmf {
        constant_v_s: windings.back_emf_constant_v_s() * torque_constant_nm_a / windings.torque_constant_nm_a(),
        resistance_ohm: windings.resistance_ohm,
        inductance_h: windings.inductance_q_h,
        proportional,
        integral,
    }
}
