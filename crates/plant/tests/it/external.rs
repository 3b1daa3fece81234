//! Shafts that an engine outside moves: the error of each rule, energy of the pair and brakes, against closed forms.

use core::f64::consts::TAU;

use plant::coupled::{Body, ExternalData, ExternalModel, Rule};
use plant::shaft::{Motion, Push};

/// Control period of the drive.
const PERIOD_S: f64 = 50e-6;
/// Inertia of the drive and of what the engine has behind it, kg·m².
const DRIVE: f64 = 0.02;
const ENGINE: f64 = 0.03;

/// A drive with a gear of 1 : 1 and a torque that is a function of its angle, on one external shaft.
struct Bench {
    body: Body,
    push: Push,
    turned_rad: f64,
    law: fn(f64) -> f64,
}

impl Bench {
    fn new(rule: Rule, first_rad: f64, beside_kg_m2: f64, law: fn(f64) -> f64) -> Self {
        let model = ExternalModel::new(rule, &[(first_rad, beside_kg_m2)]).unwrap();
        let push = Push { inertia_kg_m2: DRIVE, ..Push::default() };
        Self { body: Body::External(model, model.at_rest()), push, turned_rad: first_rad, law }
    }

    fn parts(&mut self) -> (ExternalModel, &mut ExternalData) {
        match &mut self.body {
            Body::External(model, data) => (*model, data),
            other => panic!("{other:?}"),
        }
    }

    fn period(&mut self) {
        // In the middle of the period: a torque that comes half of one late would be an error of the test.
        self.push.torque_nm = (self.law)(self.turned_rad + 0.5 * PERIOD_S * self.push.velocity_rad_s);
        let mut motions = [Motion::default()];
        self.body.step(PERIOD_S, &[1.0], &[self.push], &mut motions);
        self.push.velocity_rad_s = motions[0].velocity_rad_s;
        self.turned_rad += motions[0].mean_rad_s * PERIOD_S;
    }

    /// An exchange of so many periods; `seen` is called with the shaft's angle after each.
    fn exchange(&mut self, periods: u32, at: (f64, f64), mut seen: impl FnMut(u32, f64)) -> f64 {
        let step = (f64::from(periods) * PERIOD_S, periods);
        let (model, data) = self.parts();
        model.begin_motion(data, step, &[at]);
        for period in 1..=periods {
            self.period();
            seen(period, self.turned_rad);
        }
        self.parts().1.torque_nm(0)
    }
}

/// The largest error of the shaft's angle while its joint swings with 1 rad at 2 Hz, after the first steps.
fn largest_error(rule: Rule, periods: u32) -> f64 {
    const W: f64 = 2.0 * TAU;
    let (at, speed) = (|t: f64| (W * t).sin(), |t: f64| W * (W * t).cos());
    let dt_s = f64::from(periods) * PERIOD_S;
    let mut bench = Bench::new(rule, 0.0, 0.0, |_| 0.0);
    let mut largest = 0.0_f64;
    for step in 0..(0.5 / dt_s) as u32 {
        let now_s = f64::from(step) * dt_s;
        // What interpolates has the step that is over.
        let begun_s = if rule == Rule::Interpolate { now_s - dt_s } else { now_s };
        bench.exchange(periods, (at(now_s), speed(now_s)), |period, angle_rad| {
            if step > 3 {
                largest = largest.max((angle_rad - at(begun_s + f64::from(period) * PERIOD_S)).abs());
            }
        });
    }
    largest
}

