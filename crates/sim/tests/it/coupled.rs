//! Drives that move a machine together: a base with its pose, two motors on a shaft, an arm of joints.

use std::time::Duration;

use can::{Bitrate, Frame};
use drives::mjoint::Model;
use plant::coupled::{ArmModel, CommonShaftModel, DifferentialDriveModel, Link};
use serde_json::Value;
use sim::command::answer;
use sim::machine::{mjoint, zlac8030l, zlim42c};
use sim::{BodyKind, BodyStimulus, CoupledShaft, Coupling, CouplingError, Place, StationId, World};

const LEFT: u8 = 4;
const RIGHT: u8 = 5;
const RADIUS_M: f64 = 0.0865;
const BASE_M: f64 = 0.5;
const COUNTS_PER_TURN: f64 = 4096.0;

const BASE: DifferentialDriveModel = DifferentialDriveModel {
    mass_kg: 30.0,
    yaw_inertia_kg_m2: 1.5,
    wheel_base_m: BASE_M,
    wheel_radius_m: RADIUS_M,
    rolling: 0.01,
    grip: Some(0.8),
    weight_share: 1.0,
    slope_rad: 0.0,
    uphill_rad: 0.0,
};

fn world(nodes: &[u8]) -> (World, StationId) {
    let mut world = World::new(Bitrate::K500, 1);
    let host = world.add_probe();
    for node in nodes {
        world.add_drive(*node, Box::new(zlac8030l(*node, 1))).unwrap();
    }
    (world, host)
}

/// A base on two wheels; the right one's motor sits the other way round.
fn base(model: DifferentialDriveModel) -> (World, StationId) {
    let (mut world, host) = world(&[LEFT, RIGHT]);
    let shafts = [CoupledShaft::direct(Place::node(LEFT)), CoupledShaft::reversed(Place::node(RIGHT))];
    world.couple("base", &Coupling::DifferentialDrive(model), &shafts).unwrap();
    world.run_for(Duration::from_millis(50));
    (world, host)
}

/// Writes a value to an object over the bus.
fn write(world: &mut World, host: StationId, node: u8, index: u16, size: usize, value: i32) {
    let command = [0x2F, 0x2B, 0, 0x23][size - 1];
    let [low, high] = index.to_le_bytes();
    let mut data = [command, low, high, 0, 0, 0, 0, 0];
    data[4..4 + size].copy_from_slice(&value.to_le_bytes()[..size]);
    world.send(host, Frame::new(can::CanId::standard(0x600 + u16::from(node)), &data)).unwrap();
    world.run_for(Duration::from_millis(2));
}

/// 2000h = 0: a ZLAC8030L goes on though its host is silent.
fn enable(world: &mut World, host: StationId, node: u8, mode: i32) {
    write(world, host, node, 0x2000, 2, 0);
    write(world, host, node, 0x6060, 1, mode);
    for word in [6, 7, 15] {
        write(world, host, node, 0x6040, 2, word);
    }
}

/// The wheels' speeds forward, r/min.
fn drive(world: &mut World, host: StationId, left: i32, right: i32, ms: u64) {
    write(world, host, LEFT, 0x60FF, 4, left);
    write(world, host, RIGHT, 0x60FF, 4, -right);
    world.run_for(Duration::from_millis(ms));
}

fn pose(world: &mut World) -> (f64, f64, f64, [f64; 2]) {
    match world.body("base").unwrap().kind {
        BodyKind::DifferentialDrive { x_m, y_m, heading_deg, slip_m, .. } => {
            (x_m, y_m, heading_deg.to_radians(), slip_m)
        }
        other => panic!("{other:?}"),
    }
}

/// What a program makes of the drives' positions: arcs of circles.
#[derive(Default)]
struct Odometry {
    x: f64,
    y: f64,
    heading: f64,
    last: Option<[f64; 2]>,
}

