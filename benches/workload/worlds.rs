//! Worlds whose speed is measured: what the benchmark times and what `run_world` runs for so long.

mod busy;

use std::time::Duration;

use can::{Bitrate, CanId, Frame, Instant};
use canopen::NodeId;
use devices::servo::CIA402;
use drives::mjoint::Model;
use plant::coupled::DifferentialDriveModel;
use sim::machine::{Order, Realism, mjoint, order as order_of, zlac8030l, zlim42c};
use sim::{CoupledShaft, Coupling, Fidelity, Place, StationId, VirtualDrive, World};

/// Names of the worlds.
pub(crate) const WORLDS: [&str; 25] = [
    "1 hub servo turning, silent bus",
    "1 hub servo turning, busy bus",
    "1 hub servo not enabled",
    "1 joint turning, silent bus",
    "1 stepper turning, silent bus",
    "one of each turning, silent bus",
    "3 hub servos turning, silent bus",
    "127 hub servos turning, silent bus",
    "127 hub servos turning, busy bus",
    "2 hub servos turning, silent bus",
    "2 hub servos moving a base, silent bus",
    "6 hub servos not enabled",
    "127 hub servos not enabled",
    "6 hub servos turning, silent bus",
    "16 hub servos turning, silent bus",
    "1 hub servo turning, as on a bench",
    "1 joint turning, as on a bench",
    "1 described servo turning, silent bus",
    "1 mechanical hub servo turning, silent bus",
    "1 mechanical joint turning, silent bus",
    "1 mechanical described servo turning, silent bus",
    "127 mechanical hub servos turning, silent bus",
    "1 mechanical hub servo not enabled",
    "1 mechanical stepper turning, silent bus",
    "1 mechanical stepper not enabled",
];

/// Drives by their node-ID.
type Drives = Vec<(u8, Box<dyn VirtualDrive>)>;

/// A world of [`WORLDS`], past its beginning.
pub(crate) fn world(name: &str) -> Option<World> {
    Some(match name {
        "1 hub servo turning, silent bus" => turning(hub_servos(1)).0,
        "1 hub servo turning, busy bus" => busy::controlled_each_millisecond(),
        "1 hub servo not enabled" => not_enabled(hub_servos(1)),
        "6 hub servos not enabled" => not_enabled(hub_servos(6)),
        "127 hub servos not enabled" => not_enabled(hub_servos(127)),
        "6 hub servos turning, silent bus" => turning(hub_servos(6)).0,
        "16 hub servos turning, silent bus" => turning(hub_servos(16)).0,
        "1 hub servo turning, as on a bench" => moving(hub_servos(1), |world| make_real(world, 1)).0,
        "1 joint turning, as on a bench" => moving(vec![joint(1)], |world| make_real(world, 1)).0,
        "1 joint turning, silent bus" => turning(vec![joint(1)]).0,
        "1 stepper turning, silent bus" => turning(vec![stepper(2)]).0,
        "one of each turning, silent bus" => {
            let mut one_of_each = hub_servos(1);
            one_of_each.extend([stepper(2), joint(3)]);
            turning(one_of_each).0
        }
        "3 hub servos turning, silent bus" => turning(hub_servos(3)).0,
        "127 hub servos turning, silent bus" => turning(hub_servos(127)).0,
        "127 hub servos turning, busy bus" => busy::many_in_one_cycle(),
        "2 hub servos turning, silent bus" => turning(hub_servos(2)).0,
        "2 hub servos moving a base, silent bus" => moving(hub_servos(2), move_a_base).0,
        "1 described servo turning, silent bus" => turning(vec![described(1)]).0,
        "1 mechanical hub servo turning, silent bus" => turning(mechanical(hub_servos(1))).0,
        "1 mechanical joint turning, silent bus" => turning(mechanical(vec![joint(1)])).0,
        "1 mechanical described servo turning, silent bus" => turning(mechanical(vec![described(1)])).0,
        "127 mechanical hub servos turning, silent bus" => turning(mechanical(hub_servos(127))).0,
        "1 mechanical hub servo not enabled" => not_enabled(mechanical(hub_servos(1))),
        "1 mechanical stepper turning, silent bus" => turning(mechanical(vec![stepper(2)])).0,
        "1 mechanical stepper not enabled" => not_enabled(mechanical(vec![stepper(2)])),
        _ => return None,
    })
}

fn hub_servos(count: u8) -> Drives {
    (1..=count).map(|node| (node, Box::new(zlac8030l(node, 0)) as Box<dyn VirtualDrive>)).collect()
}

fn joint(node: u8) -> (u8, Box<dyn VirtualDrive>) {
    (node, Box::new(mjoint(Model::named("m4230e17b50").expect("a model"), node, Bitrate::M1)))
}

fn stepper(node: u8) -> (u8, Box<dyn VirtualDrive>) {
    (node, Box::new(zlim42c(node, 0)))
}

