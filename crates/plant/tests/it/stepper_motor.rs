//! The open-loop plant: a rotor that hangs on the field, rings about it, slips off it, and the energy book.

use plant::angle::Angle;
use plant::mechanics::RotorModel;
use plant::rig::RigModel;
use plant::stepper::{Phase, StepperModel};
use plant::thermal::BodyModel;
use plant::{Bridges, StepperMotor, StepperMotorModel};
use proptest::prelude::*;

const DT_S: f64 = 50e-6;
const TAU: f64 = core::f64::consts::TAU;
const MODEL: StepperMotorModel = StepperMotorModel::ZLIM42_C_70;
/// Without detent, where a closed form leaves it out.
const SMOOTH: StepperMotorModel =
    StepperMotorModel { stepper: StepperModel { detent_nm: 0.0, ..MODEL.stepper }, ..MODEL };
/// And without dry friction.
const FREE: StepperMotorModel = StepperMotorModel { rotor: RotorModel { coulomb_nm: 0.0, ..MODEL.rotor }, ..SMOOTH };
const CURRENT_A: f64 = 2.2;

fn motor(model: StepperMotorModel) -> StepperMotor {
    StepperMotor::new(model, Angle::default(), 24.0, 25.0)
}

/// Currents whose vector points at an electrical angle.
fn field(electrical_turns: f64, current_a: f64) -> Bridges {
    let rad = electrical_turns * TAU;
    Bridges::Regulated([current_a * libm::cos(rad), current_a * libm::sin(rad)])
}

/// Electrical turns of the rotor from its start.
fn electrical_turns(motor: &StepperMotor) -> f64 {
    motor.rotor.angle.as_turns() * f64::from(motor.model.stepper.teeth)
}

/// Holds the field for a time, with friction enough to come to rest, and then takes the friction away again.
fn settle(motor: &mut StepperMotor, electrical: f64) {
    let viscous = motor.model.rotor.viscous_nm_s;
    motor.model.rotor.viscous_nm_s = 0.01;
    for _ in 0..10_000 {
        motor.step(DT_S, &field(electrical, CURRENT_A));
    }
    motor.model.rotor.viscous_nm_s = viscous;
}

fn near(actual: f64, expected: f64, relative: f64) -> bool {
    (actual - expected).abs() <= relative * expected.abs()
}

#[test]
fn under_load_the_rotor_lags_the_field_by_the_arc_sine() {
    for (model, holding_nm) in [(StepperMotorModel::ZLIM42_C_70, 0.48), (StepperMotorModel::ZLIM42_C_82, 0.72)] {
        for share in [-0.9, -0.3, 0.1, 0.5, 0.95] {
            let stepper = StepperModel { detent_nm: 0.0, ..model.stepper };
            let mut motor = motor(StepperMotorModel { stepper, rotor: FREE.rotor, ..model });
            motor.rig.load.torque_nm = share * holding_nm;
            // A microstep of 1/16 of a full step.
            settle(&mut motor, 1.0 / 64.0);
            let lag_rad = (1.0 / 64.0 - electrical_turns(&motor)) * TAU;
            assert!((lag_rad - libm::asin(share)).abs() < 1e-4, "{lag_rad} at {share}");
        }
    }
}

#[test]
fn without_load_each_microstep_moves_the_rotor_by_its_share_of_a_full_step() {
    let mut motor = motor(FREE);
    for microstep in 0..32 {
        let electrical = f64::from(microstep) / 64.0;
        settle(&mut motor, electrical);
        assert!((electrical_turns(&motor) - electrical).abs() < 1e-6);
    }
    // 16 microsteps are a full step of 1.8 degrees.
    settle(&mut motor, 16.0 / 64.0);
    assert!((motor.rotor.angle.as_turns() * 360.0 - 1.8).abs() < 1e-5);
}

#[test]
fn detent_pulls_microsteps_towards_the_full_steps_by_the_balance_of_both_sines() {
    let mut motor = motor(StepperMotorModel { rotor: FREE.rotor, ..MODEL });
    let electrical = 1.0 / 16.0;
    settle(&mut motor, electrical);
    let rotor_rad = electrical_turns(&motor) * TAU;
    let pull = 0.48 * libm::sin(electrical * TAU - rotor_rad);
    let detent = MODEL.stepper.detent_nm * libm::sin(4.0 * rotor_rad);
    assert!((pull - detent).abs() < 1e-6, "{pull} {detent}");
    assert!(rotor_rad < electrical * TAU - 0.02);
}

