//! Weights, springs, stops, fans, friction and backlash against closed forms, on motors whose bridge is open.

use core::f64::consts::TAU;

use plant::Motor;
use plant::angle::Angle;
use plant::attachment::{Attachment, Fan, GRAVITY_M_S2, LoadGear, Pulley, Spring, Stops, Stribeck};
use plant::{Actuation, Bridges, HubMotor, HubMotorModel, Inverter, JointMotor, JointMotorModel, StepperMotor};
use plant::{StepperMotorModel, joint_motor};
use proptest::prelude::*;

const DT_S: f64 = 50e-6;
const OPEN: Actuation = Actuation { inverter: Inverter::Open, bleeder_on: false, brake_released: true };
const INERTIA: f64 = HubMotorModel::ZLLG65ASM250_L.rotor.inertia_kg_m2;

/// A wheel motor without friction of its own, with something attached.
fn frictionless(what: Attachment) -> HubMotor {
    let mut model = HubMotorModel::ZLLG65ASM250_L;
    (model.rotor.coulomb_nm, model.rotor.viscous_nm_s) = (0.0, 0.0);
    let mut motor = HubMotor::new(model, Angle::new(0, 0.3), 48.0, 25.0);
    motor.attach(what);
    motor
}

fn rad(motor: &HubMotor) -> f64 {
    motor.rotor.angle.turns_from(Angle::new(0, 0.3)) * TAU
}

fn run(motor: &mut HubMotor, seconds: f64) {
    for _ in 0..(seconds / DT_S).round() as u32 {
        motor.step(DT_S, &OPEN);
    }
}

fn near(what: &str, measured: f64, expected: f64, relative: f64) {
    assert!((measured - expected).abs() <= relative * expected.abs(), "{what}: {measured}, expected {expected}");
}

#[test]
fn a_weight_falls_with_the_acceleration_of_its_drum_in_the_direction_of_its_rope() {
    for radius_m in [0.05, -0.05] {
        let mut motor =
            frictionless(Attachment { pulley: Some(Pulley { mass_kg: 2.0, radius_m }), ..Default::default() });
        motor.rig.load.coulomb_nm = 0.3;
        run(&mut motor, 0.5);
        // (m g r - friction) / (J + m r^2), against the direction that lifts.
        let expected = -(2.0 * GRAVITY_M_S2 * radius_m - 0.3 * radius_m.signum()) / (INERTIA + 2.0 * 0.0025) * 0.5;
        near("velocity after half a second", motor.rotor.velocity_rad_s, expected, 1e-9);
    }
    // 2 kg at 5 cm are 0.98 N·m: a friction of 1 N·m holds them for ever.
    let mut held =
        frictionless(Attachment { pulley: Some(Pulley { mass_kg: 2.0, radius_m: 0.05 }), ..Default::default() });
    held.rig.load.coulomb_nm = 1.0;
    let before = held.rotor;
    run(&mut held, 1.0);
    assert_eq!(held.rotor, before);
}

#[test]
fn a_spring_swings_at_its_frequency_and_keeps_its_energy() {
    let spring = Spring { stiffness_nm_rad: 5.0, rest: Angle::new(0, 0.3) };
    let mut motor = frictionless(Attachment { spring: Some(spring), ..Default::default() });
    motor.rotor.velocity_rad_s = 10.0;
    let period_s = TAU * (INERTIA / 5.0_f64).sqrt();
    let whole_j = 0.5 * INERTIA * 100.0;
    let stored_j = motor.stored_j();
    let (mut last, mut up) = (rad(&motor), Vec::new());
    let mut farthest: f64 = 0.0;
    for step in 0..200_000_u32 {
        motor.step(DT_S, &OPEN);
        let now = rad(&motor);
        farthest = farthest.max(now);
        if last < 0.0 && now >= 0.0 {
            up.push((f64::from(step) - now / (now - last)) * DT_S);
        }
        last = now;
    }
    near("period", (up[up.len() - 1] - up[0]) / (up.len() - 1) as f64, period_s, 1e-5);
    near("amplitude", farthest, (2.0 * whole_j / 5.0).sqrt(), 1e-5);
    // The bus goes on feeding the drive's electronics; what is in motion and spring is the rest.
    let lost = stored_j - motor.stored_j() + motor.rig.energy.balance_j();
    assert!(lost.abs() < 1e-8 * whole_j, "{lost} J of {whole_j} J");
}

