//! The SGMAH-04A against its maker's table (3.1.1 of SIEP S800000 15) and against closed forms.

use plant::angle::{Angle, Axis};
use plant::mechanics::RotorModel;
use plant::{Actuation, HubMotor, HubMotorModel, Inverter};

const DT_S: f64 = 10e-6;
const MODEL: HubMotorModel = HubMotorModel::SGMAH_04A;
const BUS_V: f64 = 283.0;
const SQRT_2: f64 = std::f64::consts::SQRT_2;

fn motor() -> HubMotor {
    HubMotor::new(MODEL, Angle::new(0, 0.0), BUS_V, 20.0)
}

/// One step with a voltage across the magnets, from the true angle in the middle of the step.
fn step(motor: &mut HubMotor, q_v: f64) {
    let half_turns = 0.5 * DT_S * motor.rotor.velocity_rad_s * f64::from(MODEL.pmsm.pole_pairs) / std::f64::consts::TAU;
    let Axis { sin, cos } = Axis::at_turns(MODEL.pmsm.electrical_turns(motor.rotor.angle) + half_turns);
    let (alpha, beta) = (-q_v * sin, q_v * cos);
    let side = 0.5 * libm::sqrt(3.0) * beta;
    let phases = [alpha, side - 0.5 * alpha, -side - 0.5 * alpha];
    let inverter = Inverter::Driven(phases.map(|v| v / motor.rig.supply.bus_v + 0.5));
    motor.step(DT_S, &Actuation { inverter, bleeder_on: false, brake_released: true });
}

fn close(value: f64, expected: f64, share: f64) -> bool {
    (value / expected - 1.0).abs() < share
}

#[test]
fn the_constants_give_the_makers_derived_figures() {
    let (pmsm, rotor) = (MODEL.pmsm, MODEL.rotor);
    let torque_constant_rms = pmsm.torque_constant_nm_a() * SQRT_2;
    assert!(close(torque_constant_rms, 0.498, 1e-12));
    let inertia_s = 3.0 * pmsm.resistance_ohm * rotor.inertia_kg_m2 / (torque_constant_rms * torque_constant_rms);
    assert!(close(inertia_s, 0.25e-3, 1e-12));
    assert!(close(pmsm.inductance_q_h / pmsm.resistance_ohm, 5.4e-3, 1e-12));
    // Rated angular acceleration 73600 rad/s^2 and power rate 93.7 kW/s, from the rated torque.
    assert!(close(1.27 / rotor.inertia_kg_m2, 73_600.0, 0.005));
    assert!(close(1.27 * 1.27 / rotor.inertia_kg_m2, 93.7e3, 0.01));
    // 400 W at 3000 r/min, and the peak torque at the peak current.
    assert!(close(1.27 * 3000.0 * std::f64::consts::TAU / 60.0, 400.0, 0.005));
    assert!(close(torque_constant_rms * 8.5, 3.82, 0.12), "saturation takes a tenth of it");
    assert_eq!(MODEL.encoder.counts_per_turn(), 131_072);
}

#[test]
fn the_bus_reaches_the_highest_speed_with_room_to_spare() {
    let r_min = MODEL.pmsm.no_load_velocity_rad_s(BUS_V) * 60.0 / std::f64::consts::TAU;
    assert!((5000.0..7500.0).contains(&r_min), "{r_min}");
}

#[test]
fn the_speed_without_load_balances_emf_friction_and_impedance() {
    let mut motor = motor();
    let q_v = 100.0;
    (0..100_000).for_each(|_| step(&mut motor, q_v));
    // 0 = R i_d - w L i_q and V = R i_q + w L i_d + ke W, with kt i_q = Tc + b W.
    let (pmsm, rotor) = (MODEL.pmsm, MODEL.rotor);
    let ohm = MODEL.rig.switch_resistance_ohm
        + pmsm.resistance_ohm * (1.0 + 0.00393 * (motor.rig.winding.temperature_c - 20.0));
    let velocity = motor.rotor.velocity_rad_s;
    let reactance = f64::from(pmsm.pole_pairs) * velocity * pmsm.inductance_q_h;
    let current_a = (rotor.coulomb_nm + rotor.viscous_nm_s * velocity) / pmsm.torque_constant_nm_a();
    let expected_v = (ohm + reactance * reactance / ohm) * current_a + pmsm.back_emf_constant_v_s() * velocity;
    assert!(close(q_v, expected_v, 2e-3), "{velocity} rad/s would take {expected_v} V");
}

