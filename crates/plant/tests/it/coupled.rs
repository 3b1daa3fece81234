//! Machines that several motors move together, against closed forms.

use core::f64::consts::{PI, TAU};

use plant::Motor;
use plant::attachment::GRAVITY_M_S2;
use plant::coupled::{ArmData, ArmModel, Body, CommonShaftData, CommonShaftModel, Link};
use plant::coupled::{DifferentialDriveData, DifferentialDriveModel};
use plant::shaft::{Motion, Push};
use plant::{Actuation, Angle, HubMotor, HubMotorModel, Inverter};
use proptest::prelude::*;

const DT_S: f64 = 50e-6;

/// Motors of a given inertia and friction, joined to a body: what drives in these tests do.
struct Bench {
    body: Body,
    turns: Vec<f64>,
    pushes: Vec<Push>,
    /// What each motor has turned, rad.
    turned: Vec<f64>,
}

impl Bench {
    fn new(body: Body, turns: &[f64], inertia_kg_m2: f64) -> Self {
        let push = Push { inertia_kg_m2, ..Push::default() };
        Self { body, turns: turns.to_vec(), pushes: vec![push; turns.len()], turned: vec![0.0; turns.len()] }
    }

    fn step(&mut self) {
        let mut motions = vec![Motion::default(); self.turns.len()];
        self.body.step(DT_S, &self.turns, &self.pushes, &mut motions);
        for ((push, motion), turned) in self.pushes.iter_mut().zip(motions).zip(&mut self.turned) {
            push.velocity_rad_s = motion.velocity_rad_s;
            *turned += motion.mean_rad_s * DT_S;
        }
    }

    fn run(&mut self, seconds: f64, torques_nm: &[f64]) {
        for (push, torque_nm) in self.pushes.iter_mut().zip(torques_nm) {
            push.torque_nm = *torque_nm;
        }
        for _ in 0..(seconds / DT_S).round() as u32 {
            self.step();
        }
    }

    fn base(&self) -> (&DifferentialDriveModel, &DifferentialDriveData) {
        match &self.body {
            Body::DifferentialDrive(model, data) => (model, data),
            other => panic!("{other:?}"),
        }
    }

    fn arm(&self) -> (&ArmModel, &ArmData) {
        match &self.body {
            Body::Arm(model, data) => (model, data),
            other => panic!("{other:?}"),
        }
    }
}

fn near(what: &str, measured: f64, expected: f64, within: f64) {
    assert!((measured - expected).abs() <= within, "{what}: {measured}, expected {expected}");
}

const BASE: DifferentialDriveModel = DifferentialDriveModel {
    mass_kg: 40.0,
    yaw_inertia_kg_m2: 2.0,
    wheel_base_m: 0.5,
    wheel_radius_m: 0.08,
    rolling: 0.0,
    grip: None,
    weight_share: 1.0,
    slope_rad: 0.0,
    uphill_rad: 0.0,
};

fn base(model: DifferentialDriveModel) -> Bench {
    Bench::new(Body::DifferentialDrive(model, DifferentialDriveData::default()), &[1.0, 1.0], 0.014)
}

#[test]
fn a_base_accelerates_by_its_mass_and_turns_by_its_inertia() {
    let mut straight = base(BASE);
    straight.run(1.0, &[2.0, 2.0]);
    let (model, data) = straight.base();
    // 2 T / r = (m + 2 J / r^2) a.
    let expected = 4.0 / 0.08 / (40.0 + 2.0 * 0.014 / 0.0064);
    near("speed", model.speed_m_s(data), expected, 1e-9);
    near("way", data.x_m, 0.5 * expected, 1e-9);
    let mut turning = base(BASE);
    turning.run(1.0, &[-1.0, 1.0]);
    let (model, data) = turning.base();
    // 2 T / r * b/2 = (I + 2 J / r^2 (b/2)^2) dw/dt.
    let expected = (2.0 / 0.08 * 0.25) / (2.0 + 2.0 * 0.014 / 0.0064 * 0.0625);
    near("rate", model.yaw_rate_rad_s(data), expected, 1e-9);
    near("place", data.x_m.hypot(data.y_m), 0.0, 1e-12);
}

