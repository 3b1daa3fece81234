//! The joints against their maker's table, and the whole plant from the source to the output.

use plant::absolute_encoder::BatteryState;
use plant::angle::{Angle, Axis};
use plant::brake::BrakeModel;
use plant::joint_motor::Actuation;
use plant::mechanics::RotorModel;
use plant::rig::RigModel;
use plant::{Inverter, JointMotor, JointMotorModel};
use proptest::prelude::*;

const DT_S: f64 = 50e-6;
const TAU: f64 = core::f64::consts::TAU;
const MODEL: JointMotorModel = JointMotorModel::M4230E17B50;

/// A column of the manual's table, as printed.
struct Printed {
    model: JointMotorModel,
    ratio: f64,
    output_nm: f64,
    current_a: f64,
    motor_nm: f64,
    rated_r_min: f64,
    resistance_ohm: f64,
    inductance_mh: f64,
    inertia_kg_m2: f64,
}

const M4230E17B50: Printed = Printed {
    model: JointMotorModel::M4230E17B50,
    ratio: 50.0,
    output_nm: 34.0,
    current_a: 3.5,
    motor_nm: 1.0,
    rated_r_min: 1500.0,
    resistance_ohm: 0.86,
    inductance_mh: 0.8,
    inertia_kg_m2: 0.69e-4,
};

const M8025E25B50: Printed = Printed {
    model: JointMotorModel::M8025E25B50,
    ratio: 50.0,
    output_nm: 51.0,
    current_a: 7.0,
    motor_nm: 2.0,
    rated_r_min: 1000.0,
    resistance_ohm: 0.53,
    inductance_mh: 0.5,
    inertia_kg_m2: 1.74e-4,
};

const TABLE: [Printed; 4] = [
    M4230E17B50,
    Printed { model: JointMotorModel::M4230E17B80, ratio: 80.0, output_nm: 51.0, ..M4230E17B50 },
    M8025E25B50,
    Printed { model: JointMotorModel::M8025E25B80, ratio: 80.0, output_nm: 85.0, ..M8025E25B50 },
];

fn joint() -> JointMotor {
    JointMotor::new(MODEL, Angle::new(0, 0.2), 36.0, 25.0)
}

/// Duties that put a voltage on the winding so that no current flows along the magnets, as a field-oriented drive does:
/// `v_d = -w L i_q`, the rest across. From the true angle, half a step on.
fn across_magnets(joint: &JointMotor, voltage_v: f64) -> Inverter {
    let pmsm = &joint.model.pmsm;
    let omega = f64::from(pmsm.pole_pairs) * joint.rotor.velocity_rad_s;
    let Axis { sin, cos } =
        Axis::at_turns(pmsm.electrical_turns(joint.rotor.angle)).turned_by(Axis::at_small_rad(0.5 * DT_S * omega));
    let most = 0.7 * voltage_v.abs();
    let d_v = (-omega * pmsm.inductance_q_h * joint.pmsm.current_a.q).clamp(-most, most);
    let q_v = libm::sqrt(voltage_v * voltage_v - d_v * d_v).copysign(voltage_v);
    let (alpha, beta) = (d_v * cos - q_v * sin, d_v * sin + q_v * cos);
    let side = 0.5 * libm::sqrt(3.0) * beta;
    let phases = [alpha, side - 0.5 * alpha, -side - 0.5 * alpha];
    let (low, high) = phases.iter().fold((f64::MAX, f64::MIN), |(l, h), &v| (l.min(v), h.max(v)));
    Inverter::Driven(phases.map(|v| (v - 0.5 * (low + high)) / joint.rig.supply.bus_v + 0.5))
}

fn run(joint: &mut JointMotor, steps: u32, q_v: f64) {
    for _ in 0..steps {
        let inverter = across_magnets(joint, q_v);
        joint.step(DT_S, &Actuation { inverter, brake_released: true, ..Actuation::default() });
    }
}

