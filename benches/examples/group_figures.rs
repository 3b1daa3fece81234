//! How well three axes of a group keep together, in virtual time: the same on every machine.
//!
//! Three servos of CiA 402 on a bus of 1 Mbit/s, cyclic synchronous positions each millisecond: first alike, then one alone, one
//! with a torque and one with an inertia on its shaft. They go by one turn; when each shaft passes the same shares of its way is
//! measured in the simulated world, between samples 50 µs apart. The second three then go to and fro for as long as is asked for
//! (seconds; without an argument 10), and reports what was missed and how far they lagged:
//!
//! ```text
//! cargo run --profile dist -p ferrodrive-benches --example group_figures -- 3600
//! ```
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;
use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::NodeId;
use cia402::ModeOfOperation;
use devices::servo::CIA402;
use master::cyclic::CyclicOptions;
use master::group::{AxisLimits, AxisSetup, Group, Phase};
use master::units::Turns;
use master::{Drive, Network};
use sim::machine::{Order, order};
use sim::{Place, Stimulus, World, block_on};

const AXES: usize = 3;
const PERIOD: Duration = Duration::from_millis(1);
const SAMPLE: Duration = Duration::from_micros(50);
const WAY_TURNS: f64 = 1.0;

/// Shares of the way at which the shafts are compared: the first is where motion is seen to have begun.
const SHARES: [f64; 5] = [0.001, 0.1, 0.5, 0.9, 0.99];

struct Bench {
    world: World,
    group: Group,
    home: Vec<f64>,
}

impl Bench {
    fn new(loaded: bool) -> Result<Self, Box<dyn Error>> {
        let mut world = World::new(Bitrate::M1, 7);
        let network = Network::new();
        world.add_station(network.clone());
        let mut axes = Vec::new();
        for (number, node) in (1..).zip(NodeId::all().take(AXES)) {
            world.add_drive(number, order(&CIA402, &Order::new(&CIA402, node, Bitrate::M1))?)?;
            let limits = AxisLimits {
                range_turns: None,
                velocity_turns_s: 2.0,
                acceleration_turns_s2: 10.0,
                jerk_turns_s3: 100.0,
                following_error_turns: 0.05,
            };
            let drive = Drive::new(network.node(node), &CIA402);
            axes.push(AxisSetup { drive, mode: ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION, limits });
        }
        if loaded {
            world.apply(Place::node(2), &Stimulus::LoadTorque(0.02))??;
            world.apply(Place::node(3), &Stimulus::LoadInertia(2e-5))??;
        }
        world.run_until(Instant::from_secs(1));
        let mut group = block_on(&mut world, Group::open(&axes, PERIOD, CyclicOptions::default()))??;
        block_on(&mut world, group.enable())??;
        let home = group.points().iter().map(|point| point.position_turns).collect();
        Ok(Self { world, group, home })
    }

    fn begin(&mut self, way_turns: f64) -> Result<(), Box<dyn Error>> {
        let to: Vec<_> = self.home.iter().map(|home| Turns(home + way_turns)).collect();
        self.group.start_move(&to, None)?;
        Ok(())
    }

    fn shafts(&mut self) -> Result<[f64; AXES], Box<dyn Error>> {
        let mut turns = [0.0; AXES];
        for (number, turns) in (1..).zip(&mut turns) {
            *turns = self.world.report(number)?.shaft_angle_rad / core::f64::consts::TAU;
        }
        Ok(turns)
    }

    /// When each shaft passed each share of its way, in microseconds from the first SYNC on.
    fn passages(&mut self, way_turns: f64) -> Result<[[f64; AXES]; SHARES.len()], Box<dyn Error>> {
        let mut passed = [[f64::NAN; AXES]; SHARES.len()];
        let from = self.shafts()?;
        let began = self.world.now();
        let (mut before, mut before_at) = (from, began);
        self.begin(way_turns)?;
        loop {
            let phase = block_on(&mut self.world, self.group.cycle())??.phase;
            let sync = self.world.now();
            loop {
                let (now, at) = (self.shafts()?, self.world.now());
                for (share, passed) in SHARES.iter().zip(&mut passed) {
                    for axis in 0..AXES {
                        let goal = from[axis] + share * way_turns;
                        let step = now[axis] - before[axis];
                        let left = goal - before[axis];
                        // Passed between the two samples, at the speed between them.
                        if passed[axis].is_nan() && step != 0.0 && (0.0..=1.0).contains(&(left / step)) {
                            let (since, between) = ((before_at - began).as_secs_f64(), (at - before_at).as_secs_f64());
                            passed[axis] = (since + between * left / step) * 1e6;
                        }
                    }
                }
                (before, before_at) = (now, at);
                if at - sync + SAMPLE >= PERIOD {
                    break;
                }
                self.world.run_for(SAMPLE);
            }
            if phase == Phase::Holding {
                return Ok(passed);
            }
        }
    }

    /// To and fro for so long; the largest following error, in turns.
    fn go_on(&mut self, time: Duration) -> Result<f64, Box<dyn Error>> {
        let end = self.world.now() + time;
        let (mut way, mut largest) = (0.0, 0.0_f64);
        while self.world.now() < end {
            self.begin(way)?;
            way = WAY_TURNS - way;
            let (group, world) = (&mut self.group, &mut self.world);
            let moved = block_on(world, async {
                let mut largest = 0.0_f64;
                while group.cycle().await?.phase == Phase::Moving {
                    largest = group.following_errors().flatten().fold(largest, f64::max);
                }
                Ok::<_, Box<dyn Error>>(largest)
            });
            largest = largest.max(moved??);
            if let Some(cause) = self.group.state().cause {
                return Err(cause.to_string().into());
            }
        }
        Ok(largest)
    }
}

/// Prints how far apart the axes are on their way.
fn spread(loaded: bool) -> Result<Bench, Box<dyn Error>> {
    let mut bench = Bench::new(loaded)?;
    println!(
        "{}",
        if loaded { "with a torque on axis 2 and an inertia on axis 3:" } else { "three axes that are alike:" }
    );
    for (share, times) in SHARES.iter().zip(bench.passages(WAY_TURNS)?) {
        let first = times.iter().copied().fold(f64::MAX, f64::min);
        let apart = times.iter().copied().fold(0.0, f64::max) - first;
        let ms = first * 1e-3;
        println!("{:5.1} % of the way after {ms:6.2} ms, the last axis {apart:.1} us behind the first", share * 100.0);
    }
    Ok(bench)
}

fn main() -> Result<(), Box<dyn Error>> {
    let seconds: u64 = std::env::args().nth(1).map_or(Ok(10), |text| text.parse())?;
    let mut bench = spread(false)?;
    block_on(&mut bench.world, bench.group.close())??;
    let mut bench = spread(true)?;
    let before = bench.world.now();
    let largest = bench.go_on(Duration::from_secs(seconds))?;
    println!(
        "{:.0} s at {} ms: {} cycles missed, following error at most {largest:.6} turns",
        (bench.world.now() - before).as_secs_f64(),
        PERIOD.as_millis(),
        bench.group.state().missed_cycles
    );
    Ok(())
}
