//! Intents against the virtual ZLAC8030L: firmware, motor and bus, in virtual time.

use std::time::Duration;

use crate::support::{mux, node};
use can::{Bitrate, Instant};
use canopen::NmtCommand;
use canopen::pdo::{Direction, MappingRecord, PdoId, PdoNumber};
use cia402::PowerState;
use devices::model;
use master::core::PdoMap;
use master::drive::{HostLoss, MotionOptions, Note};
use master::pdo::{PdoConfig, TimerUnits};
use master::units::{Amperes, Counts, Degrees, Ramp, Rpm, Turns};
use master::{Drive, Error, Network, join_all};
use sim::machine::zlac8030l;
use sim::{Place, World, block_on};

const TPDO1: PdoId = PdoId { direction: Direction::Tpdo, number: PdoNumber::FIRST };

/// The value of 200Eh for 500 kbit/s.
const K500: u16 = 1;

fn world(ids: &[u8]) -> (World, Network, Vec<Drive>) {
    let mut world = World::new(Bitrate::K500, 11);
    let network = Network::new();
    world.add_station(network.clone());
    for id in ids {
        world.add_drive(*id, Box::new(zlac8030l(*id, K500))).unwrap();
    }
    let profile = model("zlac8030l").unwrap();
    let drives = ids.iter().map(|id| Drive::new(network.node(node(*id)), profile)).collect();
    // The drives boot.
    world.run_until(Instant::from_secs(2));
    (world, network, drives)
}

fn slowly() -> MotionOptions {
    MotionOptions { speed: Some(Rpm(60.0)), ..MotionOptions::default() }
}

#[test]
fn the_identity_is_the_models() {
    let (mut world, _, drives) = world(&[4]);
    block_on(&mut world, drives[0].check_identity()).unwrap().unwrap();
}

#[test]
fn it_enables_and_disables() {
    let (mut world, _, drives) = world(&[4]);
    block_on(&mut world, drives[0].enable()).unwrap().unwrap();
    assert_eq!(block_on(&mut world, drives[0].state()).unwrap().unwrap().power, Some(PowerState::OperationEnabled));
    block_on(&mut world, drives[0].disable()).unwrap().unwrap();
    assert_eq!(block_on(&mut world, drives[0].state()).unwrap().unwrap().power, Some(PowerState::SwitchOnDisabled));
}

/// 605Bh = 0: the motor is let go at once (quick start guide V1.00, 6.3), and a wheel with a load coasts for seconds.
#[test]
fn a_motor_that_coasts_without_power_counts_as_moved_until_it_was_seen_to_stand() {
    let (mut world, network, drives) = world(&[4]);
    world.apply(Place::node(4), &"load inertia 0.1".parse().unwrap()).unwrap().unwrap();
    let shaft_rpm = |world: &mut World| world.report(4).unwrap().velocity_rpm.abs();
    block_on(&mut world, drives[0].node().write(mux(0x605B, 0), 0_i16)).unwrap().unwrap();
    block_on(&mut world, drives[0].velocity(Rpm(100.0), slowly())).unwrap().unwrap();
    block_on(&mut world, drives[0].disable()).unwrap().unwrap();
    assert_eq!(block_on(&mut world, drives[0].state()).unwrap().unwrap().power, Some(PowerState::SwitchOnDisabled));
    assert!(shaft_rpm(&mut world) > 10.0, "it coasts");
    assert!(network.moved().contains(node(4)));
    // 0.1 kg m2 at 10.5 rad/s against 0.1 N m of friction and more: some 10 s.
    world.run_for(Duration::from_secs(20));
    for stopped in block_on(&mut world, network.stop_all_moved()).unwrap() {
        stopped.outcome.unwrap();
    }
    assert!(shaft_rpm(&mut world) < 1.0 && network.moved().is_empty());
}

/// One that its ramp has stopped is seen to stand at once.
#[test]
fn a_motor_that_is_stopped_by_its_shutdown_ramp_does_not_count_as_moved() {
    let (mut world, network, drives) = world(&[4]);
    block_on(&mut world, drives[0].velocity(Rpm(100.0), slowly())).unwrap().unwrap();
    block_on(&mut world, drives[0].disable()).unwrap().unwrap();
    assert!(world.report(4).unwrap().velocity_rpm.abs() < 1.0 && network.moved().is_empty());
}

#[test]
fn an_absolute_move_ends_at_its_target_in_the_time_that_speed_and_ramps_take() {
    let (mut world, network, drives) = world(&[4]);
    let report = block_on(&mut world, drives[0].move_absolute(Counts(32_000), slowly())).unwrap().unwrap();
    let position = world.report(4).unwrap().position;
    assert!((position - 32_000).abs() <= 30, "{position}");
    // 32000 counts at 4096 counts/s is 7.81 s; ramps of 0.5 s each add their half.
    let seconds = report.reached_after.unwrap().as_secs_f64();
    assert!((7.8..9.5).contains(&seconds), "{seconds}");
    assert!(matches!(report.notes[..], [Note::HostLoss(HostLoss::StopsInSilence { .. })]));
    assert!(network.moved().is_empty());
}

