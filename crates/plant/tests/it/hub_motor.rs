//! The whole plant: energy from the source to the road, sensors, repeatability.

use plant::angle::{Angle, Axis};
use plant::encoder::EncoderFault;
use plant::hall::FORWARD_SEQUENCE;
use plant::pmsm::Phase;
use plant::rig::RigModel;
use plant::thermal::BodyModel;
use plant::{Actuation, HubMotor, HubMotorModel, Inverter};
use proptest::prelude::*;

const DT_S: f64 = 50e-6;
const MODEL: HubMotorModel = HubMotorModel::ZLLG65ASM250_L;

fn motor() -> HubMotor {
    HubMotor::new(MODEL, Angle::new(0, 0.2), 48.0, 25.0)
}

/// Duties that put a voltage across the magnets, from the true angle.
fn across_magnets(motor: &HubMotor, q_v: f64) -> Inverter {
    let electrical = MODEL.pmsm.electrical_turns(motor.rotor.angle);
    let Axis { sin, cos } = Axis::at_turns(electrical);
    let (alpha, beta) = (-q_v * sin, q_v * cos);
    let side = 0.5 * libm::sqrt(3.0) * beta;
    let phases = [alpha, side - 0.5 * alpha, -side - 0.5 * alpha];
    Inverter::Driven(phases.map(|v| v / motor.rig.supply.bus_v + 0.5))
}

/// Runs at a voltage across the magnets and checks the energy book after every step.
fn run(motor: &mut HubMotor, steps: u32, q_v: f64, bleeder_on: bool) {
    for _ in 0..steps {
        let inverter = across_magnets(motor, q_v);
        motor.step(DT_S, &Actuation { inverter, bleeder_on, brake_released: true });
    }
}

fn assert_energy_closes(motor: &HubMotor, stored_at_first_j: f64) {
    let gained = motor.stored_j() - stored_at_first_j;
    let through = motor.rig.energy.source_j.abs() + motor.stored_j() + motor.rig.energy.load_j.abs();
    let rest = motor.rig.energy.balance_j() - gained;
    assert!(rest.abs() < 1e-5 * through, "{rest} J missing of {through} J: {:?}", motor.rig.energy);
}

#[test]
fn energy_closes_while_accelerating() {
    let mut motor = motor();
    motor.rig.load.inertia_kg_m2 = 0.2;
    let stored = motor.stored_j();
    run(&mut motor, 20_000, 10.0, false);
    assert!(motor.rotor.velocity_rad_s > 15.0, "{}", motor.rotor.velocity_rad_s);
    assert_energy_closes(&motor, stored);
}

#[test]
fn regeneration_without_a_bleeder_raises_the_bus_and_energy_closes() {
    let mut motor = motor();
    motor.rig.load.inertia_kg_m2 = 0.2;
    let stored = motor.stored_j();
    run(&mut motor, 40_000, 12.0, false);
    let source_j = motor.rig.energy.source_j;
    run(&mut motor, 1_000, 10.0, false);
    assert!(motor.rig.supply.bus_v > 50.0, "{} V", motor.rig.supply.bus_v);
    assert!(motor.rig.energy.source_j - source_j < 0.5, "the source takes nothing back and gives little");
    assert_energy_closes(&motor, stored);
}

#[test]
fn the_bleeder_holds_the_bus_down_and_energy_closes() {
    let mut motor = motor();
    motor.rig.load.inertia_kg_m2 = 0.2;
    let stored = motor.stored_j();
    run(&mut motor, 40_000, 12.0, false);
    let mut highest = 0.0_f64;
    let mut bleeder_on = false;
    for _ in 0..2_000 {
        // As the drive's firmware does, with the manual's thresholds scaled to this bus.
        bleeder_on = motor.rig.supply.bus_v > if bleeder_on { 50.0 } else { 52.0 };
        run(&mut motor, 1, 10.0, bleeder_on);
        highest = highest.max(motor.rig.supply.bus_v);
    }
    assert!(highest < 53.0, "{highest} V");
    assert!(motor.rig.energy.bleeder_j > 1.0, "{} J", motor.rig.energy.bleeder_j);
    assert_energy_closes(&motor, stored);
}

