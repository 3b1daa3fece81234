//! The law of stopping for test motions and tuning: however one ends, its shaft stands. Every way of sending x every model x every way
//! to end, as `crates/master/tests/it/stopping` has it for what these are made of. `docs/safety.md` has the times.
//!
//! What a stop may take is each drive's own ramp, as there.

use std::task::{Context, Poll, Waker};
use std::time::Duration;

use ::tune::Objective;
use can::{Bitrate, Instant};
use canopen::NodeId;
use cia402::PowerState;
use devices::HostWatch;
use host::capture::{Measurand, Restorer, Wanted};
use host::test_motion::{Motion, Run, Shape, points, run};
use host::tune::{Bounds, Excursion, Request, loops_of, move_there_and_back, tune};
use master::cyclic::CyclicOptions;
use master::drive::SwitchedOff;
use master::group::{AxisLimits, AxisSetup, Group};
use master::units::{Ramp, Rpm};
use master::{Drive, Network};
use sim::machine::{Order, order};
use sim::{Place, StationId, Stimulus, World, block_on, block_on_for};
use words::failure::Failure;

#[path = "../../../master/tests/it/stopping/page.rs"]
mod page;
#[path = "../../../master/tests/it/stopping/process.rs"]
mod process;
use process::Process;

const NODE: u8 = 4;
const PERIOD: Duration = Duration::from_millis(10);
const FROZEN: Duration = Duration::from_secs(4);

#[derive(Clone, Copy, Debug, PartialEq)]
enum End {
    /// What a command does at a signal, and Python with a call that is given up: the motion is no longer awaited, and what it moved is
    /// stopped.
    StopAll,
    /// The guard of the library goes out of scope while the motion is still awaited.
    StopGuard,
    Killed,
    Frozen,
    CableCut,
}

const ENDS: [End; 5] = [End::StopAll, End::StopGuard, End::Killed, End::Frozen, End::CableCut];

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
            End::StopAll => {
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

fn limits() -> AxisLimits {
    AxisLimits {
        range_turns: None,
        velocity_turns_s: 1.0,
        acceleration_turns_s2: 4.0,
        jerk_turns_s3: 40.0,
        following_error_turns: 0.5,
    }
}

fn motion(steps: bool) -> Motion {
    if steps {
        let ramp = Some(Ramp::Time(Duration::from_millis(300)));
        return Motion::Steps { speed: Rpm(60.0), ramp, hold: Duration::from_secs(20) };
    }
    let limits = limits();
    let shape = Shape::Ramp { velocity_turns_s: 0.9, hold_s: 20.0 };
    let points = points(&shape, &limits, PERIOD.as_secs_f64()).unwrap();
    Motion::Points { points, limits, period: PERIOD, cyclic: CyclicOptions::default() }
}

async fn moved(drive: &Drive, motion: &Motion, travel: Option<f64>, runs: &mut Vec<Run>) -> Result<(), Failure> {
    drive.guard(SwitchedOff::SwitchOn).await?;
    moved_with(&Restorer::of(drive), (drive, motion), travel, runs).await
}

async fn moved_with(
    restorer: &Restorer,
    (drive, motion): (&Drive, &Motion),
    travel: Option<f64>,
    runs: &mut Vec<Run>,
) -> Result<(), Failure> {
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
    run((drive, motion), (&wanted, restorer), (1, travel), runs, |_| ()).await
}

/// Looks at what a future does beside the world: once.
fn poke(future: std::pin::Pin<&mut impl Future<Output = Result<(), Failure>>>) -> Poll<Result<(), Failure>> {
    future.poll(&mut Context::from_waker(Waker::noop()))
}

/// What moves.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Moved {
    Steps,
    Points,
    Tune,
    TuneMove,
}

impl Moved {
    const fn words(self) -> &'static str {
        match self {
            Self::Steps => "`test-motion` (steps)",
            Self::Points => "`test-motion` (points)",
            Self::Tune => "`tune`",
            Self::TuneMove => "`tune` (a move)",
        }
    }

    /// Whether set-points come in cycles: a program that was frozen finds that it is late.
    fn is_in_cycles(self, name: &str) -> bool {
        // A joint is turned by `velocity` while it is tuned.
        self == Self::Points || self == Self::Tune && name != "m4230e17b50"
    }

    /// Set in motion, without an end of its own in the time that is looked at, or with a target.
    async fn go(self, drive: &Drive) -> Result<(), Failure> {
        if matches!(self, Self::Steps | Self::Points) {
            return moved(drive, &motion(self == Self::Steps), None, &mut Vec::new()).await;
        }
        let request = Request {
            objective: Objective::PhaseMargin(40.0),
            with_position: false,
            period: Some(Duration::from_millis(1)),
            bounds: Bounds { speed_rpm: loops_of(drive)?.1.usual_rpm, ..Bounds::default() },
            cyclic: CyclicOptions::default(),
            torque_constant_nm_a: None,
            journal: None,
            on_kept: |_| (),
            apply: false,
            within: Duration::from_secs(60),
        };
        let restorer = Restorer::of(drive);
        if self == Self::TuneMove {
            let mut excursion = Excursion::default();
            return move_there_and_back((drive, &restorer), &request, &mut excursion).await.map(drop);
        }
        tune((drive, &restorer), &request, &(), std::future::pending()).await.map(drop)
    }
}

