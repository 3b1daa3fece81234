//! The motor's winding against closed forms of the dq equations.

use plant::HubMotorModel;
use plant::angle::Axis;
use plant::mechanics::{Load, RotorData, RotorModel};
use plant::pmsm::{Dq, Phase, PmsmData, PmsmInput, PmsmModel, PmsmOutput, Terminals};

const DT_S: f64 = 50e-6;
const MOTOR: PmsmModel = HubMotorModel::ZLLG65ASM250_L.pmsm;
const ROTOR: RotorModel = HubMotorModel::ZLLG65ASM250_L.rotor;
const RESISTANCE_OHM: f64 = 0.3;

/// A winding whose rotor angle and velocity the test dictates.
struct Bench {
    motor: PmsmModel,
    data: PmsmData,
    lost_phase: Option<Phase>,
    electrical_rad: f64,
    dt_s: f64,
}

impl Bench {
    fn new(motor: PmsmModel) -> Self {
        Bench { motor, data: PmsmData::default(), lost_phase: None, electrical_rad: 0.0, dt_s: DT_S }
    }

    /// One step at a velocity; `terminals` is given the magnets' direction in the middle of the step.
    fn step(&mut self, velocity_rad_s: f64, terminals: impl Fn(Axis) -> Terminals) -> PmsmOutput {
        let step_rad = velocity_rad_s * f64::from(self.motor.pole_pairs) * self.dt_s;
        let axis = Axis::at_turns((self.electrical_rad + 0.5 * step_rad) / core::f64::consts::TAU);
        self.electrical_rad += step_rad;
        let input = PmsmInput {
            terminals: terminals(axis),
            lost_phase: self.lost_phase,
            resistance_ohm: RESISTANCE_OHM,
            axis,
            velocity_rad_s,
        };
        self.motor.step(&mut self.data, self.dt_s, &input)
    }

    fn phase_current_a(&self) -> [f64; 3] {
        self.motor.phase_current_a(&self.data, Axis::at_turns(self.electrical_rad / core::f64::consts::TAU))
    }
}

/// A voltage that stands across the magnets, and along them.
fn in_rotor_frame(d: f64, q: f64) -> impl Fn(Axis) -> Terminals {
    move |axis| Terminals::Driven { alpha_v: d * axis.cos - q * axis.sin, beta_v: d * axis.sin + q * axis.cos }
}

fn near(actual: f64, expected: f64, relative: f64) -> bool {
    (actual - expected).abs() <= relative * expected.abs()
}

#[test]
fn a_stalled_motor_draws_voltage_over_resistance_with_the_electrical_time_constant() {
    let mut bench = Bench::new(MOTOR);
    let steps = (MOTOR.inductance_q_h / RESISTANCE_OHM / DT_S).round();
    let time_s = steps * DT_S;
    for _ in 0..steps as u32 {
        bench.step(0.0, in_rotor_frame(0.0, 3.0));
    }
    let expected = 10.0 * (1.0 - libm::exp(-time_s * RESISTANCE_OHM / MOTOR.inductance_q_h));
    assert!(near(bench.data.current_a.q, expected, 1e-4), "{} {expected}", bench.data.current_a.q);
    for _ in 0..2000 {
        bench.step(0.0, in_rotor_frame(0.0, 3.0));
    }
    assert!(near(bench.data.current_a.q, 10.0, 1e-9));
}

#[test]
fn no_load_speed_is_voltage_over_back_emf_less_the_share_of_friction() {
    let mut bench = Bench::new(MOTOR);
    let mut rotor = RotorData::default();
    let volts = 13.0;
    for _ in 0..100_000 {
        let velocity = rotor.turn(bench.dt_s, &Load::default());
        let torque = bench.step(velocity, in_rotor_frame(0.0, volts)).torque_nm;
        ROTOR.step(&mut rotor, DT_S, torque, &Load::default(), 0.0);
    }
    let speed = rotor.velocity_rad_s;
    // The torque that is left carries friction; its current drops R i and turns the d axis by w L i.
    let q = (ROTOR.coulomb_nm + ROTOR.viscous_nm_s * speed) / MOTOR.torque_constant_nm_a();
    let omega = f64::from(MOTOR.pole_pairs) * speed;
    let d = omega * MOTOR.inductance_q_h * q / RESISTANCE_OHM;
    let needed = RESISTANCE_OHM * q + omega * (MOTOR.inductance_d_h * d + MOTOR.flux_linkage_wb);
    assert!(near(needed, volts, 1e-9), "{needed} V for {volts} V");
    let ideal = volts / MOTOR.back_emf_constant_v_s();
    assert!(speed < ideal && speed > 0.98 * ideal);
}