fn near(actual: f64, expected: f64, relative: f64) -> bool {
    (actual - expected).abs() <= relative * expected.abs()
}

fn assert_energy_closes(joint: &JointMotor, stored_at_first_j: f64, relative: f64) {
    let gained = joint.stored_j() - stored_at_first_j;
    let through = joint.rig.energy.source_j.abs() + joint.stored_j() + joint.rig.energy.load_j.abs();
    let rest = joint.rig.energy.balance_j() - gained;
    assert!(rest.abs() < relative * through, "{rest} J missing of {through} J: {:?}", joint.rig.energy);
}

#[test]
fn the_windings_and_masses_are_the_manuals() {
    for Printed { model, ratio, resistance_ohm, inductance_mh, inertia_kg_m2, .. } in TABLE {
        assert_eq!((model.gear.ratio, model.rotor.inertia_kg_m2), (ratio, inertia_kg_m2));
        // Printed between two wires: two phases in series.
        assert!(near(2.0 * model.pmsm.resistance_ohm, resistance_ohm, 1e-12), "{}", model.name);
        assert!(near(2.0 * model.pmsm.inductance_q_h, 1e-3 * inductance_mh, 1e-12));
    }
}

#[test]
fn at_the_printed_torque_the_r_m_s_current_of_a_phase_is_the_printed_one() {
    for Printed { model, current_a, motor_nm, .. } in TABLE {
        let amplitude_a = motor_nm / model.pmsm.torque_constant_nm_a();
        assert!(near(amplitude_a / libm::sqrt(2.0), current_a, 1e-12), "{}: {amplitude_a} A", model.name);
    }
}

#[test]
fn the_motors_torque_at_its_rated_speed_gives_the_printed_output_torque() {
    for Printed { model, output_nm, motor_nm, rated_r_min, .. } in TABLE {
        let driven_nm = model.gear.driven_torque_nm(&model.rotor, motor_nm, rated_r_min * TAU / 60.0);
        assert!(near(driven_nm, output_nm, 1e-9), "{}: {driven_nm} N m", model.name);
    }
}

#[test]
fn without_load_and_without_a_weakened_field_a_joint_ends_where_its_back_emf_is_the_bus() {
    for Printed { model, ratio, motor_nm, current_a, .. } in TABLE {
        let mut joint = JointMotor::new(model, Angle::default(), 36.0, 25.0);
        for _ in 0..40_000 {
            let all = joint.rig.supply.bus_v / libm::sqrt(3.0);
            run(&mut joint, 1, all);
        }
        // 36 V / sqrt(3) over Kt / 1.5, with Kt the torque over the amplitude of the current.
        let most = 36.0 / libm::sqrt(3.0) * 1.5 * libm::sqrt(2.0) * current_a / motor_nm;
        let velocity = joint.rotor.velocity_rad_s;
        assert!((0.97 * most..most).contains(&velocity), "{}: {velocity} of {most} rad/s", model.name);
        // The kinematic error makes the output's speed swing by twice its amplitude times the ratio, up to 3.5 %.
        assert!(near(joint.gear.output_velocity_rad_s, velocity / ratio, 0.04), "{}", model.name);
    }
}

