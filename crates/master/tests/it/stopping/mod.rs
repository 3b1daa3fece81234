//! The law of stopping: whatever this program has set in motion, by whichever intent, stops when the program ends it, and is
//! said to stand only when it stands. Every way to move x every model that has it x every way to end.
//!
//! What a stop may take is each drive's own ramp: 6085h of the ZL drives in ms from their highest speed (quick start guide
//! V1.00, chapter 9; user manual V1.03, 5.4), 2000 (r/min)/s and more of the others.

mod another_master;
mod blind;
mod everything;
mod page;
mod process;
mod second_try;
mod stream;

use std::time::Duration;

use can::{Bitrate, Instant};
use cia402::ModeOfOperation;
use devices::{Description, HostWatch, model};
use master::base::{Base, BaseLimits, Geometry, Twist, WheelSetup};
use master::cyclic::CyclicOptions;
use master::drive::{HomingOptions, MotionOptions, StopGuard, SwitchedOff};
use master::group::{AxisLimits, AxisSetup, Group};
use master::units::{Amperes, Ramp, Rpm, Turns};
use master::{Drive, Error, Network};
use sim::machine::{Order, order};

use sim::{Place, StationId, Stimulus, World, block_on};

use crate::support::{INVERTER, node};
use process::Process;

/// The nodes of one model, two of them: a group and a base have two axes.
const NODES: [u8; 2] = [1, 2];

const PERIOD: Duration = Duration::from_millis(10);

struct Bench {
    world: World,
    network: Network,
    process: StationId,
    drives: [Drive; 2],
    moving: Vec<u8>,
}

impl Bench {
    fn new(name: &str) -> Self {
        let mut world = World::new(Bitrate::M1, 11);
        let network = Network::new();
        let process = world.add_station(Process::of(&network));
        let description = described(name);
        let drives = NODES.map(|number| {
            let id = node(number);
            world.add_drive(number, order(description, &Order::new(description, id, Bitrate::M1)).unwrap()).unwrap();
            Drive::new(network.node(id), description)
        });
        world.run_until(Instant::from_secs(2));
        Self { world, network, process, drives, moving: Vec::new() }
    }

    fn run<T>(&mut self, what: impl Future<Output = T>) -> T {
        block_on(&mut self.world, what).unwrap()
    }

    fn process(&mut self) -> &mut Process {
        self.world.station_mut(self.process).unwrap()
    }

    fn speed(&mut self, number: u8) -> f64 {
        self.world.report(number).unwrap().velocity_rpm
    }

    /// The fastest of those that were set in motion, within a cycle: a joint that interpolates may rest between two points.
    fn fastest(&mut self) -> f64 {
        let mut most = 0.0_f64;
        for _ in 0..10 {
            for number in self.moving.clone() {
                most = most.max(self.speed(number).abs());
            }
            self.world.run_for(PERIOD / 10);
        }
        most
    }

    /// How long until all have stood for a tenth of a second, from now on; `None` if they turn on.
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
}

fn options() -> MotionOptions {
    let ramp = Some(Ramp::Time(Duration::from_millis(300)));
    MotionOptions {
        speed: Some(Rpm(60.0)),
        acceleration: ramp,
        deceleration: ramp,
        wait: false,
        ..MotionOptions::default()
    }
}

/// A way to set drives in motion. What it holds on to keeps them moving.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Motion {
    Velocity,
    Move,
    Torque,
    Home,
    GroupMove,
    /// A stream of points, as of a recorded path.
    GroupFollow,
    Base,
}

const MOTIONS: [Motion; 7] = [
    Motion::Velocity,
    Motion::Move,
    Motion::Torque,
    Motion::Home,
    Motion::GroupMove,
    Motion::GroupFollow,
    Motion::Base,
];

enum Moving {
    Alone,
    Group(Box<Group>),
    Base(Box<Base>),
}

impl Bench {
    /// Sets it in motion, and lets it turn for a second. `None` where the model has no such motion.
    fn set_in_motion(&mut self, motion: Motion) -> Option<Moving> {
        let [drive, _] = self.drives.clone();
        self.moving = vec![NODES[0]];
        let moved = match motion {
            Motion::Velocity => self.run(drive.velocity(Rpm(60.0), options())).map(drop),
            Motion::Move => self.run(drive.move_relative(Turns(100.0), options())).map(drop),
            Motion::Torque => self.run(drive.torque(Amperes(0.5))).map(drop),
            Motion::Home => self.start_homing(&drive),
            Motion::GroupMove | Motion::GroupFollow => {
                return self.group(motion).map(|group| Moving::Group(Box::new(group)));
            }
            Motion::Base => return self.base().map(|base| Moving::Base(Box::new(base))),
        };
        match moved {
            Err(Error::NoSuchMode { .. } | Error::NoSuchQuantity { .. }) => return None,
            other => other.unwrap(),
        }
        self.world.run_for(Duration::from_secs(1));
        Some(Moving::Alone)
    }