#[test]
fn relative_moves_add_up() {
    let (mut world, _, drives) = world(&[4]);
    for _ in 0..3 {
        block_on(&mut world, drives[0].move_relative(Degrees(90.0), slowly())).unwrap().unwrap();
    }
    let position = world.report(4).unwrap().position;
    assert!((position - 3 * 1024).abs() <= 40, "{position}");
}

#[test]
fn four_drives_move_at_the_same_time() {
    let (mut world, _, drives) = world(&[1, 2, 3, 4]);
    let began = world.now();
    let moves = join_all(drives.iter().map(|drive| drive.move_absolute(Turns(2.0), slowly())));
    assert!(block_on(&mut world, moves).unwrap().iter().all(Result::is_ok));
    assert!((world.now() - began).as_secs_f64() < 4.0, "{}", world.now());
}

#[test]
fn velocity_is_reached_watched_and_stopped() {
    let (mut world, network, drives) = world(&[4]);
    let options = MotionOptions { acceleration: Some(Ramp::Time(Duration::from_millis(300))), ..Default::default() };
    block_on(&mut world, drives[0].velocity(Rpm(100.0), options)).unwrap().unwrap();
    block_on(&mut world, drives[0].supervise(Duration::from_secs(3))).unwrap().unwrap();
    let speed = world.report(4).unwrap().velocity_rpm;
    assert!((speed - 100.0).abs() < 5.0, "{speed}");
    block_on(&mut world, drives[0].stop()).unwrap().unwrap();
    assert!(world.report(4).unwrap().velocity_rpm.abs() < 2.0);
    assert!(network.moved().is_empty());
}

#[test]
fn without_supervision_the_host_watchdog_stops_it_as_the_note_says() {
    let (mut world, network, drives) = world(&[4]);
    let report = block_on(&mut world, drives[0].velocity(Rpm(100.0), MotionOptions::default())).unwrap().unwrap();
    let [Note::HostLoss(HostLoss::StopsInSilence { time, .. })] = report.notes[..] else {
        panic!("{:?}", report.notes)
    };
    block_on(&mut world, network.sleep(time + Duration::from_secs(2))).unwrap();
    assert!(world.report(4).unwrap().velocity_rpm.abs() < 2.0);
}

#[test]
fn a_locked_rotor_in_a_move_is_explained() {
    let (mut world, _, drives) = world(&[4]);
    block_on(&mut world, drives[0].enable()).unwrap().unwrap();
    world.with_drive(4, |drive, now| drive.set_rotor_locked(true, now)).unwrap().unwrap();
    let error = block_on(&mut world, drives[0].move_absolute(Turns(3.0), slowly())).unwrap().unwrap_err();
    let Error::NotReached(explanation) = &error else { panic!("{error}") };
    assert!(explanation.conclusion.starts_with("The drive is at fault"), "{error}");
    assert!(explanation.advice.to_lowercase().contains("blocked motor"), "{error}");
}

#[test]
fn enabling_on_too_low_a_supply_explains_and_works_after_reset() {
    let (mut world, network, drives) = world(&[4]);
    world.with_drive(4, |drive, now| drive.set_supply(14.0, now)).unwrap().unwrap();
    block_on(&mut world, network.sleep(Duration::from_secs(1))).unwrap();
    let error = block_on(&mut world, drives[0].enable()).unwrap().unwrap_err();
    assert!(error.to_string().contains("under-voltage"), "{error}");
    world.with_drive(4, |drive, now| drive.set_supply(48.0, now)).unwrap().unwrap();
    block_on(&mut world, network.sleep(Duration::from_secs(1))).unwrap();
    block_on(&mut world, drives[0].reset_fault()).unwrap().unwrap();
    block_on(&mut world, drives[0].enable()).unwrap().unwrap();
}

#[test]
fn a_drive_whose_supply_fails_in_the_middle_of_a_move_is_explained() {
    let (mut world, network, drives) = world(&[4]);
    let options = MotionOptions { wait: false, ..slowly() };
    block_on(&mut world, drives[0].move_absolute(Turns(100.0), options)).unwrap().unwrap();
    block_on(&mut world, network.sleep(Duration::from_millis(500))).unwrap();
    world.cut_power(4).unwrap();
    let error = block_on(&mut world, drives[0].supervise(Duration::from_secs(5))).unwrap().unwrap_err();
    assert!(error.to_string().contains("stopped answering"), "{error}");
}

