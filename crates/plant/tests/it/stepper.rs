//! The stepper's windings and detent against closed forms, at a rotor whose motion the test dictates.

use plant::StepperMotorModel;
use plant::angle::Axis;
use plant::pmsm::{PmsmData, PmsmInput, Terminals};
use plant::stepper::{Bridges, Phase, StepperData, StepperInput, StepperModel, StepperOutput, Turn};

const DT_S: f64 = 50e-6;
const TAU: f64 = core::f64::consts::TAU;
const MOTOR: StepperModel = StepperMotorModel::ZLIM42_C_70.stepper;
const RESISTANCE_OHM: f64 = 1.85;

/// Windings whose rotor angle and velocity the test dictates.
struct Bench {
    data: StepperData,
    lost_phase: Option<Phase>,
    electrical_rad: f64,
    bus_v: f64,
    dt_s: f64,
}

impl Bench {
    fn new(dt_s: f64) -> Self {
        Bench { data: StepperData::default(), lost_phase: None, electrical_rad: 0.0, bus_v: 24.0, dt_s }
    }

    fn step(&mut self, velocity_rad_s: f64, bridges: Bridges) -> StepperOutput {
        let step_rad = velocity_rad_s * f64::from(MOTOR.teeth) * self.dt_s;
        let turn = Turn::new(axis(self.electrical_rad), 0.5 * step_rad);
        self.electrical_rad += step_rad;
        let input = StepperInput {
            bridges,
            bus_v: self.bus_v,
            lost_phase: self.lost_phase,
            shorted_phase: None,
            resistance_ohm: RESISTANCE_OHM,
            turn,
        };
        MOTOR.step(&mut self.data, self.dt_s, &input)
    }
}

fn axis(rad: f64) -> Axis {
    Axis::at_turns(rad / TAU)
}

fn near(actual: f64, expected: f64, relative: f64) -> bool {
    (actual - expected).abs() <= relative * expected.abs()
}

#[test]
fn a_stalled_phase_draws_voltage_over_resistance_with_its_time_constant() {
    let mut bench = Bench::new(DT_S);
    let steps = 30_u32;
    for _ in 0..steps {
        bench.step(0.0, Bridges::Driven([0.1, -0.05]));
    }
    let time_s = f64::from(steps) * DT_S;
    let rise = 1.0 - libm::exp(-time_s * RESISTANCE_OHM / MOTOR.inductance_h);
    assert!(near(bench.data.current_a[0], 2.4 / RESISTANCE_OHM * rise, 1e-6), "{:?}", bench.data);
    assert!(near(bench.data.current_a[1], -1.2 / RESISTANCE_OHM * rise, 1e-6));
}

#[test]
fn holding_torque_at_the_rated_current_is_the_manuals() {
    for (model, holding_nm) in [(StepperMotorModel::ZLIM42_C_70, 0.48), (StepperMotorModel::ZLIM42_C_82, 0.72)] {
        let stepper = model.stepper;
        // A current vector of 2.2 A at rest, over all angles of the rotor; the detent changes the peak by little.
        let (mut highest, mut without_detent) = (0.0_f64, 0.0_f64);
        for tenth_degree in 0..3600 {
            let turn = Turn::new(axis(f64::from(tenth_degree) * TAU / 3600.0), 0.0);
            let mut data = StepperData { current_a: [2.2, 0.0] };
            let input = StepperInput {
                bridges: Bridges::Regulated([2.2, 0.0]),
                bus_v: 24.0,
                lost_phase: None,
                shorted_phase: None,
                resistance_ohm: RESISTANCE_OHM,
                turn,
            };
            let torque = stepper.step(&mut data, DT_S, &input).torque_nm;
            without_detent = without_detent.max(torque);
            highest = highest.max(torque + stepper.detent_torque_nm(&turn));
        }
        assert!(near(without_detent, holding_nm, 1e-5), "{without_detent}");
        assert!(near(highest, holding_nm, 0.05), "{highest}");
    }
}

#[test]
fn detent_torque_has_four_periods_per_electrical_turn_and_rests_at_the_full_steps() {
    let mut last = MOTOR.detent_torque_nm(&Turn::new(axis(-1e-4), 0.0));
    let (mut stable, mut highest) = (Vec::new(), 0.0_f64);
    for step in 0..36_000 {
        let rad = f64::from(step) * TAU / 36_000.0 + 1e-4;
        let torque = MOTOR.detent_torque_nm(&Turn::new(axis(rad), 0.0));
        highest = highest.max(torque);
        // At rest where the torque falls through zero.
        if last > 0.0 && torque <= 0.0 {
            stable.push((rad / TAU * 4.0).round());
        }
        last = torque;
    }
    assert_eq!(stable, [0.0, 1.0, 2.0, 3.0]);
    assert!(near(highest, 0.025 * 0.48, 1e-6));
}