/// Frequency of the rotor's ringing about a rest position after a small displacement.
fn ringing_hz(model: StepperMotorModel, current_a: f64) -> f64 {
    let mut motor = StepperMotor::new(model, Angle::new(0, 1e-4), 24.0, 25.0);
    let mut crossings = Vec::new();
    // A fiftieth of the angle at which the sine bends by a per mille.
    for step in 0..4_000 {
        let before = motor.rotor.angle.as_turns();
        motor.step(DT_S, &field(0.0, current_a));
        let after = motor.rotor.angle.as_turns();
        if before < 0.0 && after >= 0.0 {
            crossings.push((f64::from(step) - before / (after - before)) * DT_S);
        }
    }
    let periods = crossings.len() - 1;
    periods as f64 / (crossings[periods] - crossings[0])
}

#[test]
fn the_rotor_rings_at_the_root_of_stiffness_over_inertia() {
    for current_a in [0.55, 1.1, 2.2] {
        let free = StepperMotorModel { rotor: FREE.rotor, ..MODEL };
        let stiffness = MODEL.stepper.stiffness_nm_rad(current_a);
        // Both sines, 50 teeth: 50 (T + 4 detent).
        assert!(near(stiffness, 50.0 * (0.48 * current_a / 2.2 + 4.0 * MODEL.stepper.detent_nm), 1e-9));
        let expected = libm::sqrt(stiffness / MODEL.rotor.inertia_kg_m2) / TAU;
        let frequency = ringing_hz(free, current_a);
        assert!(near(frequency, expected, 0.005), "{frequency} for {expected} Hz at {current_a} A");
    }
}

#[test]
fn the_ringing_dies_as_slowly_as_viscous_friction_says() {
    let mut motor = StepperMotor::new(FREE, Angle::new(0, 1e-4), 24.0, 25.0);
    let mut energy = Vec::new();
    let stiffness = FREE.stepper.stiffness_nm_rad(CURRENT_A);
    for _ in 0..4_000 {
        motor.step(DT_S, &field(0.0, CURRENT_A));
        let (angle, velocity) = (motor.rotor.angle.as_rad(), motor.rotor.velocity_rad_s);
        energy.push(0.5 * (stiffness * angle * angle + FREE.rotor.inertia_kg_m2 * velocity * velocity));
    }
    // Amplitude falls with exp(-B / 2J t), energy with twice the rate. The explicit angle of the rotor gives back
    // 1e-4 of critical, a fortieth of this damping.
    let rate = libm::log(energy[400] / energy[3_600]) / (3_200.0 * DT_S);
    let expected = FREE.rotor.viscous_nm_s / FREE.rotor.inertia_kg_m2;
    assert!(near(rate, expected, 0.05), "{rate} for {expected} 1/s");
}

#[test]
fn a_rotor_pulls_out_at_the_holding_torque_and_not_before() {
    for (share, holds) in [(0.98, true), (1.02, false)] {
        let mut motor = motor(SMOOTH);
        motor.model.rotor.viscous_nm_s = 0.01;
        // Turning slowly; the load grows to its share of what the field gives beyond the frictions, over a second.
        let velocity_turns_s = 0.2;
        let friction_nm = motor.model.rotor.coulomb_nm + 0.01 * velocity_turns_s * TAU;
        for step in 0..40_000 {
            let time_s = f64::from(step) * DT_S;
            motor.rig.load.torque_nm = share * (0.48 - friction_nm) * time_s.min(1.0);
            motor.step(DT_S, &field(50.0 * velocity_turns_s * time_s, CURRENT_A));
        }
        let lag = 50.0 * velocity_turns_s * 2.0 - electrical_turns(&motor);
        assert_eq!(lag < 0.3, holds, "{lag} electrical turns behind at {share}");
    }
}

#[test]
fn a_lost_rotor_comes_to_rest_whole_times_four_full_steps_away_and_no_sensor_shows_it() {
    let run = |overload_nm: f64| {
        let mut motor = motor(FREE);
        settle(&mut motor, 0.0);
        // Overloaded for a time, then free again.
        motor.rig.load.torque_nm = overload_nm;
        for _ in 0..400 {
            motor.step(DT_S, &field(0.0, CURRENT_A));
        }
        motor.rig.load.torque_nm = 0.0;
        settle(&mut motor, 0.0);
        settle(&mut motor, 0.0);
        motor
    };
    // A torque that comes at once swings an undamped rotor twice as far: it stands 0.72 of the holding torque, no more.
    let (kept, lost) = (run(0.7 * 0.48), run(0.76 * 0.48));
    assert!(electrical_turns(&kept).abs() < 1e-6);
    let slipped = electrical_turns(&lost);
    assert!(slipped < -0.5, "{slipped}");
    assert!((slipped - slipped.round()).abs() < 1e-6, "{slipped}");
    // Four full steps of 1.8 degrees for each.
    let full_steps = lost.rotor.angle.as_turns() * 200.0;
    assert!((full_steps - 4.0 * slipped.round()).abs() < 1e-5);
    assert!((lost.sense().phase_current_a[0] - kept.sense().phase_current_a[0]).abs() < 1e-9);
    assert!(lost.sense().phase_current_a[1].abs() < 1e-9);
}

