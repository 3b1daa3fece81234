//! A world does the same on any number of threads: frame by frame at its nanosecond, event by event, and shaft by shaft at
//! its bit.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use can::{Bitrate, CanId, Frame, Instant};
use canopen::NodeId;
use plant::coupled::DifferentialDriveModel;
use sim::fault::{Babble, Corruption, Delay, NodeFaults};
use sim::machine::{Order, Realism, TimingMode, order};
use sim::recorder::{Channel, Recorder, Signal};
use sim::{CoupledShaft, Coupling, Digest, Place, Prng, StationId, Stimulus, World};

use crate::common::{Chatter, TestDrive};

const MODELS: [&str; 5] = ["zlac8030l", "m4230e17b50", "zlim42c", "cia402", "zlim42c-82"];

/// A world of so many drives of all kinds, with a host that sends SYNC each millisecond.
fn world_of(drives: u8, seed: u64) -> (World, StationId) {
    let mut world = World::new(Bitrate::M1, seed);
    world.watch(true);
    let host = world.add_probe();
    let sync = Frame::new(CanId::standard(0x80), &[]);
    world.add_station(Chatter::new(sync, Instant::from_millis(5), Duration::from_millis(1)));
    for node in 1..=drives {
        let timing = if node % 7 == 0 { TimingMode::Device } else { TimingMode::Ideal };
        world.set_timing(timing);
        // The switches and the object of a ZLIM42-C have no 16 to 31.
        let kinds = if (16..32).contains(&node) { &MODELS[..2] } else { &MODELS[..] };
        let description = devices::model(kinds[usize::from(node) % kinds.len()]).expect("a model");
        let id = NodeId::new(node).expect("a node-ID");
        let drive = order(description, &Order::new(description, id, Bitrate::M1)).expect("a machine");
        world.add_drive(node, drive).expect("numbers differ");
        if node % 5 == 0 {
            world.set_realism(node, Realism::Full).expect("it was added");
        }
    }
    (world, host)
}

/// The batch is done to its end, and all drives come back: who catches the panic finds each of them where it was.
#[test]
fn a_drive_that_panics_takes_no_other_with_it() {
    let mut world = World::new(Bitrate::K500, 1);
    world.set_threads(3);
    let host = world.add_probe();
    for node in 1..=30 {
        let mut drive = Box::new(TestDrive::new(node));
        drive.powered = true;
        world.add_drive(node, drive).expect("numbers differ");
    }
    let sync = |world: &mut World| {
        world.send(host, Frame::new(CanId::standard(0x80), &[])).expect("there is room");
        catch_unwind(AssertUnwindSafe(|| world.run_for(Duration::from_millis(1))))
    };
    sync(&mut world).expect("nothing is wrong");
    world.apply(Place::node(7), &Stimulus::LoadTorque(f64::NAN)).expect("it is there").expect("it is taken");
    let panic = sync(&mut world).expect_err("node 7 panics");
    assert_eq!(panic.downcast_ref::<&str>(), Some(&"a drive has panicked; this world cannot go on"));
    let numbers: Vec<u8> = world.drive_numbers().collect();
    assert_eq!(numbers, (1..=30).collect::<Vec<_>>());
    world.apply(Place::node(7), &Stimulus::LoadTorque(0.0)).expect("it is there").expect("it is taken");
    sync(&mut world).expect("the next batch is done too");
}

/// Nodes 5 and 10 (hub servos) move a base.
fn couple(world: &mut World) {
    let base = DifferentialDriveModel {
        mass_kg: 30.0,
        yaw_inertia_kg_m2: 1.5,
        wheel_base_m: 0.5,
        wheel_radius_m: 0.0865,
        rolling: 0.01,
        grip: Some(0.8),
        weight_share: 1.0,
        slope_rad: 0.0,
        uphill_rad: 0.0,
    };
    let shafts = [5, 10].map(|node| CoupledShaft::direct(Place::node(node)));
    world.couple("base", &Coupling::DifferentialDrive(base), &shafts).expect("two free shafts");
}