#[test]
fn energy_closes_when_a_load_drives_the_shorted_motor() {
    let mut motor = motor();
    motor.rig.load.torque_nm = -3.0;
    let stored = motor.stored_j();
    for _ in 0..40_000 {
        motor.step(DT_S, &Actuation { inverter: Inverter::Shorted, bleeder_on: false, brake_released: true });
    }
    // All that the load brings becomes heat; the bus only feeds the electronics.
    let heat = motor.rig.energy.winding_j + motor.rig.energy.switches_j + motor.rig.energy.friction_j;
    let brought = -motor.rig.energy.load_j;
    assert!((heat - brought).abs() < 0.01 * brought, "{heat} of {brought}");
    assert_energy_closes(&motor, stored);
}

#[test]
fn two_wires_that_touch_carry_the_voltage_between_them_over_their_path_and_brake_a_free_motor() {
    let mut motor = motor();
    motor.wires_touch = true;
    motor.step(DT_S, &Actuation { inverter: Inverter::Driven([0.55, 0.45, 0.5]), ..Actuation::default() });
    // A tenth of 48 V over the contact's 50 milliohm and two switches; the winding sees none of it.
    let short_a = 4.8 / (0.05 + 2.0 * MODEL.rig.switch_resistance_ohm);
    let [u, v, w] = motor.sense().phase_current_a;
    assert!((u - short_a).abs() < 1e-6 && (v + short_a).abs() < 1e-6 && w.abs() < 1e-6, "{u} {v} {w}");

    // Switched off, the load turns it far slower than one whose wires are sound, and charges nothing.
    let ends = |touch: bool| {
        let mut motor = self::motor();
        (motor.wires_touch, motor.rig.load.torque_nm) = (touch, -3.0);
        (0..40_000).for_each(|_| motor.step(DT_S, &Actuation { brake_released: true, ..Actuation::default() }));
        (motor.rotor.velocity_rad_s, motor.rig.supply.bus_v)
    };
    let ((touching, bus_v), (sound, _)) = (ends(true), ends(false));
    assert!(touching < 0.2 * sound && bus_v < 48.1, "{touching} and {sound} rad/s, {bus_v} V");
}

#[test]
fn a_driven_open_motor_charges_the_bus_through_its_diodes() {
    let mut motor = motor();
    motor.rig.load.torque_nm = -3.0;
    let stored = motor.stored_j();
    for _ in 0..40_000 {
        motor.step(DT_S, &Actuation { brake_released: true, ..Actuation::default() });
    }
    assert!(motor.rig.supply.bus_v > 60.0, "{} V", motor.rig.supply.bus_v);
    assert_energy_closes(&motor, stored);
}

#[test]
fn the_winding_warms_its_resistance_rises_and_the_stall_current_falls() {
    let fast = BodyModel { resistance_k_w: 2.0, capacity_j_k: 0.05 };
    let model = HubMotorModel { rig: RigModel { winding: fast, ..MODEL.rig }, ..MODEL };
    let mut motor = HubMotor::new(model, Angle::default(), 48.0, 20.0);
    motor.rig.load.locked = true;
    for _ in 0..200_000 {
        let inverter = across_magnets(&motor, 1.5);
        motor.step(DT_S, &Actuation { inverter, bleeder_on: false, brake_released: true });
    }
    // P = 3/2 R i^2, T = 20 + R_th P, R = R20 (1 + a (T - 20)), i = V / (R + R_switch).
    let i = motor.pmsm.current_a.q;
    let r = 1.5 / i - MODEL.rig.switch_resistance_ohm;
    let rise = 2.0 * 1.5 * r * i * i;
    assert!((motor.rig.winding.temperature_c - 20.0 - rise).abs() < 0.01 * rise, "{rise}");
    assert!((r - 0.255 * (1.0 + 0.003_93 * rise)).abs() < 1e-3 * r);
    assert!(rise > 20.0);
}

#[test]
fn a_held_temperature_shows_in_the_sensors_within_a_millisecond() {
    let mut motor = motor();
    motor.rig.winding.hold_c = Some(95.0);
    motor.rig.heat_sink.hold_c = Some(85.0);
    for _ in 0..20 {
        motor.step(DT_S, &Actuation::default());
    }
    let sensors = motor.sense();
    assert_eq!((sensors.winding_c, sensors.heat_sink_c), (95.0, 85.0));
}