/// Turns that the rotor makes in the last tenth of a second of a ramp to a speed and a time at it.
fn speed_reached_turns_s(volts: f64, target_turns_s: f64, load_nm: f64) -> f64 {
    let mut motor = StepperMotor::new(MODEL, Angle::default(), volts, 25.0);
    motor.rig.load.torque_nm = load_nm;
    let (mut field_turns, mut start) = (0.0, 0.0);
    let (ramp, end) = (20_000, 26_000);
    for step in 0..end {
        let speed = target_turns_s * (f64::from(step) / f64::from(ramp)).min(1.0);
        // The chopper's reference is what the field should be at the end of the step.
        field_turns += 50.0 * speed * DT_S;
        motor.step(DT_S, &field(field_turns, CURRENT_A));
        if step == end - 2_000 {
            start = motor.rotor.angle.as_turns();
        }
    }
    (motor.rotor.angle.as_turns() - start) / 0.1
}

#[test]
fn torque_falls_with_speed_because_the_bus_no_longer_drives_the_current() {
    // Without load it goes on to 1800 r/min, beyond the speed at which its back-emf alone exceeds the bus.
    let idle = speed_reached_turns_s(24.0, 30.0, 0.0);
    assert!(near(idle, 30.0, 0.01), "{idle}");
    assert!(30.0 * TAU * MODEL.stepper.torque_constant_nm_a() > 24.0);
    // Against 0.2 N m: followed at 300 r/min, lost at 2400 r/min on 24 V.
    let slow = speed_reached_turns_s(24.0, 5.0, 0.2);
    assert!(near(slow, 5.0, 0.01), "{slow}");
    let fast = speed_reached_turns_s(24.0, 40.0, 0.2);
    assert!(fast < 20.0, "{fast}");
}

#[test]
fn energy_closes_through_a_ramp_a_loss_and_an_open_bridge() {
    let mut motor = motor(MODEL);
    motor.rig.load.inertia_kg_m2 = 1e-5;
    let stored = motor.stored_j();
    let mut field_turns = 0.0;
    for step in 0..60_000_u32 {
        motor.rig.load.torque_nm = if step > 30_000 { 0.8 } else { 0.1 };
        field_turns += 50.0 * 5.0 * (f64::from(step) / 20_000.0).min(1.0) * DT_S;
        let bridges = if step > 50_000 { Bridges::Open } else { field(field_turns, CURRENT_A) };
        motor.step(DT_S, &bridges);
    }
    let gained = motor.stored_j() - stored;
    let through = motor.rig.energy.source_j + motor.rig.energy.load_j.abs();
    let rest = motor.rig.energy.balance_j() - gained;
    assert!(rest.abs() < 1e-3 * through, "{rest} J missing of {through} J: {:?}", motor.rig.energy);
}

#[test]
fn the_winding_warms_and_its_resistance_rises() {
    let fast = BodyModel { resistance_k_w: 5.0, capacity_j_k: 0.02 };
    let model = StepperMotorModel { rig: RigModel { winding: fast, ..MODEL.rig }, ..MODEL };
    let mut motor = StepperMotor::new(model, Angle::default(), 24.0, 20.0);
    motor.rig.load.locked = true;
    for _ in 0..100_000 {
        motor.step(DT_S, &Bridges::Driven([0.1, 0.0]));
    }
    let current = motor.sense().phase_current_a[0];
    let winding_ohm = motor.rig.supply.bus_v * 0.1 / current - MODEL.rig.switch_resistance_ohm;
    let rise = 5.0 * current * current * winding_ohm;
    assert!((motor.sense().winding_c - 20.0 - rise).abs() < 0.01 * rise, "{rise}");
    assert!(near(winding_ohm, 1.65 * (1.0 + 0.003_93 * rise), 1e-3));
}

#[test]
fn a_lost_phase_shows_in_the_currents() {
    let mut motor = motor(MODEL);
    motor.lost_phase = Some(Phase::B);
    for _ in 0..1_000 {
        motor.step(DT_S, &field(0.125, 1.5));
    }
    let [a, b] = motor.sense().phase_current_a;
    assert!(near(a, 1.5 * libm::cos(TAU / 8.0), 1e-9) && b == 0.0);
}