#[test]
fn detent_gives_back_all_its_work_whatever_the_step() {
    for steps_per_turn in [7, 8, 50, 1000] {
        let half_rad = 0.5 * TAU / f64::from(steps_per_turn);
        let (mut at, mut work_j) = (axis(0.3), 0.0);
        let before_j = MOTOR.detent_energy_j(at);
        for _ in 0..steps_per_turn / 3 {
            let turn = Turn::new(at, half_rad);
            work_j += MOTOR.detent_torque_nm(&turn) * 2.0 * half_rad / f64::from(MOTOR.teeth);
            at = turn.end();
        }
        assert!((work_j + MOTOR.detent_energy_j(at) - before_j).abs() < 1e-14, "{steps_per_turn}");
    }
}

/// Mean torque of a settled motor at a velocity, its phases on a sinusoidal voltage that leads the magnets.
fn settled_torque_nm(dt_s: f64, velocity_rad_s: f64, voltage_v: f64, lead_rad: f64) -> f64 {
    let mut bench = Bench::new(dt_s);
    let omega = velocity_rad_s * f64::from(MOTOR.teeth);
    // A held voltage is smaller than its sine by sinc of half its rotation.
    let half = 0.5 * omega * dt_s;
    let duty = voltage_v / 24.0 * half / libm::sin(half);
    // Whole turns of the field, long after the transient.
    let settle = (0.03 / dt_s) as u32;
    let measure = (0.02 / dt_s) as u32;
    let mut sum = 0.0;
    for step in 0..settle + measure {
        let at = axis(bench.electrical_rad + half + lead_rad);
        let torque = bench.step(velocity_rad_s, Bridges::Driven([duty * at.cos, duty * at.sin])).torque_nm;
        if step >= settle {
            sum += torque;
        }
    }
    sum / f64::from(measure)
}

#[test]
fn pull_out_torque_follows_the_analytic_torque_speed_curve() {
    let mut last = f64::INFINITY;
    for r_min in [60.0, 300.0, 600.0, 1000.0, 1500.0, 3000.0] {
        let velocity = r_min * TAU / 60.0;
        // At low speed 24 V would be far more than the windings stand; there the current limits, not the voltage.
        let volts = 12.0;
        let highest =
            (0..360).map(|d| settled_torque_nm(DT_S, velocity, volts, f64::from(d) * TAU / 360.0)).fold(-1e9, f64::max);
        let expected = MOTOR.pull_out_nm(volts, RESISTANCE_OHM, velocity);
        assert!(near(highest, expected, 0.005), "{highest} for {expected} N m at {r_min} r/min");
        assert!(highest < last, "torque falls with speed");
        last = highest;
    }
}

#[test]
fn at_3000_r_min_the_step_of_50_us_is_within_half_a_per_cent_and_halving_it_gains_sixteen_fold() {
    // 2.5 kHz electrical: 8 steps a period at 50 µs. The torque on a sinusoidal voltage is known exactly; harmonics
    // of a held one do not turn with the magnets and make none.
    let velocity = 100.0 * core::f64::consts::PI;
    let omega = velocity * f64::from(MOTOR.teeth);
    let impedance = libm::hypot(RESISTANCE_OHM, omega * MOTOR.inductance_h);
    let phase = libm::atan2(omega * MOTOR.inductance_h, RESISTANCE_OHM);
    let lead = 2.4;
    // Current across the magnets: the voltage's, which lags by the phase of the impedance, less the back-emf's.
    let emf_v = MOTOR.flux_linkage_wb * omega;
    let across_a = (12.0 * libm::sin(lead - phase) - emf_v * RESISTANCE_OHM / impedance) / impedance;
    let exact = MOTOR.torque_constant_nm_a() * across_a;
    let [coarse, middle, fine] =
        [50e-6, 25e-6, 12.5e-6].map(|dt_s| (settled_torque_nm(dt_s, velocity, 12.0, lead) - exact).abs());
    let scale = MOTOR.pull_out_nm(12.0, RESISTANCE_OHM, velocity);
    assert!(coarse < 0.005 * scale, "{coarse} of {scale} N m");
    for ratio in [coarse / middle, middle / fine] {
        assert!((12.0..20.0).contains(&ratio), "{coarse} {middle} {fine}");
    }
}

#[test]
fn every_step_keeps_its_energy_balance_in_every_state_of_the_bridges() {
    let mut bench = Bench::new(DT_S);
    for step in 0..40_000_u32 {
        let velocity = f64::from(step) * 0.02 - 400.0;
        let wave = f64::from(step) * 0.37;
        let bridges = match step / 37 % 4 {
            0 => Bridges::Driven([libm::sin(wave), libm::cos(wave)]),
            1 => Bridges::Shorted,
            2 => Bridges::Regulated([2.0 * libm::sin(wave), 2.0 * libm::cos(wave)]),
            _ => Bridges::Open,
        };
        let before_j = MOTOR.magnetic_energy_j(&bench.data);
        let out = bench.step(velocity, bridges);
        let stored_w = (MOTOR.magnetic_energy_j(&bench.data) - before_j) / DT_S;
        let rest = out.bus_w - out.heat_w_per_ohm * RESISTANCE_OHM - out.torque_nm * velocity - stored_w;
        assert!(rest.abs() < 1e-8 * (out.bus_w.abs() + stored_w.abs() + 1.0), "{rest} W at step {step}: {bridges:?}");
    }
}