#[test]
fn without_slip_the_pose_is_that_of_the_wheels_angles() {
    let mut bench = base(DifferentialDriveModel { rolling: 0.01, grip: Some(0.8), ..BASE });
    let (mut x, mut y, mut heading, mut last) = (0.0, 0.0, 0.0, [0.0; 2]);
    for segment in 0..40_u32 {
        let torques = [[2.0, 2.0], [1.0, -1.0], [-2.0, -1.5], [0.5, 1.5]][segment as usize % 4];
        for _ in 0..100 {
            bench.run(0.001, &torques);
            let way = [0, 1].map(|i| (bench.turned[i] - last[i]) * 0.08);
            last = [bench.turned[0], bench.turned[1]];
            // An arc of a circle (closed form), as odometry has it.
            let (length, turn) = (0.5 * (way[0] + way[1]), (way[1] - way[0]) / 0.5);
            let chord = if turn == 0.0 { length } else { length * (0.5 * turn).sin() / (0.5 * turn) };
            (x, y) = (x + chord * (heading + 0.5 * turn).cos(), y + chord * (heading + 0.5 * turn).sin());
            heading += turn;
        }
    }
    let (_, data) = bench.base();
    assert!(data.x_m.abs() + data.y_m.abs() > 0.05, "it went somewhere: {data:?}");
    near("x", data.x_m, x, 1e-5);
    near("y", data.y_m, y, 1e-5);
    near("heading", data.heading_rad, heading, 1e-9);
    assert_eq!(data.slip_m, [0.0; 2]);
}

#[test]
fn a_wheel_slips_beyond_its_grip_and_the_base_gets_no_more_than_that() {
    let mut bench = base(DifferentialDriveModel { grip: Some(0.3), ..BASE });
    bench.run(0.5, &[20.0, 20.0]);
    let (model, data) = bench.base();
    near("speed", model.speed_m_s(data), 0.3 * GRAVITY_M_S2 * 0.5, 1e-9);
    // J dw/dt = T - r F.
    let rim = 0.08 * (20.0 - 0.08 * 0.5 * 0.3 * 40.0 * GRAVITY_M_S2) / 0.014 * 0.5;
    near("rim", bench.pushes[0].velocity_rad_s * 0.08, rim, 1e-6 * rim);
    near("slip", data.slip_m[0], 0.5 * 0.5 * (rim - model.speed_m_s(data)), 1e-3);
    assert_eq!(data.slips, [true; 2]);
    // Without torque the ground brakes the wheels until they grip again, with the momentum of both.
    bench.run(2.0, &[0.0, 0.0]);
    let (_, data) = bench.base();
    assert_eq!(data.slips, [false; 2]);
    near("rim", bench.pushes[0].velocity_rad_s * 0.08, data.ground_m_s[0], 1e-12);
}

#[test]
fn a_base_stands_on_a_slope_by_its_friction_and_rolls_down_beyond_it() {
    let slope = |degrees: f64| DifferentialDriveModel {
        slope_rad: degrees.to_radians(),
        rolling: 0.05,
        grip: Some(0.8),
        ..BASE
    };
    // tan(slope) under the rolling resistance: it stands. 0.05 is 2.86 degrees.
    let mut stands = base(slope(2.8));
    stands.run(1.0, &[0.0, 0.0]);
    assert_eq!(stands.base().1.x_m, 0.0);
    let mut rolls = base(slope(10.0));
    rolls.run(1.0, &[0.0, 0.0]);
    let angle = 10_f64.to_radians();
    let force = 40.0 * GRAVITY_M_S2 * (angle.sin() - 0.05 * angle.cos());
    near("speed", rolls.base().0.speed_m_s(rolls.base().1), -force / (40.0 + 2.0 * 0.014 / 0.0064), 1e-6);
    // Locked wheels hold it until they slide: tan(40 degrees) is over the grip of 0.8.
    for (degrees, slides) in [(35.0, false), (40.0, true)] {
        let mut locked = base(DifferentialDriveModel { rolling: 0.0, ..slope(degrees) });
        locked.pushes.iter_mut().for_each(|push| push.dry_nm = 1e12);
        locked.run(0.1, &[0.0, 0.0]);
        assert_eq!(locked.base().1.x_m != 0.0, slides, "{degrees} degrees");
        assert_eq!(locked.turned, [0.0; 2]);
    }
}