    fn start_homing(&mut self, drive: &Drive) -> Result<(), Error> {
        // Looks for a switch that is not there, as long as it is let.
        let method = drive.axis_description().and_then(|axis| axis.homing).map_or(17, |_| 17);
        let homing = drive.axis_description().and_then(|axis| axis.homing);
        let speed = homing.and_then(|homing| homing.search_speed).map(|_| Rpm(60.0));
        self.run(drive.home(method, HomingOptions { wait: false, speed, ..HomingOptions::default() })).map(drop)
    }

    fn group(&mut self, motion: Motion) -> Option<Group> {
        self.moving = NODES.to_vec();
        AxisSetup::best_mode(&self.drives[0]).ok()?;
        let axes = self.drives.clone().map(|drive| {
            let mode = AxisSetup::best_mode(&drive).unwrap();
            let limits = AxisLimits {
                range_turns: None,
                velocity_turns_s: 1.0,
                acceleration_turns_s2: 4.0,
                jerk_turns_s3: 40.0,
                following_error_turns: 0.5,
            };
            AxisSetup { drive, mode, limits }
        });
        let mut group = self.run(Group::open(&axes, PERIOD, CyclicOptions::default())).unwrap();
        self.run(group.enable()).unwrap();
        if motion == Motion::GroupFollow {
            stream::start(&mut group);
        } else {
            let to: Vec<_> = group.points().iter().map(|point| Turns(point.position_turns + 100.0)).collect();
            group.start_move(&to, None).unwrap();
        }
        for _ in 0..150 {
            self.run(group.cycle()).unwrap();
        }
        assert_eq!(group.state().cause, None, "{}", self.drives[0].description().unwrap().name);
        Some(group)
    }

    fn base(&mut self) -> Option<Base> {
        self.moving = NODES.to_vec();
        let modes = self.drives[0].axis_description().unwrap().modes;
        let mode = [ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY, ModeOfOperation::PROFILE_VELOCITY]
            .into_iter()
            .find(|mode| modes.contains(mode))?;
        let wheels = self.drives.clone().map(|drive| WheelSetup { drive, mode, turns: 1.0 });
        let geometry = Geometry { wheel_base_m: 0.4, wheel_radius_m: 0.1 };
        let limits = BaseLimits {
            linear_m_s: 0.8,
            angular_rad_s: 2.0,
            wheel_m_s: 0.8,
            wheel_m_s2: 2.0,
            watchdog: Duration::from_millis(200),
            lag_m: 0.2,
        };
        let [left, right] = &wheels;
        let mut base = self.run(Base::open([left, right], geometry, limits, PERIOD, CyclicOptions::default())).ok()?;
        self.run(base.enable()).unwrap();
        for _ in 0..150 {
            base.command(Twist { linear_m_s: 0.6, angular_rad_s: 0.0 }).unwrap();
            self.run(base.cycle()).unwrap();
        }
        Some(base)
    }
}

/// A way for a program to end a motion, or to be ended.
#[derive(Clone, Copy, Debug, PartialEq)]
enum End {
    /// What a command does at a signal, and a network of a program that is closed.
    StopAll,
    /// The guard of the library goes out of scope, and the program lives on.
    StopGuard,
    /// The program ends everything, and leaves the bus.
    Close,
    /// Another program stops everything on the bus, and this one goes on with what it does.
    Everything,
    /// The program no longer steps what moves, and lives on.
    Forgotten,
    Killed,
    Frozen,
    CableCut,
}

const ENDS: [End; 8] = [
    End::StopAll,
    End::StopGuard,
    End::Close,
    End::Everything,
    End::Forgotten,
    End::Killed,
    End::Frozen,
    End::CableCut,
];

/// How long a frozen program does not run.
const FROZEN: Duration = Duration::from_secs(4);