/// Restitution of a spring and damper that pushes and does not pull, with the damping `b` over twice the mass and the
/// frequency `f` without it: T. Schwager and T. Pöschel, "Coefficient of restitution and linear-dashpot model revisited",
/// Granular Matter 9 (2007).
fn restitution(b: f64, f: f64) -> f64 {
    let damped = (f * f - b * b).sqrt();
    (-b / damped * (core::f64::consts::PI - (2.0 * b * damped / (damped * damped - b * b)).atan())).exp()
}

#[test]
fn a_stop_throws_back_what_its_damping_leaves() {
    for (stiffness, damping) in [(2000.0, 0.0), (2000.0, 2.0), (500.0, 1.0)] {
        let stops = Stops {
            low: None,
            high: Some(Angle::new(0, 0.35)),
            stiffness_nm_rad: stiffness,
            damping_nm_s_rad: damping,
        };
        let mut motor = frictionless(Attachment { stops: Some(stops), ..Default::default() });
        motor.rotor.velocity_rad_s = 8.0;
        run(&mut motor, 0.2);
        let expected = -8.0 * restitution(damping / (2.0 * INERTIA), (stiffness / INERTIA).sqrt());
        near("velocity after it", motor.rotor.velocity_rad_s, expected, 5e-3);
        let (most, missing) = (0.5 * INERTIA * 64.0, motor.rig.energy.balance_j());
        assert!(motor.rig.energy.friction_j > -1e-9 * most && missing.is_finite());
    }
}

#[test]
fn a_stop_holds_a_load_at_the_torque_over_its_stiffness_and_lets_it_go_again() {
    let stops = Stops {
        low: Some(Angle::new(0, 0.25)),
        high: Some(Angle::new(0, 0.35)),
        stiffness_nm_rad: 1000.0,
        damping_nm_s_rad: 5.0,
    };
    let mut motor = frictionless(Attachment { stops: Some(stops), ..Default::default() });
    for torque_nm in [4.0, -4.0] {
        motor.rig.load.torque_nm = torque_nm;
        run(&mut motor, 3.0);
        let expected = -(0.05 * TAU + 4.0 / 1000.0) * torque_nm.signum();
        near("angle", rad(&motor), expected, 1e-6);
        assert!(motor.rotor.velocity_rad_s.abs() < 1e-6, "{}", motor.rotor.velocity_rad_s);
    }
}

#[test]
fn the_stiffest_stop_on_the_lightest_rotor_neither_explodes_nor_gives_energy() {
    let model = StepperMotorModel::ZLIM42_C_70;
    let mut motor = StepperMotor::new(model, Angle::default(), 24.0, 25.0);
    let stops = Stops {
        low: Some(Angle::new(0, -0.1)),
        high: Some(Angle::new(0, 0.1)),
        stiffness_nm_rad: 1e6,
        damping_nm_s_rad: 0.0,
    };
    motor.attach(Attachment { stops: Some(stops), ..Default::default() });
    motor.rotor.velocity_rad_s = 40.0;
    let whole_j = 0.5 * model.rotor.inertia_kg_m2 * 1600.0;
    for _ in 0..20_000 {
        motor.step(DT_S, &Bridges::Open);
        let kinetic_j = 0.5 * model.rotor.inertia_kg_m2 * motor.rotor.velocity_rad_s.powi(2);
        assert!(kinetic_j < 1.5 * whole_j + 0.01, "{kinetic_j} J");
    }
    assert!(motor.rotor.angle.as_turns().abs() < 0.11, "{}", motor.rotor.angle.as_turns());
}

#[test]
fn a_fan_takes_the_torque_at_the_speed_where_it_is_the_torque() {
    let fan = Fan { torque_nm: 2.0, velocity_rad_s: 30.0 };
    let mut motor = frictionless(Attachment { fan: Some(fan), ..Default::default() });
    // 0.5 N·m are a quarter of 2: half the speed.
    motor.rig.load.torque_nm = -0.5;
    run(&mut motor, 6.0);
    near("terminal velocity", motor.rotor.velocity_rad_s, 15.0, 1e-9);
    // Coasting: dw/dt = -k w^2 / J gives 1/w = 1/w0 + k t / J.
    motor.rig.load.torque_nm = 0.0;
    run(&mut motor, 0.5);
    near(
        "velocity half a second later",
        motor.rotor.velocity_rad_s,
        1.0 / (1.0 / 15.0 + 2.0 / 900.0 * 0.5 / INERTIA),
        1e-6,
    );
}

