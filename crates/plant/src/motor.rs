//! What a motor of any kind has: a shaft, what is joined to it, and the [`Rig`] around it.
//!
//! What its windings and its own sensors do is each kind's. What stands here is what the owner of a machine does with any of
//! them.

use crate::angle::Angle;
use crate::attachment::Attachment;
use crate::mechanics::{RotorData, RotorModel};
use crate::physics::Physics;
use crate::pmsm::PmsmModel;
use crate::rig::{Rig, RigModel};
use crate::shaft::Motion;
use crate::stepper::Stepping;

/// A motor of any kind with its rig.
pub trait Motor: Clone + PartialEq {
    /// What the drive's pins do.
    type Pins;
    /// What the slow things may do to a motor that stands: what melts, what runs empty.
    type Wear: PartialEq;

    /// One step.
    fn step(&mut self, dt_s: f64, pins: &Self::Pins);

    /// Its shaft.
    fn rotor(&self) -> &RotorData;

    /// What never changes about its shaft.
    fn rotor_model(&self) -> &RotorModel;

    /// Its windings, of one with magnets.
    fn pmsm_model(&self) -> Option<&PmsmModel> {
        None
    }

    /// Its windings, of a stepper.
    fn stepping(&self) -> Option<Stepping> {
        None
    }

    /// Load, supply, temperatures and energies.
    fn rig(&self) -> &Rig;

    /// The same to change, and what hardly changes about these.
    fn rig_and_model(&mut self) -> (&mut Rig, &mut RigModel);

    /// What it does now.
    fn physics(&self) -> Physics;

    /// A resistor is across the bus, as long as the bus is where it is.
    fn bleeds(&self, pins: &Self::Pins) -> bool;

    /// The slow things, which are looked at once in so many steps.
    fn step_slow(&mut self);

    /// What these may have done.
    fn wear(&self) -> Self::Wear;

    /// Ends the step of a coupled motor.
    fn follow(&mut self, motion: &Motion);

    /// From now on the shaft is moved by [`follow`](Self::follow) after each step, for ever.
    fn couple(&mut self) {
        self.rig_and_model().0.couple();
    }

    /// Joins these things to the shaft, in place of those before. Not to a coupled one: what it shares it has already.
    fn attach(&mut self, what: Attachment) {
        let (rotor, angle) = (*self.rotor_model(), self.rotor().angle);
        self.rig_and_model().0.attach(what, &rotor, angle);
    }

    /// Where the load is: the shaft, or what is behind its load gear.
    fn load_angle(&self) -> Angle {
        let shaft = self.rotor().angle;
        self.rig().attached().map_or(shaft, |attached| attached.load_angle(shaft))
    }
}

/// What each kind answers by its own fields and methods.
macro_rules! parts {
    ($motor:ident) => {
        fn step(&mut self, dt_s: f64, pins: &Self::Pins) {
            $motor::step(self, dt_s, pins);
        }

        fn rotor(&self) -> &$crate::mechanics::RotorData {
            &self.rotor
        }

        fn rotor_model(&self) -> &$crate::mechanics::RotorModel {
            &self.model.rotor
        }

        fn rig(&self) -> &$crate::rig::Rig {
            &self.rig
        }

        fn rig_and_model(&mut self) -> (&mut $crate::rig::Rig, &mut $crate::rig::RigModel) {
            (&mut self.rig, &mut self.model.rig)
        }

        fn step_slow(&mut self) {
            $motor::step_slow(self);
        }
    };
}

pub(crate) use parts;