/// What software cannot stop: a model without a watch over its host, whose host no longer talks. A program that was frozen finds
/// that it is late where it gives set-points in cycles.
fn is_beyond_software(name: &str, motion: Motion, end: End) -> bool {
    let in_cycles = matches!(motion, Motion::GroupMove | Motion::GroupFollow | Motion::Base);
    let silent = matches!(end, End::Killed | End::CableCut) || end == End::Frozen && !in_cycles;
    silent && described(name).host_watch == HostWatch::None
}

/// A model, or an inverter.
fn described(name: &str) -> &'static Description {
    if name == INVERTER.name { *INVERTER } else { model(name).unwrap() }
}

fn models() -> impl Iterator<Item = &'static str> {
    ["zlac8030l", "m4230e17b50", "zlim42c", "cia402"].into_iter()
}

#[test]
fn whatever_moves_stops_within_its_ramp_however_its_program_ends() {
    let mut times = Vec::new();
    for name in models().chain([INVERTER.name]) {
        for motion in MOTIONS {
            for end in ENDS {
                let mut bench = Bench::new(name);
                for drive in bench.drives.clone() {
                    bench.run(drive.guard(SwitchedOff::SwitchOn)).unwrap();
                }
                // A model without this motion has it with no other end either.
                let Some(moving) = bench.set_in_motion(motion) else { break };
                let speed = bench.fastest();
                assert!(speed > 5.0, "{name} {motion:?}: {speed} r/min before its end");
                let stood = bench.end((name, motion, end), moving, speed);
                times.push(((name, motion), end, stood));
            }
        }
    }
    page::compare(TABLE_BEGINS, &table(&times));
}

const TABLE_BEGINS: &str = "| motion | drive |";