#[test]
fn a_joint_lifts_its_printed_torque_as_fast_as_the_voltage_allows() {
    for Printed { model, ratio, output_nm, rated_r_min, .. } in TABLE {
        // The M8025's rated speed. Without a weakened field the M4230 has voltage for 1200 r/min at 1 N m.
        let output_r_min = f64::min(1200.0, rated_r_min) / ratio;
        let mut joint = JointMotor::new(model, Angle::default(), 36.0, 25.0);
        joint.rig.load.inertia_kg_m2 = 0.2;
        let target = output_r_min * TAU / 60.0;
        let full = 0.98 * 36.0 / libm::sqrt(3.0);
        let mut q_v = 0.0;
        for step in 0..60_000_u32 {
            joint.rig.load.torque_nm = output_nm * (f64::from(step) / 20_000.0).min(1.0);
            // As little as a speed loop: more voltage while too slow.
            q_v = (q_v + 2e-3 * (target - joint.gear.output_velocity_rad_s)).clamp(0.0, full);
            run(&mut joint, 1, q_v);
        }
        let velocity = joint.rotor.velocity_rad_s / ratio;
        assert!(near(velocity, target, 0.03), "{}: {velocity} of {target} rad/s at {q_v} V", model.name);
        // With the output's own friction, and the swing of the kinematic error.
        assert!(near(joint.gear.torque_nm, output_nm, 0.1), "{}: {} N m", model.name, joint.gear.torque_nm);
    }
}

#[test]
fn at_rated_torque_the_winding_stays_at_the_printed_85_degrees() {
    for Printed { model, motor_nm, .. } in TABLE {
        let q_a = motor_nm / model.pmsm.torque_constant_nm_a();
        let copper_w = 1.5 * q_a * q_a * model.pmsm.resistance_ohm;
        assert!(near(40.0 + model.rig.winding.resistance_k_w * copper_w, 85.0, 1e-9));
    }
}

#[test]
fn the_encoder_counts_the_motors_shaft_and_the_output_turns_by_the_ratio_less() {
    let mut joint = joint();
    let before = joint.sense().position_counts;
    let output = joint.output_angle().as_turns();
    run(&mut joint, 20_000, 10.0);
    run(&mut joint, 20_000, 0.0);
    let counted = joint.sense().position_counts - before;
    assert!(counted > 5 * 32_768);
    let turned = joint.output_angle().as_turns() - output;
    // Backlash of 20 arc seconds at most, the windup of friction, and the kinematic error.
    let gear = &MODEL.gear;
    let off_rad = (20.0_f64 / 3600.0).to_radians()
        + 2.0 * gear.kinematic_error_rad
        + gear.output_coulomb_nm / gear.stiffness_nm_rad;
    let off_turns = (turned * 50.0 - f64::from(counted) / 32_768.0).abs();
    assert!(off_turns < 50.0 * off_rad / TAU + 1.0 / 32_768.0, "{off_turns} turns of the motor");
}

#[test]
fn the_brake_variant_holds_a_load_that_the_other_lets_fall() {
    let braked = JointMotorModel { rotor: RotorModel { coulomb_nm: 0.0, ..MODEL.rotor }, ..MODEL }.with_brake();
    assert_eq!(braked.brake, BrakeModel { holding_nm: 1.0 });
    let mut held = JointMotor::new(braked, Angle::default(), 36.0, 25.0);
    held.rig.load.torque_nm = 34.0;
    for _ in 0..20_000 {
        held.step(DT_S, &Actuation::default());
    }
    assert!(held.rotor.angle.as_rad().abs() < 1e-9, "{:?}", held.rotor);
    let mut falling = held.clone();
    for _ in 0..20_000 {
        falling.step(DT_S, &Actuation { brake_released: true, ..Actuation::default() });
    }
    assert!(falling.rotor.velocity_rad_s < -10.0, "{:?}", falling.rotor);
}

#[test]
fn power_off_with_a_battery_keeps_the_turns_and_without_loses_them() {
    for (connected, kept) in [(true, true), (false, false)] {
        let mut joint = JointMotor::new(MODEL, Angle::new(7, 0.25), 36.0, 25.0);
        assert_eq!(joint.sense().position_counts, 7 * 32_768 + 8_192);
        joint.encoder.battery.connected = connected;
        joint.rig.supply.connected = false;
        // The bus falls under what the electronics need.
        for _ in 0..20_000 {
            joint.step(DT_S, &Actuation::default());
        }
        assert!(joint.sense().bus_v < 9.0, "{}", joint.sense().bus_v);
        joint.rig.supply.connected = true;
        for _ in 0..2_000 {
            joint.step(DT_S, &Actuation::default());
        }
        let sensors = joint.sense();
        assert_eq!(sensors.turns_lost, !kept);
        assert_eq!(sensors.position_counts, if kept { 7 * 32_768 + 8_192 } else { 8_192 });
        assert_eq!(sensors.battery == BatteryState::Disconnected, !connected);
    }
}

