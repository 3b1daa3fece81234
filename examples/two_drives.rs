//! Two hub-motor drives on one bus as the wheels of a mobile robot: a metre ahead, then a quarter turn on the spot.
//!
//! Both drives are asked at the same time: one SDO transfer per node may be under way, so that two nodes take as long as
//! one. Positions in counts make the way exact, however long a message takes.
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;
use std::f64::consts::PI;
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use devices::zltech::ZLAC8030L;
use master::drive::{Drive, MotionOptions};
use master::units::{Rpm, Turns};
use master::{Network, join_all};
use sim::World;

const WHEEL_DIAMETER_M: f64 = 0.2;
/// Distance of the wheels from each other.
const TRACK_M: f64 = 0.5;
const COUNTS_PER_TURN: f64 = 4096.0;
/// 200Eh: number 1 stands for 500 kbit/s, as the drive is delivered.
const BAUD_RATE_500K: u16 = 1;

/// The wheels look outwards: the right one turns backwards when the robot goes ahead.
struct Robot {
    left: Drive,
    right: Drive,
}

impl Robot {
    /// Both wheels roll by these ways, beginning and ending together.
    async fn roll(&self, left_m: f64, right_m: f64) -> Result<(), master::Error> {
        let turns = |way_m: f64| Turns(way_m / (PI * WHEEL_DIAMETER_M));
        // The wheel with the shorter way goes slower by the same factor, so that the path is an arc.
        let longest_m = left_m.abs().max(right_m.abs());
        let options = |way_m: f64| {
            let rpm = (60.0 * way_m.abs() / longest_m).max(1.0);
            MotionOptions { speed: Some(Rpm(rpm)), ..MotionOptions::default() }
        };
        let wheels = [(&self.left, left_m), (&self.right, -right_m)];
        let moves = wheels.map(|(drive, way_m)| drive.move_relative(turns(way_m), options(way_m)));
        join_all(moves).await.into_iter().try_for_each(|moved| moved.map(|_| ()))
    }

    /// Where the wheels are, in m.
    async fn odometry(&self) -> Result<(f64, f64), master::Error> {
        let states = join_all([self.left.state(), self.right.state()]).await;
        let mut ways_m = Vec::new();
        for state in states {
            let counts = state?.position.map_or(0, |position| position.0);
            ways_m.push(counts as f64 / COUNTS_PER_TURN * PI * WHEEL_DIAMETER_M);
        }
        Ok((ways_m[0], -ways_m[1]))
    }
}

async fn tour(robot: &Robot) -> Result<(), master::Error> {
    let quarter_m = PI * TRACK_M / 4.0;
    for (name, left_m, right_m) in [("a metre ahead", 1.0, 1.0), ("a quarter turn to the left", -quarter_m, quarter_m)]
    {
        robot.roll(left_m, right_m).await?;
        let (left_m, right_m) = robot.odometry().await?;
        let (way_m, heading_deg) = ((left_m + right_m) / 2.0, ((right_m - left_m) / TRACK_M).to_degrees());
        println!("{name}: {way_m:.3} m ahead, heading {heading_deg:.1}°");
    }
    Ok(())
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let mut world = World::new(Bitrate::K500, 1);
    let network = Network::new();
    world.add_station(network.clone());
    let mut wheels = Vec::new();
    // Node-IDs 1 and 2 are set by the drives' DIP switches.
    for number in [1, 2] {
        let node = NodeId::new(number).ok_or("no node-ID")?;
        world.add_drive(number, Box::new(sim::machine::zlac8030l(number, BAUD_RATE_500K)))?;
        wheels.push(Drive::new(network.node(node), &ZLAC8030L));
    }
    world.run_for(Duration::from_secs(1));
    let robot = Robot { left: wheels.remove(0), right: wheels.remove(0) };
    sim::block_on(&mut world, tour(&robot))??;
    println!("it took {:.1} s of virtual time", world.now().as_secs_f64());
    Ok(())
}