/// a = w², j = w³ and so on are the largest of a sine of 1 rad.
#[test]
fn each_rule_is_off_by_what_its_table_says() {
    const W: f64 = 2.0 * TAU;
    let bound = |rule, dt_s: f64| match rule {
        Rule::Hold => W.powi(2) * dt_s.powi(2) / 2.0,
        Rule::Interpolate => W.powi(4) * dt_s.powi(4) / 384.0,
        _ => W.powi(3) * dt_s.powi(3) * 5.0 / 12.0,
    };
    for (rule, order) in [(Rule::Hold, 2), (Rule::Integrate, 3), (Rule::Interpolate, 4)] {
        let (coarse, fine) = (largest_error(rule, 80), largest_error(rule, 40));
        let expected = bound(rule, 80.0 * PERIOD_S);
        assert!((0.8..1.05).contains(&(coarse / expected)), "{rule:?}: {coarse}, expected {expected}");
        let ratio = coarse / fine / 2_f64.powi(order);
        assert!((0.85..1.15).contains(&ratio), "{rule:?}: halving the step divides the error by {}", coarse / fine);
    }
}

/// The engine: its mass and the drive's, moved with the torque that it was given, and gravity if it has any.
struct Engine {
    angle_rad: f64,
    velocity_rad_s: f64,
    gravity: fn(f64) -> f64,
}

impl Engine {
    /// One step of Runge and Kutta's rule, far more exact than what is looked at.
    fn step(&mut self, dt_s: f64, torque_nm: f64) {
        let rate = |angle: f64| (torque_nm + (self.gravity)(angle)) / (DRIVE + ENGINE);
        let (x, v) = (self.angle_rad, self.velocity_rad_s);
        let (x1, v1) = (v, rate(x));
        let (x2, v2) = (v + 0.5 * dt_s * v1, rate(x + 0.5 * dt_s * x1));
        let (x3, v3) = (v + 0.5 * dt_s * v2, rate(x + 0.5 * dt_s * x2));
        let (x4, v4) = (v + dt_s * v3, rate(x + dt_s * x3));
        self.angle_rad += dt_s / 6.0 * (x1 + 2.0 * x2 + 2.0 * x3 + x4);
        self.velocity_rad_s += dt_s / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
    }

    fn at(&self) -> (f64, f64) {
        (self.angle_rad, self.velocity_rad_s)
    }
}

/// A motor that pulls like a spring of 2 N·m/rad, and an engine's mass: one oscillator in two programs. What is left of its energy after
/// 10 s, and the angle of the single body then.
fn oscillate(rule: Rule, dt_ms: u32) -> (f64, f64, f64) {
    const STIFFNESS: f64 = 2.0;
    let w = (STIFFNESS / (DRIVE + ENGINE)).sqrt();
    let mut bench = Bench::new(rule, 0.5, 0.0, |angle_rad| -STIFFNESS * angle_rad);
    let mut engine = Engine { angle_rad: 0.5, velocity_rad_s: 0.0, gravity: |_| 0.0 };
    let energy = |(x, v): (f64, f64)| 0.5 * STIFFNESS * x * x + 0.5 * (DRIVE + ENGINE) * v * v;
    let first = energy(engine.at());
    let periods = dt_ms * 20;
    for _ in 0..10_000 / dt_ms {
        let torque_nm = bench.exchange(periods, engine.at(), |_, _| ());
        engine.step(f64::from(dt_ms) * 1e-3, torque_nm);
    }
    (energy(engine.at()) / first, engine.angle_rad, 0.5 * (w * 10.0).cos())
}

#[test]
fn the_energy_of_drive_and_engine_is_that_of_one_body() {
    for (rule, dt_ms) in [(Rule::Hold, 1), (Rule::Integrate, 1), (Rule::Hold, 2), (Rule::Integrate, 2)] {
        let (share, angle_rad, expected_rad) = oscillate(rule, dt_ms);
        assert!((share - 1.0).abs() < 0.005, "{rule:?}, {dt_ms} ms: {share}");
        assert!((angle_rad - expected_rad).abs() < 0.01, "{rule:?}, {dt_ms} ms: {angle_rad}, expected {expected_rad}");
    }
    // A torque that comes late pushes an oscillation on: w² dt per second.
    let (share, ..) = oscillate(Rule::Interpolate, 1);
    let expected = (2.0_f64 / (DRIVE + ENGINE) * 1e-3 * 10.0).exp();
    assert!((share / expected - 1.0).abs() < 0.05, "{share}, expected {expected}");
}

