//! Motors on one shaft: two hub motors on an axle, a motor and its brake motor, a test bench of drive and load.

use core::f64::consts::TAU;

use super::friction::{MOST, System};
use crate::angle::Angle;
use crate::shaft::{Motion, Push};

/// What never changes about the shaft.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CommonShaftModel {
    /// Inertia of the shaft alone, kg·m².
    pub inertia_kg_m2: f64,
    /// Dry friction of its bearings, N·m.
    pub coulomb_nm: f64,
    /// Viscous friction of its bearings, N·m·s/rad.
    pub viscous_nm_s: f64,
}

/// Its state.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CommonShaftData {
    /// Its angle since the motors were joined.
    pub angle: Angle,
    /// Its velocity.
    pub velocity_rad_s: f64,
}

impl CommonShaftModel {
    pub(super) fn step(&self, data: &mut CommonShaftData, dt_s: f64, pushes: &[Push]) -> [Motion; MOST] {
        let sum = |part: fn(&Push) -> f64| pushes.iter().map(part).sum::<f64>();
        let inertia = self.inertia_kg_m2 + sum(|push| push.inertia_kg_m2);
        let viscous = self.viscous_nm_s + sum(|push| push.viscous_nm_s);
        let dry = self.coulomb_nm + sum(|push| push.dry_nm);
        let before = data.velocity_rad_s;
        let mut system = System::new(1);
        system.matrix[0][0] = inertia / dt_s + 0.5 * viscous;
        system.push[0] = sum(|push| push.torque_nm) + (inertia / dt_s - 0.5 * viscous) * before;
        system.dry[0] = dry;
        let mut was = [0.0; MOST];
        was[0] = before;
        let after = system.velocities(&was);
        let friction_nm = system.friction(&after)[0];
        let mean_rad_s = 0.5 * (before + after[0]);
        data.velocity_rad_s = after[0];
        data.angle = data.angle.advanced_by(mean_rad_s * dt_s / TAU);
        // Each bearing has its share of what friction there is.
        let share = |push: &Push| if dry > 0.0 { friction_nm * push.dry_nm / dry } else { 0.0 };
        core::array::from_fn(|i| {
            let dry_nm = pushes.get(i).map_or(0.0, share);
            Motion { velocity_rad_s: after[0], mean_rad_s, dry_nm }
        })
    }
}