#[test]
fn a_quick_stop_from_elsewhere_ends_a_move_with_an_explanation() {
    let (mut world, network, drives) = world(&[4]);
    let probe = world.add_probe();
    block_on(&mut world, drives[0].move_absolute(Turns(100.0), MotionOptions { wait: false, ..slowly() }))
        .unwrap()
        .unwrap();
    block_on(&mut world, network.sleep(Duration::from_millis(500))).unwrap();
    world.send(probe, "604#2B40600002000000".parse().unwrap()).unwrap();
    world.run_for(Duration::from_millis(5));
    let error = block_on(&mut world, drives[0].supervise(Duration::from_secs(5))).unwrap().unwrap_err();
    assert!(error.to_string().contains("A quick stop came in the middle of the motion"), "{error}");
    // Enabling releases it (quick start guide 4.6).
    block_on(&mut world, drives[0].enable()).unwrap().unwrap();
}

#[test]
fn the_guard_stops_a_move_that_was_cut_short() {
    let (mut world, network, drives) = world(&[4]);
    block_on(&mut world, async {
        let guard = network.stop_guard();
        let moving = drives[0].move_absolute(Turns(100.0), slowly());
        assert!(crate::support::first(network.sleep(Duration::from_secs(2)), moving).await.is_none());
        drop(guard);
        network.sleep(Duration::from_secs(2)).await;
    })
    .unwrap();
    let report = world.report(4).unwrap();
    assert!(report.velocity_rpm.abs() < 1.0, "{report:?}");
    let state = block_on(&mut world, drives[0].state()).unwrap().unwrap();
    assert_eq!(state.power, Some(PowerState::QuickStopActive));
}

#[test]
fn torque_against_a_locked_rotor_shows_as_current() {
    let (mut world, network, drives) = world(&[4]);
    world.with_drive(4, |drive, now| drive.set_rotor_locked(true, now)).unwrap().unwrap();
    // 300 mA/s by 6087h: 0.6 A takes 2 s.
    block_on(&mut world, async {
        drives[0].torque(Amperes(0.6)).await.unwrap();
        drives[0].supervise(Duration::from_secs(3)).await.unwrap();
    })
    .unwrap();
    let state = block_on(&mut world, drives[0].state()).unwrap().unwrap();
    assert!((state.current.unwrap().0 - 0.6).abs() < 0.15, "{state:?}");
    block_on(&mut world, drives[0].stop()).unwrap().unwrap();
    let _ = network;
}

#[test]
fn a_tpdo_is_configured_saved_and_comes_back_after_a_power_cycle() {
    let (mut world, network, drives) = world(&[4]);
    let profile = model("zlac8030l").unwrap();
    let units = TimerUnits {
        inhibit: Duration::from_nanos(profile.pdo.inhibit_unit_ns),
        event: Duration::from_nanos(profile.pdo.event_timer_unit_ns),
    };
    let map = PdoMap(vec![MappingRecord::from_raw(0x6041_0010), MappingRecord::from_raw(0x6064_0020)]);
    let config = PdoConfig::new(TPDO1, map).event_time(Duration::from_millis(50));
    let node = drives[0].node().clone();
    block_on(&mut world, node.configure_pdo(&config, units)).unwrap().unwrap();
    block_on(&mut world, drives[0].save()).unwrap().unwrap();
    block_on(&mut world, network.sleep(Duration::from_secs(1))).unwrap();
    world.cut_power(4).unwrap();
    world.run_for(Duration::from_secs(1));
    let booted = node.wait_boot_up(Duration::from_secs(5));
    world.set_power(4, true).unwrap();
    block_on(&mut world, booted).unwrap().unwrap();
    let after = block_on(&mut world, node.adopt_pdo(TPDO1, units)).unwrap().unwrap();
    assert_eq!((after.map, after.event_time), (config.map, config.event_time));
    node.nmt(NmtCommand::Start);
    block_on(&mut world, network.sleep(Duration::from_millis(200))).unwrap();
    let received = network.received(node.id(), mux(0x6064, 0)).unwrap();
    assert!(network.now() - received.at <= Duration::from_millis(51), "{received:?}");
}

