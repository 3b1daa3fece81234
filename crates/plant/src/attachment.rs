//! What a shaft can be joined to beyond an inertia, a torque and plain friction: friction that is greater at rest, a weight on a
//! drum, a spring, end stops, a fan, a gear with backlash.
//!
//! ```text
//! friction   coulomb + (static - coulomb) exp(-(w / stribeck)^2)          Stribeck
//! pulley     mass * g * radius, and mass * radius^2 of inertia           its rope is always taut
//! spring     stiffness * (angle - rest)
//! stops      stiffness * (angle beyond the stop) + damping * w           pushes, never pulls
//! fan        torque * (w / speed)^2, against the motion
//! ```
//!
//! All of it is what an [`Attachment`] adds to the [`Load`] of a step. The torques go by where the shaft is in the middle of the
//! step (the implicit midpoint rule) and, where they change their slope, by what their energy changes by over the way: so a
//! step is stable however stiff a stop is, a spring keeps its energy, and a stop gives back no more than it took.

use core::f64::consts::TAU;

use crate::angle::Angle;
use crate::gear::{GearModel, mean_spring_torque};
use crate::mechanics::{Load, RotorModel};

/// Standard acceleration of gravity (ISO 80000-3), m/s².
pub const GRAVITY_M_S2: f64 = 9.806_65;

/// Newton's rule doubles the digits; a step into a stop takes three to five, and this ends a chatter.
const NEWTON_STEPS: u32 = 12;
/// Relative change of the way at which it is done.
const NEWTON_DONE: f64 = 1e-12;
/// Assumed: damping over stiffness of a load gear's torsion, that of the joints' gears.
const TORSION_DAMPING_S: f64 = 50e-6;
/// Inertia of a load gear's output wheel over the motor's, seen through the gear. The gear's equations need some.
pub const OUTPUT_WHEEL_SHARE: f64 = 0.01;

/// Dry friction that is greater at rest. The friction of a fast shaft is the load's `coulomb_nm`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stribeck {
    /// Torque that breaks it loose; not less than `coulomb_nm`.
    pub static_nm: f64,
    /// Velocity at which the excess has fallen to 1/e.
    pub velocity_rad_s: f64,
}

/// A weight on a rope around a drum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulley {
    /// Its mass.
    pub mass_kg: f64,
    /// Radius of the drum; positive if positive motion lifts the weight, negative if it lowers it.
    pub radius_m: f64,
}

/// A torsion spring to a fixed point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Torque per angle.
    pub stiffness_nm_rad: f64,
    /// Where it gives no torque.
    pub rest: Angle,
}

/// Stops that end the way of a shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stops {
    /// Lower end of the way, if it has one.
    pub low: Option<Angle>,
    /// Upper end of the way, if it has one.
    pub high: Option<Angle>,
    /// Torque per angle beyond an end.
    pub stiffness_nm_rad: f64,
    /// Torque per velocity while it is pressed.
    pub damping_nm_s_rad: f64,
}

/// A fan or a pump: torque that grows with the square of the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fan {
    /// Torque at this velocity.
    pub torque_nm: f64,
    /// The velocity; positive.
    pub velocity_rad_s: f64,
}

/// A gear between the shaft and its load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadGear {
    /// Turns of the shaft per turn of the load.
    pub ratio: f64,
    /// Angle by which the load is loose while the shaft stands still.
    pub backlash_rad: f64,
    /// Torsional stiffness, at the load.
    pub stiffness_nm_rad: f64,
}

/// What a shaft is joined to. Angles and torques are those of the load: behind the gear, if there is one.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Attachment {
    /// More friction at rest.
    pub stribeck: Option<Stribeck>,
    /// A weight.
    pub pulley: Option<Pulley>,
    /// A spring.
    pub spring: Option<Spring>,
    /// End stops.
    pub stops: Option<Stops>,
    /// A fan.
    pub fan: Option<Fan>,
    /// A gear in front of all that.
    pub gear: Option<LoadGear>,
}

impl Pulley {
    /// Torque on the shaft, positive against positive motion.
    pub fn torque_nm(&self) -> f64 {
        self.mass_kg * GRAVITY_M_S2 * self.radius_m
    }

    /// Inertia of the weight at the shaft.
    pub fn inertia_kg_m2(&self) -> f64 {
        self.mass_kg * self.radius_m * self.radius_m
    }
}

