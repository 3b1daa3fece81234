//! A turning inertia with friction that truly holds.
//!
//! ```text
//! J dw/dt = motor torque - load torque - viscous * w - dry friction * sign(w)
//! ```
//!
//! Dry friction is solved implicitly: it takes away exactly what is needed to stop and no more, so that a rotor at
//! rest under less torque than the friction stays at the same angle to the last bit. The load torque is active: a
//! positive one opposes positive motion, and it drives the motor when the motor does not hold it.

use crate::angle::Angle;

const INV_TAU: f64 = 1.0 / core::f64::consts::TAU;

/// rad/s in one r/min.
pub(crate) const RAD_S_PER_RPM: f64 = core::f64::consts::TAU / 60.0;

/// What never changes about a rotor and its bearings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotorModel {
    /// Inertia of the rotor alone.
    pub inertia_kg_m2: f64,
    /// Torque per velocity.
    pub viscous_nm_s: f64,
    /// Dry friction: torque against any motion, and the torque that holds at rest.
    pub coulomb_nm: f64,
}

/// What is joined to the shaft. All of it may be changed while running.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Load {
    /// Inertia that turns with the rotor.
    pub inertia_kg_m2: f64,
    /// Active torque, signed: positive opposes positive motion. A weight on a rope, a slope, another motor.
    pub torque_nm: f64,
    /// Passive dry friction of the load.
    pub coulomb_nm: f64,
    /// Passive viscous friction of the load.
    pub viscous_nm_s: f64,
    /// The shaft is held fast: nothing moves it.
    pub locked: bool,
}

/// State of the rotor.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RotorData {
    /// Mechanical angle.
    pub angle: Angle,
    /// Mechanical velocity.
    pub velocity_rad_s: f64,
    /// Change of the velocity over the last step, zero if the rotor came to rest in it.
    pub velocity_change_rad_s: f64,
}

/// What happened during one step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RotorOutput {
    /// Mean velocity over the step.
    pub velocity_rad_s: f64,
    /// Heat of all friction during the step, brake included.
    pub friction_j: f64,
    /// Work done on the active load torque; negative while the load drives.
    pub load_j: f64,
}

impl RotorModel {
    /// Energy of the turning masses.
    pub fn kinetic_energy_j(&self, data: &RotorData, load: &Load) -> f64 {
        0.5 * (self.inertia_kg_m2 + load.inertia_kg_m2) * data.velocity_rad_s * data.velocity_rad_s
    }

    /// Changes the velocity by one step of motor torque, load and a brake's friction; [`RotorData::turn`] moves the
    /// angle.
    ///
    /// Implicit midpoint: `w_mean = w + dt/2J * (torques at w_mean)`.
    #[inline]
    pub fn step(&self, data: &mut RotorData, dt_s: f64, motor_nm: f64, load: &Load, brake_nm: f64) -> RotorOutput {
        if load.locked {
            *data = RotorData { angle: data.angle, ..RotorData::default() };
            return RotorOutput::default();
        }
        let half_s = 0.5 * dt_s;
        let inertia = self.inertia_kg_m2 + load.inertia_kg_m2;
        let viscous = self.viscous_nm_s + load.viscous_nm_s;
        let dry = self.coulomb_nm + load.coulomb_nm + brake_nm;
        let before = data.velocity_rad_s;
        let torque = motor_nm - load.torque_nm;

        // Ready before the torque is: a division is slow.
        let mobility = 1.0 / (inertia + half_s * viscous);
        let drive = inertia * before + half_s * torque;
        let excess = (drive.abs() - half_s * dry).max(0.0);
        let mean = excess.copysign(drive) * mobility;
        let after = 2.0 * mean - before;
        let crosses_zero = mean == 0.0 || (after < 0.0) != (mean < 0.0);
        let mean = if crosses_zero && torque.abs() <= dry {
            data.velocity_rad_s = 0.0;
            data.velocity_change_rad_s = 0.0;
            stopping_velocity(inertia, before, torque, dry, dt_s)
        } else {
            data.velocity_rad_s = after;
            data.velocity_change_rad_s = after - before;
            mean
        };
        // What the torques brought in and is not kinetic energy now went into friction.
        let after = data.velocity_rad_s;
        let way_rad = mean * dt_s;
        let friction_j = torque * way_rad - 0.5 * inertia * (after + before) * (after - before);
        RotorOutput { velocity_rad_s: mean, friction_j, load_j: load.torque_nm * way_rad }
    }

    /// True if a rotor at rest stays so while the motor gives no torque.
    #[inline]
    pub(crate) fn holds(&self, load: &Load, brake_nm: f64) -> bool {
        load.locked || load.torque_nm.abs() <= self.coulomb_nm + load.coulomb_nm + brake_nm
    }
}

impl RotorData {
    /// At rest, and was so in the step before.
    #[inline]
    pub(crate) fn stands(&self) -> bool {
        self.velocity_rad_s == 0.0 && self.velocity_change_rad_s == 0.0
    }

    /// Turns the rotor on by one step, and returns the velocity it turned at.
    ///
    /// That is the velocity in the middle of the step if the acceleration stays what it was (the second-order
    /// Adams-Bashforth rule). Its error is the change of acceleration, which adds up to nothing in the long run; in
    /// exchange the angle does not wait for the torque of the same step. At rest and locked it is exactly zero.
    #[inline]
    pub fn turn(&mut self, dt_s: f64, load: &Load) -> f64 {
        if load.locked {
            return 0.0;
        }
        let velocity_rad_s = self.velocity_rad_s + 0.5 * self.velocity_change_rad_s;
        self.angle = self.angle.advanced_by(velocity_rad_s * dt_s * INV_TAU);
        velocity_rad_s
    }
}

/// Mean velocity of a step in which dry friction stops the rotor: half the velocity it had, for as long as it moved.
fn stopping_velocity(inertia: f64, before: f64, torque: f64, dry: f64, dt_s: f64) -> f64 {
    let deceleration_nm = dry - torque * 1_f64.copysign(before);
    let moving = (inertia * before.abs() / (deceleration_nm * dt_s)).min(1.0);
    0.5 * before * moving
}
