//! The law of stopping for test motions: however one ends, its shaft stands. Every shape of sending x every model x every way to end,
//! as `crates/master/tests/it/stopping` has it for what these are made of.
//!
//! What a stop may take is each drive's own ramp, as there.

use std::task::{Context, Poll, Waker};
use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::NodeId;
use devices::HostWatch;
use host::capture::{Measurand, Restorer, Wanted};
use host::test_motion::{Motion, Run, Shape, points, run};
use master::cyclic::CyclicOptions;
use master::drive::SwitchedOff;
use master::group::AxisLimits;
use master::units::{Ramp, Rpm};
use master::{Drive, Network};
use sim::machine::{Order, order};
use sim::{Place, StationId, Stimulus, World, block_on, block_on_for};
use words::failure::Failure;

#[path = "../../../master/tests/it/stopping/process.rs"]
mod process;
use process::Process;

const NODE: u8 = 4;
const PERIOD: Duration = Duration::from_millis(10);
const FROZEN: Duration = Duration::from_secs(4);

#[derive(Clone, Copy, Debug, PartialEq)]
enum End {
    /// What a command does at a signal.
    StopAll,
    /// The guard of the library goes out of scope while the motion is still awaited.
    StopGuard,
    /// The motion is no longer awaited, and its program stops what it has moved.
    Dropped,
    Killed,
    Frozen,
    CableCut,
}

const ENDS: [End; 6] = [End::StopAll, End::StopGuard, End::Dropped, End::Killed, End::Frozen, End::CableCut];

struct Bench {
    world: World,
    network: Network,
    process: StationId,
    drive: Drive,
}

impl Bench {
    fn new(name: &str) -> Self {
        let mut world = World::new(Bitrate::M1, 11);
        let network = Network::new();
        let process = world.add_station(Process::of(&network));
        let (id, model) = (NodeId::new(NODE).unwrap(), devices::model(name).unwrap());
        world.add_drive(NODE, order(model, &Order::new(model, id, Bitrate::M1)).unwrap()).unwrap();
        world.run_until(Instant::from_secs(2));
        Self { world, process, drive: Drive::new(network.node(id), model), network }
    }

    fn run<T>(&mut self, what: impl Future<Output = T>) -> T {
        block_on(&mut self.world, what).unwrap()
    }

    /// The greatest speed within a cycle: a joint that interpolates may rest between two points.
    fn fastest(&mut self) -> f64 {
        (0..10).fold(0.0, |most: f64, _| {
            self.world.run_for(PERIOD / 10);
            most.max(self.world.report(NODE).unwrap().velocity_rpm.abs())
        })
    }

    /// How long until it has stood for a tenth of a second; `None` if it turns on.
    fn time_to_standstill(&mut self, limit: Duration) -> Option<Duration> {
        let began = self.world.now();
        let mut stood_since = None;
        while self.world.now() - began < limit {
            let stands = self.fastest() < 1.0;
            stood_since = stands.then(|| stood_since.unwrap_or(self.world.now()));
            if let Some(since) = stood_since.filter(|since| self.world.now() - *since >= Duration::from_millis(100)) {
                return Some(since - began);
            }
        }
        None
    }

    fn end(&mut self, end: End) {
        match end {
            End::StopAll | End::Dropped => {
                let network = self.network.clone();
                let stopped = self.run(network.stop_and_release());
                assert!(stopped.iter().all(|stopped| stopped.outcome.is_ok()) && !stopped.is_empty(), "{stopped:?}");
                assert!(self.fastest() < 2.0, "said to stand");
            }
            End::StopGuard => {
                drop(self.network.stop_guard());
                self.world.refresh();
            }
            End::Killed => self.world.station_mut::<Process>(self.process).unwrap().killed = true,
            End::Frozen => {
                let until = self.world.now() + FROZEN;
                self.world.station_mut::<Process>(self.process).unwrap().frozen_until = Some(until);
            }
            End::CableCut => self.world.apply(Place::node(NODE), &Stimulus::CableCut(true)).unwrap().unwrap(),
        }
    }
}

fn motion(steps: bool) -> Motion {
    if steps {
        let ramp = Some(Ramp::Time(Duration::from_millis(300)));
        return Motion::Steps { speed: Rpm(60.0), ramp, hold: Duration::from_secs(20) };
    }
    let limits = AxisLimits {
        range_turns: None,
        velocity_turns_s: 1.0,
        acceleration_turns_s2: 4.0,
        jerk_turns_s3: 40.0,
        following_error_turns: 0.5,
    };
    let shape = Shape::Ramp { velocity_turns_s: 0.9, hold_s: 20.0 };
    let points = points(&shape, &limits, PERIOD.as_secs_f64()).unwrap();
    Motion::Points { points, limits, period: PERIOD, cyclic: CyclicOptions::default() }
}