/// Profile velocity at 100 r/min, as far as each of them takes that; some answer late, and lose each other's frames.
fn start(world: &mut World, host: StationId, drives: u8) {
    let writes: [[u8; 8]; 6] = [
        [0x2B, 0x00, 0x20, 0, 0, 0, 0, 0],
        [0x2F, 0x60, 0x60, 0, 3, 0, 0, 0],
        [0x2B, 0x40, 0x60, 0, 0x06, 0, 0, 0],
        [0x2B, 0x40, 0x60, 0, 0x07, 0, 0, 0],
        [0x2B, 0x40, 0x60, 0, 0x0F, 0, 0, 0],
        [0x23, 0xFF, 0x60, 0, 100, 0, 0, 0],
    ];
    for data in writes {
        for node in 1..=drives {
            let request = Frame::full(CanId::standard(0x600 + u16::from(node)), data);
            world.send(host, request).expect("the probe has room");
        }
        world.run_for(Duration::from_millis(3 + u64::from(drives) / 4));
    }
}

/// What random hands do at it, some of them to the wire.
fn disturb(world: &mut World, drives: u8, prng: &mut Prng) {
    const HANDS: [&str; 8] = [
        "load torque 0.4",
        "load torque 0",
        "rotor lock",
        "rotor free",
        "supply 30",
        "power cycle",
        "fault encoder on",
        "fault encoder off",
    ];
    let node = 1 + prng.below(u64::from(drives)) as u8;
    let id = world.drive_id(node).expect("it was added");
    match prng.below(8) {
        0 => world.cut(id),
        1 => world.join(id),
        2 => {
            let late = Some(Delay { min_ns: 0, max_ns: prng.below(300_000) });
            world.set_node_faults(id, NodeFaults { late, ..NodeFaults::default() });
        }
        3 => {
            let babble = Some(Babble { frame: Frame::new(CanId::standard(0x7FF), &[]), gap_ns: 400_000 });
            world.set_node_faults(id, NodeFaults { babble, ..NodeFaults::default() });
        }
        4 => world.set_corruption(Corruption::with_probability(prng.below(3) as f64 * 0.02)),
        _ => {
            let words = HANDS[prng.below(HANDS.len() as u64) as usize];
            let stimulus = words.parse().expect("a stimulus");
            let _ = world.apply(Place::node(node), &stimulus).expect("it was added");
        }
    }
}

/// All that came of it: digest, events, what can be measured at each drive, samples.
fn run(drives: u8, threads: usize, joined: bool, recorded: bool) -> (Digest, Vec<String>) {
    let (mut world, host) = world_of(drives, 11);
    world.set_threads(threads);
    if joined {
        couple(&mut world);
    }
    if recorded {
        let channels = (1..=drives).map(|node| Channel { place: Place::node(node), signal: Signal::Velocity });
        world.start_recording(Recorder::new(Duration::from_micros(700), channels));
    }
    start(&mut world, host, drives);
    let mut prng = Prng::new(5);
    for _ in 0..12 {
        disturb(&mut world, drives, &mut prng);
        world.run_for(Duration::from_nanos(prng.below(2_000_000)));
    }
    // A copy goes on the same, with threads of its own.
    let mut world = world.snapshot();
    world.run_for(Duration::from_millis(5));
    let mut seen: Vec<String> = std::iter::from_fn(|| world.poll_event()).map(|event| format!("{event:?}")).collect();
    seen.extend((1..=drives).map(|node| format!("{:?}", world.report(node).expect("it was added"))));
    seen.extend(world.stop_recording().map(|recorder| format!("{recorder:?}")));
    (world.digest(), seen)
}

fn is_the_same_on(threads: &[usize], drives: u8, joined: bool, recorded: bool) {
    let (digest, seen) = run(drives, 1, joined, recorded);
    for threads in threads {
        let (again, seen_again) = run(drives, *threads, joined, recorded);
        let differs = seen.iter().zip(&seen_again).find(|(one, many)| one != many);
        assert_eq!(differs, None, "{drives} drives on {threads} threads");
        assert_eq!((seen_again.len(), again), (seen.len(), digest), "{drives} drives on {threads} threads");
    }
}

#[test]
fn twenty_drives_of_all_kinds_do_the_same_on_any_number_of_threads() {
    is_the_same_on(&[2, 3], 20, true, true);
}

#[test]
fn a_full_bus_of_drives_does_the_same_on_any_number_of_threads() {
    is_the_same_on(&[2, 3], 127, true, false);
}

#[test]
fn a_world_has_as_many_threads_as_it_is_given_and_one_at_least() {
    let mut world = World::new(Bitrate::M1, 1);
    assert_eq!(world.threads(), 1);
    world.set_threads(0);
    assert_eq!(world.threads(), 1);
    world.set_threads(3);
    assert_eq!(world.threads(), 3);
    assert_eq!(world.snapshot().threads(), 3);
}
