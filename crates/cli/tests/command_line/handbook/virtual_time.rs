use std::time::Duration;

use ferrodrive::can::Bitrate;
use ferrodrive::canopen::NodeId;
use ferrodrive::cia402::PowerState;
use ferrodrive::devices;
use ferrodrive::master::units::Rpm;
use ferrodrive::master::{Drive, Error, MotionOptions, Network};
use ferrodrive::sim::machine::{Order, order};
use ferrodrive::sim::{World, block_on, command};

/// Yours: what the software under test does with a drive.
async fn turn_for_a_second(drive: &Drive) -> Result<(), Error> {
    drive.velocity(Rpm(60.0), MotionOptions::default()).await?;
    drive.supervise(Duration::from_secs(1)).await?;
    drive.stop().await
}

/// A bus with a ZLAC8030L at node 4 that has booted, and a master's handle on it.
fn bench() -> (World, Drive) {
    let model = devices::model("zlac8030l").expect("a model that ferrodrive knows");
    let node = NodeId::new(4).expect("1 to 127");
    let mut world = World::new(Bitrate::K500, 1);
    let drive = order(model, &Order::new(model, node, Bitrate::K500)).expect("nothing special was ordered");
    world.add_drive(4, drive).expect("the bus is empty");
    let network = Network::new();
    world.add_station(network.clone());
    world.run_for(Duration::from_secs(1));
    (world, Drive::new(network.node(node), model))
}

#[test]
fn the_wheel_stands_after_its_second() {
    let (mut world, drive) = bench();
    block_on(&mut world, turn_for_a_second(&drive)).unwrap().unwrap();
    let seen = world.report(4).unwrap();
    assert!(seen.velocity_rpm.abs() < 2.0, "{} r/min", seen.velocity_rpm);
    assert!(seen.shaft_angle_rad > 6.0, "a turn a second: {} rad", seen.shaft_angle_rad);
}

#[test]
fn a_broken_hall_sensor_ends_the_second_with_an_error() {
    let (mut world, drive) = bench();
    block_on(&mut world, drive.velocity(Rpm(60.0), MotionOptions::default())).unwrap().unwrap();
    let answer = command::answer(&mut world, "4 fault hall on").unwrap();
    assert!(answer.json.contains("\"ok\":true"), "{}", answer.json);
    assert!(block_on(&mut world, turn_for_a_second(&drive)).unwrap().is_err());
    let state = block_on(&mut world, drive.state()).unwrap().unwrap();
    assert_eq!(state.power, Some(PowerState::Fault));
}