#[test]
fn touching_wires_draw_voltage_over_their_contact_and_brake_a_turned_rotor() {
    let mut motor = motor(StepperMotorModel::ZLIM42_C_70);
    motor.shorted_phase = Some(Phase::B);
    motor.step(DT_S, &Bridges::Driven([0.0, 0.5]));
    // 12 V over 1 ohm of contact and 0.2 ohm of switches; the other phase has nothing.
    let sensed = motor.sense();
    assert!(near(sensed.phase_current_a[1], 10.0, 0.01) && sensed.phase_current_a[0].abs() < 1e-9, "{sensed:?}");
    assert!(near(sensed.bus_current_a, 5.0, 0.01), "{sensed:?}");
    // Open bridges feed no contact, and a rotor that is turned feels its shorted winding.
    let coasting = |shorted: Option<Phase>| {
        let mut motor = self::motor(StepperMotorModel::ZLIM42_C_70);
        motor.shorted_phase = shorted;
        motor.rotor.velocity_rad_s = 100.0;
        (0..200).for_each(|_| motor.step(DT_S, &Bridges::Open));
        assert_eq!(motor.sense().phase_current_a, [0.0; 2]);
        motor.rotor.velocity_rad_s
    };
    assert!(coasting(Some(Phase::A)) < 0.8 * coasting(None));
}

#[test]
fn a_transistor_that_has_broken_down_takes_current_from_the_bus_and_the_energies_close() {
    let mut motor = motor(StepperMotorModel::ZLIM42_C_70);
    let before = motor.stored_j() - motor.rig.energy.balance_j();
    motor.broken_down = true;
    (0..2000).for_each(|_| motor.step(DT_S, &Bridges::Open));
    // 5 ohm behind 0.1 ohm of the source.
    assert!(near(motor.sense().bus_current_a, 24.0 / 5.1, 0.01), "{:?}", motor.sense());
    assert!((motor.stored_j() - motor.rig.energy.balance_j() - before).abs() < 1e-9);
}

#[test]
fn halved_steps_lead_to_the_same_motion() {
    let play = |dt_s: f64| {
        let mut motor = motor(FREE);
        motor.rig.load.torque_nm = 0.1;
        for step in 0..(0.1 / dt_s).round() as u32 {
            // The field at the end of the step, from rest.
            let time_s = f64::from(step + 1) * dt_s;
            motor.step(dt_s, &field(50.0 * 10.0 * time_s * time_s, CURRENT_A));
        }
        motor.rotor.angle.as_rad()
    };
    let [coarse, middle, fine] = [100e-6, 50e-6, 25e-6].map(play);
    assert!((middle - fine).abs() < 0.6 * (coarse - middle).abs(), "{coarse} {middle} {fine}");
    assert!((middle - fine).abs() < 2e-3);
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let play = || {
        let mut motor = motor(MODEL);
        for step in 0..5_000 {
            motor.step(DT_S, &field(f64::from(step) * 0.01, 1.5));
        }
        motor
    };
    assert_eq!(play(), play());
}

fn any_bridges() -> impl Strategy<Value = Bridges> {
    prop_oneof![
        Just(Bridges::Open),
        Just(Bridges::Shorted),
        [-1.5..=1.5_f64, -1.5..=1.5_f64].prop_map(Bridges::Driven),
        [-3.0..=3.0_f64, -3.0..=3.0_f64].prop_map(Bridges::Regulated),
        Just(Bridges::Driven([f64::NAN, f64::INFINITY])),
        Just(Bridges::Regulated([f64::NAN, f64::INFINITY])),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_the_bridges_do_the_book_closes_and_the_numbers_stay_sound(
        play in prop::collection::vec((any_bridges(), -0.6..0.6_f64, 1_u32..300), 1..12),
        lost in prop::option::of(prop_oneof![Just(Phase::A), Just(Phase::B)]),
    ) {
        let mut motor = motor(MODEL);
        motor.rig.load.inertia_kg_m2 = 1e-5;
        let stored = motor.stored_j();
        for (index, (bridges, load_nm, steps)) in play.into_iter().enumerate() {
            motor.rig.load.torque_nm = load_nm;
            motor.lost_phase = if index % 3 == 2 { lost } else { None };
            for _ in 0..steps {
                motor.step(DT_S, &bridges);
            }
            let sensors = motor.sense();
            prop_assert!(sensors.bus_v.is_finite() && sensors.bus_v >= 0.0);
            prop_assert!(sensors.phase_current_a.iter().all(|a| a.is_finite()));
            prop_assert!(motor.rotor.velocity_rad_s.abs() < 1e5);
        }
        let through = motor.rig.energy.source_j + motor.stored_j() + motor.rig.energy.load_j.abs() + motor.rig.energy.winding_j;
        let rest = motor.rig.energy.balance_j() - (motor.stored_j() - stored);
        // At thousands of r/min out of step the torque turns round every few steps, and the angle's explicit step
        // shows: a per mille, in place of the parts in a million of a motor that is in step.
        prop_assert!(rest.abs() < 0.01 * through, "{rest} J missing of {through} J");
    }
}