#[test]
fn the_three_phase_equivalent_makes_the_same_torque_and_power() {
    let pmsm = MOTOR.three_phase_equivalent();
    // Fine steps and a slow rotor, where both integrators are exact enough.
    let dt_s = 1e-6;
    let velocity = 20.0;
    let mut bench = Bench::new(dt_s);
    let mut data = PmsmData::default();
    let half = 0.5 * velocity * f64::from(MOTOR.teeth) * dt_s;
    for _ in 0..20_000 {
        let middle = axis(bench.electrical_rad + half);
        let lead = axis(bench.electrical_rad + half + 1.8);
        let (alpha_v, beta_v) = (6.0 * lead.cos, 6.0 * lead.sin);
        let input = PmsmInput {
            terminals: Terminals::Driven { alpha_v, beta_v },
            lost_phase: None,
            resistance_ohm: 1.5 * RESISTANCE_OHM,
            axis: middle,
            velocity_rad_s: velocity,
        };
        let three = pmsm.step(&mut data, dt_s, &input);
        let two = bench.step(velocity, Bridges::Driven([alpha_v / 24.0, beta_v / 24.0]));
        assert!((three.torque_nm - two.torque_nm).abs() < 1e-5, "{three:?} {two:?}");
        assert!((three.bus_w - two.bus_w).abs() < 1e-3, "{three:?} {two:?}");
    }
}

#[test]
fn a_chopper_reaches_its_current_as_fast_as_the_bus_allows_and_holds_it() {
    let mut bench = Bench::new(DT_S);
    let mut steps = 0;
    while (bench.data.current_a[0] - 2.2).abs() > 1e-9 {
        bench.step(0.0, Bridges::Regulated([2.2, 0.0]));
        steps += 1;
        assert!(steps < 1000);
    }
    // 24 V into R and L: t = L/R ln(1 / (1 - 2.2 R / 24)).
    let rise_s = MOTOR.inductance_h / RESISTANCE_OHM * -libm::log(1.0 - 2.2 * RESISTANCE_OHM / 24.0);
    assert_eq!(steps, (rise_s / DT_S).ceil() as u32);
    let out = bench.step(0.0, Bridges::Regulated([2.2, 0.0]));
    assert!(near(out.bus_w, 2.2 * 2.2 * RESISTANCE_OHM, 1e-9));
}

#[test]
fn a_running_current_dies_through_the_diodes_and_its_energy_reaches_the_bus() {
    let mut bench = Bench::new(1e-6);
    bench.data.current_a = [2.0, -1.0];
    let stored_j = MOTOR.magnetic_energy_j(&bench.data);
    let (mut to_bus_j, mut heat_j, mut steps) = (0.0, 0.0, 0_u32);
    while bench.data != StepperData::default() {
        let out = bench.step(0.0, Bridges::Open);
        to_bus_j -= out.bus_w * bench.dt_s;
        heat_j += out.heat_w_per_ohm * RESISTANCE_OHM * bench.dt_s;
        steps += 1;
        assert!(steps < 10_000);
    }
    assert!(near(to_bus_j + heat_j, stored_j, 1e-9));
    // L di/dt = -U - R i, from 2 A to zero.
    let expected_s = MOTOR.inductance_h / RESISTANCE_OHM * libm::log(1.0 + 2.0 * RESISTANCE_OHM / 24.0);
    assert!(near(f64::from(steps) * bench.dt_s, expected_s, 0.01));
}

#[test]
fn open_bridges_carry_nothing_until_a_phases_back_emf_exceeds_the_bus() {
    let onset = 24.0 / (MOTOR.flux_linkage_wb * f64::from(MOTOR.teeth));
    let mut bench = Bench::new(10e-6);
    for _ in 0..2000 {
        assert_eq!(bench.step(0.99 * onset, Bridges::Open), StepperOutput::default());
    }
    let braking: f64 = (0..2000).map(|_| bench.step(1.2 * onset, Bridges::Open).torque_nm).sum();
    assert!(braking < 0.0);
}

#[test]
fn a_lost_phase_carries_nothing_and_burns_its_energy_once() {
    let mut bench = Bench::new(DT_S);
    bench.data.current_a = [1.5, 2.0];
    bench.lost_phase = Some(Phase::A);
    let out = bench.step(0.0, Bridges::Driven([1.0, 0.1]));
    assert!(near(out.arc_j, 0.5 * MOTOR.inductance_h * 1.5 * 1.5, 1e-12));
    let out = bench.step(0.0, Bridges::Driven([1.0, 0.1]));
    assert_eq!((out.arc_j, bench.data.current_a[0]), (0.0, 0.0));
    assert!(bench.data.current_a[1] > 1.9);
}