#[test]
fn without_inductance_and_friction_the_speed_rises_with_the_mechanical_time_constant() {
    let motor = PmsmModel { inductance_d_h: 1e-7, inductance_q_h: 1e-7, ..MOTOR };
    let rotor_model = RotorModel { viscous_nm_s: 0.0, coulomb_nm: 0.0, ..ROTOR };
    let mut bench = Bench::new(motor);
    bench.dt_s = 5e-6;
    let mut rotor = RotorData::default();
    let time_constant_s =
        rotor_model.inertia_kg_m2 * RESISTANCE_OHM / (motor.torque_constant_nm_a() * motor.back_emf_constant_v_s());
    let steps = (time_constant_s / bench.dt_s) as u32;
    for _ in 0..steps {
        let velocity = rotor.turn(bench.dt_s, &Load::default());
        let torque = bench.step(velocity, in_rotor_frame(0.0, 5.0)).torque_nm;
        rotor_model.step(&mut rotor, bench.dt_s, torque, &Load::default(), 0.0);
    }
    let elapsed = f64::from(steps) * bench.dt_s / time_constant_s;
    let expected = 5.0 / motor.back_emf_constant_v_s() * (1.0 - libm::exp(-elapsed));
    assert!(near(rotor.velocity_rad_s, expected, 1e-3), "{} {expected}", rotor.velocity_rad_s);
}

#[test]
fn shorted_wires_brake_with_the_closed_form() {
    for speed in [-60.0, -5.0, 1.0, 10.0, 100.0] {
        let mut bench = Bench::new(MOTOR);
        let mut torque = 0.0;
        for _ in 0..5000 {
            let out = bench.step(speed, |_| Terminals::Shorted);
            assert_eq!(out.bus_w, 0.0);
            torque = out.torque_nm;
        }
        let omega = f64::from(MOTOR.pole_pairs) * speed;
        let reactance = omega * MOTOR.inductance_q_h;
        let expected =
            -1.5 * f64::from(MOTOR.pole_pairs) * MOTOR.flux_linkage_wb * MOTOR.flux_linkage_wb * omega * RESISTANCE_OHM
                / (RESISTANCE_OHM * RESISTANCE_OHM + reactance * reactance);
        assert!(near(torque, expected, 1e-9), "{torque} {expected} at {speed} rad/s");
    }
}

#[test]
fn open_wires_carry_nothing_until_the_back_emf_exceeds_the_bus() {
    let onset = MOTOR.no_load_velocity_rad_s(48.0);
    let mut bench = Bench::new(MOTOR);
    for _ in 0..1000 {
        let out = bench.step(0.999 * onset, |_| Terminals::Open { bus_v: 48.0 });
        assert_eq!(out, PmsmOutput::default());
    }
    let mut out = PmsmOutput::default();
    for _ in 0..5000 {
        out = bench.step(1.1 * onset, |_| Terminals::Open { bus_v: 48.0 });
    }
    assert!(out.torque_nm < 0.0 && out.bus_w < 0.0, "{out:?}");
    // What the shaft gives is heat and what the bus gets.
    let shaft_w = -out.torque_nm * 1.1 * onset;
    assert!(near(shaft_w, out.heat_w_per_ohm * RESISTANCE_OHM - out.bus_w, 1e-6));
}

#[test]
fn a_running_current_dies_through_the_diodes_and_its_energy_reaches_the_bus() {
    let mut bench = Bench::new(MOTOR);
    bench.dt_s = 1e-6;
    bench.data.current_a = Dq { d: 0.0, q: 10.0 };
    let stored_j = MOTOR.magnetic_energy_j(&bench.data);
    let (mut to_bus_j, mut heat_j, mut steps) = (0.0, 0.0, 0_u32);
    while bench.data.current_a != Dq::default() {
        let out = bench.step(0.0, |_| Terminals::Open { bus_v: 48.0 });
        to_bus_j -= out.bus_w * bench.dt_s;
        heat_j += out.heat_w_per_ohm * RESISTANCE_OHM * bench.dt_s;
        steps += 1;
        assert!(steps < 10_000);
    }
    assert!(near(to_bus_j + heat_j, stored_j, 1e-3));
    // L di/dt = -U - R i, from 10 A to zero.
    let (counter_v, l) = (48.0 / libm::sqrt(3.0), MOTOR.inductance_q_h);
    let expected_s = l / RESISTANCE_OHM * libm::log(1.0 + 10.0 * RESISTANCE_OHM / counter_v);
    assert!(near(f64::from(steps) * bench.dt_s, expected_s, 0.01));
}