impl Odometry {
    fn read(&mut self, world: &mut World) {
        let metres = std::f64::consts::TAU * RADIUS_M / COUNTS_PER_TURN;
        let now = [
            world.report(LEFT).unwrap().position as f64 * metres,
            -world.report(RIGHT).unwrap().position as f64 * metres,
        ];
        let last = self.last.replace(now).unwrap_or(now);
        let (left, right) = (now[0] - last[0], now[1] - last[1]);
        let (length, turn) = (0.5 * (left + right), (right - left) / BASE_M);
        let chord = if turn == 0.0 { length } else { length * (0.5 * turn).sin() / (0.5 * turn) };
        self.x += chord * (self.heading + 0.5 * turn).cos();
        self.y += chord * (self.heading + 0.5 * turn).sin();
        self.heading += turn;
    }
}

/// Drives a square of about a metre, reading the positions every 10 ms.
fn square(model: DifferentialDriveModel) -> (Odometry, (f64, f64, f64, [f64; 2]), World) {
    let (mut world, host) = base(model);
    for node in [LEFT, RIGHT] {
        enable(&mut world, host, node, 3);
    }
    let mut odometry = Odometry::default();
    odometry.read(&mut world);
    for side in 0..8 {
        let (left, right) = if side % 2 == 0 { (60, 60) } else { (-30, 30) };
        drive(&mut world, host, left, right, 6);
        for _ in 0..if side % 2 == 0 { 180 } else { 145 } {
            world.run_for(Duration::from_millis(10));
            odometry.read(&mut world);
        }
        drive(&mut world, host, 0, 0, 6);
        for _ in 0..60 {
            world.run_for(Duration::from_millis(10));
            odometry.read(&mut world);
        }
    }
    let pose = pose(&mut world);
    (odometry, pose, world)
}

#[test]
fn a_square_driven_without_slip_is_where_the_wheels_say() {
    let (odometry, (x, y, heading, slip), _) = square(BASE);
    assert_eq!(slip, [0.0; 2]);
    assert!(heading > 5.0, "it turned round once: {heading}");
    // A count is 0.13 mm at the rim, and 0.27 mrad of heading.
    assert!((odometry.heading - heading).abs() < 1e-3, "{} {heading}", odometry.heading);
    assert!((odometry.x - x).hypot(odometry.y - y) < 2e-3, "{} {} {x} {y}", odometry.x, odometry.y);
}

#[test]
fn on_ice_the_wheels_say_something_else() {
    let (odometry, (x, y, heading, slip), _) = square(DifferentialDriveModel { grip: Some(0.02), ..BASE });
    assert!(slip.iter().any(|slip| slip.abs() > 0.01), "{slip:?}");
    let off = (odometry.x - x).hypot(odometry.y - y) + (odometry.heading - heading).abs();
    assert!(off > 0.05, "{} {} {}; {x} {y} {heading}", odometry.x, odometry.y, odometry.heading);
}

#[test]
fn who_is_asked_first_and_how_often_makes_no_difference() {
    let run = |look: fn(&mut World)| {
        let (mut world, host) = base(BASE);
        for node in [LEFT, RIGHT] {
            enable(&mut world, host, node, 3);
        }
        drive(&mut world, host, 80, 20, 0);
        for _ in 0..97 {
            world.run_for(Duration::from_nanos(10_370_001));
            look(&mut world);
        }
        (world.digest(), pose(&mut world))
    };
    let seldom = run(|_| ());
    let left_first = run(|world| {
        for node in [LEFT, RIGHT] {
            world.report(node).unwrap();
        }
    });
    let right_first = run(|world| {
        world.report(RIGHT).unwrap();
        world.body("base").unwrap();
        let mut copy = world.snapshot();
        copy.run_for(Duration::from_millis(50));
    });
    assert_eq!(seldom, left_first);
    assert_eq!(seldom, right_first);
}

