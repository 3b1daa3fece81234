//! A virtual drive inside your own test: no hardware, no waiting, the same run every time.
//!
//! Copy the test below into your project. It is run by `cargo test`, and by
//! `cargo run -p ferrodrive-examples --example embed_in_your_test`.
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use cia402::PowerState;
use devices::zltech::ZLAC8030L;
use master::Network;
use master::drive::{Drive, MotionOptions};
use master::units::Rpm;
use sim::{Component, World};

/// The node-ID a ZLAC8030L is delivered with.
const NODE: u8 = 4;

/// 200Eh: number 1 stands for 500 kbit/s, as the drive is delivered.
const BAUD_RATE_500K: u16 = 1;

/// A bus with one drive that has booted, and a master's handle on it.
fn bench() -> (World, Drive) {
    let node = NodeId::new(NODE).expect("4 is a node-ID");
    let mut world = World::new(Bitrate::K500, 1);
    world.add_drive(NODE, Box::new(sim::machine::zlac8030l(NODE, BAUD_RATE_500K))).expect("the bus is empty");
    let network = Network::new();
    world.add_station(network.clone());
    world.run_for(Duration::from_secs(1));
    (world, Drive::new(network.node(node), &ZLAC8030L))
}

/// What your software does when the drive reports a fault is worth a test. Here the Hall sensors break while it turns.
#[cfg_attr(test, test)]
fn a_hall_fault_is_reported_with_its_remedy_and_can_be_reset() {
    let (mut world, drive) = bench();

    // `block_on` moves virtual time on for as long as the future waits.
    sim::block_on(&mut world, drive.velocity(Rpm(100.0), MotionOptions::default())).unwrap().unwrap();

    // Between two steps the machine can be changed: loads, supply, inputs, faults.
    world.with_drive(NODE, |machine, now| machine.set_fault(Component::Hall, true, now)).unwrap().unwrap();
    world.run_for(Duration::from_millis(200));

    let state = sim::block_on(&mut world, drive.state()).unwrap().unwrap();
    assert_eq!(state.power, Some(PowerState::Fault));
    assert_eq!(state.fault_code, Some(0x0200));
    println!("the drive says: {}. {}", state.faults[0].name, state.faults[0].remedy);

    // Asking it to move now fails with an explanation instead of a timeout.
    let refused = sim::block_on(&mut world, drive.enable()).unwrap().unwrap_err();
    println!("the master says: {refused}");

    // The cable is mended, the fault reset, and on it goes.
    world.with_drive(NODE, |machine, now| machine.set_fault(Component::Hall, false, now)).unwrap().unwrap();
    world.run_for(Duration::from_secs(2));
    sim::block_on(&mut world, drive.reset_fault()).unwrap().unwrap();
    sim::block_on(&mut world, drive.enable()).unwrap().unwrap();
}

/// Virtual time is exact: two runs are the same to the last bit, shaft angle included.
#[cfg_attr(test, test)]
fn the_same_test_gives_the_same_run() {
    let run = || {
        let (mut world, drive) = bench();
        sim::block_on(&mut world, drive.velocity(Rpm(60.0), MotionOptions::default())).unwrap().unwrap();
        world.digest()
    };
    assert_eq!(run(), run());
}

pub(crate) fn main() {
    a_hall_fault_is_reported_with_its_remedy_and_can_be_reset();
    the_same_test_gives_the_same_run();
    println!("both tests pass");
}