#[test]
fn an_origin_set_by_command_is_zero_and_clears_the_loss() {
    let mut joint = JointMotor::new(MODEL, Angle::new(7, 0.25), 36.0, 25.0);
    joint.encoder.turns_lost = true;
    joint.step(DT_S, &Actuation { set_origin: true, ..Actuation::default() });
    assert_eq!((joint.sense().position_counts, joint.sense().turns_lost), (0, false));
}

#[test]
fn a_locked_output_winds_up_by_torque_over_stiffness_and_the_encoder_sees_only_that() {
    let frictionless =
        plant::gear::GearModel { coulomb_nm: 0.0, mesh_loss: 0.0, kinematic_error_rad: 0.0, ..MODEL.gear };
    let model = JointMotorModel {
        gear: frictionless,
        rotor: RotorModel { coulomb_nm: 0.0, viscous_nm_s: 0.01, ..MODEL.rotor },
        rig: RigModel { resistance_per_k: 0.0, ..MODEL.rig },
        ..MODEL
    };
    let mut joint = JointMotor::new(model, Angle::default(), 36.0, 25.0);
    joint.rig.load.locked = true;
    run(&mut joint, 20_000, 1.5);
    let q_a = 1.5 / (model.pmsm.resistance_ohm + model.rig.switch_resistance_ohm);
    let output_nm = 50.0 * q_a * model.pmsm.torque_constant_nm_a();
    let windup = output_nm / model.gear.stiffness_nm_rad + 0.5 * model.gear.backlash_rad;
    assert!(near(joint.rotor.angle.as_rad(), 50.0 * windup, 1e-3), "{}", joint.rotor.angle.as_rad());
    assert!(joint.output_angle().as_rad().abs() < 1e-12);
    assert_eq!(joint.sense().position_counts, (50.0 * windup / TAU * 32_768.0) as i32);
}

#[test]
fn energy_closes_while_lifting_and_while_falling_into_a_discharge_module() {
    let mut joint = joint();
    joint.rig.load.inertia_kg_m2 = 0.5;
    joint.rig.load.torque_nm = 10.0;
    joint.discharge_from_v = Some(45.0);
    let stored = joint.stored_j();
    run(&mut joint, 20_000, 10.0);
    assert!(joint.rotor.velocity_rad_s > 50.0, "{}", joint.rotor.velocity_rad_s);
    assert_energy_closes(&joint, stored, 1e-4);
    joint.rig.load.torque_nm = 30.0;
    run(&mut joint, 40_000, -15.0);
    assert!(
        joint.rig.energy.bleeder_j > 0.1 && joint.rig.supply.bus_v < 46.0,
        "{:?} {}",
        joint.rig.energy,
        joint.rig.supply.bus_v
    );
    assert_energy_closes(&joint, stored, 1e-3);
}

#[test]
fn a_held_temperature_shows_in_the_sensors_within_a_millisecond() {
    let mut joint = joint();
    joint.rig.winding.hold_c = Some(95.0);
    for _ in 0..20 {
        joint.step(DT_S, &Actuation::default());
    }
    assert_eq!(joint.sense().winding_c, 95.0);
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let play = || {
        let mut joint = joint();
        joint.rig.load.torque_nm = 5.0;
        run(&mut joint, 5_000, 9.0);
        run(&mut joint, 5_000, -9.0);
        joint
    };
    assert_eq!(play(), play());
}

