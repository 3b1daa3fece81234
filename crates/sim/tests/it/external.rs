//! Drives whose shafts an engine outside moves: torque out and motion in, the other form, and what is refused.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use can::{Bitrate, CanId, Frame, Instant, Station};
use drives::mjoint::Model;
use plant::coupled::{ExternalModel, Rule};
use sim::machine::{mjoint, zlac8030l};
use sim::{BodyKind, CoupledShaft, Coupling, CouplingError, ExchangeError, Given, Place, StationId, World};

const LEFT: u8 = 4;
const RIGHT: u8 = 5;
const DT: Duration = Duration::from_millis(1);
const DT_S: f64 = 1e-3;
/// What the engine has behind each wheel, kg·m².
const WHEEL: f64 = 0.05;

fn world(rule: Rule) -> (World, StationId) {
    let mut world = World::new(Bitrate::K500, 1);
    let host = world.add_probe();
    for node in [LEFT, RIGHT] {
        world.add_drive(node, Box::new(zlac8030l(node, 1))).unwrap();
    }
    let model = ExternalModel::new(rule, &[(0.0, WHEEL), (0.0, WHEEL)]).unwrap();
    let shafts = [CoupledShaft::direct(Place::node(LEFT)), CoupledShaft::reversed(Place::node(RIGHT))];
    world.couple("wheels", &Coupling::External(model), &shafts).unwrap();
    world.run_for(Duration::from_millis(50));
    (world, host)
}

/// Writes a value to an object over the bus, in time that the engine has.
fn write(engine: &mut Engine, (world, host): (&mut World, StationId), node: u8, index: u16, size: usize, value: i32) {
    let command = [0x2F, 0x2B, 0, 0x23][size - 1];
    let [low, high] = index.to_le_bytes();
    let mut data = [command, low, high, 0, 0, 0, 0, 0];
    data[4..4 + size].copy_from_slice(&value.to_le_bytes()[..size]);
    world.send(host, Frame::new(CanId::standard(0x600 + u16::from(node)), &data)).unwrap();
    engine.run(world, 2);
}

/// Both wheels at a speed, r/min forward.
fn drive(engine: &mut Engine, world: &mut World, host: StationId, speed_rpm: i32) {
    for (node, sign) in [(LEFT, 1), (RIGHT, -1)] {
        write(engine, (world, host), node, 0x2000, 2, 0);
        write(engine, (world, host), node, 0x6060, 1, 3);
        for word in [6, 7, 15] {
            write(engine, (world, host), node, 0x6040, 2, word);
        }
        write(engine, (world, host), node, 0x60FF, 4, sign * speed_rpm);
    }
}

/// Two free wheels: mass and armature, and nothing else.
#[derive(Clone, Debug, Default, PartialEq)]
struct Engine {
    angle_rad: [f64; 2],
    velocity_rad_s: [f64; 2],
    inertia_kg_m2: [f64; 2],
}

impl Engine {
    fn of(world: &mut World) -> Self {
        let shafts = world.external_shafts();
        let inertia = |i: usize| WHEEL + shafts[i].inertia_kg_m2;
        Self { inertia_kg_m2: [inertia(0), inertia(1)], ..Self::default() }
    }

    fn run(&mut self, world: &mut World, steps: u32) {
        for _ in 0..steps {
            let mut torque_nm = [0.0; 2];
            world.exchange(DT, (&self.angle_rad, &self.velocity_rad_s), &mut torque_nm).unwrap();
            for (i, torque_nm) in torque_nm.iter().enumerate() {
                self.velocity_rad_s[i] += torque_nm / self.inertia_kg_m2[i] * DT_S;
                self.angle_rad[i] += self.velocity_rad_s[i] * DT_S;
            }
        }
    }
}

/// A station that counts its own wake-ups at 0.5 ms together with its copies, which share its state as those of a master do.
#[derive(Clone, Default)]
struct Shared(Arc<AtomicUsize>);

impl Station for Shared {
    fn handle_frame(&mut self, _: &Frame, _: Instant) {}

    fn handle_timeout(&mut self, _: Instant) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        None
    }

    fn poll_timeout(&self) -> Option<Instant> {
        (self.0.load(Ordering::Relaxed) == 0).then_some(Instant::from_micros(500))
    }
}

