//! Between a firmware whose power stage follows by itself and the plant's closed form of it.

use drives::engine::actuator::servo::{CurrentDemand, CurrentGains, Dq as LoopDq, Followed};
use plant::angle::Axis;
use plant::current_loop::{CurrentLoop, KnownMotor};
use plant::mechanics::RotorData;
use plant::pmsm::{Dq, PmsmData, PmsmModel};

/// What the firmware asks for, as the plant takes it, while the rotor stands where the firmware saw it.
#[inline]
pub(super) fn current_loop(
    demand: &CurrentDemand,
    gains: &CurrentGains,
    model: &PmsmModel,
    rotor: &RotorData,
) -> CurrentLoop {
    let CurrentDemand { setpoint_a, electrical_turns } = demand;
    let ahead_turns = model.electrical_turns(rotor.angle) - f64::from(*electrical_turns);
    let ahead_turns = ahead_turns - ahead_turns.round();
    CurrentLoop {
        setpoint_a: Dq { d: f64::from(setpoint_a.d), q: f64::from(setpoint_a.q) },
        ahead: Axis::at_small_rad(ahead_turns * core::f64::consts::TAU),
        proportional: f64::from(gains.controller.proportional),
        integral_per_s: f64::from(gains.controller.integral_per_s),
        known: KnownMotor {
            inductance_d_h: f64::from(gains.feed_forward.inductance_d_h),
            inductance_q_h: f64::from(gains.feed_forward.inductance_q_h),
            flux_linkage_wb: f64::from(gains.feed_forward.flux_linkage_wb),
        },
        modulation_limit: f64::from(gains.modulation_limit),
        voltage_lag_s: f64::from(gains.voltage_lag_s),
    }
}

/// What became of it, as the firmware takes it.
// Apart, so that a look at the sensors each control period stays as small as it is.
#[cold]
#[inline(never)]
pub(super) fn followed(rotor: &RotorData, pmsm: &PmsmData) -> Followed {
    let vector = |Dq { d, q }: Dq| LoopDq { d: d as f32, q: q as f32 };
    Followed {
        velocity_rad_s: (rotor.velocity_rad_s - 0.5 * rotor.velocity_change_rad_s) as f32,
        current_a: vector(pmsm.current_loop.seen_a),
        wanted_v: vector(pmsm.current_loop.wanted_v),
        saturated: pmsm.current_loop.saturated,
    }
}