#[test]
fn phase_currents_lead_forward_through_u_v_w_and_sum_to_nothing() {
    let mut motor = motor();
    run(&mut motor, 20_000, 8.0, false);
    let mut order = Vec::new();
    for _ in 0..2_000 {
        run(&mut motor, 1, 8.0, false);
        let current = motor.sense().phase_current_a;
        assert!(current.iter().sum::<f64>().abs() < 1e-9);
        let highest = (0..3).max_by(|&a, &b| current[a].total_cmp(&current[b])).unwrap();
        if order.last() != Some(&highest) {
            order.push(highest);
        }
    }
    assert!(order.len() > 9);
    assert!(order.windows(2).all(|pair| pair[1] == (pair[0] + 1) % 3), "{order:?}");
}

#[test]
fn forward_motion_counts_up_and_runs_the_hall_sequence() {
    let mut motor = motor();
    let mut states = vec![motor.sense().hall];
    let before = motor.rotor.angle.count(4096);
    for _ in 0..4_000 {
        run(&mut motor, 1, 4.0, false);
        let hall = motor.sense().hall;
        if states.last() != Some(&hall) {
            states.push(hall);
        }
    }
    assert!(states.len() > 12);
    let place = |state: u8| FORWARD_SEQUENCE.iter().position(|&s| s == state).unwrap();
    assert!(states.windows(2).all(|pair| place(pair[1]) == (place(pair[0]) + 1) % 6), "{states:?}");
    let counted = motor.rotor.angle.count(4096) - before;
    assert!(counted > 0);
    assert_eq!(motor.sense().encoder_count, counted as u16);
}

#[test]
fn a_disconnected_encoder_stands_still_while_the_motor_turns() {
    let mut motor = motor();
    run(&mut motor, 2_000, 4.0, false);
    motor.encoder.fault = EncoderFault::Disconnected;
    let count = motor.sense().encoder_count;
    run(&mut motor, 2_000, 4.0, false);
    assert_eq!(motor.sense().encoder_count, count);
}

#[test]
fn no_load_speed_at_24_v_is_the_published_one() {
    let mut motor = HubMotor::new(MODEL, Angle::default(), 24.0, 25.0);
    // As much voltage as the bus has, turned on by half a step to stand across the magnets.
    for _ in 0..60_000 {
        let q_v = motor.rig.supply.bus_v / libm::sqrt(3.0);
        let lead = motor.rotor.velocity_rad_s * 15.0 * DT_S / 2.0;
        let axis = Axis::at_turns(MODEL.pmsm.electrical_turns(motor.rotor.angle)).turned_by(Axis::at_small_rad(lead));
        let (alpha, beta) = (-q_v * axis.sin, q_v * axis.cos);
        let side = 0.5 * libm::sqrt(3.0) * beta;
        let phases = [alpha, side - 0.5 * alpha, -side - 0.5 * alpha];
        let (low, high) = phases.iter().fold((f64::MAX, f64::MIN), |(l, h), &v| (l.min(v), h.max(v)));
        let duty = phases.map(|v| (v - 0.5 * (low + high)) / motor.rig.supply.bus_v + 0.5);
        motor.step(DT_S, &Actuation { inverter: Inverter::Driven(duty), bleeder_on: false, brake_released: true });
    }
    let r_min = motor.rotor.velocity_rad_s * 60.0 / core::f64::consts::TAU;
    // 262 r/min on the sister motor's test sheet.
    assert!((255.0..265.0).contains(&r_min), "{r_min}");
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let play = || {
        let mut motor = motor();
        motor.rig.load.torque_nm = 0.7;
        run(&mut motor, 5_000, 9.0, false);
        run(&mut motor, 5_000, -9.0, true);
        motor
    };
    assert_eq!(play(), play());
}

#[test]
fn a_clone_goes_on_as_the_original() {
    let mut one = motor();
    run(&mut one, 1_234, 9.0, false);
    let mut other = one.clone();
    run(&mut one, 1_000, 5.0, false);
    run(&mut other, 1_000, 5.0, false);
    assert_eq!(one, other);
}

