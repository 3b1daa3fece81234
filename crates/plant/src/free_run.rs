//! What a shaft does in the end when nothing drives or holds it but its load: the velocity at which friction and the idle bridge
//! take as much as the load gives.

use crate::clamp::ClampModel;
use crate::gear::GearModel;
use crate::hub_motor::HubMotor;
use crate::joint_motor::JointMotor;
use crate::mechanics::RotorModel;
use crate::pmsm::{PmsmModel, SQRT_3};
use crate::rig::{Rig, RigModel};
use crate::stepper_motor::StepperMotor;

/// Halvings of a range: to the last bit of any.
const HALVINGS: u32 = 60;

/// Where a free shaft ends up. Velocities are the motor's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FreeRun {
    /// Friction, or a brake, holds it.
    Held,
    /// It turns at this velocity in the end.
    Turns {
        /// Signed.
        velocity_rad_s: f64,
    },
    /// It goes on until its bearings seize, at this velocity.
    Seizes {
        /// Signed.
        velocity_rad_s: f64,
    },
}

/// What stands against the load, at the motor.
struct Resistance<'a> {
    rig: &'a Rig,
    rotor: RotorModel,
    /// Friction at the output of a joint's own reducer.
    output_coulomb_nm: f64,
    /// Turns of the motor per turn of the load.
    ratio: f64,
    limit_rad_s: f64,
    brake_nm: f64,
}

impl Resistance<'_> {
    /// `None` without a torque, where spring or stops decide, where something holds the shaft fast, or where others move it too.
    fn free_run(&self, generator_nm: impl Fn(f64) -> f64) -> Option<FreeRun> {
        let what = self.rig.attachment();
        let load = &self.rig.load;
        if what.spring.is_some() || what.stops.is_some() || load.locked || self.rig.is_coupled() {
            return None;
        }
        let drive_nm = what.active_nm(load) / self.ratio;
        if drive_nm == 0.0 {
            return None;
        }
        let against = |velocity: f64| {
            let at_load = velocity / self.ratio;
            let fan_nm = what.fan.map_or(0.0, |fan| {
                let relative = at_load / fan.velocity_rad_s;
                fan.torque_nm * relative * relative
            });
            let output_nm = what.dry_nm(load, at_load) + self.output_coulomb_nm + load.viscous_nm_s * at_load + fan_nm;
            self.rotor.coulomb_nm + self.brake_nm + self.rotor.viscous_nm_s * velocity + output_nm / self.ratio
        };
        if drive_nm.abs() <= against(0.0) {
            return Some(FreeRun::Held);
        }
        let excess_nm = |velocity: f64| drive_nm.abs() - against(velocity) - generator_nm(velocity);
        // A positive load drives backwards.
        let signed = |velocity: f64| -velocity.copysign(drive_nm);
        if excess_nm(self.limit_rad_s) > 0.0 {
            return Some(FreeRun::Seizes { velocity_rad_s: signed(self.limit_rad_s) });
        }
        let velocity_rad_s = signed(root(0.0, self.limit_rad_s, excess_nm));
        Some(FreeRun::Turns { velocity_rad_s })
    }
}

/// Where a falling function passes zero.
fn root(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let halved = |(low, high): (f64, f64), _| {
        let middle = 0.5 * (low + high);
        if f(middle) > 0.0 { (middle, high) } else { (low, middle) }
    };
    (0..HALVINGS).fold((low, high), halved).0
}

/// Torque that the idle bridge asks of a motor which a load turns: its voltage charges the bus, up to where electronics and
/// suppressors take what comes. `counter` is the amplitude per bus voltage that stands against the back-emf.
fn bridge_torque_nm(
    motor: &PmsmModel,
    (model, rig, clamp): (&RigModel, &Rig, &ClampModel),
    path_ohm: f64,
    counter: f64,
    velocity_rad_s: f64,
) -> f64 {
    let emf_v = motor.back_emf_constant_v_s() * velocity_rad_s;
    let source_v = if rig.supply.connected { rig.supply.source_v } else { 0.0 };
    let open_v = emf_v / counter;
    if open_v <= source_v || velocity_rad_s <= 0.0 {
        return 0.0;
    }
    let inductance_h = 0.5 * (motor.inductance_d_h + motor.inductance_q_h);
    let reactance = f64::from(motor.pole_pairs) * velocity_rad_s * inductance_h;
    // |(R i + V) + j X i| = emf: the bridge's voltage is in phase with the current.
    let square = path_ohm * path_ohm + reactance * reactance;
    let current_a = |bus_v: f64| {
        let against_v = counter * bus_v;
        let along = path_ohm * against_v;
        (libm::sqrt(along * along + square * (emf_v * emf_v - against_v * against_v)) - along) / square
    };
    let surplus_w =
        |bus_v: f64| 1.5 * counter * bus_v * current_a(bus_v) - clamp.power_w(bus_v) - model.supply.consumption_w;
    let bus_v = if surplus_w(source_v) > 0.0 { root(source_v, open_v, surplus_w) } else { source_v };
    let current = current_a(bus_v);
    1.5 * current * (path_ohm * current + counter * bus_v) / velocity_rad_s
}