/// When its shaft stands after this end; `None` for never.
fn stood_after(name: &str, what: Moved, end: End) -> Option<Duration> {
    let said = format!("{name} {what:?} {end:?}");
    let mut bench = Bench::new(name);
    let drive = bench.drive.clone();
    let mut moving = Some(Box::pin(what.go(&drive)));
    let began = block_on_for(&mut bench.world, Duration::from_secs(3), moving.as_mut().unwrap());
    assert!(began.is_err(), "{said}: {began:?}");
    // A measurement goes both ways, and a joint may rest between two points: until it turns.
    for _ in 0..2000 {
        if bench.world.report(NODE).unwrap().velocity_rpm.abs() > 20.0 {
            break;
        }
        let goes_on = block_on_for(&mut bench.world, PERIOD / 10, moving.as_mut().unwrap());
        assert!(goes_on.is_err(), "{said}: {goes_on:?}");
    }
    let before = bench.world.report(NODE).unwrap().velocity_rpm.abs();
    assert!(before > 5.0, "{said}: {before} r/min before its end");
    // Asked here too: one that stands at its target before its watch acts would not show that.
    let (id, watch) = (drive.node().id(), devices::model(name).unwrap().host_watch);
    assert_eq!(bench.network.guarded(id).is_some(), watch != HostWatch::None, "{said}: its watch is armed");
    // Beside it all others happen while the motion is still awaited.
    if end == End::StopAll {
        moving = None;
    }
    let ended_at = bench.world.now();
    bench.end(end);
    if end == End::StopAll {
        // It was seen to stand.
        return Some(bench.world.now() - ended_at);
    }
    if let Some(moving) = moving.as_mut() {
        let _ = poke(moving.as_mut());
    }
    let silent = matches!(end, End::Killed | End::CableCut) || end == End::Frozen && !what.is_in_cycles(name);
    if silent && watch == HostWatch::None {
        assert_eq!(bench.time_to_standstill(Duration::from_secs(6)), None, "{said}: by nothing known");
        return None;
    }
    let longest = match end {
        End::StopAll | End::StopGuard => Duration::from_secs(1),
        End::Frozen if watch == HostWatch::None => FROZEN + Duration::from_secs(1),
        _ => Duration::from_secs(3),
    };
    let stood = bench.time_to_standstill(Duration::from_secs(10));
    assert!(stood.is_some_and(|time| time <= longest), "{said}: {stood:?}");
    // And stays so, whatever is still sent.
    bench.world.run_for(Duration::from_secs(5));
    assert!(bench.fastest() < 1.0, "{said}: turns again at {} r/min", bench.fastest());
    stood
}

#[test]
fn a_test_motion_of_a_drive_that_a_group_moves_is_refused_and_stops_nothing() {
    let mut bench = Bench::new("zlac8030l");
    let drive = bench.drive.clone();
    bench.run(async {
        let mode = AxisSetup::best_mode(&drive).unwrap();
        let axis = AxisSetup { drive: drive.clone(), mode, limits: limits() };
        let mut group = Group::open(&[axis], PERIOD, CyclicOptions::default()).await.unwrap();
        group.enable().await.unwrap();
        for is_steps in [true, false] {
            let restorer = Restorer::of(&drive);
            let (motion, mut runs) = (motion(is_steps), Vec::new());
            let refused = group.beside(moved_with(&restorer, (&drive, &motion), None, &mut runs)).await.unwrap_err();
            assert_eq!(refused.kind, "in_cycles", "{refused}");
            // What ends the program has nothing to stop for it.
            assert!(restorer.is_done() && runs.is_empty());
            assert_eq!(group.beside(restorer.restore()).await, Vec::<String>::new());
        }
        let state = group.beside(drive.state()).await.unwrap();
        assert_eq!(state.power, Some(PowerState::OperationEnabled));
        group.close().await.unwrap();
    });
}

#[test]
fn a_test_motion_and_a_tuning_stop_within_their_ramp_however_they_end() {
    let mut lines =
        vec![format!("{TABLE_BEGINS} signal, failure, given up | `StopGuard` | killed | frozen 4 s | cable |")];
    lines.push("|---|---|---|---|---|---|---|".to_owned());
    for what in [Moved::Steps, Moved::Points, Moved::Tune, Moved::TuneMove] {
        for name in ["zlac8030l", "m4230e17b50", "zlim42c", "cia402"] {
            if matches!(what, Moved::Tune | Moved::TuneMove) && devices::model(name).unwrap().axes[0].loops.is_none() {
                continue;
            }
            let cell = |end| match stood_after(name, what, end) {
                Some(time) => format!("{:.2} s", time.as_secs_f64()),
                None => "**never**".to_owned(),
            };
            lines.push(format!("| {} | {name} | {} |", what.words(), ENDS.map(cell).join(" | ")));
        }
    }
    page::compare(TABLE_BEGINS, &lines.join("\n"));
}

const TABLE_BEGINS: &str = "| motion with captures | drive |";

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