#[test]
fn a_look_at_the_shafts_of_a_new_world_does_not_touch_its_stations() {
    let mut world = World::new(Bitrate::K500, 1);
    world.add_drive(LEFT, Box::new(zlac8030l(LEFT, 1))).unwrap();
    let model = ExternalModel::new(Rule::Integrate, &[(0.0, WHEEL)]).unwrap();
    world.couple("wheel", &Coupling::External(model), &[CoupledShaft::direct(Place::node(LEFT))]).unwrap();
    let station = Shared::default();
    world.add_station(station.clone());
    assert!(world.external_shafts()[0].inertia_kg_m2 > 0.0);
    assert_eq!(station.0.load(Ordering::Relaxed), 0, "the copy that looks ahead has no part in it");
    world.run_for(Duration::from_millis(1));
    assert_eq!(station.0.load(Ordering::Relaxed), 1);
}

#[test]
fn a_drive_leads_a_wheel_of_the_engine_and_stops_it() {
    for rule in [Rule::Integrate, Rule::Hold, Rule::Interpolate] {
        let (mut world, host) = world(rule);
        let mut engine = Engine::of(&mut world);
        drive(&mut engine, &mut world, host, 60);
        engine.run(&mut world, 2000);
        let expected = std::f64::consts::TAU;
        for (i, node) in [LEFT, RIGHT].into_iter().enumerate() {
            let speed = engine.velocity_rad_s[i];
            assert!((speed / expected - 1.0).abs() < 0.02, "{rule:?}: {speed} rad/s, expected {expected}");
            // What the encoder saw is where the engine's wheel is, but for the step that is under way.
            let counted = world.report(node).unwrap().position as f64 / 4096.0 * std::f64::consts::TAU;
            let sign = if node == LEFT { 1.0 } else { -1.0 };
            assert!(
                (sign * counted - engine.angle_rad[i]).abs() < 0.02,
                "{rule:?}: {counted}, {}",
                engine.angle_rad[i]
            );
        }
        // Quick stop: the wheels stand in the engine, and the drives say so after that.
        for node in [LEFT, RIGHT] {
            write(&mut engine, (&mut world, host), node, 0x6040, 2, 2);
        }
        let still_turning = world.report(LEFT).unwrap().velocity_rpm;
        assert!(still_turning > 30.0, "{rule:?}: a wheel with mass is not stopped at once, {still_turning} r/min");
        engine.run(&mut world, 3000);
        assert!(engine.velocity_rad_s.iter().all(|speed| speed.abs() < 0.01), "{rule:?}: {:?}", engine.velocity_rad_s);
        assert!(world.report(LEFT).unwrap().velocity_rpm.abs() < 0.1, "{rule:?}");
    }
}

#[test]
fn the_same_exchanges_give_the_same_bits_and_a_clone_goes_on_like_its_world() {
    let run = || {
        let (mut world, host) = world(Rule::Integrate);
        let mut engine = Engine::of(&mut world);
        drive(&mut engine, &mut world, host, 45);
        engine.run(&mut world, 300);
        (world, engine)
    };
    let ((mut first, mut engine), (mut second, mut other)) = (run(), run());
    assert_eq!((first.digest().value(), &engine), (second.digest().value(), &other));
    let (mut copy, mut beside) = (first.snapshot(), engine.clone());
    engine.run(&mut first, 200);
    other.run(&mut second, 200);
    beside.run(&mut copy, 200);
    assert_eq!((first.digest().value(), &engine), (second.digest().value(), &other));
    assert_eq!((first.digest().value(), &engine), (copy.digest().value(), &beside));
}

#[test]
fn the_other_form_gives_the_motion_of_the_drive_with_its_load() {
    let (mut world, _) = world(Rule::Torque);
    let inertia = WHEEL + world.external_shafts()[0].inertia_kg_m2;
    let dry_nm = world.external_shafts()[0].dry_nm;
    let (mut angle_rad, mut velocity_rad_s) = ([0.0; 2], [0.0; 2]);
    for _ in 0..20 {
        let torques = [dry_nm + 1.0, -0.5 * dry_nm];
        world.exchange_torque(DT, &torques, (&mut angle_rad, &mut velocity_rad_s)).unwrap();
    }
    // The bridges idle; viscous friction takes a little.
    let expected = 1.0 / inertia * 0.02;
    assert!((velocity_rad_s[0] / expected - 1.0).abs() < 0.03, "{velocity_rad_s:?}, expected {expected}");
    assert_eq!((angle_rad[1], velocity_rad_s[1]), (0.0, 0.0), "friction holds it");
}