#[test]
fn a_free_base_rolls_down_a_slope_and_is_seen_in_what_is_got() {
    let (mut world, _) = base(BASE);
    let reported =
        |world: &mut World, line: &str| -> Value { serde_json::from_str(&answer(world, line).unwrap().json).unwrap() };
    assert_eq!(reported(&mut world, "body base slope 10")["ok"], true);
    world.run_for(Duration::from_millis(500));
    let got = reported(&mut world, "5 get");
    let (body, by_name) = (&got["body"], reported(&mut world, "body base get"));
    assert_eq!((body, &body["kind"]), (&by_name["body"], &Value::from("differential-drive")));
    // m g (sin 10 - 0.01 cos 10) less 0.1 N·m of dry friction at each wheel, over the mass and the wheels'.
    let angle = 10_f64.to_radians();
    let force = 30.0 * 9.80665 * (angle.sin() - 0.01 * angle.cos()) - 2.0 * 0.1 / RADIUS_M;
    let expected = -force / (30.0 + 2.0 * 0.014 / RADIUS_M.powi(2)) * 0.5;
    let speed = body["speed_m_s"].as_f64().unwrap();
    assert!((speed - expected).abs() < 0.02 * expected.abs(), "{speed}, {expected}");
    let wheel = got["velocity_rpm"].as_f64().unwrap() * std::f64::consts::TAU / 60.0 * RADIUS_M;
    assert!((wheel + speed).abs() < 1e-5, "the right motor sits the other way round: {wheel} {speed}");
    for (line, expected) in [
        ("body base slope 90", "slope must be -80 to 80 degrees"),
        ("body base payload 2", "there is slope, grip and mass"),
        ("body bas get", "no body is called \"bas\"; there is base"),
        ("body", "expected: body NAME get"),
        ("body base fly", "expected: body NAME slope|grip|mass|payload VALUE"),
        ("4 load gear 2 1", "part of a coupled machine"),
    ] {
        let answer = reported(&mut world, line);
        assert!(
            answer["ok"] == false && answer["error"]["message"].as_str().unwrap().contains(expected),
            "{line}: {answer}"
        );
    }
}

#[test]
fn two_motors_on_a_shaft_share_the_work_and_one_that_is_off_is_dragged_along() {
    let (mut world, host) = world(&[LEFT, RIGHT]);
    let shafts = [LEFT, RIGHT].map(|node| CoupledShaft::direct(Place::node(node)));
    world.couple("axle", &Coupling::CommonShaft(CommonShaftModel::default()), &shafts).unwrap();
    world.run_for(Duration::from_millis(50));
    enable(&mut world, host, LEFT, 3);
    write(&mut world, host, LEFT, 0x60FF, 4, 100);
    world.run_for(Duration::from_secs(2));
    let [one, other] = [LEFT, RIGHT].map(|node| world.report(node).unwrap());
    assert!((one.velocity_rpm - 100.0).abs() < 1.0, "{one:?}");
    assert_eq!(one.velocity_rpm, other.velocity_rpm);
    assert_eq!(one.shaft_angle_rad, other.shaft_angle_rad);
    // The friction of both: 2 (0.099 + 0.099 / 27.4 w) over 0.761 N·m/A.
    let expected = 2.0 * 0.099 * (1.0 + 10.47 / 27.4) / 0.761;
    let mean_a = (0..100).map(|_| {
        world.run_for(Duration::from_micros(7_130));
        world.report(LEFT).unwrap().current_a.abs()
    });
    let mean_a = mean_a.sum::<f64>() / 100.0;
    assert!((mean_a - expected).abs() < 0.05 * expected, "{mean_a} A, {expected} A");
}

fn link(length_m: f64, mass_kg: f64, offset_m: f64) -> Link {
    Link {
        offset_m: [offset_m, 0.0, 0.0],
        axis: [0.0, -1.0, 0.0],
        mass_kg,
        center_m: [0.5 * length_m, 0.0, 0.0],
        inertia_kg_m2: [0.0, mass_kg * length_m * length_m / 12.0, mass_kg * length_m * length_m / 12.0],
        first_rad: 0.0,
    }
}