impl LoadGear {
    /// The gear's equations, for a motor of this inertia. It has no friction of its own, and never breaks.
    pub(crate) fn model(&self, rotor: &RotorModel) -> GearModel {
        GearModel {
            ratio: self.ratio,
            stiffness_nm_rad: self.stiffness_nm_rad,
            damping_nm_s_rad: TORSION_DAMPING_S * self.stiffness_nm_rad,
            backlash_rad: self.backlash_rad,
            output_inertia_kg_m2: OUTPUT_WHEEL_SHARE * rotor.inertia_kg_m2 * self.ratio * self.ratio,
            coulomb_nm: 0.0,
            viscous_nm_s: 0.0,
            mesh_loss: 0.0,
            output_coulomb_nm: 0.0,
            kinematic_error_rad: 0.0,
            rated_nm: f64::MAX,
            peak_nm: f64::MAX,
            ratchet_nm: f64::MAX,
        }
    }
}

impl Attachment {
    /// Nothing at all.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// The torque that does the same work whichever way it is done: the load's and the weight's.
    pub fn active_nm(&self, load: &Load) -> f64 {
        load.torque_nm + self.pulley.map_or(0.0, |pulley| pulley.torque_nm())
    }

    /// Inertia that turns with the load.
    pub fn inertia_kg_m2(&self, load: &Load) -> f64 {
        load.inertia_kg_m2 + self.pulley.map_or(0.0, |pulley| pulley.inertia_kg_m2())
    }

    /// Dry friction at a velocity.
    pub fn dry_nm(&self, load: &Load, velocity_rad_s: f64) -> f64 {
        let Some(Stribeck { static_nm, velocity_rad_s: scale }) = self.stribeck else { return load.coulomb_nm };
        let excess_nm = (static_nm - load.coulomb_nm).max(0.0);
        let relative = velocity_rad_s / scale;
        load.coulomb_nm + excess_nm * libm::exp(-relative * relative)
    }

    /// Torque of all that does more than rub at an angle and a velocity of the load: active torques, spring, stops and fan.
    /// Positive against positive motion.
    pub fn torque_nm(&self, load: &Load, angle: Angle, velocity_rad_s: f64) -> f64 {
        let at = Deflection::new(self, angle);
        let spring_nm = self.spring.map_or(0.0, |spring| spring.stiffness_nm_rad * at.spring_rad);
        let stops_nm = self.stops.map_or(0.0, |stops| {
            let pressed_rad = at.pressed_rad(0.0);
            let torque_nm = stops.stiffness_nm_rad * pressed_rad + stops.damping_nm_s_rad * velocity_rad_s;
            // A stop that is left behind does not pull.
            if torque_nm * pressed_rad <= 0.0 { 0.0 } else { torque_nm }
        });
        let fan_nm = self.fan.map_or(0.0, |fan| {
            let relative = velocity_rad_s / fan.velocity_rad_s;
            fan.torque_nm * relative * relative.abs()
        });
        self.active_nm(load) + spring_nm + stops_nm + fan_nm
    }

    /// Energy in spring and stops at an angle of the load.
    pub fn energy_j(&self, angle: Angle) -> f64 {
        Deflection::new(self, angle).energy_j(self, 0.0)
    }

    /// One step of the load from this angle and velocity. `attempt` moves whatever the load hangs on under a plain load, and
    /// returns its mean velocity over the step and what else came of it; the last attempt counts.
    pub(crate) fn step<T>(
        &self,
        load: &Load,
        (angle, velocity_rad_s): (Angle, f64),
        dt_s: f64,
        mut attempt: impl FnMut(&Load) -> (f64, T),
    ) -> (T, AttachedWork) {
        let at = Deflection::new(self, angle);
        let mut way_rad = velocity_rad_s * dt_s;
        let mut steps = 1;
        loop {
            let (mean, outcome) = attempt(&self.during(load, &at, velocity_rad_s, dt_s, way_rad));
            let change = (mean * dt_s - way_rad).abs();
            way_rad = mean * dt_s;
            if change <= NEWTON_DONE * way_rad.abs() || steps == NEWTON_STEPS {
                return (outcome, self.work(load, &at, way_rad));
            }
            steps += 1;
        }
    }

