//! A stepper axis with a limit switch: it finds its reference, and moves within software limits from there on.
//!
//! The ZLIM42-C takes no positions in cycles (6502h has no cyclic mode), so the group gives it a speed in each cycle and closes
//! the position loop over the bus: the path is limited in jerk, and the axis ends within some tenths of a degree.
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;
use std::time::Duration;

use can::Bitrate;
use canopen::{Mux, NodeId};
use cia402::ModeOfOperation;
use master::cyclic::CyclicOptions;
use master::drive::HomingOptions;
use master::group::{AxisHoming, AxisLimits, AxisSetup, Group, HomingOrder, home};
use master::units::Turns;
use master::{Drive, Network};
use sim::machine::{Order, order};
use sim::{Place, Stimulus, World};

const PERIOD: Duration = Duration::from_millis(5);

/// Between the switch and the far end: three turns.
const LIMITS: AxisLimits = AxisLimits {
    range_turns: Some(0.25..=3.0),
    velocity_turns_s: 1.0,
    acceleration_turns_s2: 4.0,
    jerk_turns_s3: 40.0,
    following_error_turns: 0.1,
};

async fn run(drive: &Drive) -> Result<(), Box<dyn Error>> {
    // X0 is the negative limit ("ZLIM42-C user manual V1.03", 5.4).
    drive.node().write(Mux::new(0x2030, 2), 3_u16).await?;
    let search = AxisHoming { drive: drive.clone(), method: 17, options: HomingOptions::default() };
    let reports = home(&[search], HomingOrder::Together).await?;
    let time = reports.first().and_then(|report| report.reached_after).unwrap_or_default();
    println!("the switch was found after {:.2} s", time.as_secs_f64());
    // Off the switch, with the drive's own planner; within the limits from then on.
    drive.move_absolute(Turns(0.5), master::MotionOptions::default()).await?;
    let setup = AxisSetup { drive: drive.clone(), mode: ModeOfOperation::PROFILE_VELOCITY, limits: LIMITS };
    let mut axis = Group::open(&[setup], PERIOD, CyclicOptions::default()).await?;
    axis.enable().await?;
    for to in [2.5, 1.0] {
        axis.move_to(&[Turns(to)], None).await?;
        // What the position loop over the bus still has to do.
        for _ in 0..100 {
            axis.cycle().await?;
        }
        let Some(Turns(at)) = axis.axes()[0].position else { return Err("its position does not come".into()) };
        println!("sent to {to} turns, at {at:.4}: {:.2} degrees off", (at - to) * 360.0);
        if (at - to).abs() > 0.01 {
            return Err("it did not arrive".into());
        }
    }
    let Err(refused) = axis.start_move(&[Turns(4.0)], None) else {
        return Err("a move beyond the limits was begun".into());
    };
    println!("{refused}");
    axis.close().await?;
    Ok(())
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let model = devices::model("zlim42c").ok_or("no such model")?;
    let mut world = World::new(Bitrate::K500, 1);
    let network = Network::new();
    world.add_station(network.clone());
    let node = NodeId::new(3).ok_or("no node-ID")?;
    world.add_drive(3, order(model, &Order::new(model, node, Bitrate::K500))?)?;
    world.run_for(Duration::from_secs(1));
    // The switch is half a turn below where the axis begins.
    let range = sim::SwitchRange { low: None, high: Some(-2000) };
    world.apply(Place::node(3), &Stimulus::Switch { name: "X0".to_owned(), range })??;
    sim::block_on(&mut world, run(&Drive::new(network.node(node), model)))?
}
