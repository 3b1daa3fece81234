//! Friction, stiction and loads against closed forms.

use plant::angle::Angle;
use plant::mechanics::RotorOutput;
use plant::mechanics::{Load, RotorData, RotorModel};
use proptest::prelude::*;

const DT_S: f64 = 50e-6;
const ROTOR: RotorModel = RotorModel { inertia_kg_m2: 0.014, viscous_nm_s: 0.0, coulomb_nm: 0.1 };

fn moving(velocity_rad_s: f64) -> RotorData {
    RotorData { velocity_rad_s, ..RotorData::default() }
}

/// One whole step of a rotor: it turns, then its velocity changes.
fn step(model: &RotorModel, rotor: &mut RotorData, torque_nm: f64, load: &Load, brake_nm: f64) -> RotorOutput {
    rotor.turn(DT_S, load);
    model.step(rotor, DT_S, torque_nm, load, brake_nm)
}

#[test]
fn dry_friction_stops_a_coasting_rotor_after_the_closed_form_and_then_it_rests_exactly() {
    let mut rotor = moving(10.0);
    let mut steps = 0_u32;
    while rotor.velocity_rad_s != 0.0 {
        step(&ROTOR, &mut rotor, 0.0, &Load::default(), 0.0);
        steps += 1;
    }
    // J w / T and J w^2 / 2 T.
    assert!((f64::from(steps) * DT_S - 1.4).abs() < 2.0 * DT_S);
    assert!((rotor.angle.as_rad() - 7.0).abs() < 1e-7, "{}", rotor.angle.as_rad());
    let rest = rotor.angle;
    for _ in 0..1000 {
        step(&ROTOR, &mut rotor, 0.0999, &Load::default(), 0.0);
        step(&ROTOR, &mut rotor, -0.0999, &Load::default(), 0.0);
    }
    assert_eq!(rotor.angle, rest);
}

#[test]
fn torque_above_the_friction_breaks_it_loose_and_accelerates_by_the_rest() {
    let mut rotor = RotorData::default();
    for _ in 0..20_000 {
        step(&ROTOR, &mut rotor, 0.17, &Load::default(), 0.0);
    }
    assert!((rotor.velocity_rad_s - 0.07 / 0.014).abs() < 1e-9);
    assert!((rotor.angle.as_rad() - 0.5 * 0.07 / 0.014).abs() < 1e-7);
}

#[test]
fn viscous_friction_slows_with_its_time_constant() {
    let model = RotorModel { viscous_nm_s: 0.014, coulomb_nm: 0.0, ..ROTOR };
    let mut rotor = moving(10.0);
    for _ in 0..20_000 {
        step(&model, &mut rotor, 0.0, &Load::default(), 0.0);
    }
    assert!((rotor.velocity_rad_s - 10.0 * libm::exp(-1.0)).abs() < 1e-6);
}

#[test]
fn a_load_drives_the_motor_and_the_brake_holds_it() {
    let weight = Load { torque_nm: 2.0, inertia_kg_m2: 0.026, ..Load::default() };
    let mut rotor = RotorData::default();
    for _ in 0..20_000 {
        step(&ROTOR, &mut rotor, 0.0, &weight, 0.0);
    }
    // A positive load pulls backwards: -(2.0 - 0.1) / (0.014 + 0.026) for one second.
    assert!((rotor.velocity_rad_s + 47.5).abs() < 1e-6, "{}", rotor.velocity_rad_s);
    let mut held = RotorData::default();
    for _ in 0..1000 {
        step(&ROTOR, &mut held, 0.0, &weight, 3.0);
    }
    assert_eq!(held, RotorData::default());
}

#[test]
fn a_locked_shaft_does_not_move() {
    let locked = Load { locked: true, ..Load::default() };
    let mut rotor = RotorData { angle: Angle::new(2, 0.3), ..moving(5.0) };
    step(&ROTOR, &mut rotor, 100.0, &locked, 0.0);
    assert_eq!(rotor, RotorData { angle: Angle::new(2, 0.3), ..RotorData::default() });
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn friction_never_gives_energy_and_the_balance_closes(
        velocity in -50.0..50.0_f64,
        torques in prop::collection::vec(-3.0..3.0_f64, 1..200),
        load_nm in -2.0..2.0_f64,
        brake_nm in 0.0..1.0_f64,
    ) {
        let model = RotorModel { viscous_nm_s: 0.01, ..ROTOR };
        let load = Load { torque_nm: load_nm, inertia_kg_m2: 0.01, ..Load::default() };
        let mut rotor = moving(velocity);
        for torque in torques {
            let before = model.kinetic_energy_j(&rotor, &load);
            let out = step(&model, &mut rotor, torque, &load, brake_nm);
            let gained = model.kinetic_energy_j(&rotor, &load) - before;
            let brought = torque * out.velocity_rad_s * DT_S;
            prop_assert!(out.friction_j >= -1e-15, "friction gave {} J", out.friction_j);
            prop_assert!((brought - out.load_j - out.friction_j - gained).abs() < 1e-12);
        }
    }

    #[test]
    fn motion_is_the_same_in_both_directions(velocity in 0.0..50.0_f64, torque in -3.0..3.0_f64) {
        let (mut one, mut other) = (moving(velocity), moving(-velocity));
        for _ in 0..100 {
            step(&ROTOR, &mut one, torque, &Load::default(), 0.0);
            step(&ROTOR, &mut other, -torque, &Load::default(), 0.0);
        }
        prop_assert_eq!(one.velocity_rad_s, -other.velocity_rad_s);
    }
}
