//! What goes wrong while a group moves: a master that is late with its SYNC, a drive with a fault of its own, and a way to rest
//! that leads over a software limit. The servos are the standard's; what is true is asked of the simulated shafts.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::support::node;
use can::{Bitrate, Frame, Instant, Station};
use cia402::ModeOfOperation;
use devices::servo::CIA402;
use master::core::CycleLoss;
use master::cyclic::{CyclicOptions, Refusal};
use master::group::{AxisLimits, AxisSetup, Group, GroupError, Phase, StopCause, StreamOptions};
use master::units::Turns;
use master::{Drive, Network};
use sim::machine::{Order, order};
use sim::stimulus::Component;
use sim::{Place, Stimulus, World, block_on};

const PERIOD: Duration = Duration::from_millis(1);

/// A master's process, which may hang: then it neither sends nor hears, and SYNC stays away.
#[derive(Clone)]
struct Process {
    network: Network,
    hangs: Arc<Mutex<bool>>,
}

impl Process {
    fn hangs(&self) -> bool {
        *self.hangs.lock().unwrap()
    }
}

impl Station for Process {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        if !self.hangs() {
            self.network.handle_frame(frame, now);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if !self.hangs() {
            self.network.handle_timeout(now);
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        if self.hangs() { None } else { self.network.poll_transmit() }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        if self.hangs() { None } else { self.network.poll_timeout() }
    }
}

struct Bench {
    world: World,
    group: Group,
    hangs: Arc<Mutex<bool>>,
}

impl Bench {
    /// Three servos, enabled. Node-IDs from 1 on.
    fn new() -> Self {
        let mut world = World::new(Bitrate::M1, 7);
        let (network, hangs) = (Network::new(), Arc::new(Mutex::new(false)));
        world.add_station(Process { network: network.clone(), hangs: Arc::clone(&hangs) });
        let mut axes = Vec::new();
        for number in 1..=3 {
            let id = node(number);
            world.add_drive(number, order(&CIA402, &Order::new(&CIA402, id, Bitrate::M1)).unwrap()).unwrap();
            let limits = AxisLimits {
                range_turns: Some(-3.0..=3.0),
                velocity_turns_s: 1.0,
                acceleration_turns_s2: 5.0,
                jerk_turns_s3: 50.0,
                following_error_turns: 0.02,
            };
            let drive = Drive::new(network.node(id), &CIA402);
            axes.push(AxisSetup { drive, mode: ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION, limits });
        }
        world.run_until(Instant::from_secs(1));
        let mut group = block_on(&mut world, Group::open(&axes, PERIOD, CyclicOptions::default())).unwrap().unwrap();
        block_on(&mut world, group.enable()).unwrap().unwrap();
        Self { world, group, hangs }
    }

    /// On the way to two turns from here, at full speed.
    fn moving() -> Self {
        let mut bench = Self::new();
        let to: Vec<_> = bench.group.points().iter().map(|point| Turns(point.position_turns + 2.0)).collect();
        bench.group.start_move(&to, None).unwrap();
        for _ in 0..800 {
            bench.cycle();
        }
        // The whole speed is 1 turn/s.
        assert!(bench.rpm().iter().all(|rpm| *rpm > 55.0), "{:?}", bench.rpm());
        bench
    }

    fn cycle(&mut self) -> Phase {
        block_on(&mut self.world, self.group.cycle()).unwrap().unwrap().phase
    }

    fn rpm(&mut self) -> [f64; 3] {
        [1, 2, 3].map(|number| self.world.report(number).unwrap().velocity_rpm)
    }