impl HubMotor {
    /// What the shaft does in the end while the bridge idles and its load stays as it is; see [`FreeRun`]. `None` where that
    /// is not for friction and bridge to decide.
    pub fn free_run(&self, brake_released: bool) -> Option<FreeRun> {
        if self.wires_touch {
            return None;
        }
        let model = &self.model;
        let ratio = self.rig.attachment().gear.map_or(1.0, |gear| gear.ratio);
        let resistance = Resistance {
            rig: &self.rig,
            rotor: model.rotor,
            output_coulomb_nm: 0.0,
            ratio,
            limit_rad_s: model.bearing_limit_rad_s,
            brake_nm: model.brake.torque_nm(brake_released),
        };
        let surroundings = (&model.rig, &self.rig, &model.clamp);
        let path_ohm = self.rig.path_ohm(&model.rig);
        resistance.free_run(|velocity| bridge_torque_nm(&model.pmsm, surroundings, path_ohm, 1.0 / SQRT_3, velocity))
    }
}

impl JointMotor {
    /// What the shaft does in the end while the bridge idles and its load stays as it is; see [`FreeRun`]. `None` where that
    /// is not for friction and bridge to decide.
    pub fn free_run(&self, brake_released: bool) -> Option<FreeRun> {
        let model = &self.model;
        let GearModel { ratio, coulomb_nm, viscous_nm_s, output_coulomb_nm, mesh_loss, .. } = model.gear;
        // What goes backward through the teeth loses their share on the way.
        let load_nm = self.rig.attachment().active_nm(&self.rig.load).abs();
        let rotor = RotorModel {
            coulomb_nm: model.rotor.coulomb_nm + coulomb_nm,
            viscous_nm_s: model.rotor.viscous_nm_s + viscous_nm_s,
            ..model.rotor
        };
        let through_nm = (load_nm - output_coulomb_nm).max(0.0);
        let resistance = Resistance {
            rig: &self.rig,
            rotor,
            output_coulomb_nm: output_coulomb_nm + mesh_loss * through_nm,
            ratio,
            limit_rad_s: model.bearing_limit_rad_s,
            brake_nm: model.brake.torque_nm(brake_released),
        };
        let surroundings = (&model.rig, &self.rig, &model.clamp);
        let path_ohm = self.rig.path_ohm(&model.rig);
        resistance.free_run(|velocity| bridge_torque_nm(&model.pmsm, surroundings, path_ohm, 1.0 / SQRT_3, velocity))
    }
}

impl StepperMotor {
    /// What the shaft does in the end while the bridges idle and its load stays as it is; see [`FreeRun`]. `None` where that
    /// is not for friction and bridges to decide.
    pub fn free_run(&self) -> Option<FreeRun> {
        let model = &self.model;
        let ratio = self.rig.attachment().gear.map_or(1.0, |gear| gear.ratio);
        // The detent holds a rotor as friction does, but takes nothing from one that turns.
        let rotor = model.rotor;
        let drive_nm = self.rig.attachment().active_nm(&self.rig.load).abs() / ratio;
        if drive_nm > 0.0 && drive_nm <= model.stepper.detent_nm + rotor.coulomb_nm + self.rig.load.coulomb_nm / ratio {
            return Some(FreeRun::Held);
        }
        let resistance = Resistance {
            rig: &self.rig,
            rotor,
            output_coulomb_nm: 0.0,
            ratio,
            limit_rad_s: model.bearing_limit_rad_s,
            brake_nm: 0.0,
        };
        let surroundings = (&model.rig, &self.rig, &model.clamp);
        // Two phases of two bridges as three of one: each stands with the whole bus against its voltage, a square wave whose
        // fundamental is 4 / pi of it.
        let path_ohm = 1.5 * self.rig.path_ohm(&model.rig);
        let motor = model.stepper.three_phase_equivalent();
        resistance.free_run(|velocity| {
            bridge_torque_nm(&motor, surroundings, path_ohm, 4.0 / core::f64::consts::PI, velocity)
        })
    }
}