/// What the page has: how long after each end the shaft stands.
fn table(times: &[((&'static str, Motion), End, Stood)]) -> String {
    let columns =
        [End::StopAll, End::StopGuard, End::Everything, End::Forgotten, End::Killed, End::Frozen, End::CableCut];
    let mut lines = vec![
        format!(
            "{TABLE_BEGINS} signal, failure, `close` | `StopGuard` | `estop` | no longer stepped | killed | frozen 4 s | cable |"
        ),
        "|---|---|---|---|---|---|---|---|---|".to_owned(),
    ];
    let mut rows: Vec<(&str, Motion)> = times.iter().map(|(row, ..)| *row).collect();
    rows.dedup();
    rows.sort_by_key(|(_, motion)| MOTIONS.iter().position(|other| other == motion));
    for row in rows {
        let cell = |end: &End| match times.iter().find(|(of, other, _)| *of == row && other == end) {
            Some((.., Stood::After(time))) => format!("{:.2} s", time.as_secs_f64()),
            Some((.., Stood::Never)) => "**never**".to_owned(),
            Some((.., Stood::AsAsked)) | None => "goes on, as asked".to_owned(),
        };
        let cells: Vec<_> = columns.iter().map(cell).collect();
        lines.push(format!("| {} | {} | {} |", row.1.words(), row.0, cells.join(" | ")));
    }
    lines.join("\n")
}

impl Motion {
    const fn words(self) -> &'static str {
        match self {
            Self::Velocity => "`velocity`",
            Self::Move => "`move`",
            Self::Torque => "`torque`",
            Self::Home => "`home`",
            Self::GroupMove => "`group move`",
            Self::GroupFollow => "`group follow`, a stream of points",
            Self::Base => "`drive-base`",
        }
    }
}

/// What became of a motion after its end.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stood {
    After(Duration),
    Never,
    /// It was asked to go on alone.
    AsAsked,
}

/// The last set-points may still be on their way, may wait in the drive for SYNC, or have been taken.
#[test]
fn a_stop_is_not_taken_back_by_set_points_that_were_sent_before_it() {
    for name in models() {
        for motion in [Motion::GroupMove, Motion::Base] {
            for end in [End::StopAll, End::StopGuard] {
                for after in [0, 1, 5, 9] {
                    let mut bench = Bench::new(name);
                    let Some(mut moving) = bench.set_in_motion(motion) else { break };
                    let speed = bench.fastest();
                    for _ in 0..3 {
                        bench.step(&mut moving);
                    }
                    bench.world.run_for(Duration::from_millis(after));
                    bench.end((name, motion, end), moving, speed);
                }
            }
        }
    }
}

impl Bench {
    /// One cycle of what is moved in cycles.
    fn step(&mut self, moving: &mut Moving) {
        match moving {
            Moving::Alone => {}
            Moving::Group(group) => drop(self.run(group.cycle()).unwrap()),
            Moving::Base(base) => {
                base.command(Twist { linear_m_s: 0.6, angular_rad_s: 0.0 }).unwrap();
                let _ = self.run(base.cycle()).unwrap();
            }
        }
    }

    fn end(&mut self, (name, motion, end): (&str, Motion, End), moving: Moving, speed: f64) -> Stood {
        let what = format!("{name} {motion:?} {end:?}");
        let network = self.network.clone();
        let mut kept = None;
        let mut said = None;
        let ended_at = self.world.now();
        match end {
            End::StopAll | End::Close => {
                let began = self.world.now();
                let stopped = self.run(network.stop_and_release());
                assert_eq!(stopped.len(), self.moving.len(), "{what}");
                for stopped in &stopped {
                    let time = stopped.outcome.as_ref().unwrap_or_else(|_| panic!("{what}: {stopped:?}"));
                    said = said.max(Some(*time));
                }
                assert!(self.fastest() < 2.0, "{what}: said to stand at {} r/min", self.fastest());
                assert!(network.moved().is_empty(), "{what}");
                assert!(self.world.now() - began < Duration::from_secs(2), "{what}");
                if end == End::Close {
                    network.fall_silent();
                }
                drop(moving);
            }
            End::StopGuard => {
                let guard: StopGuard = network.stop_guard();
                drop(guard);
                self.world.refresh();
                kept = Some(moving);
            }
            End::Everything => (said, kept) = self.stop_everything(moving, &what),
            // A motion that goes on alone is what its program asked for.
            End::Forgotten if matches!(moving, Moving::Alone) => return Stood::AsAsked,
            End::Forgotten => drop(moving),
            End::Killed => self.process().killed = true,
            End::Frozen => {
                let until = self.world.now() + FROZEN;
                self.process().frozen_until = Some(until);
            }
            End::CableCut => {
                for number in self.moving.clone() {
                    self.world.apply(Place::node(number), &Stimulus::CableCut(true)).unwrap().unwrap();
                }
            }
        }
        if is_beyond_software(name, motion, end) {
            assert_eq!(self.time_to_standstill(Duration::from_secs(8)), None, "{what}: stopped by nothing known");
            return Stood::Never;
        }
        let watch = match end {
            End::StopAll | End::StopGuard | End::Close | End::Everything => Duration::ZERO,
            // The patience of the master's own supervision: two cycles, and the one that has begun.
            End::Forgotten => 4 * PERIOD,
            End::Frozen if described(name).host_watch == HostWatch::None => FROZEN,
            _ => Duration::from_secs(2),
        };
        if watch.is_zero() {
            self.world.run_for(Duration::from_millis(100));
            let after = self.fastest();
            assert!(after < 0.95 * speed || after < 1.0, "{what}: {after} r/min 100 ms later, {speed} before");
        }
        let waited = self.world.now() - ended_at;
        let stood = self.time_to_standstill(Duration::from_secs(10));
        assert!(stood.is_some_and(|time| time <= watch + Duration::from_secs(1)), "{what}: {stood:?}");
        // And stays so, whatever is still sent: longer than any watch waits, and than a frozen program sleeps.
        self.world.run_for(Duration::from_secs(if end == End::Frozen { 6 } else { 3 }));
        assert!(self.fastest() < 1.0, "{what}: turns again at {} r/min", self.fastest());
        drop(kept);
        Stood::After(said.unwrap_or(waited + stood.unwrap()))
    }
}

#[test]
fn a_program_that_was_frozen_reports_it_and_does_not_set_a_drive_going_again() {
    for name in models().filter(|name| model(name).unwrap().host_watch != HostWatch::None) {
        let mut bench = Bench::new(name);
        let [drive, _] = bench.drives.clone();
        bench.run(drive.guard(SwitchedOff::SwitchOn)).unwrap();
        bench.run(drive.velocity(Rpm(60.0), MotionOptions { wait: true, ..options() })).unwrap();
        bench.moving = vec![NODES[0]];
        let until = bench.world.now() + FROZEN;
        bench.process().frozen_until = Some(until);
        let error = bench.run(drive.supervise(Duration::from_secs(10))).unwrap_err();
        assert!(error.to_string().contains("This program did not run for 4."), "{name}: {error}");
        assert!(bench.fastest() < 1.0, "{name}");
        let stopped = bench.run(bench.network.clone().stop_and_release());
        assert!(stopped.iter().all(|stopped| stopped.outcome.is_ok()), "{name}: {stopped:?}");
        bench.world.run_for(Duration::from_secs(6));
        assert!(bench.fastest() < 1.0, "{name}");
    }
}

#[test]
fn a_drive_that_was_not_seen_to_stand_keeps_its_watch_and_is_reported_as_moving() {
    for name in models() {
        let mut bench = Bench::new(name);
        let [drive, other] = bench.drives.clone();
        for drive in [&drive, &other] {
            bench.run(drive.guard(SwitchedOff::SwitchOn)).unwrap();
            bench.run(drive.velocity(Rpm(60.0), MotionOptions { wait: true, ..options() })).unwrap();
        }
        bench.world.apply(Place::node(NODES[0]), &Stimulus::CableCut(true)).unwrap().unwrap();
        let began = bench.world.now();
        let stopped = bench.run(bench.network.clone().stop_and_release());
        let outcomes: Vec<_> = stopped.iter().map(|stopped| stopped.outcome.is_ok()).collect();
        assert_eq!(outcomes, [false, true], "{name}: {stopped:?}");
        // The dead one costs the other no time: its own ramp of 300 ms, and some looks.
        assert!(bench.world.now() - began < Duration::from_secs(2), "{name}");
        assert!(bench.network.moved().contains(node(NODES[0])) && !bench.network.moved().contains(node(NODES[1])));
        // Its cable is fixed. What keeps it content has ended, and it has stopped by itself where it has a watch.
        bench.world.run_for(Duration::from_secs(3));
        bench.world.apply(Place::node(NODES[0]), &Stimulus::CableCut(false)).unwrap().unwrap();
        bench.world.run_for(Duration::from_secs(3));
        bench.moving = vec![NODES[0]];
        let has_watch = model(name).unwrap().host_watch != HostWatch::None;
        assert_eq!(bench.fastest() < 1.0, has_watch, "{name}");
    }
}

/// As a command does it: the motion fails, what stopped it is asked, all is closed, and what may still move is stopped.
#[test]
fn after_a_failure_with_a_dead_drive_everything_ends_soon_after_the_others_stand() {
    for name in models() {
        for motion in [Motion::GroupMove, Motion::Base] {
            let mut bench = Bench::new(name);
            for drive in bench.drives.clone() {
                bench.run(drive.guard(SwitchedOff::SwitchOn)).unwrap();
            }
            let Some(mut moving) = bench.set_in_motion(motion) else { continue };
            bench.world.apply(Place::node(NODES[1]), &Stimulus::CableCut(true)).unwrap().unwrap();
            let cut_at = bench.world.now();
            let failed = |moving: &Moving| match moving {
                Moving::Alone => false,
                Moving::Group(group) => group.state().cause.is_some(),
                Moving::Base(base) => base.state().cause.is_some(),
            };
            while !failed(&moving) {
                match &mut moving {
                    Moving::Base(base) => {
                        let _ = base.command(Twist { linear_m_s: 0.6, angular_rad_s: 0.0 });
                        let _ = bench.run(base.cycle()).unwrap();
                    }
                    Moving::Group(group) => drop(bench.run(group.cycle()).unwrap()),
                    Moving::Alone => {}
                }
                assert!(bench.world.now() - cut_at < Duration::from_millis(200), "{name} {motion:?}");
            }
            match moving {
                Moving::Base(mut base) => {
                    bench.run(base.stop()).unwrap_err();
                    bench.run(base.explain_stop());
                    let _ = bench.run(base.close());
                }
                Moving::Group(mut group) => {
                    bench.run(group.rest()).unwrap_err();
                    bench.run(group.explain_stop());
                    let _ = bench.run(group.close());
                }
                Moving::Alone => {}
            }
            let stopped = bench.run(bench.network.clone().stop_and_release());
            assert!(stopped.iter().any(|stopped| stopped.node == node(NODES[1]) && stopped.outcome.is_err()));
            // Both ways to rest within the limits take 0.3 s at least: 0.6 m/s at 2 m/s^2, 1 turn/s at 4 turns/s^2 and 40 turns/s^3.
            let ended = bench.world.now() - cut_at;
            assert!(ended < Duration::from_millis(300 + 1000), "{name} {motion:?}: {ended:?}");
            assert!(bench.speed(NODES[0]).abs() < 1.0, "{name} {motion:?}");
        }
    }
}