#[test]
fn friction_that_is_greater_at_rest_holds_up_to_it_and_then_lets_go_with_a_jerk() {
    let stribeck = Stribeck { static_nm: 0.8, velocity_rad_s: 0.5 };
    let mut motor = frictionless(Attachment { stribeck: Some(stribeck), ..Default::default() });
    motor.rig.load.coulomb_nm = 0.4;
    motor.rig.load.torque_nm = -0.799;
    let before = motor.rotor;
    run(&mut motor, 2.0);
    assert_eq!(motor.rotor, before, "not by a bit");
    motor.rig.load.torque_nm = -0.801;
    run(&mut motor, 1.0);
    assert!(motor.rotor.velocity_rad_s > 1.0, "it runs away: {}", motor.rotor.velocity_rad_s);
    // At speed the friction is 0.4 N·m again.
    let at = motor.rotor.velocity_rad_s;
    run(&mut motor, 0.1);
    near("gain in 0.1 s", motor.rotor.velocity_rad_s - at, 0.401 / INERTIA * 0.1, 1e-6);
}

#[test]
fn a_mass_that_a_spring_pulls_over_sticky_ground_sticks_and_slips() {
    // The spring's far end is moved on by 0.5 rad/s: the shaft stands until the spring has 0.8 N·m, then jumps.
    let stribeck = Stribeck { static_nm: 0.8, velocity_rad_s: 0.2 };
    let (mut stands, mut jumps, mut was_at_rest) = (0_u32, 0_u32, true);
    let mut motor = frictionless(Attachment::default());
    motor.rig.load.coulomb_nm = 0.4;
    for step in 0..120_000 {
        let rest = Angle::new(0, 0.3).advanced_by(f64::from(step) * DT_S * 0.5 / TAU);
        let spring = Spring { stiffness_nm_rad: 2.0, rest };
        motor.attach(Attachment { spring: Some(spring), stribeck: Some(stribeck), ..Default::default() });
        let before = motor.rotor.angle;
        motor.step(DT_S, &OPEN);
        let at_rest = motor.rotor.velocity_rad_s == 0.0;
        if at_rest && was_at_rest {
            assert_eq!(motor.rotor.angle, before, "it creeps");
            stands += 1;
        }
        jumps += u32::from(was_at_rest && !at_rest);
        was_at_rest = at_rest;
    }
    // A jump takes it about 2 (0.8 - 0.4) / 2 = 0.4 rad on; 6 s at 0.5 rad/s are 3 rad, the first 0.4 of which it stands.
    assert!((4..=9).contains(&jumps), "{jumps} jumps");
    assert!(stands > 40_000, "it stands for most of the time: {stands}");
}

#[test]
fn a_free_wheel_of_the_data_sheet_coasts_down_in_the_time_of_its_friction() {
    let model = HubMotorModel::ZLLG65ASM250_L;
    let mut motor = HubMotor::new(model, Angle::default(), 48.0, 25.0);
    motor.rotor.velocity_rad_s = 20.0;
    let mut steps = 0_u32;
    while motor.rotor.velocity_rad_s != 0.0 {
        motor.step(DT_S, &OPEN);
        steps += 1;
    }
    // J dw/dt = -(c + b w): t = J/b ln(1 + b w / c).
    let (c, b) = (model.rotor.coulomb_nm, model.rotor.viscous_nm_s);
    near("seconds", f64::from(steps) * DT_S, INERTIA / b * (1.0 + b * 20.0 / c).ln(), 1e-4);
}

#[test]
fn behind_a_loose_gear_the_load_waits_until_the_backlash_is_used_up() {
    let gear = LoadGear { ratio: 10.0, backlash_rad: 0.05, stiffness_nm_rad: 2000.0 };
    let mut motor = frictionless(Attachment { gear: Some(gear), ..Default::default() });
    motor.rig.load = plant::mechanics::Load { inertia_kg_m2: 3.0, coulomb_nm: 1.0, ..Default::default() };
    // From the middle of the backlash the motor turns half of it, times the ratio, before the load feels anything.
    let load_at =
        |motor: &HubMotor| motor.rig.attached().map(|attached| attached.load_angle(motor.rotor.angle)).unwrap();
    let first = load_at(&motor);
    motor.rotor.velocity_rad_s = 0.2;
    while rad(&motor) < 0.99 * 0.025 * 10.0 {
        assert!((load_at(&motor).turns_from(first) * TAU).abs() < 1e-12, "the load moved at {}", rad(&motor));
        motor.step(DT_S, &OPEN);
    }
    // And then both go on together: with the friction's power gone, momentum over the sum of the masses.
    let mut driven = frictionless(Attachment {
        gear: Some(LoadGear { backlash_rad: 0.0, stiffness_nm_rad: 2e5, ..gear }),
        ..Default::default()
    });
    driven.rig.load = plant::mechanics::Load { inertia_kg_m2: 3.0, torque_nm: -2.0, ..Default::default() };
    run(&mut driven, 0.5);
    let output = gear_wheel(10.0) + 3.0 + INERTIA * 100.0;
    near("velocity of the motor", driven.rotor.velocity_rad_s, 10.0 * 2.0 / output * 0.5, 0.02);
}

