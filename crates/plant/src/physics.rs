//! What a motor of any kind does at a moment, as seen from inside it.
//!
//! In goes nothing: it is read from a motor's state and changes none of it. What a drive's sensors make of it is
//! [`sense`](crate::HubMotor::sense).

use crate::angle::Angle;
use crate::rig::{Energy, Rig};

/// Torques, currents, temperatures and energies of a motor.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Physics {
    /// Torque of the motor on its rotor in N·m, mean over the last step, cogging and detent included.
    pub motor_torque_nm: f64,
    /// Torque that the load gives at its own shaft in N·m, positive against positive motion: what is active, a spring, end stops,
    /// a fan. Neither friction nor what holds a locked shaft, and not what other motors do to a machine that they share.
    pub load_torque_nm: f64,
    /// Angle of the load in rad, many turns: behind a gear if there is one.
    pub load_angle_rad: f64,
    /// Currents of the wires in A, positive into the motor: U, V, W, or those of a stepper's two phases.
    pub phase_current_a: [Option<f64>; 3],
    /// Voltage that the source is set to in V; the bus may have another.
    pub source_v: f64,
    /// True temperature of the winding in °C.
    pub winding_c: f64,
    /// True temperature of the power stage's heat sink in °C.
    pub heat_sink_c: f64,
    /// Temperature of the surroundings in °C.
    pub ambient_c: f64,
    /// Where energy came from and went, in J since the begin.
    pub energy: Energy,
    /// Energy stored now in J: in all that moves, in springs, in the winding's field and in the bus capacitor.
    pub stored_j: f64,
}

impl Physics {
    /// What a rig knows of it, of a load that stands here and turns so fast.
    pub(crate) fn of_rig(rig: &Rig, load: (Angle, f64)) -> Self {
        let (angle, velocity_rad_s) = load;
        let load_torque_nm = match rig.attached() {
            None => rig.load.torque_nm,
            Some(attached) => attached.what().torque_nm(&rig.load, angle, velocity_rad_s),
        };
        Self {
            load_torque_nm,
            load_angle_rad: angle.as_rad(),
            source_v: rig.supply.source_v,
            winding_c: rig.winding.temperature_c,
            heat_sink_c: rig.heat_sink.temperature_c,
            ambient_c: rig.ambient_c,
            energy: rig.energy,
            ..Self::default()
        }
    }
}

/// Velocity of a load whose shaft turns so fast.
pub(crate) fn load_velocity_rad_s(rig: &Rig, shaft_rad_s: f64) -> f64 {
    rig.attached().map_or(shaft_rad_s, |attached| attached.load_velocity_rad_s(shaft_rad_s))
}