fn described(node: u8) -> (u8, Box<dyn VirtualDrive>) {
    let order = Order::new(&CIA402, NodeId::new(node).expect("a node-ID"), Bitrate::M1);
    (node, order_of(&CIA402, &order).expect("the standard's own servo"))
}

/// The same of fidelity mechanical.
fn mechanical(mut drives: Drives) -> Drives {
    for (_, drive) in &mut drives {
        drive.set_fidelity(Fidelity::Mechanical, Instant::ZERO).expect("a model that has both");
    }
    drives
}

fn not_enabled(drives: Drives) -> World {
    let mut world = World::new(Bitrate::M1, 1);
    // A node that acknowledges: alone it would repeat its boot-up message for ever.
    world.add_probe();
    for (node, drive) in drives {
        world.add_drive(node, drive).expect("numbers differ");
    }
    world.run_for(Duration::from_secs(1));
    world
}

/// With noise, dead time and cogging.
fn make_real(world: &mut World, node: u8) {
    world.set_realism(node, Realism::Full).expect("it was added");
}

/// The wheels of a base of 30 kg.
fn move_a_base(world: &mut World) {
    let base = DifferentialDriveModel {
        mass_kg: 30.0,
        yaw_inertia_kg_m2: 1.5,
        wheel_base_m: 0.5,
        wheel_radius_m: 0.0865,
        rolling: 0.01,
        grip: Some(0.8),
        weight_share: 1.0,
        slope_rad: 0.0,
        uphill_rad: 0.0,
    };
    let shafts = [1, 2].map(|node| CoupledShaft::direct(Place::node(node)));
    world.couple("base", &Coupling::DifferentialDrive(base), &shafts).expect("two free shafts");
}

/// A bus of drives that all turn at 100 r/min, with next to no frame on it; and who may speak there.
fn turning(drives: Drives) -> (World, StationId) {
    moving(drives, |_| {})
}

/// The same, what hangs on their shafts being made by `join`.
fn moving(drives: Drives, join: impl FnOnce(&mut World)) -> (World, StationId) {
    let mut world = World::new(Bitrate::M1, 1);
    let probe = world.add_probe();
    // 60FFh of the described servo counts increments of its encoder, 131072 a turn.
    let target = |drive: &dyn VirtualDrive| if drive.model() == CIA402.name { 100 * 131_072 / 60 } else { 100_u32 };
    let targets: Vec<(u8, u32)> = drives.iter().map(|(node, drive)| (*node, target(drive.as_ref()))).collect();
    let nodes: Vec<u8> = drives.iter().map(|(node, _)| *node).collect();
    for (node, drive) in drives {
        world.add_drive(node, drive).expect("numbers differ");
    }
    join(&mut world);
    world.run_for(Duration::from_millis(20));
    while world.poll_received(probe).is_some() {} // boot-up messages
    for (node, target) in targets {
        turn(&mut world, probe, node, target);
    }
    world.run_for(Duration::from_secs(1));
    assert_turning(&mut world, &nodes);
    (world, probe)
}

fn assert_turning(world: &mut World, nodes: &[u8]) {
    for node in nodes {
        let speed = world.report(*node).map(|report| report.velocity_rpm);
        // The stepper's rotor swings with its steps.
        assert!(speed.as_ref().is_ok_and(|rpm| (rpm - 100.0).abs() < 40.0), "node {node}: {speed:?}");
    }
}

/// Profile velocity at 100 r/min, enabled as each of the drives can be; no watch over the host where there is one.
fn turn(world: &mut World, probe: StationId, node: u8, target: u32) {
    request(world, probe, node, [0x2B, 0x00, 0x20, 0, 0, 0, 0, 0], true);
    request(world, probe, node, [0x2F, 0x60, 0x60, 0, 3, 0, 0, 0], false);
    for command in [0x06, 0x07, 0x0F] {
        request(world, probe, node, [0x2B, 0x40, 0x60, 0, command, 0, 0, 0], false);
    }
    let [a, b, c, d] = target.to_le_bytes();
    request(world, probe, node, [0x23, 0xFF, 0x60, 0, a, b, c, d], false);
}

/// An SDO request and its answer.
fn request(world: &mut World, probe: StationId, node: u8, data: [u8; 8], may_refuse: bool) {
    let request = Frame::full(CanId::standard(0x600 + u16::from(node)), data);
    world.send(probe, request).expect("the probe has room");
    world.run_for(Duration::from_millis(1));
    let answers = std::iter::from_fn(|| world.poll_received(probe)).map(|(_, frame)| frame);
    let answer = answers.filter(|frame| frame.id() == CanId::standard(0x580 + u16::from(node))).last();
    let first = answer.and_then(|frame| frame.data().first().copied());
    assert!(first == Some(0x60) || (may_refuse && first == Some(0x80)), "{request} -> {answer:?}");
}