#[test]
fn a_lost_wire_carries_nothing_and_the_other_two_one_current() {
    for (phase, lost, others) in [(Phase::U, 0, [1, 2]), (Phase::V, 1, [2, 0]), (Phase::W, 2, [0, 1])] {
        let mut bench = Bench::new(MOTOR);
        bench.lost_phase = Some(phase);
        for _ in 0..2000 {
            bench.step(20.0, in_rotor_frame(0.0, 12.0));
            let current = bench.phase_current_a();
            assert!(current[lost].abs() < 0.02 * current[others[0]].abs().max(1.0), "{current:?}");
            assert!((current[others[0]] + current[others[1]]).abs() < 0.02 * current[others[0]].abs().max(1.0));
        }
    }
}

#[test]
fn a_stalled_motor_with_a_lost_wire_draws_the_line_voltage_over_two_resistances() {
    let mut bench = Bench::new(MOTOR);
    bench.lost_phase = Some(Phase::U);
    for _ in 0..2000 {
        bench.step(0.0, |_| Terminals::from_duties([0.9, 0.6, 0.4], 30.0));
    }
    let [u, v, w] = bench.phase_current_a();
    let expected = (0.6 - 0.4) * 30.0 / (2.0 * RESISTANCE_OHM);
    assert!(u.abs() < 1e-9 && near(v, expected, 1e-6) && near(w, -expected, 1e-6), "{u} {v} {w}");
}

#[test]
fn duties_make_the_same_voltage_whatever_their_common_part() {
    let Terminals::Driven { alpha_v, beta_v } = Terminals::from_duties([0.6, 0.4, 0.5], 48.0) else { panic!() };
    let Terminals::Driven { alpha_v: a, beta_v: b } = Terminals::from_duties([0.8, 0.6, 0.7], 48.0) else { panic!() };
    assert!((alpha_v - a).abs() < 1e-12 && (beta_v - b).abs() < 1e-12);
    assert!(near(alpha_v, 48.0 * (2.0 * 0.6 - 0.4 - 0.5) / 3.0, 1e-12));
}

#[test]
fn every_step_keeps_its_energy_balance_with_salient_poles_too() {
    let salient = PmsmModel { inductance_d_h: 0.5e-3, inductance_q_h: 0.9e-3, ..MOTOR };
    let mut bench = Bench::new(salient);
    let mut velocity = -40.0;
    for step in 0..20_000 {
        velocity += 0.004;
        let before = salient.magnetic_energy_j(&bench.data);
        let (d, q) = (4.0 * libm::sin(f64::from(step) * 0.01), 10.0 * libm::cos(f64::from(step) * 0.003));
        let out = bench.step(velocity, in_rotor_frame(d, q));
        let stored_w = (salient.magnetic_energy_j(&bench.data) - before) / DT_S;
        let rest = out.bus_w - out.heat_w_per_ohm * RESISTANCE_OHM - out.torque_nm * velocity - stored_w;
        let scale = out.bus_w.abs() + stored_w.abs() + 1.0;
        assert!(rest.abs() < 1e-9 * scale, "{rest} W of {scale} W at step {step}");
    }
}

#[test]
fn halving_the_step_quarters_the_error() {
    let run = |dt_s: f64| {
        let mut bench = Bench::new(MOTOR);
        bench.dt_s = dt_s;
        let steps = (5e-3 / dt_s).round() as u32;
        for step in 0..steps {
            let time_s = (f64::from(step) + 0.5) * dt_s;
            let omega = 600.0;
            let (alpha_v, beta_v) = (9.0 * libm::cos(omega * time_s), 9.0 * libm::sin(omega * time_s));
            bench.step(38.0, |_| Terminals::Driven { alpha_v, beta_v });
        }
        bench.data.current_a
    };
    let [coarse, middle, fine, reference] = [100e-6, 50e-6, 25e-6, 1e-6].map(run);
    let error = |i: Dq| libm::hypot(i.d - reference.d, i.q - reference.q);
    for ratio in [error(coarse) / error(middle), error(middle) / error(fine)] {
        assert!((3.5..4.5).contains(&ratio), "{ratio}");
    }
    assert!(error(middle) < 0.02, "{} A", error(middle));
}