#[test]
fn two_motors_on_a_shaft_add_up_whichever_way_round_they_sit() {
    let model = CommonShaftModel { inertia_kg_m2: 0.1, ..CommonShaftModel::default() };
    // The second sits the other way round, behind a gear of 4 : 1.
    let mut bench = Bench::new(Body::CommonShaft(model, CommonShaftData::default()), &[1.0, -0.25], 0.02);
    bench.pushes[0].dry_nm = 0.5;
    bench.run(1.0, &[2.0, -1.0]);
    // (2 + 4 - 0.5) / (0.1 + 0.02 + 16 * 0.02).
    let expected = 5.5 / 0.44;
    near("first", bench.pushes[0].velocity_rad_s, expected, 1e-9);
    near("second", bench.pushes[1].velocity_rad_s, -4.0 * expected, 1e-9);
}

fn rod(length_m: f64, mass_kg: f64, first_rad: f64, offset_m: f64) -> Link {
    Link {
        offset_m: [offset_m, 0.0, 0.0],
        // Turning about -y lifts what points along x.
        axis: [0.0, -1.0, 0.0],
        mass_kg,
        center_m: [0.5 * length_m, 0.0, 0.0],
        inertia_kg_m2: [0.0, mass_kg * length_m * length_m / 12.0, 0.0],
        first_rad,
    }
}

/// A point of some mass at the end of a massless rod.
fn point(length_m: f64, mass_kg: f64, first_rad: f64, offset_m: f64) -> Link {
    Link { center_m: [length_m, 0.0, 0.0], inertia_kg_m2: [0.0; 3], ..rod(length_m, mass_kg, first_rad, offset_m) }
}

fn arm(links: &[Link], inertia_kg_m2: f64) -> Bench {
    let model = ArmModel::new(links).unwrap();
    Bench::new(Body::Arm(model, model.at_rest()), &vec![1.0; links.len()], inertia_kg_m2)
}

#[test]
fn a_rod_swings_as_a_physical_pendulum() {
    // Down is -90 degrees; a small swing about it has the period 2 pi sqrt(2 l / 3 g).
    let mut bench = arm(&[rod(0.6, 2.0, -0.5 * PI + 0.01, 0.0)], 0.0);
    let period_s = TAU * (2.0 * 0.6 / (3.0 * GRAVITY_M_S2)).sqrt();
    let (mut last, mut crossings) = (0.01, Vec::new());
    for step in 0..200_000_u32 {
        bench.step();
        let now = bench.arm().1.angle_rad[0] + 0.5 * PI;
        if last < 0.0 && now >= 0.0 {
            crossings.push((f64::from(step) - now / (now - last)) * DT_S);
        }
        last = now;
    }
    let mean = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
    // A swing of 0.01 rad takes 1/16 of its square longer.
    near("period", mean, period_s * (1.0 + 1e-4 / 16.0), 1e-6 * period_s);
}

#[test]
fn gravity_asks_of_each_joint_what_the_levers_say() {
    let (first, second) = (0.4_f64, -0.7_f64);
    let mut model = ArmModel::new(&[rod(0.5, 3.0, first, 0.0), rod(0.4, 2.0, second, 0.5)]).unwrap();
    (model.tool_m, model.payload_kg) = ([0.4, 0.0, 0.0], 1.5);
    let g = GRAVITY_M_S2;
    let torque = model.gravity_torque_nm(&model.at_rest());
    let outer = g * (first + second).cos() * (2.0 * 0.2 + 1.5 * 0.4);
    near("elbow", torque[1], outer, 1e-12);
    near("shoulder", torque[0], outer + g * first.cos() * (3.0 * 0.25 + (2.0 + 1.5) * 0.5), 1e-12);
    let [x, y, z] = model.tool_at_m(&model.at_rest());
    near("x", x, 0.5 * first.cos() + 0.4 * (first + second).cos(), 1e-12);
    near("z", z, 0.5 * first.sin() + 0.4 * (first + second).sin(), 1e-12);
    assert_eq!(y, 0.0);
}