async fn moved(drive: &Drive, motion: &Motion, travel: Option<f64>, runs: &mut Vec<Run>) -> Result<(), Failure> {
    drive.guard(SwitchedOff::SwitchOn).await?;
    let quantities = vec![Measurand::named(drive, None, "velocity").await?];
    let wanted = Wanted {
        quantities,
        period: PERIOD,
        bitrate: Bitrate::M1,
        take: Vec::new(),
        // A joint has no TPDO to spare.
        by_sdo: true,
        journal: None,
        on_kept: |_| (),
    };
    run((drive, motion), (&wanted, &Restorer::of(drive)), (1, travel), runs, |_| ()).await
}

/// Looks at what a future does beside the world: once.
fn poke(future: std::pin::Pin<&mut impl Future<Output = Result<(), Failure>>>) -> Poll<Result<(), Failure>> {
    future.poll(&mut Context::from_waker(Waker::noop()))
}

#[test]
fn a_test_motion_stops_within_its_ramp_however_it_ends() {
    for name in ["zlac8030l", "m4230e17b50", "zlim42c", "cia402"] {
        let watch = devices::model(name).unwrap().host_watch;
        for steps in [true, false] {
            for end in ENDS {
                let what = format!("{name} {} {end:?}", if steps { "steps" } else { "points" });
                let mut bench = Bench::new(name);
                let (drive, motion, mut runs) = (bench.drive.clone(), motion(steps), Vec::new());
                let mut moving = Some(Box::pin(moved(&drive, &motion, None, &mut runs)));
                let began = block_on_for(&mut bench.world, Duration::from_secs(3), moving.as_mut().unwrap());
                assert!(began.is_err(), "{what}: {began:?}");
                assert!(bench.fastest() > 5.0, "{what}: {} r/min before its end", bench.fastest());
                // Beside it all others happen while the motion is still awaited.
                if matches!(end, End::StopAll | End::Dropped) {
                    moving = None;
                }
                bench.end(end);
                if let Some(moving) = moving.as_mut() {
                    let _ = poke(moving.as_mut());
                }
                let silent = matches!(end, End::Killed | End::CableCut) || end == End::Frozen && steps;
                if silent && watch == HostWatch::None {
                    assert_eq!(bench.time_to_standstill(Duration::from_secs(6)), None, "{what}: by nothing known");
                    continue;
                }
                let longest = match end {
                    End::StopAll | End::Dropped | End::StopGuard => Duration::from_secs(1),
                    End::Frozen if watch == HostWatch::None => FROZEN + Duration::from_secs(1),
                    _ => Duration::from_secs(3),
                };
                let stood = bench.time_to_standstill(Duration::from_secs(10));
                assert!(stood.is_some_and(|time| time <= longest), "{what}: {stood:?}");
                // And stays so, whatever is still sent.
                bench.world.run_for(Duration::from_secs(5));
                assert!(bench.fastest() < 1.0, "{what}: turns again at {} r/min", bench.fastest());
            }
        }
    }
}

#[test]
fn a_shaft_that_comes_too_far_is_stopped_and_points_that_would_are_refused() {
    let mut bench = Bench::new("zlac8030l");
    let (drive, mut runs) = (bench.drive.clone(), Vec::new());
    let failure = bench.run(moved(&drive, &motion(true), Some(1.5), &mut runs)).unwrap_err();
    assert_eq!(failure.kind, "travel_bound");
    let counts = bench.run(drive.node().upload(cia402::object::POSITION_ACTUAL_VALUE)).unwrap();
    let turns = f64::from(i32::from_le_bytes(counts.as_bytes().try_into().unwrap())) / 4096.0;
    // From 60 r/min within 300 ms, and what it goes until it was looked at.
    assert!((1.5..1.75).contains(&turns), "{turns}");
    assert!(bench.fastest() < 1.0 && runs.len() == 1, "{runs:?}");
    let ways = [(1, 18.4, true), (1, 17.0, false), (3, 18.4, true)];
    for (count, most, fits) in ways {
        // It comes back to where it began.
        assert_eq!(motion(false).check_travel(count, most).is_ok(), fits, "{count} {most}");
    }
    let Motion::Points { limits, period, cyclic, .. } = motion(false) else { unreachable!() };
    let onwards = Motion::Points { points: vec![0.25, 0.5], limits, period, cyclic };
    assert!(onwards.check_travel(3, 1.5).is_ok() && onwards.check_travel(4, 1.5).is_err());
}