#[test]
fn what_makes_no_sense_is_refused_and_nothing_is_stored() {
    let (mut world, _) = world(Rule::Integrate);
    let mut torque_nm = [0.0; 2];
    world.exchange(DT, (&[0.001, 0.0], &[1.0, 0.0]), &mut torque_nm).unwrap();
    let before = (world.now(), world.digest().value(), world.external_shafts());
    let mut refused = |dt: Duration, angle_rad: &[f64], velocity_rad_s: &[f64]| {
        let mut torque_nm = vec![0.0; angle_rad.len()];
        let error = world.exchange(dt, (angle_rad, velocity_rad_s), &mut torque_nm).unwrap_err().to_string();
        assert_eq!((world.now(), world.digest().value(), world.external_shafts()), before, "{error}");
        error
    };
    assert_eq!(refused(DT, &[0.0], &[0.0]), "expected 2 values, one for each external shaft of the world, got 1");
    assert_eq!(refused(DT, &[0.0; 2], &[0.0]), "expected 2 values, one for each external shaft of the world, got 1");
    assert!(refused(DT, &[0.0, f64::NAN], &[0.0; 2]).starts_with("the angle of joint 2 is NaN; expected a number"));
    assert!(refused(DT, &[0.0; 2], &[f64::INFINITY, 0.0]).starts_with("the velocity of joint 1 is inf"));
    assert!(refused(Duration::ZERO, &[0.0; 2], &[0.0; 2]).contains("a whole number of control periods of 0.00005 s"));
    assert!(refused(Duration::from_micros(1010), &[0.0; 2], &[0.0; 2]).starts_with("a step of 0.00101 s"));
    assert!(refused(Duration::from_secs(2), &[0.0; 2], &[0.0; 2]).contains("at most 1 s"));
    let jump = refused(DT, &[-3.0, 0.0], &[1.0, 0.0]);
    assert!(jump.starts_with("joint 1 is at -3 rad, 2.999 rad further than its velocities explain"), "{jump}");
    let form = world.exchange_torque(DT, &[0.0; 2], (&mut [0.0; 2], &mut [0.0; 2])).unwrap_err();
    assert_eq!(form, ExchangeError::Form { takes: "an angle and a velocity" });
    world.begin_exchange(DT, Given::Motion(&[0.001, 0.0], &[0.0; 2])).unwrap();
    let again = world.begin_exchange(DT, Given::Motion(&[0.001, 0.0], &[0.0; 2])).unwrap_err();
    assert_eq!(again, ExchangeError::UnderWay { left: DT });

    let mut empty = World::new(Bitrate::K500, 1);
    assert_eq!(empty.exchange(DT, (&[], &[]), &mut []), Err(ExchangeError::NoShafts));
    let two = ExternalModel::new(Rule::Hold, &[(0.0, 0.0), (f64::NAN, 0.0)]).unwrap();
    let shafts = [CoupledShaft::direct(Place::node(LEFT))];
    let coupled = |world: &mut World, model| world.couple("x", &Coupling::External(model), &shafts).unwrap_err();
    assert!(matches!(coupled(&mut empty, two), CouplingError::Refused(_)), "an angle that is not a number");
    assert!(
        ExternalModel::new(Rule::Hold, &[]).is_none() && ExternalModel::new(Rule::Hold, &[(0.0, 0.0); 8]).is_none()
    );
    let one = ExternalModel::new(Rule::Hold, &[(0.0, 0.0)]).unwrap();
    assert_eq!(coupled(&mut empty, one), CouplingError::NoSuchDrive(LEFT));
}

#[test]
fn time_outside_of_an_exchange_finds_the_shafts_held() {
    let (mut world, host) = world(Rule::Integrate);
    let mut engine = Engine::of(&mut world);
    drive(&mut engine, &mut world, host, 60);
    engine.run(&mut world, 500);
    let at = world.external_shafts()[0].angle_rad;
    assert!(world.external_shafts()[0].velocity_rad_s > 1.0);
    world.run_for(Duration::from_millis(100));
    let held = world.external_shafts()[0];
    assert_eq!((held.angle_rad, held.velocity_rad_s), (at, 0.0));
    let Some(BodyKind::External { joints_deg, .. }) = world.body("wheels").map(|body| body.kind) else { panic!() };
    assert_eq!(joints_deg[0], at.to_degrees());
    engine.run(&mut world, 10);
    assert!(world.external_shafts()[0].angle_rad > at);
}

