//! The wheel motor's published constants (see `plant::hub_motors`) and what follows from them.
//!
//! q current in A (peak value of a phase), torque in N·m, speed of the shaft in rad/s.

use plant::hub_motor::HubMotorModel;

const MODEL: HubMotorModel = HubMotorModel::ZLLG65ASM250_L;

pub(crate) const RAD_S_PER_RPM: f64 = core::f64::consts::PI / 30.0;
pub(crate) const COUNTS_PER_TURN: f64 = 4096.0;

/// Resistance of a phase with its switch, at the ambient temperature of 25 °C.
pub(crate) fn phase_ohm() -> f64 {
    winding_ohm(25.0) + MODEL.rig.switch_resistance_ohm
}

/// Resistance of a phase of the winding at a temperature: copper.
pub(crate) fn winding_ohm(celsius: f64) -> f64 {
    MODEL.pmsm.resistance_ohm * (1.0 + MODEL.rig.resistance_per_k * (celsius - 20.0))
}

/// Torque of 1 A: 3/2 p psi.
pub(crate) fn torque_per_a() -> f64 {
    1.5 * emf_per_rad_s()
}

/// Peak voltage that one phase induces at 1 rad/s: p psi.
pub(crate) fn emf_per_rad_s() -> f64 {
    f64::from(MODEL.pmsm.pole_pairs) * MODEL.pmsm.flux_linkage_wb
}

/// Friction and iron loss at a speed.
pub(crate) fn friction_nm(rad_s: f64) -> f64 {
    MODEL.rotor.coulomb_nm + MODEL.rotor.viscous_nm_s * rad_s
}

pub(crate) fn inertia_kg_m2() -> f64 {
    MODEL.rotor.inertia_kg_m2
}

pub(crate) fn bus_capacitance_f() -> f64 {
    MODEL.rig.supply.capacitance_f + MODEL.rig.supply.source_capacitance_f
}

pub(crate) fn source_capacitance_f() -> f64 {
    MODEL.rig.supply.source_capacitance_f
}

/// Time that the free wheel takes from a speed to rest: J dw/dt = -(dry + viscous w).
pub(crate) fn coasting_time_s(rad_s: f64) -> f64 {
    let rotor = MODEL.rotor;
    rotor.inertia_kg_m2 / rotor.viscous_nm_s * (1.0 + rotor.viscous_nm_s * rad_s / rotor.coulomb_nm).ln()
}

/// Speed at which the induced voltage and the drop of the no-load current use up `share` of what a bus can give
/// (amplitude of the phase voltage: bus / sqrt 3).
pub(crate) fn no_load_rpm(bus_v: f64, share: f64) -> f64 {
    let phase_v = share * bus_v / 3_f64.sqrt();
    let ideal = phase_v / emf_per_rad_s();
    let drop_v = phase_ohm() * friction_nm(ideal) / torque_per_a();
    (phase_v - drop_v) / emf_per_rad_s() / RAD_S_PER_RPM
}

/// Winding's warming after `time_s` of steady heat: one body of resistance Rth and capacity C.
pub(crate) fn warming_k(heat_w: f64, time_s: f64) -> f64 {
    let body = MODEL.rig.winding;
    heat_w * body.resistance_k_w * (1.0 - (-time_s / body.time_constant_s()).exp())
}
