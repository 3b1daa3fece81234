//! A rig whose shaft is attached or coupled: see [`shaft`](crate::shaft).

use core::f64::consts::TAU;

use crate::angle::Angle;
use crate::attachment::Attachment;
use crate::mechanics::{Load, RotorData, RotorModel};
use crate::rig::Rig;
use crate::shaft::{Attached, Coupled, HELD_NM, Motion, PendingStep, Push, Turned};

impl Rig {
    /// What is attached, if anything is.
    pub fn attached(&self) -> Option<&Attached> {
        self.attached.as_ref()
    }

    /// What is attached, as a value; nothing at all if nothing is.
    pub fn attachment(&self) -> Attachment {
        self.attached.map_or_else(Attachment::default, |attached| attached.what)
    }

    /// Joins these things to the load of a shaft that is at `angle` now, in place of those before.
    pub(crate) fn attach(&mut self, what: Attachment, rotor: &RotorModel, angle: Angle) {
        self.attached = match &self.attached {
            _ if what.is_empty() => None,
            Some(attached) => Some(attached.changed(what, rotor, angle)),
            None => Some(Attached::new(what, rotor, angle)),
        };
    }

    /// From now on the shaft moves with the machine that it is coupled to.
    pub(crate) fn couple(&mut self) {
        self.coupled.get_or_insert_default();
    }

    /// True if the shaft moves with a machine that others move too.
    pub fn is_coupled(&self) -> bool {
        self.coupled.is_some()
    }

    /// What the shaft did to the machine in the step that waits for its motion.
    pub fn push(&self) -> Option<Push> {
        self.coupled.map(|coupled| coupled.push)
    }

    /// True if the shaft is not a plain one.
    #[inline]
    pub(crate) fn is_joined(&self) -> bool {
        self.attached.is_some() | self.coupled.is_some()
    }

    /// Energy of the rotor and all that turns with it of its own, and of what is wound up.
    pub(crate) fn mechanical_j(&self, rotor: &RotorModel, data: &RotorData) -> f64 {
        match &self.attached {
            Some(attached) => attached.stored_j(rotor, data, &self.load),
            None => rotor.kinetic_energy_j(data, &self.load),
        }
    }

    /// The bearings seize: shaft and load stand from now on. What that takes from the moving masses, which goes into the bearings as
    /// heat.
    #[cold]
    pub(crate) fn seize(&mut self, model: &RotorModel, rotor: &mut RotorData) -> f64 {
        let kinetic_j = if self.is_coupled() { 0.0 } else { self.stop(model, rotor) };
        self.load.locked = true;
        kinetic_j
    }

    /// Stops a shaft that is not coupled: a coupled one stops with its machine.
    fn stop(&mut self, model: &RotorModel, rotor: &mut RotorData) -> f64 {
        let before_j = self.mechanical_j(model, rotor);
        if let Some(Attached { gear: Some((_, gear)), .. }) = &mut self.attached {
            gear.output_velocity_rad_s = 0.0;
        }
        *rotor = RotorData { angle: rotor.angle, ..RotorData::default() };
        before_j - self.mechanical_j(model, rotor)
    }

    /// One step of an attached shaft.
    pub(crate) fn turn_attached(
        &mut self,
        rotor: (&RotorModel, &mut RotorData),
        dt_s: f64,
        motor_nm: f64,
        brake_nm: f64,
    ) -> Turned {
        let mut plain = Attached { what: Attachment::default(), gear: None };
        self.attached.as_mut().unwrap_or(&mut plain).turn(&self.load, rotor, dt_s, motor_nm, brake_nm)
    }

    /// The plain load of a coupled shaft for the step to come, at the load.
    pub(crate) fn expected_load(&self, angle: Angle, velocity_rad_s: f64, dt_s: f64) -> Load {
        self.attached.map_or(self.load, |attached| {
            attached.what.expected(&self.load, attached.load_angle(angle), velocity_rad_s, dt_s)
        })
    }

    /// What a coupled shaft without a gear does to its machine.
    pub(crate) fn push_directly(&mut self, rotor: (&RotorModel, &RotorData), pending: PendingStep, brake_nm: f64) {
        let (model, data) = rotor;
        let load = self.expected_load(data.angle, data.velocity_rad_s, pending.dt_s);
        let held_nm = if load.locked { HELD_NM } else { 0.0 };
        let push = Push {
            velocity_rad_s: data.velocity_rad_s,
            torque_nm: pending.motor_nm - load.torque_nm,
            inertia_kg_m2: model.inertia_kg_m2 + load.inertia_kg_m2,
            dry_nm: model.coulomb_nm + load.coulomb_nm + brake_nm + held_nm,
            viscous_nm_s: model.viscous_nm_s + load.viscous_nm_s,
        };
        self.coupled = Some(Coupled { push, pending });
    }

    /// Moves a coupled shaft as its machine did, and says what became of the motor's work. `None` if it does not wait.
    pub(crate) fn follow(&mut self, rotor: &mut RotorData, motion: &Motion) -> Option<(PendingStep, Turned)> {
        let Coupled { push, pending } = self.coupled?;
        let way_rad = motion.mean_rad_s * pending.dt_s;
        let before = push.velocity_rad_s;
        let after = motion.velocity_rad_s;
        *rotor = RotorData {
            angle: rotor.angle.advanced_by(way_rad / TAU),
            velocity_rad_s: after,
            velocity_change_rad_s: if after == 0.0 { 0.0 } else { after - before },
        };
        let friction_j = (motion.dry_nm + push.viscous_nm_s * motion.mean_rad_s) * way_rad;
        let kinetic_j = 0.5 * push.inertia_kg_m2 * (after + before) * (after - before);
        let load_j = pending.motor_nm * way_rad - friction_j - kinetic_j;
        Some((pending, Turned { mean_rad_s: motion.mean_rad_s, friction_j, load_j }))
    }
}
