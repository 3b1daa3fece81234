use std::time::Duration;

use ferrodrive::can::Bitrate;
use ferrodrive::canopen::NodeId;
use ferrodrive::devices;
use ferrodrive::master::units::{Degrees, Rpm};
use ferrodrive::master::{Drive, Error, MotionOptions, Network, join_all};
use ferrodrive::sim::machine::{Order, order};
use ferrodrive::sim::{World, block_on, command};

/// A bus with two joints, at nodes 1 and 2.
fn bench() -> (World, [Drive; 2]) {
    let model = devices::model("m4230e17b50").unwrap();
    let mut world = World::new(Bitrate::M1, 1);
    let network = Network::new();
    world.add_station(network.clone());
    let drives = [1, 2].map(|number| {
        let node = NodeId::new(number).unwrap();
        world.add_drive(number, order(model, &Order::new(model, node, Bitrate::M1)).unwrap()).unwrap();
        Drive::new(network.node(node), model)
    });
    world.run_for(Duration::from_secs(1));
    (world, drives)
}

/// Both turn at the same time, in degrees of the motors; the slower way is done at a lower speed.
async fn together(drives: &[Drive; 2], ways: [f64; 2]) -> Result<(), Error> {
    let longest = ways[0].abs().max(ways[1].abs());
    let moves = drives.iter().zip(ways).map(|(drive, way)| {
        let speed = Some(Rpm((200.0 * way.abs() / longest).max(1.0)));
        drive.move_relative(Degrees(way), MotionOptions { speed, ..MotionOptions::default() })
    });
    join_all(moves).await.into_iter().try_for_each(|moved| moved.map(|_| ()))
}

fn angle_deg(world: &mut World, number: u8) -> f64 {
    world.report(number).unwrap().shaft_angle_rad.to_degrees()
}

#[test]
fn both_axes_arrive() {
    let (mut world, drives) = bench();
    let from = [angle_deg(&mut world, 1), angle_deg(&mut world, 2)];
    block_on(&mut world, together(&drives, [720.0, -360.0])).unwrap().unwrap();
    let ways = [angle_deg(&mut world, 1) - from[0], angle_deg(&mut world, 2) - from[1]];
    assert!((ways[0] - 720.0).abs() < 1.0 && (ways[1] + 360.0).abs() < 1.0, "{ways:?}");
}

#[test]
fn one_axis_that_is_held_fails_alone() {
    let (mut world, drives) = bench();
    let answer = command::answer(&mut world, "2 rotor lock").unwrap();
    assert!(answer.json.contains("\"ok\":true"), "{}", answer.json);
    let from = angle_deg(&mut world, 1);
    assert!(block_on(&mut world, together(&drives, [720.0, 720.0])).unwrap().is_err());
    assert!((angle_deg(&mut world, 1) - from - 720.0).abs() < 1.0, "the other one arrives");
}