#[test]
fn halved_steps_lead_to_the_same_motion() {
    let play = |dt_s: f64| {
        let mut motor = motor();
        motor.rig.load.torque_nm = 0.5;
        let steps = (0.5 / dt_s) as u32;
        for step in 0..steps {
            // A rotating field at 10 Hz electrical that the motor is pulled along by.
            let turns = 10.0 * (f64::from(step) + 0.5) * dt_s * (f64::from(step) * dt_s);
            let Axis { sin, cos } = Axis::at_turns(turns);
            let side = 0.5 * libm::sqrt(3.0) * sin;
            let duty = [cos, side - 0.5 * cos, -side - 0.5 * cos].map(|x| 0.5 + 0.08 * x);
            motor.step(dt_s, &Actuation { inverter: Inverter::Driven(duty), bleeder_on: false, brake_released: true });
        }
        motor.rotor.angle.as_rad()
    };
    let [coarse, middle, fine] = [100e-6, 50e-6, 25e-6].map(play);
    assert!((middle - fine).abs() < 0.6 * (coarse - middle).abs(), "{coarse} {middle} {fine}");
    assert!((middle - fine).abs() < 1e-3);
}

fn any_inverter() -> impl Strategy<Value = Inverter> {
    prop_oneof![
        Just(Inverter::Open),
        Just(Inverter::Shorted),
        [0.0..=1.0_f64, 0.0..=1.0_f64, 0.0..=1.0_f64].prop_map(Inverter::Driven),
    ]
}

/// Stretches of some steps each under one actuation and one load torque.
fn any_play() -> impl Strategy<Value = Vec<(Inverter, bool, bool, f64, u32)>> {
    prop::collection::vec((any_inverter(), any::<bool>(), any::<bool>(), -20.0..20.0_f64, 1_u32..300), 1..12)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_the_drive_does_the_energy_book_closes(play in any_play(), touch in any::<bool>()) {
        let mut motor = motor();
        motor.wires_touch = touch;
        let stored = motor.stored_j();
        for (inverter, bleeder_on, brake_released, load_nm, steps) in play {
            motor.rig.load.torque_nm = load_nm;
            for _ in 0..steps {
                motor.step(DT_S, &Actuation { inverter, bleeder_on, brake_released });
            }
        }
        let through = motor.rig.energy.source_j + motor.stored_j() + motor.rig.energy.load_j.abs() + motor.rig.energy.winding_j;
        let rest = motor.rig.energy.balance_j() - (motor.stored_j() - stored);
        prop_assert!(rest.abs() < 0.002 * through, "{rest} J missing of {through} J");
    }

    #[test]
    fn no_fault_and_no_duty_makes_the_plant_lose_its_numbers(
        play in any_play(), lost in prop::option::of(prop_oneof![Just(Phase::U), Just(Phase::V), Just(Phase::W)]),
        bad in prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1e300)],
    ) {
        let mut motor = motor();
        for (index, (inverter, bleeder_on, brake_released, load_nm, steps)) in play.into_iter().enumerate() {
            motor.lost_phase = if index % 2 == 1 { lost } else { None };
            motor.wires_touch = index % 5 == 4;
            motor.rig.supply.connected = index % 3 != 2;
            motor.rig.load.torque_nm = load_nm;
            let inverter = match inverter {
                Inverter::Driven([u, v, _]) if index % 4 == 3 => Inverter::Driven([u, v, bad]),
                Inverter::Driven([_, v, w]) if index % 5 == 4 => Inverter::Driven([bad, v, w]),
                other => other,
            };
            for _ in 0..steps {
                motor.step(DT_S, &Actuation { inverter, bleeder_on, brake_released });
            }
            let sensors = motor.sense();
            prop_assert!(sensors.bus_v.is_finite() && sensors.bus_v >= 0.0);
            prop_assert!(sensors.phase_current_a.iter().all(|a| a.is_finite()));
            prop_assert!(sensors.winding_c.is_finite() && (1..=6).contains(&sensors.hall));
            prop_assert!(motor.rotor.velocity_rad_s.is_finite() && motor.rotor.velocity_rad_s.abs() < 1e4);
        }
    }
}