#[test]
fn an_arm_of_three_joints_is_held_by_its_drives_and_carries_a_payload() {
    let mut world = World::new(Bitrate::K500, 1);
    let host = world.add_probe();
    for (node, model) in [(1, "m8025e25b80"), (2, "m8025e25b50"), (3, "m4230e17b50")] {
        world.add_drive(node, Box::new(mjoint(Model::named(model).unwrap(), node, Bitrate::K500))).unwrap();
    }
    let mut model = ArmModel::new(&[link(0.3, 2.0, 0.0), link(0.3, 1.5, 0.3), link(0.2, 0.5, 0.3)]).unwrap();
    model.tool_m = [0.2, 0.0, 0.0];
    let shafts = [1, 2, 3].map(|node| CoupledShaft::direct(Place::node(node)));
    world.couple("arm", &Coupling::Arm(Box::new(model)), &shafts).unwrap();
    world.run_for(Duration::from_secs(1));
    let joints = |world: &mut World| match world.body("arm").unwrap().kind {
        BodyKind::Arm { joints_deg, tool_m, .. } => (joints_deg, tool_m),
        other => panic!("{other:?}"),
    };
    // The joints hold their outputs from power-on on; before that they fell a little.
    let (held, tool) = joints(&mut world);
    assert!(held.iter().all(|degrees| degrees.abs() < 5.0), "{held:?}");
    assert!((tool[0] - 0.8).abs() < 0.01, "{tool:?}");
    // What each reducer gives is what gravity asks, but for the friction of its output (and of what it drives backward).
    let transmitted = world.report(1).unwrap().output.unwrap().torque_nm;
    let gravity = 9.80665 * (2.0 * 0.15 + 1.5 * 0.45 + 0.5 * 0.7);
    assert!((transmitted - gravity).abs() < 0.3 * gravity, "{transmitted} N·m, {gravity} N·m");
    world.apply_to_body("arm", &BodyStimulus::Payload(1.0)).unwrap().unwrap();
    // The last joint turns by half a turn of its motor: an output turn is 50.
    enable(&mut world, host, 3, 1);
    write(&mut world, host, 3, 0x607A, 4, 32_768 * 5);
    write(&mut world, host, 3, 0x6040, 2, 0x1F);
    world.run_for(Duration::from_secs(3));
    let (moved, _) = joints(&mut world);
    assert!((moved[0] - held[0]).abs() < 0.5 && (moved[1] - held[1]).abs() < 0.5, "{held:?} {moved:?}");
    let motor = world.report(3).unwrap().shaft_angle_rad.to_degrees();
    assert!((moved[2] - motor / 50.0).abs() < 1e-6, "{moved:?} {motor}");
    // Without power nothing holds it but the friction of its reducers, and they do not hold ten kilograms.
    world.apply_to_body("arm", &BodyStimulus::Payload(10.0)).unwrap().unwrap();
    for node in [1, 2, 3] {
        world.cut_power(node).unwrap();
    }
    world.run_for(Duration::from_secs(3));
    let (fallen, _) = joints(&mut world);
    assert!(fallen[0] < moved[0] - 5.0, "{fallen:?}");
}

/// What may be said to a body and to the drives that move it, up to the ends of the ranges and beyond.
const EXTREMES: [&str; 28] = [
    "body b slope 80 360",
    "body b slope -80 -360",
    "body b slope 1e-300",
    "body b slope 0",
    "body b slope 1e308",
    "body b grip 0.001",
    "body b grip 10",
    "body b grip off",
    "body b mass 0.01",
    "body b mass 100000",
    "body b mass 0",
    "body b payload 100000",
    "body b payload 1e-300",
    "body b payload 0",
    "1 load torque 1000",
    "1 load torque -1000",
    "2 load torque 1000",
    "2 load inertia 1000",
    "2 load inertia 0",
    "1 load friction 1000 static 1000 stribeck 1e-4",
    "1 load none",
    "1 load pulley 10000 -10",
    "2 rotor lock",
    "2 rotor free",
    "1 power cut",
    "1 power on",
    "2 supply 100 limit 1000 resistance 0.001",
    "2 supply 0",
];

