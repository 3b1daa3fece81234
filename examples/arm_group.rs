//! Three joints as one arm: to a start together, along a sine at 2 ms, and along a recorded path (`arm/path.csv`) at 10 ms.
//!
//! A group moves all axes with one SYNC, within the limits that are stated for each of them. The joints take positions by their
//! interpolated position mode.
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;
use std::f64::consts::TAU;
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use cia402::ModeOfOperation;
use host::group_follow::{GroupFollow, RecordedPath, stream};
use machine::group_move::GroupMove;
use master::cyclic::CyclicOptions;
use master::group::{AxisLimits, AxisSetup, Group};
use master::units::{Angle, Turns};
use master::{Drive, Network};
use sim::World;
use sim::machine::{Order, order};

/// What a joint may do: a third of a turn to both sides of where it begins, half a turn in a second.
fn limits(from: f64) -> AxisLimits {
    AxisLimits {
        range_turns: Some(from - 0.34..=from + 0.34),
        velocity_turns_s: 0.5,
        acceleration_turns_s2: 4.0,
        jerk_turns_s3: 40.0,
        following_error_turns: 0.01,
    }
}

/// A swing of three joints from rest: the sine's beginning is eased in within a second.
fn sine(time_s: f64) -> [f64; 3] {
    let ease = {
        let s = time_s.min(1.0);
        s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
    };
    [(0.10, 0.5), (0.06, 1.0), (0.08, 0.75)].map(|(turns, hz)| ease * turns * (TAU * hz * time_s).sin())
}

/// Streams points relative to where the arm is; the largest following error in turns.
async fn swing(group: &mut Group, path: impl Iterator<Item = [f64; 3]>) -> Result<f64, Box<dyn Error>> {
    let from: Vec<_> = group.points().iter().map(|point| point.position_turns).collect();
    let points = path.map(|point| point.iter().zip(&from).map(|(by, from)| Turns(from + by)).collect::<Vec<_>>());
    let mut largest: f64 = 0.0;
    stream(group, points, |group| largest = group.following_errors().flatten().fold(largest, f64::max)).await?;
    Ok(largest)
}

async fn run(drives: &[Drive]) -> Result<(), Box<dyn Error>> {
    let mode = ModeOfOperation::INTERPOLATED_POSITION;
    let mut setups = Vec::new();
    for drive in drives {
        let at = drive.state().await?.angle.ok_or("the joint does not say where it is")?;
        setups.push(AxisSetup { drive: drive.clone(), mode, limits: limits(at.0 / 360.0) });
    }
    let mut group = Group::open(&setups, Duration::from_millis(2), CyclicOptions::default()).await?;
    group.enable().await?;
    let start: Vec<_> = group.points().iter().map(|point| point.position_turns).collect();
    let to: Vec<_> = start.iter().zip([0.10, -0.05, 0.02]).map(|(from, by)| Turns(from + by)).collect();
    let time = group.start_move(&to, None)?;
    group.rest().await?;
    println!("moved together by 36, -18 and 7.2 degrees in {:.2} s, limited in jerk", time.as_secs_f64());
    let error = swing(&mut group, (1..=2000).map(|cycle| sine(f64::from(cycle) * 0.002))).await?;
    println!("4 s of a sine at 2 ms: at most {:.3} degrees from the set-points", error * 360.0);
    if error > 0.005 || group.state().missed_cycles > 0 {
        return Err("the sine was not followed".into());
    }
    let back: Vec<_> = start.into_iter().map(Turns).collect();
    group.move_to(&back, Some(Duration::from_secs(2))).await?;
    group.close().await?;

    // The recorded path, from where the arm is, within the limits that a move has too: as `ferrodrive group follow --relative`.
    let path = RecordedPath::parse("arm/path.csv", include_bytes!("arm/path.csv")).map_err(|bad| bad.to_string())?;
    let options = GroupMove {
        relative: true,
        period: Some(Duration::from_millis(10)),
        acceleration: Some(4.0),
        following_error: Some(Angle::Turns(0.01)),
        ..GroupMove::default()
    };
    let follow = GroupFollow { path, approach: false, options };
    let planned = follow.plan(None, drives.to_vec()).await.map_err(|failure| failure.to_string())?;
    let mut group = planned.start.open(CyclicOptions::default()).await?;
    let followed = planned.carry_out(&mut group, |_, _| {}).await;
    group.close().await?;
    let followed = followed?;
    let error = followed.largest_turns.iter().copied().fold(0.0, f64::max);
    println!("4 s of the recorded path at 10 ms: at most {:.3} degrees from the set-points", error * 360.0);
    if error > 0.005 || followed.missed_cycles > 0 {
        return Err("the recorded path was not followed".into());
    }
    Ok(())
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let joint = devices::model("m4230e17b50").ok_or("no such model")?;
    let mut world = World::new(Bitrate::M1, 1);
    let network = Network::new();
    world.add_station(network.clone());
    let mut drives = Vec::new();
    for number in [1, 2, 3] {
        let node = NodeId::new(number).ok_or("no node-ID")?;
        world.add_drive(number, order(joint, &Order::new(joint, node, Bitrate::M1))?)?;
        drives.push(Drive::new(network.node(node), joint));
    }
    world.run_for(Duration::from_secs(1));
    sim::block_on(&mut world, run(&drives))?
}
