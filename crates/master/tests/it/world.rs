//! The master on a simulated bus with arbitration, frame times and honest faults, against toy drives.

use std::time::Duration;

use crate::support::toy::Toy;
use crate::support::toy_drive::zlac8030l;
use crate::support::{mux, node};
use can::{Bitrate, Instant};
use canopen::pdo::{Direction, MappingRecord, PdoId, PdoNumber};
use devices::model;
use master::core::PdoMap;
use master::drive::MotionOptions;
use master::pdo::{PdoConfig, TimerUnits, TransmissionType};
use master::units::{Rpm, Turns};
use master::{Drive, Error, Network, join_all};
use sim::fault::{Babble, Corruption, Delay, NodeFaults};
use sim::{StationId, World, block_on};

const RPDO1: PdoId = PdoId { direction: Direction::Rpdo, number: PdoNumber::FIRST };
const TPDO1: PdoId = PdoId { direction: Direction::Tpdo, number: PdoNumber::FIRST };

const DEVICE_TYPE: canopen::Mux = mux(0x1000, 0);

fn world(toys: impl IntoIterator<Item = Toy>) -> (World, Network, Vec<StationId>) {
    let mut world = World::new(Bitrate::K500, 7);
    let network = Network::new();
    world.add_station(network.clone());
    let ids = toys.into_iter().map(|toy| world.add_station(toy)).collect();
    (world, network, ids)
}

fn drives(network: &Network, ids: &[u8]) -> Vec<Drive> {
    ids.iter().map(|id| Drive::new(network.node(node(*id)), model("zlac8030l").unwrap())).collect()
}

#[test]
fn three_drives_move_at_the_same_time() {
    let (mut world, network, _) = world([1, 2, 4].map(zlac8030l));
    let drives = drives(&network, &[1, 2, 4]);
    let options = MotionOptions { speed: Some(Rpm(60.0)), ..MotionOptions::default() };
    let moves = join_all(drives.iter().map(|drive| drive.move_absolute(Turns(2.0), options)));
    let reports = block_on(&mut world, moves).unwrap();
    for report in reports {
        // 2 turns at 1 turn/s, seen within two polls.
        let seconds = report.unwrap().reached_after.unwrap().as_secs_f64();
        assert!((1.99..2.05).contains(&seconds), "{seconds}");
    }
    // Not one after the other, which would be 6 s.
    assert!(world.now() < Instant::from_millis(2_200), "{}", world.now());
}

#[test]
fn two_runs_give_the_same_frames_at_the_same_nanoseconds() {
    let run = || {
        let (mut world, network, _) = world([1, 2].map(zlac8030l));
        world.set_corruption(Corruption::with_probability(0.02));
        let drives = drives(&network, &[1, 2]);
        let moves = join_all(drives.iter().map(|drive| drive.move_absolute(Turns(1.0), MotionOptions::default())));
        assert!(block_on(&mut world, moves).unwrap().iter().all(Result::is_ok));
        (world.now(), world.digest().value())
    };
    assert_eq!(run(), run());
}

#[test]
fn a_cut_cable_in_the_middle_of_a_move_is_explained_after_one_timeout() {
    let (mut world, network, ids) = world([zlac8030l(4)]);
    let drive = drives(&network, &[4]).remove(0);
    let options = MotionOptions { wait: false, ..MotionOptions::default() };
    block_on(&mut world, drive.move_absolute(Turns(100.0), options)).unwrap().unwrap();
    world.cut(ids[0]);
    let cut_at = world.now();
    let error = block_on(&mut world, drive.supervise(Duration::from_secs(10))).unwrap().unwrap_err();
    assert!(error.to_string().contains("The drive stopped answering"), "{error}");
    assert_eq!(world.now() - cut_at, Duration::from_millis(500));
    assert!(network.moved().contains(node(4)), "it may still be moving");
}

#[test]
fn a_timeout_comes_exactly_at_its_deadline_and_the_retry_works_after_the_cable_is_back() {
    let (mut world, network, ids) = world([Toy::new(4).u32(0x1000, 0, 7), Toy::new(5)]);
    world.cut(ids[0]);
    world.run_until(Instant::from_millis(1_234));
    let node = network.node(node(4)).with_timeout(Duration::from_millis(80));
    let error = block_on(&mut world, node.read::<u32>(DEVICE_TYPE)).unwrap().unwrap_err();
    assert!(matches!(error, Error::NoAnswer { .. }), "{error}");
    assert_eq!(world.now(), Instant::from_millis(1_314));
    world.join(ids[0]);
    assert_eq!(block_on(&mut world, node.read::<u32>(DEVICE_TYPE)).unwrap().unwrap(), 7);
}