#[test]
fn whatever_is_done_to_what_drives_move_together_stays_a_number() {
    let base = Coupling::DifferentialDrive(BASE);
    let light = DifferentialDriveModel { mass_kg: 0.01, yaw_inertia_kg_m2: 1e-6, wheel_radius_m: 1e-3, ..BASE };
    let shaft = Coupling::CommonShaft(CommonShaftModel::default());
    let arm = ArmModel::new(&[link(0.3, 1e5, 0.0), link(100.0, 0.0, 100.0)]).unwrap();
    let couplings = [base, Coupling::DifferentialDrive(light), shaft, Coupling::Arm(Box::new(arm))];
    for seed in 0..24 {
        let mut prng = sim::Prng::new(seed);
        let (mut world, host) = world(&[1, 2]);
        let shafts = [1, 2].map(|node| CoupledShaft::direct(Place::node(node)));
        world.couple("b", &couplings[seed as usize % couplings.len()], &shafts).unwrap();
        world.run_for(Duration::from_millis(20));
        for node in [1, 2] {
            enable(&mut world, host, node, 3);
            write(&mut world, host, node, 0x60FF, 4, 3000);
        }
        for _ in 0..30 {
            let line = EXTREMES[prng.below(EXTREMES.len() as u64) as usize];
            assert!(answer(&mut world, line).unwrap().json.starts_with(r#"{"ok":"#), "{line}");
            world.run_for(Duration::from_nanos(prng.below(30_000_000)));
            let state = format!("{:?} {:?} {:?}", world.body("b"), world.report(1), world.report(2));
            assert!(!state.contains("NaN") && !state.contains("inf"), "seed {seed}, after {line}: {state}");
        }
    }
}

#[test]
fn what_cannot_be_coupled_is_refused_with_the_reason() {
    let (mut world, _) = world(&[LEFT, RIGHT]);
    world.add_drive(2, Box::new(zlim42c(2, 1))).unwrap();
    let [left, right, third, absent] = [LEFT, RIGHT, 2, 9].map(|node| CoupledShaft::direct(Place::node(node)));
    let shaft = Coupling::CommonShaft(CommonShaftModel::default());
    let base = Coupling::DifferentialDrive(BASE);
    let refused = |world: &mut World, coupling: &Coupling, shafts: &[CoupledShaft]| {
        let before = world.digest();
        let error = world.couple("one", coupling, shafts).unwrap_err();
        assert_eq!((world.digest(), world.body_names().count()), (before, 0));
        error.to_string()
    };
    for (coupling, shafts, expected) in [
        (&base, &[left][..], "a differential-drive has 2 to 2 drives, not 1"),
        (&shaft, &[left, absent][..], "there is no drive 9"),
        (&shaft, &[left, left][..], "drive 4 is part of a body already"),
        (&shaft, &[left, CoupledShaft { turns: 0.0, ..right }][..], "turns of the body's shaft"),
        (&shaft, &[left, CoupledShaft { turns: f64::NAN, ..right }][..], "turns of the body's shaft"),
    ] {
        let error = refused(&mut world, coupling, shafts);
        assert!(error.contains(expected), "{error}");
    }
    let heavy = Coupling::DifferentialDrive(DifferentialDriveModel { mass_kg: -1.0, ..BASE });
    assert!(refused(&mut world, &heavy, &[left, right]).contains("mass of a body must be 0.01 to 100000 kg"));
    answer(&mut world, "5 load gear 2 1").unwrap();
    assert!(refused(&mut world, &shaft, &[left, right]).contains("load gear off"));
    answer(&mut world, "5 load gear off").unwrap();
    // A stepper and a wheel on one shaft is nothing to be refused.
    world.couple("one", &shaft, &[right, third]).unwrap();
    assert_eq!(world.couple("one", &shaft, &[left, right]), Err(CouplingError::DuplicateName("one".into())));
    assert_eq!(world.couple("two", &shaft, &[left, right]), Err(CouplingError::Taken(Place::node(RIGHT))));
    // One that is taken away leaves its shaft behind.
    world.remove(world.drive_id(RIGHT).unwrap());
    world.run_for(Duration::from_millis(10));
    assert!(world.report(2).is_ok());
}