/// The accelerations of a double pendulum of points, from the textbook's equations, angles from the horizontal.
fn double_pendulum(q: [f64; 2], v: [f64; 2], m: [f64; 2], l: [f64; 2]) -> [f64; 2] {
    let (a, b) = (q[0], q[0] + q[1]);
    let (va, vb) = (v[0], v[0] + v[1]);
    // M [a'', b''] = rhs in the angles from the horizontal.
    let off = m[1] * l[0] * l[1] * (a - b).cos();
    let matrix = [[(m[0] + m[1]) * l[0] * l[0], off], [off, m[1] * l[1] * l[1]]];
    let swing = m[1] * l[0] * l[1] * (a - b).sin();
    let rhs = [
        -swing * vb * vb - (m[0] + m[1]) * GRAVITY_M_S2 * l[0] * a.cos(),
        swing * va * va - m[1] * GRAVITY_M_S2 * l[1] * b.cos(),
    ];
    let det = matrix[0][0] * matrix[1][1] - off * off;
    let aa = (rhs[0] * matrix[1][1] - off * rhs[1]) / det;
    let bb = (matrix[0][0] * rhs[1] - off * rhs[0]) / det;
    [aa, bb - aa]
}

#[test]
fn two_points_swing_as_the_double_pendulum_of_the_textbooks() {
    let (m, l) = ([2.0, 1.0], [0.5, 0.4]);
    let mut bench = arm(&[point(l[0], m[0], 0.3, 0.0), point(l[1], m[1], 0.4, l[0])], 0.0);
    // The textbook's equations by Runge and Kutta, in steps a tenth as long.
    let (mut q, mut v) = ([0.3, 0.4], [0.0; 2]);
    let h = 0.1 * DT_S;
    for _ in 0..20_000 {
        bench.step();
        for _ in 0..10 {
            let f = |q: [f64; 2], v: [f64; 2]| (v, double_pendulum(q, v, m, l));
            let on = |a: [f64; 2], b: [f64; 2], by: f64| [a[0] + by * b[0], a[1] + by * b[1]];
            let k1 = f(q, v);
            let k2 = f(on(q, k1.0, 0.5 * h), on(v, k1.1, 0.5 * h));
            let k3 = f(on(q, k2.0, 0.5 * h), on(v, k2.1, 0.5 * h));
            let k4 = f(on(q, k3.0, h), on(v, k3.1, h));
            for i in 0..2 {
                q[i] += h / 6.0 * (k1.0[i] + 2.0 * k2.0[i] + 2.0 * k3.0[i] + k4.0[i]);
                v[i] += h / 6.0 * (k1.1[i] + 2.0 * k2.1[i] + 2.0 * k3.1[i] + k4.1[i]);
            }
        }
    }
    let (_, data) = bench.arm();
    near("shoulder after a second", data.angle_rad[0], q[0], 1e-5);
    near("elbow after a second", data.angle_rad[1], q[1], 1e-5);
}

/// A seven-joint arm with axes in all directions.
fn seven() -> Vec<Link> {
    (0..7)
        .map(|i| Link {
            offset_m: if i == 0 { [0.0; 3] } else { [0.05, 0.02, 0.25] },
            axis: [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.6, 0.0, 0.8]][i % 3],
            mass_kg: 4.0 - 0.5 * i as f64,
            center_m: [0.01, 0.03, 0.12],
            inertia_kg_m2: [0.02, 0.018, 0.005],
            first_rad: 0.3 * i as f64 - 0.5,
        })
        .collect()
}

#[test]
fn an_arm_that_falls_freely_keeps_its_energy() {
    for (links, seconds) in [(vec![rod(0.5, 3.0, 0.2, 0.0), rod(0.4, 2.0, 0.9, 0.5)], 5.0), (seven(), 1.0)] {
        let mut bench = arm(&links, 0.0);
        let before = bench.arm().0.energy_j(bench.arm().1);
        let mut fastest: f64 = 0.0;
        for _ in 0..(seconds / DT_S) as u32 {
            bench.step();
            fastest = bench.arm().1.velocity_rad_s.iter().fold(fastest, |most, v| most.max(v.abs()));
        }
        let after = bench.arm().0.energy_j(bench.arm().1);
        assert!(fastest > 3.0, "it falls");
        near("energy in J", after, before, 2e-3);
    }
}