/// Two bodies are exchanged as one, in the order in which they were coupled, and each shaft is seen through its reducer.
#[test]
fn shafts_of_several_bodies_and_behind_reducers_stand_in_one_row() {
    let mut world = World::new(Bitrate::M1, 1);
    for (node, model) in [(1, "m4230e17b50"), (2, "m8025e25b80")] {
        world.add_drive(node, Box::new(mjoint(Model::named(model).unwrap(), node, Bitrate::M1))).unwrap();
    }
    for (name, node) in [("b", 2), ("a", 1)] {
        let model = ExternalModel::new(Rule::Integrate, &[(0.5, 0.0)]).unwrap();
        world.couple(name, &Coupling::External(model), &[CoupledShaft::direct(Place::node(node))]).unwrap();
    }
    let shafts = world.external_shafts();
    assert_eq!(shafts.iter().map(|shaft| shaft.place.node).collect::<Vec<_>>(), [2, 1]);
    assert_eq!(shafts.iter().map(|shaft| (1.0 / shaft.turns).round()).collect::<Vec<_>>(), [80.0, 50.0]);
    // The rotor's inertia times the square of the ratio is most of it (figures of the manuals' motors are some 1e-5 kg·m²).
    assert!(shafts.iter().all(|shaft| (0.01..2.0).contains(&shaft.inertia_kg_m2)), "{shafts:?}");
    let before = [2, 1].map(|node| world.report(node).unwrap().shaft_angle_rad);
    let mut torque_nm = [0.0; 2];
    for step in 1..=50 {
        let angle_rad = 0.5 + 0.001 * f64::from(step);
        world.exchange(DT, (&[angle_rad, angle_rad], &[1.0, 1.0]), &mut torque_nm).unwrap();
    }
    let turned = [2, 1].map(|node| world.report(node).unwrap().shaft_angle_rad);
    for ((turned, before), ratio) in turned.iter().zip(before).zip([80.0, 50.0]) {
        // It goes on at 1 rad/s through the last step.
        assert!(((turned - before) / ratio - 0.051).abs() < 0.002, "{}", (turned - before) / ratio);
    }
}

/// A wheel whose drive is not enabled carries a pendulum of the engine: what the engine loses in 10 s is heat of the drive's friction, to 0.5 % of what
/// there was.
#[test]
fn energy_that_the_engine_loses_is_heat_of_the_drive() {
    const WEIGHT_NM: f64 = 4.0;
    for rule in [Rule::Integrate, Rule::Hold, Rule::Interpolate] {
        let (mut world, _) = world(rule);
        let inertia = WHEEL + world.external_shafts()[0].inertia_kg_m2;
        let (mut angle_rad, mut velocity_rad_s, mut torque_nm) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        // The shafts are joined at 0: the weight hangs at 1 rad.
        let energy_j =
            |angle: f64, velocity: f64| 0.5 * inertia * velocity * velocity - WEIGHT_NM * (angle - 1.0).cos();
        let before_j = energy_j(0.0, 0.0);
        let heat_j = |world: &mut World| world.report(LEFT).unwrap().physics.unwrap().energy.friction_j;
        let cold_j = heat_j(&mut world);
        for _ in 0..10_000 {
            world.exchange(DT, (&angle_rad, &velocity_rad_s), &mut torque_nm).unwrap();
            // Half a kick, a drift, half a kick: the engine itself keeps its energy.
            let kick = |angle: f64| 0.5 * DT_S * (torque_nm[0] - WEIGHT_NM * (angle - 1.0).sin()) / inertia;
            velocity_rad_s[0] += kick(angle_rad[0]);
            angle_rad[0] += velocity_rad_s[0] * DT_S;
            velocity_rad_s[0] += kick(angle_rad[0]);
        }
        let lost_j = before_j - energy_j(angle_rad[0], velocity_rad_s[0]);
        let swing_j = before_j + WEIGHT_NM;
        let heat_j = heat_j(&mut world) - cold_j;
        assert!(lost_j > 0.3 * swing_j, "{rule:?}: {lost_j}");
        assert!((lost_j - heat_j).abs() < 0.005 * swing_j, "{rule:?}: lost {lost_j}, heat {heat_j} of {swing_j}");
    }
}