    /// The plain load that acts while the shaft turns on by about `way_rad`: its torque, and as viscous friction how that
    /// changes if the way is another.
    fn during(&self, load: &Load, at: &Deflection, velocity_rad_s: f64, dt_s: f64, way_rad: f64) -> Load {
        let mut torque_nm = self.active_nm(load);
        let mut viscous_nm_s = load.viscous_nm_s;
        if let Some(Spring { stiffness_nm_rad, .. }) = self.spring {
            torque_nm += stiffness_nm_rad * at.spring_rad;
            viscous_nm_s += 0.5 * stiffness_nm_rad * dt_s;
        }
        if let Some(stops) = self.stops {
            let (stop_nm, slope) = at.stop_torque(&stops, dt_s, way_rad);
            torque_nm += stop_nm - slope * way_rad;
            viscous_nm_s += slope * dt_s;
        }
        if let Some(fan) = self.fan {
            // k w |w|, and its tangent.
            let mean = way_rad / dt_s;
            let slope = fan.torque_nm * mean.abs() / (fan.velocity_rad_s * fan.velocity_rad_s);
            torque_nm -= slope * mean;
            viscous_nm_s += 2.0 * slope;
        }
        Load {
            inertia_kg_m2: self.inertia_kg_m2(load),
            torque_nm,
            coulomb_nm: self.dry_nm(load, velocity_rad_s),
            viscous_nm_s,
            locked: load.locked,
        }
    }

    fn work(&self, load: &Load, at: &Deflection, way_rad: f64) -> AttachedWork {
        AttachedWork {
            stored_j: at.energy_j(self, way_rad) - at.energy_j(self, 0.0),
            load_j: self.active_nm(load) * way_rad,
        }
    }

    /// The plain load of a step in which the shaft goes on as it goes, for a machine that cannot try twice.
    pub(crate) fn expected(&self, load: &Load, angle: Angle, velocity_rad_s: f64, dt_s: f64) -> Load {
        self.during(load, &Deflection::new(self, angle), velocity_rad_s, dt_s, velocity_rad_s * dt_s)
    }
}

/// What became of the work in a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct AttachedWork {
    /// Into spring and stops.
    pub(crate) stored_j: f64,
    /// Done on the active torques.
    pub(crate) load_j: f64,
}

/// How far a load is from the places that matter.
struct Deflection {
    spring_rad: f64,
    above_low_rad: f64,
    above_high_rad: f64,
}

impl Deflection {
    fn new(attachment: &Attachment, angle: Angle) -> Self {
        let from = |place: Angle| angle.turns_from(place) * TAU;
        let stops = attachment.stops;
        Self {
            spring_rad: attachment.spring.map_or(0.0, |spring| from(spring.rest)),
            above_low_rad: stops.and_then(|stops| stops.low).map_or(f64::MAX, from),
            above_high_rad: stops.and_then(|stops| stops.high).map_or(f64::MIN, from),
        }
    }

    /// How far a stop is pressed after `way_rad` more.
    fn pressed_rad(&self, way_rad: f64) -> f64 {
        (self.above_high_rad + way_rad).max(0.0) + (self.above_low_rad + way_rad).min(0.0)
    }

    fn energy_j(&self, attachment: &Attachment, way_rad: f64) -> f64 {
        let half = |stiffness: f64, by_rad: f64| 0.5 * stiffness * by_rad * by_rad;
        let spring_j = attachment.spring.map_or(0.0, |spring| half(spring.stiffness_nm_rad, self.spring_rad + way_rad));
        spring_j + attachment.stops.map_or(0.0, |stops| half(stops.stiffness_nm_rad, self.pressed_rad(way_rad)))
    }

    /// Mean torque of the stops over a way, and its slope over that way.
    fn stop_torque(&self, stops: &Stops, dt_s: f64, way_rad: f64) -> (f64, f64) {
        let (before, after) = (self.pressed_rad(0.0), self.pressed_rad(way_rad));
        if before == 0.0 && after == 0.0 {
            return (0.0, 0.0);
        }
        let (spring_nm, slope) = mean_spring_torque(stops.stiffness_nm_rad, before, after, way_rad);
        let damping = stops.damping_nm_s_rad / dt_s;
        let torque_nm = spring_nm + damping * way_rad;
        // It has been left behind: it does not pull.
        if torque_nm * (before + after) <= 0.0 { (0.0, 0.0) } else { (torque_nm, slope + damping) }
    }
}
