//! Which model a node is: what its identity and its objects show, and what a master does with a guess.

use std::future::poll_fn;
use std::pin::pin;
use std::time::Duration;

use crate::support::toy::Toy;
use crate::support::{Bus, mux, node};
use can::{Bitrate, Instant};
use canopen::NmtState;
use devices::all;
use drives::mjoint::Model;
use master::drive::MotionOptions;
use master::identify::{Found, Guess, Knowledge, knowledge};
use master::units::Rpm;
use master::{Drive, Error, Network};
use sim::machine::{TimingMode, mjoint, zlac8030l, zlim42c, zlim42c_82};
use sim::{World, block_on};

const K500: u16 = 1;
const JOINT: u8 = 1;
const STEPPER: u8 = 2;
const LARGE_STEPPER: u8 = 3;
const SERVO: u8 = 4;

fn bench() -> (World, Network) {
    let mut world = World::new(Bitrate::K500, 5);
    let network = Network::new();
    world.add_station(network.clone());
    let joint = Model::named("m4230e17b50").unwrap();
    world.add_drive(JOINT, Box::new(mjoint(joint, JOINT, Bitrate::K500))).unwrap();
    world.add_drive(STEPPER, Box::new(zlim42c(STEPPER, K500))).unwrap();
    world.add_drive(LARGE_STEPPER, Box::new(zlim42c_82(LARGE_STEPPER, K500))).unwrap();
    world.add_drive(SERVO, Box::new(zlac8030l(SERVO, K500))).unwrap();
    world.run_until(Instant::from_secs(2));
    (world, network)
}

fn scan(world: &mut World, network: &Network) -> Vec<Found> {
    block_on(world, network.scan(Duration::from_millis(100), |_| {})).unwrap()
}

fn guess(world: &mut World, network: &Network, id: u8) -> Guess {
    let known = block_on(world, knowledge(&network.node(node(id)))).unwrap().unwrap();
    known.guess().unwrap_or_else(|| panic!("{known:?}"))
}

fn guessed_drive(world: &mut World, network: &Network, id: u8) -> Drive {
    let guess = guess(world, network, id);
    Drive::known_as(network.node(node(id)), Knowledge::Guessed(guess))
}