#[test]
fn a_wave_generator_spun_beyond_its_bearings_limit_seizes_until_the_reducer_is_replaced() {
    for (share, seizes) in [(0.97, false), (1.03, true)] {
        let mut joint = joint();
        joint.rotor.velocity_rad_s = share * MODEL.bearing_limit_rad_s;
        run(&mut joint, 16, 0.0);
        assert_eq!(joint.is_seized(), seizes, "at {share} of the limit");
    }
    let mut joint = joint();
    joint.rotor.velocity_rad_s = 1.03 * MODEL.bearing_limit_rad_s;
    run(&mut joint, 4_000, 0.0);
    // It stands, and the motor's whole voltage does not turn it: 36 V over the winding are far below what seizing holds.
    run(&mut joint, 400, 10.0);
    assert_eq!(joint.rotor.velocity_rad_s, 0.0);
    joint.replace_reducer();
    run(&mut joint, 400, 10.0);
    assert!(!joint.is_seized() && joint.rotor.velocity_rad_s > 1.0, "{} rad/s", joint.rotor.velocity_rad_s);
}

#[test]
fn a_power_stage_above_its_limit_joins_the_wires_and_blows_the_fuse() {
    let idle = Actuation { inverter: Inverter::Open, brake_released: true, set_origin: false };
    let after_20_ms = |celsius: f64| {
        let mut joint = joint();
        joint.rig.heat_sink.temperature_c = celsius;
        joint.rotor.velocity_rad_s = 100.0;
        (0..400).for_each(|_| joint.step(DT_S, &idle));
        joint
    };
    let sound = after_20_ms(MODEL.power_stage_limit_c - 1.0);
    assert!(!sound.is_power_stage_burnt() && sound.rig.supply.connected);
    let burnt = after_20_ms(MODEL.power_stage_limit_c + 1.0);
    assert!(burnt.is_power_stage_burnt());
    assert_eq!((burnt.rig.supply.bus_v, burnt.rig.supply.connected), (0.0, false));
    // Joined wires brake: friction alone leaves most of the speed in 20 ms.
    assert!(burnt.rotor.velocity_rad_s.abs() < 0.2 * sound.rotor.velocity_rad_s, "{}", burnt.rotor.velocity_rad_s);
}

fn any_inverter() -> impl Strategy<Value = Inverter> {
    prop_oneof![
        Just(Inverter::Open),
        Just(Inverter::Shorted),
        [0.3..=0.7_f64, 0.3..=0.7_f64, 0.3..=0.7_f64].prop_map(Inverter::Driven),
        Just(Inverter::Driven([f64::NAN, 0.5, 2.0])),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_the_drive_does_the_book_closes_and_the_numbers_stay_sound(
        play in prop::collection::vec((any_inverter(), any::<bool>(), -100.0..100.0_f64, 1_u32..300), 1..12),
        load_kg_m2 in 0.0..1.0_f64,
        locked in any::<bool>(),
    ) {
        let mut joint = joint();
        joint.rig.load.inertia_kg_m2 = load_kg_m2;
        joint.rig.load.locked = locked;
        let stored = joint.stored_j();
        for (inverter, brake_released, load_nm, steps) in play {
            joint.rig.load.torque_nm = load_nm;
            for _ in 0..steps {
                joint.step(DT_S, &Actuation { inverter, brake_released, set_origin: false });
            }
            let sensors = joint.sense();
            prop_assert!(sensors.bus_v.is_finite() && sensors.phase_current_a.iter().all(|a| a.is_finite()));
            prop_assert!(joint.rotor.velocity_rad_s.abs() < 1e4);
        }
        let through = joint.rig.energy.source_j + joint.stored_j() + joint.rig.energy.load_j.abs() + joint.rig.energy.winding_j;
        let rest = joint.rig.energy.balance_j() - (joint.stored_j() - stored);
        prop_assert!(rest.abs() < 0.005 * through, "{rest} J missing of {through} J");
    }
}