#[test]
fn the_blocked_motor_takes_the_stall_current_with_the_inductive_time_constant() {
    let mut motor = motor();
    motor.lock_rotor(true);
    let ohm = MODEL.pmsm.resistance_ohm + MODEL.rig.switch_resistance_ohm;
    let (q_v, time_constant_s) = (10.0, MODEL.pmsm.inductance_q_h / ohm);
    let steps = (time_constant_s / DT_S).round() as u32;
    (0..steps).for_each(|_| step(&mut motor, q_v));
    let expected_a = q_v / ohm * (1.0 - (-f64::from(steps) * DT_S / time_constant_s).exp());
    assert!(close(motor.pmsm.current_a.q, expected_a, 1e-3), "{} {expected_a}", motor.pmsm.current_a.q);
    (0..10 * steps).for_each(|_| step(&mut motor, q_v));
    assert!(close(motor.pmsm.current_a.q, q_v / ohm, 2e-3), "{}", motor.pmsm.current_a.q);
}

#[test]
fn the_free_motor_swings_at_its_two_time_constants() {
    // Te Tm s^2 + Tm s + 1 = 0: with Te = 21 Tm the poles are a damped pair. A small voltage, so that the axes stay apart.
    // And without friction, which would hold the motor back at first.
    let rotor = RotorModel { coulomb_nm: 0.0, viscous_nm_s: 0.0, ..MODEL.rotor };
    let mut motor = HubMotor::new(HubMotorModel { rotor, ..MODEL }, Angle::new(0, 0.0), BUS_V, 20.0);
    let ohm = MODEL.pmsm.resistance_ohm + MODEL.rig.switch_resistance_ohm;
    let (kt, ke) = (MODEL.pmsm.torque_constant_nm_a(), MODEL.pmsm.back_emf_constant_v_s());
    let inertia_s = ohm * MODEL.rotor.inertia_kg_m2 / (kt * ke);
    let inductive_s = MODEL.pmsm.inductance_q_h / ohm;
    let damping = 0.5 / inductive_s;
    let ringing = (1.0 / (inertia_s * inductive_s) - damping * damping).sqrt();
    let mut highest = (0.0, 0.0);
    for k in 1..2000 {
        step(&mut motor, 2.0);
        if motor.rotor.velocity_rad_s > highest.1 {
            highest = (f64::from(k) * DT_S, motor.rotor.velocity_rad_s);
        }
    }
    assert!(close(highest.0, std::f64::consts::PI / ringing, 0.02), "{highest:?}");
}

#[test]
fn the_brake_holds_the_rated_torque_and_adds_its_inertia() {
    let model = HubMotorModel::SGMAH_04A_BRAKE;
    assert!(close(model.rotor.inertia_kg_m2, 0.231e-4, 1e-9));
    let mut motor = HubMotor::new(model, Angle::new(0, 0.0), BUS_V, 20.0);
    motor.rig.load.torque_nm = -1.27;
    let held = Actuation { inverter: Inverter::Open, bleeder_on: false, brake_released: false };
    (0..1000).for_each(|_| motor.step(DT_S, &held));
    assert_eq!(motor.rotor.velocity_rad_s, 0.0);
    let released = Actuation { brake_released: true, ..held };
    (0..1000).for_each(|_| motor.step(DT_S, &released));
    assert!(motor.rotor.velocity_rad_s > 100.0, "{}", motor.rotor.velocity_rad_s);
}
