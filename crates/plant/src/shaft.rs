//! What a motor's shaft hangs on when it is more than a plain load: an [`Attachment`] of its own, or a machine that it shares with
//! other motors.
//!
//! A shaft that is *attached* is moved with its motor's step, as a free one is. One that is *coupled* is not: the motor's step
//! says what it does to the shaft (its [`Push`]), the owner of the machine moves all its shafts together, and each motor then
//! follows with the [`Motion`] that came of it. A free shaft is neither, and pays for no more than the question.

use core::f64::consts::TAU;

use crate::angle::Angle;
use crate::attachment::Attachment;
use crate::flows::Flows;
use crate::gear::{GearData, GearInput, GearModel};
use crate::mechanics::{Load, RotorData, RotorModel};

/// Holds against anything: the dry friction of a shaft that is held fast.
pub(crate) const HELD_NM: f64 = 1e12;

/// What a coupled motor does to its machine during one step. All of it is at the motor's shaft.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Push {
    /// How fast it turns.
    pub velocity_rad_s: f64,
    /// Torque of the motor, less what its own load takes.
    pub torque_nm: f64,
    /// Inertia of the rotor and of its own load.
    pub inertia_kg_m2: f64,
    /// Dry friction: motor, brake, load. That of a shaft held fast is endless.
    pub dry_nm: f64,
    /// Viscous friction.
    pub viscous_nm_s: f64,
}

/// What came of it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Motion {
    /// Velocity at the end of the step.
    pub velocity_rad_s: f64,
    /// Mean velocity over the step.
    pub mean_rad_s: f64,
    /// Torque that the dry friction gave, signed: positive against positive motion.
    pub dry_nm: f64,
}

/// An attachment at work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attached {
    pub(crate) what: Attachment,
    pub(crate) gear: Option<(GearModel, GearData)>,
}

/// A shaft that waits for its motion.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Coupled {
    pub(crate) push: Push,
    pub(crate) pending: PendingStep,
}

/// What a motor's step has already done when it waits for its motion.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct PendingStep {
    pub(crate) flows: Flows,
    pub(crate) motor_nm: f64,
    pub(crate) dt_s: f64,
    pub(crate) bleeder_on: bool,
}

/// How a shaft moved during one step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Turned {
    /// Mean velocity.
    pub(crate) mean_rad_s: f64,
    pub(crate) friction_j: f64,
    /// Work done on active torques, and on the machine that it is coupled to.
    pub(crate) load_j: f64,
}

impl Attached {
    /// The attachment, joined to a shaft that stands at this angle.
    pub(crate) fn new(what: Attachment, rotor: &RotorModel, angle: Angle) -> Self {
        let gear = what.gear.map(|gear| gear.model(rotor));
        Self { what, gear: gear.map(|model| (model, model.at_rest(angle))) }
    }

    /// What it is.
    pub fn what(&self) -> &Attachment {
        &self.what
    }

    /// The load's angle while the shaft is at one.
    pub fn load_angle(&self, shaft: Angle) -> Angle {
        self.gear.as_ref().map_or(shaft, |(model, data)| model.output_angle(data, shaft))
    }

    /// The load's velocity while the shaft has one.
    pub fn load_velocity_rad_s(&self, shaft_rad_s: f64) -> f64 {
        self.gear.as_ref().map_or(shaft_rad_s, |(_, data)| data.output_velocity_rad_s)
    }

    /// The same with other things joined; what is in the gear stays as it is, if the gear does.
    pub(crate) fn changed(&self, what: Attachment, rotor: &RotorModel, angle: Angle) -> Self {
        let fresh = Self::new(what, rotor, angle);
        if what.gear == self.what.gear { Self { what, gear: self.gear } } else { fresh }
    }

    /// Energy of all that moves and all that is wound up, the rotor included.
    pub(crate) fn stored_j(&self, rotor: &RotorModel, data: &RotorData, load: &Load) -> f64 {
        let whole = Load { inertia_kg_m2: self.what.inertia_kg_m2(load), ..*load };
        let wound_j = self.what.energy_j(self.load_angle(data.angle));
        match &self.gear {
            Some((model, gear)) => {
                wound_j + model.kinetic_energy_j(gear, rotor, data, &whole) + model.spring_energy_j(gear)
            }
            None => wound_j + rotor.kinetic_energy_j(data, &whole),
        }
    }

    /// One step of rotor and load, the rotor's angle included.
    pub(crate) fn turn(
        &mut self,
        load: &Load,
        rotor: (&RotorModel, &mut RotorData),
        dt_s: f64,
        motor_nm: f64,
        brake_nm: f64,
    ) -> Turned {
        let (model, data) = rotor;
        if load.locked {
            *data = RotorData { angle: data.angle, ..RotorData::default() };
            if let Some((_, gear)) = &mut self.gear {
                gear.output_velocity_rad_s = 0.0;
            }
            return Turned::default();
        }
        match &mut self.gear {
            None => {
                let before = *data;
                let ((moved, out), work) = self.what.step(load, (data.angle, data.velocity_rad_s), dt_s, |load| {
                    let mut rotor = before;
                    let out = model.step(&mut rotor, dt_s, motor_nm, load, brake_nm);
                    (out.velocity_rad_s, (rotor, out))
                });
                *data = RotorData { angle: before.angle.advanced_by(out.velocity_rad_s * dt_s / TAU), ..moved };
                let friction_j = out.friction_j + out.load_j - work.stored_j - work.load_j;
                Turned { mean_rad_s: out.velocity_rad_s, friction_j, load_j: work.load_j }
            }
            Some((gear_model, gear)) => {
                let before = (*data, *gear);
                let at = (gear_model.output_angle(gear, data.angle), gear.output_velocity_rad_s);
                let ((moved, out), work) = self.what.step(load, at, dt_s, |load| {
                    let (mut rotor, mut gear) = before;
                    let input = GearInput { motor_nm, brake_nm, load };
                    let out = gear_model.step(&mut gear, model, &mut rotor, dt_s, &input);
                    (out.output_velocity_rad_s, ((rotor, gear), out))
                });
                (*data, *gear) = moved;
                let friction_j = out.friction_j + out.load_j - work.stored_j - work.load_j;
                Turned { mean_rad_s: out.motor_velocity_rad_s, friction_j, load_j: work.load_j }
            }
        }
    }
}
