//! A path of positions for three drives at once, a point each millisecond by process data: the same program for any model
//! that takes positions cycle by cycle.
//!
//! The program waits for SYNC, looks at what the drives sent, and gives each its next point; all of it in one exchange, so
//! that the three set-points leave together and act with the next SYNC. A 1 Mbit/s bus has room for three drives at 1 ms.
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;
use std::f64::consts::TAU;
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use cia402::ModeOfOperation;
use devices::{Description, model};
use master::cyclic::{CyclicDrive, CyclicOptions, Demand};
use master::units::Turns;
use master::{Drive, Network, join_all};
use sim::World;
use sim::machine::{Order, order};

const PERIOD: Duration = Duration::from_millis(1);
const PATH_S: f64 = 2.0;

/// Turns of the swing and swings a second, of each axis.
const SWINGS: [(f64, f64); 3] = [(2.0, 0.5), (1.0, 1.0), (0.5, 1.5)];

/// Models and the modes in which they take a position each cycle.
const MODELS: [(&str, ModeOfOperation); 2] =
    [("m4230e17b50", ModeOfOperation::INTERPOLATED_POSITION), ("cia402", ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION)];

/// What came of a path.
struct Outcome {
    /// How far a shaft was from where it had been sent two cycles before, in turns.
    farthest_turns: f64,
    missed_cycles: u64,
}

/// From 0 and back, at rest at both ends.
fn place((turns, hz): (f64, f64), time_s: f64) -> f64 {
    turns / 2.0 * (1.0 - (TAU * hz * time_s).cos())
}

/// Steps all drives in one cycle until each follows; where they are.
async fn enable(network: &Network, drives: &mut [CyclicDrive]) -> Result<Vec<f64>, Box<dyn Error>> {
    for _ in 0..1000 {
        network.next_sync().await?;
        let states =
            network.exchange(|io| drives.iter_mut().map(|drive| drive.step(io, Demand::Hold)).collect::<Vec<_>>());
        let places: Vec<_> = states.iter().filter(|state| state.follows).filter_map(|state| state.position).collect();
        if places.len() == drives.len() {
            return Ok(places.into_iter().map(|Turns(turns)| turns).collect());
        }
    }
    Err("not all drives could be enabled within a second".into())
}

async fn stream(network: &Network, drives: &mut [CyclicDrive]) -> Result<Outcome, Box<dyn Error>> {
    let from = enable(network, drives).await?;
    let first = network.next_sync().await?;
    let mut outcome = Outcome { farthest_turns: 0.0, missed_cycles: 0 };
    let mut before = first;
    let mut asked = vec![from.clone(); 2];
    loop {
        let cycle = network.next_sync().await?;
        outcome.missed_cycles += cycle.missed_since(&before);
        before = cycle;
        // The cycle's number is the time: a cycle that was missed leaves no dent in the path.
        let time_s = (cycle.number - first.number) as f64 * PERIOD.as_secs_f64();
        if time_s > PATH_S {
            return Ok(outcome);
        }
        let points: Vec<_> = SWINGS.iter().zip(&from).map(|(swing, from)| from + place(*swing, time_s)).collect();
        let states = network.exchange(|io| {
            let steps = drives.iter_mut().zip(&points);
            steps.map(|(drive, point)| drive.step(io, Demand::Position(Turns(*point).into()))).collect::<Vec<_>>()
        });
        for (state, there) in states.iter().zip(&asked[0]) {
            if let Some(refusal) = state.refused {
                return Err(refusal.to_string().into());
            }
            if let Some(Turns(at)) = state.position {
                outcome.farthest_turns = outcome.farthest_turns.max((at - there).abs());
            }
        }
        asked.rotate_left(1);
        asked[1] = points;
    }
}

async fn run(network: &Network, drives: &[Drive], mode: ModeOfOperation) -> Result<Outcome, Box<dyn Error>> {
    let mut cyclic = Vec::new();
    for drive in drives {
        drive.configure_cyclic(mode).await?;
        let opened = drive.cyclic(mode, CyclicOptions::default()).await?;
        // What the drive does when this program dies in the middle of the path.
        println!("  node {}: {}", opened.node(), opened.host_loss());
        cyclic.push(opened);
    }
    network.sync(Some(PERIOD));
    let outcome = stream(network, &mut cyclic).await?;
    for _ in 0..100 {
        network.next_sync().await?;
        network.exchange(|io| {
            for drive in &mut cyclic {
                drive.step(io, Demand::Off);
            }
        });
    }
    network.sync(None);
    join_all(drives.iter().map(Drive::release_guard)).await.into_iter().collect::<Result<(), _>>()?;
    Ok(outcome)
}

fn three(model: &'static Description, mode: ModeOfOperation) -> Result<Outcome, Box<dyn Error>> {
    let mut world = World::new(Bitrate::M1, 1);
    let network = Network::new();
    world.add_station(network.clone());
    let mut drives = Vec::new();
    for number in [1, 2, 3] {
        let node = NodeId::new(number).ok_or("no node-ID")?;
        world.add_drive(number, order(model, &Order::new(model, node, Bitrate::M1))?)?;
        drives.push(Drive::new(network.node(node), model));
    }
    world.run_for(Duration::from_secs(1));
    sim::block_on(&mut world, run(&network, &drives, mode))?
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    for (name, mode) in MODELS {
        let model = model(name).ok_or("no such model")?;
        println!("{}, mode {mode}", model.title);
        let Outcome { farthest_turns, missed_cycles } = three(model, mode)?;
        println!("  at most {:.2} degrees off the path, {missed_cycles} cycles missed", farthest_turns * 360.0);
        if missed_cycles > 0 || farthest_turns > 0.05 {
            return Err("the path was not followed".into());
        }
    }
    Ok(())
}