#[test]
fn an_arm_whose_joints_hold_gravity_stands_to_the_last_bit() {
    let mut bench = arm(&seven(), 0.1);
    let gravity = bench.arm().0.gravity_torque_nm(bench.arm().1);
    // Half of it by the motors; of the rest a little more than all by friction.
    for (push, torque) in bench.pushes.iter_mut().zip(gravity) {
        (push.torque_nm, push.dry_nm) = (0.5 * torque, 0.51 * torque.abs() + 1e-9);
    }
    let before = bench.arm().1.angle_rad;
    (0..2000).for_each(|_| bench.step());
    assert_eq!(bench.arm().1.angle_rad, before);
    bench.pushes[3].dry_nm = 0.0;
    (0..2000).for_each(|_| bench.step());
    assert!(bench.arm().1.angle_rad[3] != before[3], "one that nothing holds falls");
}

#[test]
fn a_coupled_motor_books_its_energy() {
    let model = HubMotorModel::ZLLG65ASM250_L;
    let mut motors = [0, 1].map(|_| HubMotor::new(model, Angle::default(), 48.0, 25.0));
    motors.iter_mut().for_each(HubMotor::couple);
    let mut body = Body::DifferentialDrive(BASE, DifferentialDriveData::default());
    let driven = Actuation { inverter: Inverter::Open, bleeder_on: false, brake_released: true };
    let first: [f64; 2] = [0, 1].map(|i| motors[i].stored_j());
    for motor in &mut motors {
        motor.rig.load.torque_nm = -1.5;
    }
    for _ in 0..20_000 {
        motors.iter_mut().for_each(|motor| motor.step(DT_S, &driven));
        let pushes = [0, 1].map(|i| motors[i].rig.push().unwrap());
        let mut motions = [Motion::default(); 2];
        body.step(DT_S, &[1.0, 1.0], &pushes, &mut motions);
        for (motor, motion) in motors.iter_mut().zip(&motions) {
            motor.follow(motion);
        }
    }
    let Body::DifferentialDrive(model, data) = &body else { panic!("{body:?}") };
    let speed = model.speed_m_s(data);
    assert!(speed > 0.5, "{speed}");
    near("wheel", motors[0].rotor.velocity_rad_s * 0.08, speed, 1e-9);
    for (motor, first_j) in motors.iter().zip(first) {
        let rest = motor.rig.energy.balance_j() - (motor.stored_j() - first_j);
        assert!(rest.abs() < 1e-6, "{rest} J missing");
    }
    // What both loads gave and friction left is in the body: `load_j` is the work of each motor on all that.
    let into_body_j: f64 = motors.iter().map(|motor| motor.rig.energy.load_j + 1.5 * motor.rotor.angle.as_rad()).sum();
    near("work in J", into_body_j, 0.5 * 40.0 * speed * speed, 1e-6);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 48, ..ProptestConfig::default() })]

    /// Whatever the motors do to a base: it stays finite, never has more energy than it was given, and the ground gives no more
    /// than the grip.
    #[test]
    fn a_base_never_has_more_energy_than_it_was_given(
        torques in prop::collection::vec((-30.0..30.0_f64, -30.0..30.0_f64), 20),
        grip in 0.05..1.0_f64,
        rolling in 0.0..0.1_f64,
        dry_nm in 0.0..2.0_f64,
        mass_kg in 1.0..200.0_f64,
    ) {
        let mut bench = base(DifferentialDriveModel { grip: Some(grip), rolling, mass_kg, ..BASE });
        bench.pushes.iter_mut().for_each(|push| push.dry_nm = dry_nm);
        let mut given_j = 0.0;
        for (left, right) in torques {
            for _ in 0..200 {
                let turned = bench.turned.clone();
                bench.run(DT_S, &[left, right]);
                given_j += left * (bench.turned[0] - turned[0]) + right * (bench.turned[1] - turned[1]);
            }
            let (model, data) = bench.base();
            let (speed, rate) = (model.speed_m_s(data), model.yaw_rate_rad_s(data));
            let wheels: f64 = bench.pushes.iter().map(|push| 0.5 * 0.014 * push.velocity_rad_s.powi(2)).sum();
            let has_j = 0.5 * mass_kg * speed * speed + rate * rate + wheels;
            prop_assert!(has_j.is_finite() && has_j <= given_j + 1e-6 * (1.0 + given_j.abs()), "{has_j} of {given_j} J");
        }
    }
}