    fn hang(&mut self, time: Duration) {
        *self.hangs.lock().unwrap() = true;
        self.world.run_for(time);
        *self.hangs.lock().unwrap() = false;
        self.world.refresh();
    }
}

#[test]
fn a_sync_that_is_late_by_a_cycle_delays_the_path_and_is_counted() {
    let mut bench = Bench::moving();
    let before: Vec<_> = bench.group.points().to_vec();
    // The SYNC of the next cycle is not sent; that of the one after it is in time again.
    bench.hang(Duration::from_micros(1900));
    bench.cycle();
    let state = bench.group.state();
    assert_eq!((state.cause, state.phase), (None, Phase::Moving));
    assert!((1..=2).contains(&state.missed_cycles), "{state:?}");
    // One point further, not two or three: no leap.
    for (after, before) in bench.group.points().iter().zip(&before) {
        let way = after.position_turns - before.position_turns;
        assert!((way - before.velocity_turns_s * 0.001).abs() < 1e-6, "{way}");
    }
    block_on(&mut bench.world, bench.group.rest()).unwrap().unwrap();
}

#[test]
fn a_sync_that_stays_away_stops_all_axes_and_the_late_program_is_named() {
    let mut bench = Bench::moving();
    // More than the two cycles that are tolerated.
    bench.hang(Duration::from_millis(20));
    let error = block_on(&mut bench.world, bench.group.rest()).unwrap().unwrap_err();
    let GroupError::Stopped(StopCause::Axis { refusal: Refusal::Stopped(CycleLoss::ProgramLate(cycles)), .. }) = error
    else {
        panic!("{error}");
    };
    assert!((15..=20).contains(&cycles), "{cycles}");
    for _ in 0..500 {
        bench.cycle();
    }
    assert!(bench.rpm().iter().all(|rpm| rpm.abs() < 0.5), "{:?}", bench.rpm());
}

#[test]
fn a_drive_with_a_fault_of_its_own_is_reported_with_its_text_and_the_others_stop_together() {
    let mut bench = Bench::moving();
    let broken = Stimulus::Fault(Component::Encoder, true);
    bench.world.apply(Place::node(2), &broken).unwrap().unwrap();
    let error = block_on(&mut bench.world, bench.group.rest()).unwrap().unwrap_err();
    let GroupError::Stopped(StopCause::Axis { axis: 2, refusal: Refusal::Fault(_), .. }) = error else {
        panic!("{error}");
    };
    let rest = bench.group.points().to_vec();
    // The two that are well have gone the same way, and stand.
    let [first, .., third] = &rest[..] else { panic!("{rest:?}") };
    assert!((first.position_turns - third.position_turns).abs() < 1e-9, "{rest:?}");
    // 7305h is "incremental sensor 1" of CiA 402-2, table 24; the standard's servo calls it by its own table.
    let missed = bench.group.state().missed_cycles;
    let said = block_on(&mut bench.world, bench.group.explain_stop()).unwrap().unwrap().to_string();
    assert!(said.contains("7305h") && said.contains("encoder"), "{said}");
    // The question did not cost a cycle.
    assert_eq!(bench.group.state().missed_cycles, missed);
    for _ in 0..100 {
        bench.cycle();
    }
    let [left, _, right] = bench.rpm();
    assert!(left.abs() < 0.5 && right.abs() < 0.5, "{left} {right}");
}

/// Two programs that command one machine: what the other one did is named, and not the load or the cable of the drive.
#[test]
fn what_another_master_commands_is_named_as_the_cause() {
    for (frame, causes) in [
        // A quick stop (CiA 402-2, 8.4.1): the drive shows it.
        (
            "602#2B40600002000000",
            ["is in Switch on disabled: another master wrote 2h to 6040h:00", "Find out who else commands it"],
        ),
        // Max torque: it lags behind.
        (
            "602#2B72600000000000",
            ["It was commanded otherwise: another master wrote 0h to 6072h:00", "6072h:00 written by another master"],
        ),
        // NMT enter pre-operational: its TPDO stays away.
        (
            "000#8002",
            ["It was commanded otherwise: an NMT command has taken its node to pre-operational", "no PDO comes"],
        ),
    ] {
        let mut bench = Bench::moving();
        let probe = bench.world.add_probe();
        bench.world.send(probe, frame.parse().unwrap()).unwrap();
        let error = block_on(&mut bench.world, bench.group.rest()).unwrap().unwrap_err();
        assert!(matches!(error, GroupError::Stopped(_)), "{frame}: {error}");
        let said = block_on(&mut bench.world, bench.group.explain_stop()).unwrap().unwrap().to_string();
        assert!(causes.iter().all(|cause| said.contains(cause)), "{frame}: {error}: {said}");
    }
    // A word that keeps it enabled stops nothing, and is not what is named.
    let mut bench = Bench::moving();
    let probe = bench.world.add_probe();
    bench.world.send(probe, "602#2B4060000F000000".parse().unwrap()).unwrap();
    bench.cycle();
    bench.world.send(probe, "000#8002".parse().unwrap()).unwrap();
    let _ = block_on(&mut bench.world, bench.group.rest()).unwrap().unwrap_err();
    let said = block_on(&mut bench.world, bench.group.explain_stop()).unwrap().unwrap().to_string();
    assert!(said.contains("It was commanded otherwise: an NMT command"), "{said}");
    // A shaft that is held was commanded by one master alone.
    let mut bench = Bench::moving();
    bench.world.apply(Place::node(2), &"rotor lock".parse().unwrap()).unwrap().unwrap();
    let error = block_on(&mut bench.world, bench.group.rest()).unwrap().unwrap_err();
    assert!(matches!(error, GroupError::Stopped(StopCause::FollowingError { axis: 2, .. })), "{error}");
    assert!(block_on(&mut bench.world, bench.group.explain_stop()).unwrap().is_none());
}

#[test]
fn no_stop_leads_over_a_software_limit() {
    let mut bench = Bench::new();
    let from = bench.group.points().iter().map(|point| point.position_turns).collect::<Vec<_>>();
    let to: Vec<_> = from.iter().map(|_| Turns(2.0)).collect();
    block_on(&mut bench.world, bench.group.move_to(&to, None)).unwrap().unwrap();
    bench.group.start_stream(StreamOptions { prefill: 1, ..StreamOptions::default() }).unwrap();
    // 5 turns/s^2 up to 1 turn/s, then on at that speed up to the limit; the producer ends there without a word.
    let (mut at, mut speed) = (2.0, 0.0_f64);
    let mut highest = 0.0_f64;
    for _ in 0..2000 {
        if bench.group.stream().is_some_and(|stream| stream.room() > 0) {
            speed = (speed + 0.005).min(1.0);
            if at + speed * 0.001 < 3.0 {
                at += speed * 0.001;
                bench.group.push(&[Turns(at); 3]).unwrap();
            }
        }
        bench.cycle();
        highest = bench.group.points().iter().fold(highest, |highest, point| highest.max(point.position_turns));
    }
    assert!(highest > 2.99 && highest <= 3.0, "{highest}");
    assert!(matches!(bench.group.state().cause, Some(StopCause::Underrun { .. })), "{:?}", bench.group.state());
    assert!(bench.rpm().iter().all(|rpm| rpm.abs() < 0.5), "{:?}", bench.rpm());
    assert_eq!(bench.group.state().phase, Phase::Holding);
}
