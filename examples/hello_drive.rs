//! Hello, drive: enable it, turn at 60 r/min for a second, stop.
//!
//! ```sh
//! # a virtual drive, in virtual time
//! cargo run -p ferrodrive-examples --example hello_drive
//! # the same code on another bus
//! cargo run -p ferrodrive-examples --example hello_drive -- --bus socketcand://127.0.0.1:29536/can0
//! ```
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "an example shows what it does")]

use std::error::Error;
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use devices::zltech::ZLAC8030L;
use master::drive::{Drive, MotionOptions};
use master::units::Rpm;
use master::{Network, Node};
use sim::World;
use transport::{BusSpec, Note, WallClock, run_station};

/// The node-ID a ZLAC8030L is delivered with.
const NODE: u8 = 4;

/// 200Eh: number 1 stands for 500 kbit/s, as the drive is delivered.
const BAUD_RATE_500K: u16 = 1;

/// What is to be done. It knows nothing of the bus it runs on: it asks, and waits for answers.
async fn hello(node: Node) -> Result<(), master::Error> {
    let drive = Drive::new(node, &ZLAC8030L);

    // Enables the drive (the three steps of CiA 402), sets the speed, and returns when it is reached.
    let motion = drive.velocity(Rpm(60.0), MotionOptions::default()).await?;
    println!("60 r/min reached after {:?}", motion.reached_after.unwrap_or_default());

    // A ZLAC8030L stops by itself when it hears nothing for a second; supervising keeps it company.
    drive.supervise(Duration::from_secs(1)).await?;
    let state = drive.state().await?;
    println!("it is at {:?}, turning at {:?}", state.position, state.velocity);

    // By its own deceleration ramp; then the power off the motor.
    drive.stop().await?;
    drive.disable().await?;
    println!("stopped at {:?}", drive.state().await?.position);
    Ok(())
}

/// A bus in this program, with one drive on it. Time is virtual: this takes milliseconds.
fn on_a_virtual_bus() -> Result<(), Box<dyn Error>> {
    let mut world = World::new(Bitrate::K500, 1);
    world.add_drive(NODE, Box::new(sim::machine::zlac8030l(NODE, BAUD_RATE_500K)))?;
    // The master is one more station on the bus; the handle we keep asks, the one in the world answers.
    let network = Network::new();
    world.add_station(network.clone());
    // The drive needs a moment to boot.
    world.run_for(Duration::from_secs(1));
    Ok(sim::block_on(&mut world, hello(node(&network)))??)
}

/// A bus that is somewhere else, in real time.
async fn on_a_real_bus(spec: &BusSpec) -> Result<(), Box<dyn Error>> {
    let clock = WallClock::start();
    let mut bus = spec.open(&clock).await?;
    let network = Network::new();
    let done = hello(node(&network));
    let report = |_, note: &Note| eprintln!("{note}");
    run_station(&mut bus, &mut network.clone(), &clock, &tokio::sync::Notify::new(), done, report).await??;
    Ok(())
}

fn node(network: &Network) -> Node {
    network.node(NodeId::new(NODE).unwrap_or(NodeId::MIN))
}

/// `--bus BUS`, or the virtual bus.
pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let bus = arguments.iter().position(|argument| argument == "--bus").and_then(|at| arguments.get(at + 1));
    match bus.map_or(Ok(BusSpec::Sim { file: None }), |text| text.parse())? {
        BusSpec::Sim { .. } => on_a_virtual_bus(),
        spec => tokio::runtime::Builder::new_current_thread().enable_all().build()?.block_on(on_a_real_bus(&spec)),
    }
}
