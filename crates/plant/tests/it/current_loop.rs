//! The closed form of a current loop beside the formulas of a winding.

use plant::angle::Axis;
use plant::current_loop::{CurrentLoop, KnownMotor};
use plant::hub_motor::HubMotorModel;
use plant::pmsm::{Dq, PmsmData, PmsmInput, PmsmModel, PmsmOutput, Terminals};

const MOTOR: PmsmModel = HubMotorModel::ZLLG65ASM250_L.pmsm;
const BUS_V: f64 = 48.0;
const STEP_S: f64 = 0.5e-3;

/// A loop of this bandwidth that cancels the winding's pole: `kp = w L`, `ki = w R`.
fn cancelling(bandwidth_rad_s: f64, asked_a: f64) -> PmsmData {
    let settings = CurrentLoop {
        setpoint_a: Dq { d: 0.0, q: asked_a },
        ahead: Axis { sin: 0.0, cos: 1.0 },
        proportional: bandwidth_rad_s * MOTOR.inductance_q_h,
        integral_per_s: bandwidth_rad_s * MOTOR.resistance_ohm,
        modulation_limit: 1.0,
        ..CurrentLoop::default()
    };
    let mut data = PmsmData::default();
    data.current_loop.settings = settings;
    data
}

fn step(data: &mut PmsmData, velocity_rad_s: f64) -> PmsmOutput {
    let input = PmsmInput {
        terminals: Terminals::Regulated { bus_v: BUS_V },
        lost_phase: None,
        resistance_ohm: MOTOR.resistance_ohm,
        axis: Axis { sin: 0.0, cos: 1.0 },
        velocity_rad_s,
    };
    MOTOR.step(data, STEP_S, &input)
}

#[test]
fn a_loop_that_cancels_the_windings_pole_is_of_first_order_at_any_bandwidth() {
    for bandwidth in [100.0, 860.0, 4000.0, 20_000.0] {
        let mut data = cancelling(bandwidth, 1.0);
        for n in 1..=6 {
            let torque_nm = step(&mut data, 0.0).torque_nm;
            let (from, to) = (f64::from(n - 1) * STEP_S * bandwidth, f64::from(n) * STEP_S * bandwidth);
            let expected = 1.0 - (-to).exp();
            assert!((data.current_a.q - expected).abs() < 1e-9, "{bandwidth}, step {n}: {} A", data.current_a.q);
            // The mean of it over the step.
            let mean = 1.0 - ((-from).exp() - (-to).exp()) / (to - from);
            let mean_a = torque_nm / MOTOR.torque_constant_nm_a();
            assert!((mean_a - mean).abs() < 1e-9, "{bandwidth}, step {n}: {mean_a} A in the mean");
        }
        assert!(!data.current_loop.saturated && data.current_a.d == 0.0);
    }
}

#[test]
fn a_loop_that_knows_its_motor_is_of_first_order_while_it_turns() {
    let mut data = cancelling(860.0, 2.0);
    data.current_loop.settings.known = KnownMotor {
        inductance_d_h: MOTOR.inductance_d_h,
        inductance_q_h: MOTOR.inductance_q_h,
        flux_linkage_wb: MOTOR.flux_linkage_wb,
    };
    for n in 1..=12 {
        step(&mut data, 27.4);
        let expected = 2.0 * (1.0 - (-f64::from(n) * STEP_S * 860.0).exp());
        assert!((data.current_a.q - expected).abs() < 1e-9, "step {n}: {} A, {expected} A", data.current_a.q);
        // What the current itself induces across is fed forward, too.
        assert!(data.current_a.d.abs() < 1e-9, "step {n}: {} A across", data.current_a.d);
    }
    // What a winding with 2 A across its magnets takes, of which most is fed forward.
    for _ in 0..400 {
        step(&mut data, 27.4);
    }
    let omega = 27.4 * f64::from(MOTOR.pole_pairs);
    let expected_v =
        Dq { d: -omega * MOTOR.inductance_q_h * 2.0, q: MOTOR.resistance_ohm * 2.0 + omega * MOTOR.flux_linkage_wb };
    let Dq { d, q } = data.current_loop.wanted_v;
    assert!((d - expected_v.d).abs() < 1e-6 && (q - expected_v.q).abs() < 1e-6, "{d} V, {q} V, {expected_v:?}");
}

#[test]
fn where_the_voltage_is_used_up_the_winding_takes_what_the_bus_gives() {
    let mut data = cancelling(860.0, 1000.0);
    let volts = BUS_V / 3.0_f64.sqrt();
    for n in 1..=3 {
        step(&mut data, 0.0);
        let time_constants = f64::from(n) * STEP_S * MOTOR.resistance_ohm / MOTOR.inductance_q_h;
        let expected = volts / MOTOR.resistance_ohm * (1.0 - (-time_constants).exp());
        assert!(data.current_loop.saturated);
        assert!((data.current_a.q - expected).abs() < 1e-3 * expected, "{} A, {expected} A", data.current_a.q);
    }
}

#[test]
fn against_the_motors_own_voltage_the_current_comes_to_its_set_point() {
    // 27.4 rad/s are half of what 48 V can push a current at.
    let mut data = cancelling(860.0, 2.0);
    let mut out = PmsmOutput::default();
    (0..400).for_each(|_| out = step(&mut data, 27.4));
    assert!((data.current_a.q - 2.0).abs() < 1e-6 && data.current_a.d.abs() < 1e-6, "{:?}", data.current_a);
    let expected_w = 1.5 * 4.0 * MOTOR.resistance_ohm + 2.0 * MOTOR.torque_constant_nm_a() * 27.4;
    assert!((out.bus_w - expected_w).abs() < 1e-4, "{} W, {expected_w} W", out.bus_w);
}

#[test]
fn a_loop_whose_angle_is_off_gives_the_cosine_of_its_torque() {
    let mut data = cancelling(860.0, 2.0);
    let (sin, cos) = (std::f64::consts::FRAC_PI_6).sin_cos();
    data.current_loop.settings.ahead = Axis { sin, cos };
    let mut out = PmsmOutput::default();
    (0..400).for_each(|_| out = step(&mut data, 0.0));
    let expected_nm = 2.0 * MOTOR.torque_constant_nm_a() * cos;
    assert!((out.torque_nm - expected_nm).abs() < 1e-6, "{} N m, {expected_nm} N m", out.torque_nm);
}