/// What the TPDO carries then is not a statusword, though it comes under the same identifier (CiA 301, 7.5.2.36: the mapping is changed while the
/// PDO is off).
#[test]
fn a_tpdo_whose_mapping_is_written_by_itself_is_not_taken_for_what_it_was() {
    let (mut world, network, drives) = world(&[4]);
    let node = drives[0].node().clone();
    let config = PdoConfig::new(TPDO1, PdoMap(vec![MappingRecord::from_raw(0x6041_0010)]));
    let config = config.event_time(Duration::from_millis(5));
    block_on(&mut world, async {
        node.configure_pdo(&config, TimerUnits::of(model("zlac8030l").unwrap())).await.unwrap();
        node.nmt(NmtCommand::Start);
        network.sleep(Duration::from_millis(50)).await;
        assert!(network.received(node.id(), mux(0x6041, 0)).is_some());
        let cob_id: u32 = node.read(mux(0x1800, 1)).await.unwrap();
        node.write(mux(0x1800, 1), cob_id | 1 << 31).await.unwrap();
        node.write(mux(0x1A00, 0), 0_u8).await.unwrap();
        node.write(mux(0x1A00, 1), 0x606C_0020_u32).await.unwrap();
        node.write(mux(0x1A00, 0), 1_u8).await.unwrap();
        node.write(mux(0x1800, 1), cob_id).await.unwrap();
        network.sleep(Duration::from_millis(50)).await;
        assert_eq!(network.received(node.id(), mux(0x6041, 0)), None);
        // What is refused (1018h cannot be mapped) is put back, and so is what it was taken for.
        let before = PdoConfig { map: PdoMap(vec![MappingRecord::from_raw(0x6064_0020)]), ..config.clone() };
        node.configure_pdo(&before, TimerUnits::of(model("zlac8030l").unwrap())).await.unwrap();
        let refused = PdoConfig { map: PdoMap(vec![MappingRecord::from_raw(0x1018_0120)]), ..config };
        node.configure_pdo(&refused, TimerUnits::of(model("zlac8030l").unwrap())).await.unwrap_err();
        network.sleep(Duration::from_millis(50)).await;
        assert!(network.received(node.id(), mux(0x6064, 0)).is_some());
        // It is led by what its statusword says.
        drives[0].velocity(Rpm(60.0), MotionOptions::default()).await.unwrap();
        drives[0].stop().await.unwrap();
    })
    .unwrap();
}

#[test]
fn a_boot_up_is_seen_after_a_reset() {
    let (mut world, _, drives) = world(&[4]);
    block_on(&mut world, drives[0].node().reset(Duration::from_secs(5))).unwrap().unwrap();
}

#[test]
fn a_move_that_was_stopped_is_replaced_by_the_next_one() {
    let (mut world, network, drives) = world(&[4]);
    let options = MotionOptions { wait: false, ..slowly() };
    block_on(&mut world, drives[0].move_absolute(Turns(50.0), options)).unwrap().unwrap();
    block_on(&mut world, network.sleep(Duration::from_secs(3))).unwrap();
    block_on(&mut world, drives[0].stop()).unwrap().unwrap();
    let halted = world.report(4).unwrap();
    assert!(halted.velocity_rpm.abs() < 2.0 && halted.position > 4096, "{halted:?}");
    block_on(&mut world, drives[0].move_absolute(Turns(1.0), slowly())).unwrap().unwrap();
    let position = world.report(4).unwrap().position;
    assert!((position - 4096).abs() <= 30, "{position}");
    // Nothing of the first move is left to run.
    block_on(&mut world, drives[0].supervise(Duration::from_secs(3))).unwrap().unwrap();
    let position = world.report(4).unwrap().position;
    assert!((position - 4096).abs() <= 30, "{position}");
}

#[test]
fn a_mode_is_changed_from_velocity_to_position_after_a_stop() {
    let (mut world, _, drives) = world(&[4]);
    block_on(&mut world, drives[0].velocity(Rpm(-60.0), MotionOptions::default())).unwrap().unwrap();
    block_on(&mut world, drives[0].stop()).unwrap().unwrap();
    block_on(&mut world, drives[0].move_absolute(Turns(0.5), slowly())).unwrap().unwrap();
    let position = world.report(4).unwrap().position;
    assert!((position - 2048).abs() <= 30, "{position}");
    block_on(&mut world, drives[0].velocity(Rpm(60.0), MotionOptions::default())).unwrap().unwrap();
    assert!((world.report(4).unwrap().velocity_rpm - 60.0).abs() < 4.0);
}

#[test]
fn a_finer_speed_resolution_takes_effect_after_save_and_restart() {
    let (mut world, network, drives) = world(&[4]);
    let node = drives[0].node().clone();
    block_on(&mut world, node.write(mux(0x202F, 5), 10_u16)).unwrap().unwrap();
    block_on(&mut world, drives[0].save()).unwrap().unwrap();
    block_on(&mut world, network.sleep(Duration::from_secs(1))).unwrap();
    block_on(&mut world, node.reset(Duration::from_secs(5))).unwrap().unwrap();
    block_on(&mut world, network.sleep(Duration::from_secs(1))).unwrap();
    block_on(&mut world, drives[0].velocity(Rpm(30.5), MotionOptions::default())).unwrap().unwrap();
    assert_eq!(block_on(&mut world, node.read::<i32>(mux(0x60FF, 0))).unwrap().unwrap(), 305);
    let speed = world.report(4).unwrap().velocity_rpm;
    assert!((speed - 30.5).abs() < 2.5, "{speed}");
}