/// Inertia of a load gear's own wheel at the load: a hundredth of the motor's seen from there.
fn gear_wheel(ratio: f64) -> f64 {
    0.01 * INERTIA * ratio * ratio
}

#[test]
fn what_is_attached_to_a_joint_acts_at_its_output() {
    let model = JointMotorModel::M4230E17B50;
    let mut joint = JointMotor::new(model, Angle::default(), 36.0, 25.0);
    joint.attach(Attachment { pulley: Some(Pulley { mass_kg: 20.0, radius_m: 0.1 }), ..Default::default() });
    let idle = joint_motor::Actuation { inverter: Inverter::Open, brake_released: true, set_origin: false };
    for _ in 0..10_000 {
        joint.step(DT_S, &idle);
    }
    // 19.6 N·m drive it backwards: far over the 2.5 N·m that its friction holds.
    assert!(joint.rotor.velocity_rad_s < -20.0, "{}", joint.rotor.velocity_rad_s);
    let lifted_m = joint.output_angle().as_rad() * 0.1;
    near("work on the weight", joint.rig.energy.load_j, 20.0 * GRAVITY_M_S2 * lifted_m, 0.01);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 64, ..ProptestConfig::default() })]

    /// Whatever is attached: a motor driven at random stays finite, friction takes and never gives, and the book closes.
    #[test]
    fn energy_closes_with_anything_attached(
        stiffness in 0.0..1e5_f64,
        damping in 0.0..50.0_f64,
        mass_kg in 0.0..100.0_f64,
        radius_m in -0.3..0.3_f64,
        fan_nm in 0.0..5.0_f64,
        static_nm in 0.0..3.0_f64,
        backlash_rad in proptest::option::of(0.0..0.2_f64),
        velocity in -30.0..30.0_f64,
        torque in -5.0..5.0_f64,
    ) {
        let what = Attachment {
            stribeck: Some(Stribeck { static_nm, velocity_rad_s: 0.3 }),
            pulley: Some(Pulley { mass_kg, radius_m }),
            spring: Some(Spring { stiffness_nm_rad: 0.01 * stiffness, rest: Angle::new(0, 0.1) }),
            stops: Some(Stops {
                low: Some(Angle::new(0, -0.5)),
                high: Some(Angle::new(0, 0.6)),
                stiffness_nm_rad: stiffness,
                damping_nm_s_rad: damping,
            }),
            fan: Some(Fan { torque_nm: fan_nm, velocity_rad_s: 30.0 }),
            gear: backlash_rad.map(|backlash_rad| LoadGear { ratio: 3.0, backlash_rad, stiffness_nm_rad: 3000.0 }),
        };
        let mut motor = HubMotor::new(HubMotorModel::ZLLG65ASM250_L, Angle::new(0, 0.3), 48.0, 25.0);
        motor.rig.load.coulomb_nm = 0.2;
        motor.rig.load.torque_nm = torque;
        motor.rig.load.inertia_kg_m2 = 0.05;
        motor.attach(what);
        motor.rotor.velocity_rad_s = velocity;
        let first_j = motor.stored_j();
        for step in 0..4000_u32 {
            let before_j = motor.rig.energy.friction_j;
            motor.step(DT_S, &OPEN);
            let heat_j = motor.rig.energy.friction_j - before_j;
            let scale = 1.0 + motor.stored_j().abs();
            prop_assert!(motor.rotor.velocity_rad_s.is_finite() && heat_j.is_finite(), "step {step}");
            prop_assert!(backlash_rad.is_some() || heat_j > -1e-6 * scale, "friction gave {heat_j} J in step {step}");
        }
        let through = motor.stored_j().abs() + first_j.abs() + motor.rig.energy.load_j.abs() + motor.rig.energy.friction_j;
        let rest = motor.rig.energy.balance_j() - (motor.stored_j() - first_j);
        prop_assert!(rest.abs() < 1e-3 * through, "{rest} J missing of {through} J");
    }
}