fn names(models: impl IntoIterator<Item = &'static devices::Description>) -> Vec<&'static str> {
    models.into_iter().map(|model| model.name).collect()
}

#[test]
fn a_scan_reports_that_the_two_zl_drives_are_ambiguous_and_what_their_objects_suggest() {
    let (mut world, network) = bench();
    let found = scan(&mut world, &network);
    let zl = ["zlac8030l", "zlim42c", "zlim42c-82"];
    // 2029h is the ZLAC8030L's bus voltage and 2069h the ZLIM42-C's, each missing in the other's manual.
    let expected = [
        (STEPPER, "it has 2069h:00 as zlim42c and zlim42c-82 have"),
        (LARGE_STEPPER, "it has 2069h:00 as zlim42c and zlim42c-82 have"),
        (SERVO, "it has 2029h:00 as zlac8030l has"),
    ];
    for (id, says) in expected {
        let node = found.iter().find(|found| found.node == node(id)).unwrap();
        assert_eq!(names(node.models.clone()), zl, "{node:?}");
        assert!(matches!(node.knowledge, Knowledge::Guessed(_)), "{node:?}");
        let doubt = node.doubt().unwrap();
        assert!(
            doubt.starts_with("cannot tell: zlac8030l, zlim42c and zlim42c-82 answer the same identity"),
            "{doubt}"
        );
        assert!(doubt.ends_with(says), "{doubt}");
    }
    let joint = found.iter().find(|found| found.node == node(JOINT)).unwrap();
    assert_eq!(joint.models.len(), 4);
    assert!(joint.doubt().unwrap().ends_with("answer the same identity and have the same objects"), "{joint:?}");
}

#[test]
fn a_guess_is_good_for_moving_and_not_for_the_parameter_memory() {
    let (mut world, network) = bench();
    for id in [JOINT, STEPPER, LARGE_STEPPER, SERVO] {
        let drive = guessed_drive(&mut world, &network, id);
        let turning = MotionOptions::default();
        block_on(&mut world, drive.velocity(Rpm(60.0), turning)).unwrap().unwrap();
        block_on(&mut world, drive.stop()).unwrap().unwrap();
        let probe = world.add_probe();
        for outcome in [block_on(&mut world, drive.save()).unwrap(), block_on(&mut world, drive.restore()).unwrap()] {
            let error = outcome.unwrap_err();
            assert!(matches!(error, Error::GuessedModel { .. }), "{error}");
            assert!(error.to_string().contains("answer the same identity"), "{error}");
        }
        world.run_for(Duration::from_millis(100));
        let mut heard = core::iter::from_fn(|| world.poll_received(probe).map(|(_, frame)| frame));
        assert!(heard.all(|frame| frame.id().as_standard() != Some(0x600 + u16::from(id))), "asked for something");
    }
}

#[test]
fn a_guess_is_good_for_writing_what_means_the_same_on_both_zl_drives() {
    let (mut world, network) = bench();
    for id in [STEPPER, SERVO] {
        let drive = guessed_drive(&mut world, &network, id);
        // Mode 3 is profile velocity on both; 4 is torque on one and nothing on the other.
        let shared = [(0x6040, 0x0F), (0x6060, 3), (0x60FF, 60), (0x6083, 500), (0x1017, 1000)];
        for (index, value) in shared {
            drive.check_write(mux(index, 0), value).unwrap();
        }
        // 2009h saves or sets the bit rate, 2010h says when to save or saves, 606Ch is in 0.1 r/min or in r/min,
        // 607Ah in counts of an encoder or in pulses.
        let different = [(0x2009, 2), (0x2010, 0), (0x2006, 10), (0x606C, 0), (0x607A, 4000), (0x6060, 4), (0x5FFF, 0)];
        for (index, value) in different {
            let error = drive.check_write(mux(index, 0), value).unwrap_err();
            assert!(matches!(error, Error::GuessedModel { .. }), "{index:X}h: {error}");
        }
    }
    let joint = guessed_drive(&mut world, &network, JOINT);
    joint.check_write(mux(0x2600, 0), 1).unwrap();
}

#[test]
fn a_name_that_the_objects_speak_against_is_refused_before_anything_is_written() {
    let (mut world, network) = bench();
    for (id, wrong, missing) in [(SERVO, "zlim42c", mux(0x2069, 0)), (STEPPER, "zlac8030l", mux(0x2029, 0))] {
        let drive = Drive::new(network.node(node(id)), devices::model(wrong).unwrap());
        let probe = world.add_probe();
        let error = block_on(&mut world, drive.check_identity()).unwrap().unwrap_err();
        assert!(matches!(error, Error::OtherModel { object, .. } if object == missing), "{error}");
        let saved = block_on(&mut world, drive.save()).unwrap();
        assert!(matches!(saved, Err(Error::OtherModel { .. })), "{saved:?}");
        let mut requests = 0;
        while let Some((_, frame)) = world.poll_received(probe) {
            if frame.id().as_standard() == Some(0x600 + u16::from(id)) {
                requests += 1;
                // Command specifier 40h: initiate upload.
                assert_eq!(frame.data()[0], 0x40, "{frame}");
            }
        }
        assert!(requests > 0);
    }
}

#[test]
fn objects_that_speak_for_two_models_or_for_none_leave_it_unknown() {
    let zl = |id| Toy::new(id).u32(0x1000, 0, 0x0004_0192).u32(0x1018, 1, 0x100).u32(0x1018, 2, 1).u32(0x1018, 3, 0);
    let both = zl(5).u16(0x2029, 0, 4800).u16(0x2069, 0, 24);
    let mut bus = Bus::new(vec![both, zl(6)]);
    let network = bus.network.clone();
    for id in [5, 6] {
        let known = bus.block_on(knowledge(&network.node(node(id)))).unwrap();
        assert!(matches!(known, Knowledge::Unknown), "{known:?}");
    }
    let found = bus.block_on(network.scan(Duration::from_millis(100), |_| {}));
    assert!(found[0].doubt().unwrap().contains("match none of them"), "{found:?}");
}

#[test]
fn models_with_the_same_objects_are_the_same_to_a_master() {
    for one in all().iter() {
        for other in all().same_objects(one) {
            // But for the speed of its motor, to which a drive holds what it is asked for in any case.
            let of_any_motor =
                |axis: &devices::AxisDescription| devices::AxisDescription { max_motor_rpm: None, ..*axis };
            let rules = |profile: &devices::Description| {
                let axes: Vec<_> = profile.axes.iter().map(of_any_motor).collect();
                (axes, profile.storage, profile.pdo, profile.nmt)
            };
            assert_eq!(rules(one), rules(other), "{} and {}", one.name, other.name);
            let identity = |profile: &devices::Description| {
                (profile.host_watch, profile.stated_departures, profile.distinguishing_object)
            };
            assert_eq!(identity(one), identity(other), "{} and {}", one.name, other.name);
        }
    }
    // ZLTECH gives all its drives one identity, and the four joints have one; the generic servo has its own.
    let alone = |name| all().of_identity(devices::model(name).expect("a model").identity).count() == 1;
    assert_eq!(["zlac8030l", "zlim42c", "m4230e17b50", "cia402"].map(alone), [false, false, false, true]);
}

#[test]
fn a_joint_is_operational_from_its_boot_up_message_on_and_the_zl_drives_are_not() {
    let mut world = World::new(Bitrate::K500, 5);
    let network = Network::new();
    world.add_station(network.clone());
    let joint = Model::named("m4230e17b50").unwrap();
    world.add_drive(JOINT, Box::new(mjoint(joint, JOINT, Bitrate::K500))).unwrap();
    world.add_drive(STEPPER, Box::new(zlim42c(STEPPER, K500))).unwrap();
    // Both have booted, and no heartbeat has come: the joint's is sent every second.
    world.run_until(Instant::from_millis(900));
    let said = network.facts(node(JOINT)).nmt_state;
    assert_eq!(said, Some(NmtState::Initialising));
    let found = scan(&mut world, &network);
    let states: Vec<_> = found.iter().map(|found| found.nmt_state).collect();
    assert_eq!(states, [Some(NmtState::Operational), Some(NmtState::PreOperational)]);
    let joint = guessed_drive(&mut world, &network, JOINT);
    let state = block_on(&mut world, joint.state()).unwrap().unwrap();
    assert_eq!(state.nmt, Some(NmtState::Operational), "{state:?}");
}

#[test]
fn a_joint_in_alarm_is_operational_though_its_heartbeat_says_04h() {
    let (mut world, network) = bench();
    let drive = guessed_drive(&mut world, &network, JOINT);
    world.apply(sim::Place::node(JOINT), &sim::Stimulus::Battery(false)).unwrap().unwrap();
    world.run_for(Duration::from_secs(3));
    assert_eq!(network.facts(node(JOINT)).nmt_state, Some(NmtState::Stopped), "05h, and 04h in alarm: 5.11.1");
    let state = block_on(&mut world, drive.state()).unwrap().unwrap();
    assert_eq!(state.nmt, Some(NmtState::Operational), "{state:?}");
    assert!(state.fault_code.is_some_and(|code| code != 0));
    // Another program that comes only now has heard nothing else; one that was there has heard what a third one commands.
    let later = Network::new();
    world.add_station(later.clone());
    world.run_for(Duration::from_secs(2));
    let seen = |network: &Network| network.facts(node(JOINT)).probable_state(drive.description());
    assert_eq!((seen(&network), seen(&later)), (Some(NmtState::Operational), None));
    let third = Network::new();
    world.add_station(third.clone());
    third.nmt_all(canopen::NmtCommand::EnterPreOperational);
    world.run_for(Duration::from_secs(2));
    assert_eq!(seen(&later), Some(NmtState::PreOperational));
}

/// A drive takes about a second to boot, in which it is deaf; the scan comes to it in its first half second.
#[test]
fn a_node_that_boots_during_a_scan_is_asked_once_it_has() {
    let mut world = World::new(Bitrate::K500, 5);
    world.set_timing(TimingMode::Device);
    let network = Network::new();
    world.add_station(network.clone());
    for number in [SERVO, STEPPER] {
        world.add_drive(number, Box::new(zlac8030l(number, K500))).unwrap();
    }
    let found = block_on(&mut world, network.scan(Duration::from_millis(500), |_| {})).unwrap();
    let nodes: Vec<_> = found.iter().map(|found| found.node.raw()).collect();
    assert_eq!(nodes, [STEPPER, SERVO]);
    assert!(found.iter().all(|found| found.identity.is_some()), "{found:?}");
    // One that was known before, and boots again.
    network.node(node(SERVO)).nmt(canopen::NmtCommand::ResetNode);
    let found = block_on(&mut world, network.scan(Duration::from_millis(500), |_| {})).unwrap();
    assert!(found.len() == 2 && found.iter().all(|found| found.identity.is_some()), "{found:?}");
}

/// CiA 301, 7.2.4.3: one SDO channel has one client. Where there are two masters all the same, the answers to both mix.
#[test]
fn another_master_that_asks_too_keeps_no_node_from_being_found() {
    let (mut alone, first) = bench();
    let expected = scan(&mut alone, &first);
    for seed in 0..8 {
        let (mut world, network) = bench();
        let other = Network::new();
        world.add_station(other.clone());
        let asking = async {
            let mut random = sim::Prng::new(seed);
            loop {
                for id in [JOINT, STEPPER, LARGE_STEPPER, SERVO] {
                    let _ = other.node(node(id)).read::<u16>(mux(0x6041, 0)).await;
                    other.sleep(Duration::from_micros(random.below(3_000))).await;
                }
            }
        };
        let scanning = network.scan(Duration::from_millis(100), |_| {});
        let (mut asking, mut scanning) = (pin!(asking), pin!(scanning));
        let both = poll_fn(|context| {
            assert!(asking.as_mut().poll(context).is_pending(), "it never ends");
            scanning.as_mut().poll(context)
        });
        let found = block_on(&mut world, both).unwrap();
        assert_eq!(found.len(), expected.len(), "seed {seed}: {found:?}");
        for (found, expected) in found.iter().zip(&expected) {
            assert_eq!(found.identity, expected.identity, "seed {seed}, node {}", found.node);
            assert_eq!(names(found.models.clone()), names(expected.models.clone()), "seed {seed}, node {}", found.node);
            assert_eq!(found.doubt(), expected.doubt(), "seed {seed}, node {}", found.node);
        }
    }
}

/// Answers that take 0.2 s and more, as behind a gateway, where a scan waits 0.1 s: of nodes that it asks first, in the middle and
/// last, and of one that it also hears.
#[test]
fn nodes_whose_answers_come_after_the_time_out_are_found_all_the_same() {
    const ALL: &[u8] = &[JOINT, SERVO, 64, 127];
    for (nodes, late) in [(ALL, "bus late 200 200"), (ALL, "bus late 300 450"), (&[127], "bus late 200 200")] {
        let mut world = World::new(Bitrate::K500, 5);
        let network = Network::new();
        world.add_station(network.clone());
        for &id in nodes {
            if id == JOINT {
                let joint = Model::named("m4230e17b50").unwrap();
                world.add_drive(id, Box::new(mjoint(joint, id, Bitrate::K500))).unwrap();
            } else {
                world.add_drive(id, Box::new(zlac8030l(id, K500))).unwrap();
            }
            world.apply(sim::Place::node(id), &late.parse().unwrap()).unwrap().unwrap();
        }
        world.run_until(Instant::from_secs(3));
        let found = scan(&mut world, &network);
        assert!(found.iter().map(|found| found.node.raw()).eq(nodes.iter().copied()), "{late}: {found:?}");
        for found in &found {
            assert!(found.identity.is_some() && found.twins.is_none(), "{late}: {found:?}");
        }
    }
}