/// A load that drives a free wheel ends where its power is what friction and the clamp take: with a clamp of `U` and `R`,
/// `P = V (V - U) / R` and the speed is `V / K`, a little more for the current.
#[test]
fn a_wheel_that_a_load_drives_ends_at_the_speed_where_drag_and_the_clamp_take_its_power() {
    let mut motor = motor();
    motor.rig.load.torque_nm = 2.5;
    let stored = motor.stored_j();
    for _ in 0..200_000 {
        motor.step(DT_S, &Actuation { brake_released: true, ..Actuation::default() });
    }
    let (bus_v, speed) = (motor.rig.supply.bus_v, -motor.rotor.velocity_rad_s);
    let drag_nm = MODEL.rotor.coulomb_nm + MODEL.rotor.viscous_nm_s * speed;
    let current_a = (2.5 - drag_nm) / MODEL.pmsm.torque_constant_nm_a();
    let copper_w = 1.5 * (MODEL.pmsm.resistance_ohm + MODEL.rig.switch_resistance_ohm) * current_a * current_a;
    let clamp_w = (2.5 - drag_nm) * speed - copper_w - MODEL.rig.supply.consumption_w;
    let clamp = MODEL.clamp;
    let expected_v = 0.5 * (clamp.from_v + (clamp.from_v.powi(2) + 4.0 * clamp_w * clamp.resistance_ohm).sqrt());
    assert!((bus_v - expected_v).abs() < 0.5, "{bus_v} V, expected {expected_v}");
    let expected = bus_v / 3_f64.sqrt() / MODEL.pmsm.back_emf_constant_v_s();
    assert!(speed > expected && speed < 1.03 * expected, "{speed} rad/s, back-emf equals the bus at {expected}");
    assert!(motor.rig.heat_sink.temperature_c > 30.0, "the clamp's heat");
    assert_energy_closes(&motor, stored);
}

/// 5 N m feed the clamp with 540 W; 150 K of the heat sink are 40 kJ, less what it gives off on the way.
#[test]
fn a_clamp_that_is_fed_for_long_melts_the_power_stage_which_then_brakes_the_wheel_and_shorts_the_bus() {
    let mut motor = motor();
    motor.rig.load.torque_nm = 5.0;
    let off = Actuation { brake_released: true, ..Actuation::default() };
    let mut seconds = 0.0;
    while !motor.is_power_stage_burnt() {
        motor.step(DT_S, &off);
        seconds += DT_S;
        assert!(seconds < 100.0, "{} degC", motor.rig.heat_sink.temperature_c);
    }
    assert!(seconds > 0.95 * 150.0 * MODEL.rig.heat_sink.capacity_j_k / 560.0, "{seconds} s");
    for _ in 0..40_000 {
        motor.step(DT_S, &off);
    }
    assert_eq!((motor.rig.supply.bus_v, motor.rig.supply.connected), (0.0, false));
    // Joined wires at a crawl: the load less the dry friction over 3/2 (p psi)^2 / R and the viscous friction.
    let ohm = MODEL.rig.switch_resistance_ohm
        + MODEL.pmsm.resistance_ohm * (1.0 + MODEL.rig.resistance_per_k * (motor.rig.winding.temperature_c - 20.0));
    let damping = 1.5 * MODEL.pmsm.back_emf_constant_v_s().powi(2) / ohm + MODEL.rotor.viscous_nm_s;
    let expected = (5.0 - MODEL.rotor.coulomb_nm) / damping;
    let speed = -motor.rotor.velocity_rad_s;
    assert!((speed / expected - 1.0).abs() < 0.03, "{speed} rad/s, expected {expected}");
    motor.mend_power_stage();
    motor.rig.load.torque_nm = 0.0;
    motor.rig.heat_sink.temperature_c = 25.0;
    for _ in 0..100 {
        motor.step(DT_S, &off);
    }
    assert!(!motor.is_power_stage_burnt());
}

/// 20 N m are more than the motor brakes with at any speed: its inductance keeps the current down.
#[test]
fn a_wheel_that_runs_away_seizes_at_the_speed_limit_of_its_bearings() {
    let mut motor = motor();
    motor.rig.load.torque_nm = 20.0;
    let off = Actuation { brake_released: true, ..Actuation::default() };
    let (mut seconds, mut fastest, stored) = (0.0, 0.0_f64, motor.stored_j());
    while !motor.is_seized() {
        fastest = fastest.max(motor.rotor.velocity_rad_s.abs());
        motor.step(DT_S, &off);
        seconds += DT_S;
        assert!(seconds < 20.0, "{} rad/s", motor.rotor.velocity_rad_s);
    }
    assert!((fastest / MODEL.bearing_limit_rad_s - 1.0).abs() < 0.01, "{fastest} rad/s");
    assert_eq!(motor.rotor.velocity_rad_s, 0.0);
    assert_energy_closes(&motor, stored);
    motor.lock_rotor(false);
    motor.rig.load.torque_nm = 0.0;
    motor.step(DT_S, &off);
    assert!(!motor.is_seized() && !motor.rig.load.locked);
}