/// A weight that pulls with 3 N·m, and a brake of 5 or 2 N·m that closes while it falls.
#[test]
fn a_brake_holds_what_the_engine_lets_fall_and_no_more_than_it_can() {
    for rule in [Rule::Integrate, Rule::Hold, Rule::Interpolate] {
        let run = |brake_nm: f64, after_s: f64| {
            let mut bench = Bench::new(rule, 0.0, 0.0, |_| 0.0);
            let mut engine = Engine { angle_rad: 0.0, velocity_rad_s: 0.0, gravity: |_| 3.0 };
            let mut most_nm = 0.0_f64;
            for step in 0..((0.05 + after_s) * 1e3) as u32 {
                bench.push.dry_nm = if step < 50 { 0.0 } else { brake_nm };
                let torque_nm = bench.exchange(20, engine.at(), |_, _| ());
                most_nm = most_nm.max(torque_nm.abs());
                engine.step(1e-3, torque_nm);
            }
            (engine, most_nm)
        };
        let (held, most_nm) = run(5.0, 0.6);
        let stopping_rad = 3_f64.powi(2) / 2.0 / (5.0 - 3.0); // (v²/2) J / (brake - load) over J: v = 3 N·m 0.05 s / J
        let expected_rad =
            0.5 * 3.0 / (DRIVE + ENGINE) * 0.05_f64.powi(2) + stopping_rad * 0.05_f64.powi(2) / (DRIVE + ENGINE);
        assert!(held.velocity_rad_s.abs() < 1e-3, "{rule:?}: it stands, not {} rad/s", held.velocity_rad_s);
        assert!((held.angle_rad - expected_rad).abs() < 0.02, "{rule:?}: {}, expected {expected_rad}", held.angle_rad);
        assert!(most_nm <= 5.0 + 1e-9, "{rule:?}: no more than the brake has, {most_nm}");
        let at = held.angle_rad;
        let (still, _) = run(5.0, 1.6);
        assert!((still.angle_rad - at).abs() < 1e-6, "{rule:?}: it creeps by {} rad in 1 s", still.angle_rad - at);

        let (slips, _) = run(2.0, 0.1);
        let expected_rad_s = (3.0 * 0.15 - 2.0 * 0.1) / (DRIVE + ENGINE);
        let off = slips.velocity_rad_s / expected_rad_s - 1.0;
        assert!(off.abs() < 0.05, "{rule:?}: {} rad/s, expected {expected_rad_s}", slips.velocity_rad_s);
    }
}

#[test]
fn the_other_form_moves_all_the_inertia_there_is() {
    let mut bench = Bench::new(Rule::Torque, 0.1, ENGINE, |_| 0.4);
    for _ in 0..100 {
        let (model, data) = bench.parts();
        model.begin_torque(data, (1e-3, 20), &[-0.1]);
        (0..20).for_each(|_| bench.period());
    }
    let (angle_rad, velocity_rad_s) = bench.parts().1.shaft(0);
    let acceleration = 0.3 / (DRIVE + ENGINE);
    assert!((velocity_rad_s - acceleration * 0.1).abs() < 1e-9, "{velocity_rad_s}");
    assert!((angle_rad - 0.1 - 0.5 * acceleration * 0.01).abs() < 1e-9, "{angle_rad}");
}

#[test]
fn beyond_the_step_that_was_exchanged_nothing_moves() {
    for rule in [Rule::Hold, Rule::Integrate, Rule::Interpolate, Rule::Torque] {
        let mut bench = Bench::new(rule, 0.0, 0.0, |_| 0.4);
        for step in 0..3 {
            bench.exchange(20, (f64::from(step) * 2e-3, 2.0), |_, _| ());
        }
        let at = bench.turned_rad;
        (0..100).for_each(|_| bench.period());
        assert_eq!((bench.turned_rad, bench.push.velocity_rad_s), (at, 0.0), "{rule:?}");
    }
}