#[test]
fn transfers_survive_disturbed_frames_late_nodes_and_a_babbling_one() {
    let text = [b'z'; 300];
    let (mut world, network, ids) = world([Toy::new(4).with(0x1008, 0, &text), Toy::new(5)]);
    world.set_corruption(Corruption::with_probability(0.05));
    let late = NodeFaults { late: Some(Delay { min_ns: 100_000, max_ns: 3_000_000 }), ..NodeFaults::default() };
    world.set_node_faults(ids[0], late);
    let babble = Babble { frame: "7FF#00".parse().unwrap(), gap_ns: 50_000 };
    world.set_node_faults(ids[1], NodeFaults { babble: Some(babble), ..NodeFaults::default() });
    let node = network.node(node(4));
    let upload = node.upload(mux(0x1008, 0));
    assert_eq!(block_on(&mut world, upload).unwrap().unwrap().as_bytes(), text);
}

#[test]
fn a_late_answer_to_a_request_that_was_given_up_does_not_disturb_the_next_one() {
    let toy = Toy::new(4).u32(0x1000, 0, 7).u32(0x1018, 1, 0x100);
    let (mut world, network, ids) = world([toy]);
    world.set_node_faults(ids[0], NodeFaults { late: Some(Delay::fixed(30_000_000)), ..NodeFaults::default() });
    let patient = network.node(node(4));
    let hasty = patient.clone().with_timeout(Duration::from_millis(20));
    let read = async {
        let first = hasty.read::<u32>(DEVICE_TYPE).await;
        // The answer to the first request arrives within this one.
        let second = patient.read::<u32>(mux(0x1018, 1)).await;
        (first, second)
    };
    let (first, second) = block_on(&mut world, read).unwrap();
    assert!(matches!(first, Err(Error::NoAnswer { .. })), "{first:?}");
    assert_eq!(second.unwrap(), 0x100);
}

#[test]
fn sync_keeps_its_period_and_synchronous_rpdos_follow_it() {
    let (mut world, network, _) =
        world([zlac8030l(4).u32(0x1400, 1, 0x204).u8(0x1400, 2, 1).u8(0x1600, 0, 1).u32(0x1600, 1, 0x60FF_0020)]);
    let probe = world.add_probe();
    let node = network.node(node(4));
    let half_ms = Duration::from_micros(500);
    let adopt = node.adopt_pdo(RPDO1, TimerUnits { inhibit: half_ms, event: half_ms });
    let config = block_on(&mut world, adopt).unwrap().unwrap();
    assert_eq!(config.transmission, TransmissionType::EVERY_SYNC);
    // Past the intermission after the last answer.
    block_on(&mut world, network.sleep(Duration::from_millis(1))).unwrap();
    network.sync(Some(Duration::from_millis(20)));
    assert!(node.send_by_pdo(mux(0x60FF, 0), 50));
    block_on(&mut world, network.sleep(Duration::from_millis(99))).unwrap();
    let mut heard = Vec::new();
    while let Some((at, frame)) = world.poll_received(probe) {
        heard.push((at, frame.to_string()));
    }
    let heard = heard.split_off(heard.iter().position(|(_, frame)| frame == "080#").unwrap());
    let syncs: Vec<Instant> = heard.iter().filter(|(_, frame)| frame == "080#").map(|(at, _)| *at).collect();
    assert_eq!(syncs.len(), 5);
    assert!(syncs.windows(2).all(|pair| pair[1] - pair[0] == Duration::from_millis(20)), "{syncs:?}");
    assert_eq!(heard[1].1, "204#32000000");
    assert_eq!(heard.iter().filter(|(_, frame)| frame.starts_with("204#")).count(), 1);
}

#[test]
fn a_condition_sees_values_that_come_by_pdo() {
    let mut toy = zlac8030l(4).u32(0x1800, 1, 0x184).u8(0x1800, 2, 255).u8(0x1A00, 0, 0).u32(0x1A00, 1, 0);
    toy.send(0x180, &[0x37, 0x06]);
    let (mut world, network, _) = world([toy]);
    let node = network.node(node(4));
    let map = PdoMap(vec![MappingRecord::from_raw(0x6041_0010)]);
    network.with_core(|core| core.image_mut().set_tpdo(node.id(), PdoNumber::FIRST, 0x184, map.clone()));
    let enabled = node.wait(|node| node.received(mux(0x6041, 0)).map(|value| value.raw), Duration::from_secs(1));
    assert_eq!(block_on(&mut world, enabled).unwrap(), Ok(0x0637));
    let config = PdoConfig::new(TPDO1, map);
    block_on(&mut world, node.configure_pdo(&config, TimerUnits::STANDARD)).unwrap().unwrap();
}
