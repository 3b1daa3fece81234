//! Intents in physical units against a toy drive with the ZLAC8030L's objects.

use std::time::Duration;

use crate::support::toy::Toy;
use crate::support::toy_drive::{ToyDrive, zlac8030l};
use crate::support::{Bus, first, mux, node};
use can::Instant;
use canopen::pdo::{MappingRecord, PdoNumber};
use cia402::PowerState;
use devices::servo::{CIA402, MODES, axis};
use devices::{AxisId, Description, Placement, model};
use master::core::PdoMap;
use master::drive::{MotionOptions, Note};
use master::units::{Amperes, Counts, Degrees, Ramp, Rpm, Turns};
use master::{Drive, Error};

fn bus_with(change: impl FnOnce(&mut Toy)) -> (Bus, Drive) {
    let mut toy = zlac8030l(4);
    change(&mut toy);
    let bus = Bus::new(vec![toy]);
    let drive = Drive::new(bus.network.node(node(4)), model("zlac8030l").unwrap());
    (bus, drive)
}

fn toy(bus: &Bus) -> &ToyDrive {
    bus.toys[0].drive.as_ref().unwrap()
}

fn object(bus: &Bus, index: u16) -> i32 {
    let mut cell = [0; 4];
    let bytes = &bus.toys[0].objects[&(index, 0)];
    cell[..bytes.len()].copy_from_slice(bytes);
    i32::from_le_bytes(cell)
}

#[test]
fn enabling_takes_the_steps_of_the_manual() {
    let (mut bus, drive) = bus_with(|_| {});
    bus.block_on(drive.enable()).unwrap();
    assert_eq!(toy(&bus).controlwords, [0x06, 0x07, 0x0F]);
    // Already there: nothing is sent.
    bus.block_on(drive.enable()).unwrap();
    assert_eq!(toy(&bus).controlwords.len(), 3);
}

#[test]
fn enabling_with_a_fault_present_explains_and_resets_nothing() {
    let (mut bus, drive) = bus_with(|toy| {
        toy.drive.as_mut().unwrap().fault_at = Some((Instant::ZERO, 0x0002));
        toy.send(0x80, &[0x02, 0x00, 0x05, 0, 0, 0, 0, 0]);
    });
    let error = bus.block_on(drive.enable()).unwrap_err();
    let Error::NotReached(explanation) = &error else { panic!("{error}") };
    assert_eq!(explanation.conclusion, "The drive is at fault: under-voltage");
    let text = error.to_string();
    assert!(text.starts_with("node 4: could not enable it. The drive is at fault: under-voltage.\n"), "{text}");
    assert!(text.contains("fault code 0002h, under-voltage"), "{text}");
    assert!(text.contains("(Fault)") && text.contains("supply 48 V") && text.contains("EMCY 0002h"), "{text}");
    assert!(text.contains("Raise the supply"), "{text}");
    assert!(toy(&bus).controlwords.is_empty());
}

#[test]
fn a_fault_is_reset_by_an_edge_and_one_that_stays_is_explained() {
    let (mut bus, drive) = bus_with(|toy| toy.drive.as_mut().unwrap().fault_at = Some((Instant::ZERO, 0x0008)));
    bus.block_on(drive.reset_fault()).unwrap();
    assert_eq!(toy(&bus).controlwords, [0x00, 0x80, 0x00]);
    assert_eq!(bus.block_on(drive.state()).unwrap().power, Some(PowerState::SwitchOnDisabled));

    let (mut bus, drive) = bus_with(|toy| {
        let drive = toy.drive.as_mut().unwrap();
        drive.fault_at = Some((Instant::ZERO, 0x0008));
        drive.fault_stays = true;
    });
    let error = bus.block_on(drive.reset_fault()).unwrap_err();
    assert!(error.to_string().contains("could not reset its fault. The drive is at fault: overload"), "{error}");
}

#[test]
fn a_drive_that_ignores_its_controlword_is_reported_as_such() {
    let (mut bus, drive) = bus_with(|toy| toy.drive.as_mut().unwrap().stubborn = true);
    let error = bus.block_on(drive.enable()).unwrap_err();
    assert!(error.to_string().contains("took the controlword 0006h (shutdown) and did not act on it"), "{error}");
}

#[test]
fn an_absolute_move_follows_the_handshake_of_the_manual() {
    let (mut bus, drive) = bus_with(|_| {});
    let options = MotionOptions { speed: Some(Rpm(60.0)), ..MotionOptions::default() };
    let report = bus.block_on(drive.move_absolute(Counts(32_000), options)).unwrap();
    // Quick start guide 4.3: 06, 07, 0F, then 0F and 1F; and bit 4 back after the acknowledge.
    assert_eq!(toy(&bus).controlwords, [0x06, 0x07, 0x0F, 0x0F, 0x1F, 0x0F]);
    assert_eq!((object(&bus, 0x6064), object(&bus, 0x6081)), (32_000, 60));
    // 32000 counts at 4096 counts/s.
    let seconds = report.reached_after.unwrap().as_secs_f64();
    assert!((7.8125..7.85).contains(&seconds), "{seconds}");
    assert_eq!(report.notes.len(), 1);
    let Note::HostLoss(loss) = report.notes[0] else { panic!("{:?}", report.notes) };
    assert_eq!(loss.stops_after(), Some(Duration::from_secs(1)));
    // The polling kept the host watchdog (1 s) content by a wide margin.
    assert!(toy(&bus).longest_gap_ns < 50_000_000, "{}", toy(&bus).longest_gap_ns);
    assert!(bus.network.moved().is_empty());
}

#[test]
fn relative_moves_use_bit_6_and_angles_become_counts() {
    let (mut bus, drive) = bus_with(|_| {});
    bus.block_on(drive.move_relative(Degrees(90.0), MotionOptions::default())).unwrap();
    assert_eq!(toy(&bus).controlwords[3..], [0x4F, 0x5F, 0x4F]);
    assert_eq!(object(&bus, 0x6064), 1024);
    bus.block_on(drive.move_relative(Turns(-0.5), MotionOptions::default())).unwrap();
    assert_eq!(object(&bus, 0x6064), -1024);
}

#[test]
fn a_fault_in_the_middle_of_a_move_is_explained_at_once() {
    let start = Instant::from_secs(5);
    let (mut bus, drive) =
        bus_with(|toy| toy.drive.as_mut().unwrap().fault_at = Some((start + Duration::from_secs(1), 0x0004)));
    let error = bus.block_on(drive.move_absolute(Turns(10.0), MotionOptions::default())).unwrap_err();
    assert!(error.to_string().contains("The drive is at fault: over-current"), "{error}");
    assert!(bus.now - start < Duration::from_millis(1_050), "{}", bus.now);
    // It was not stopped: it stays on the list of what moved.
    assert!(bus.network.moved().contains(node(4)));
}

#[test]
fn a_drive_that_falls_silent_in_the_middle_of_a_move_is_explained() {
    let silent = Instant::from_secs(6);
    let (mut bus, drive) = bus_with(|toy| toy.drive.as_mut().unwrap().silent_at = Some(silent));
    let error = bus.block_on(drive.move_absolute(Turns(10.0), MotionOptions::default())).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("could not move it to the wanted position. The drive stopped answering"), "{text}");
    assert!(text.contains("use the emergency stop"), "{text}");
    assert!(bus.now - silent < Duration::from_millis(600), "{}", bus.now);
}

#[test]
fn a_blocked_motor_is_reported_after_the_time_the_move_should_take() {
    let (mut bus, drive) = bus_with(|toy| toy.drive.as_mut().unwrap().blocked = true);
    let error = bus.block_on(drive.move_absolute(Turns(2.0), MotionOptions::default())).unwrap_err();
    // 2 turns at 120 r/min: 1 s, plus ramps of 0.5 s each, times 1.5, plus 2 s.
    let took = (bus.now - Instant::from_secs(5)).as_secs_f64();
    assert!((5.0..5.2).contains(&took), "{took}");
    assert!(error.to_string().contains("at 100 counts where 8192 counts was asked for"), "{error}");
}

#[test]
fn a_set_point_that_is_not_acknowledged_is_explained() {
    let (mut bus, drive) = bus_with(|toy| toy.drive.as_mut().unwrap().deaf_to_set_points = true);
    let error = bus.block_on(drive.move_absolute(Turns(1.0), MotionOptions::default())).unwrap_err();
    assert!(error.to_string().contains("did not acknowledge the set-point (statusword bit 12)"), "{error}");
}

#[test]
fn velocity_sets_ramps_first_and_waits_for_the_speed() {
    let (mut bus, drive) = bus_with(|_| {});
    let options = MotionOptions { acceleration: Some(Ramp::RpmPerSecond(120.0)), ..MotionOptions::default() };
    let report = bus.block_on(drive.velocity(Rpm(-60.0), options)).unwrap();
    assert!(report.reached_after.is_some());
    assert_eq!((object(&bus, 0x60FF), object(&bus, 0x6083), object(&bus, 0x606C)), (-60, 500, -600));
    assert!(bus.network.moved().contains(node(4)));
    bus.block_on(drive.stop()).unwrap();
    assert_eq!(object(&bus, 0x60FF), 0);
    assert!(bus.network.moved().is_empty());
}

#[test]
fn a_finer_speed_resolution_is_taken_into_account() {
    let (mut bus, drive) = bus_with(|toy| {
        toy.objects.insert((0x202F, 5), vec![10, 0]);
    });
    let options = MotionOptions { wait: false, ..MotionOptions::default() };
    bus.block_on(drive.velocity(Rpm(12.5), options)).unwrap();
    assert_eq!(object(&bus, 0x60FF), 125);
}

#[test]
fn a_speed_left_over_is_zeroed_before_enabling() {
    let (mut bus, drive) = bus_with(|toy| {
        toy.objects.insert((0x60FF, 0), 500_u32.to_le_bytes().to_vec());
        toy.objects.insert((0x6060, 0), vec![3]);
        toy.objects.insert((0x6061, 0), vec![3]);
    });
    bus.block_on(drive.enable()).unwrap();
    assert_eq!(object(&bus, 0x60FF), 0);
}

#[test]
fn torque_is_written_in_the_drive_s_unit() {
    let (mut bus, drive) = bus_with(|_| {});
    bus.block_on(drive.torque(Amperes(-1.5))).unwrap();
    assert_eq!(object(&bus, 0x6071) as u16, -1500_i16 as u16);
    assert_eq!(object(&bus, 0x6061), 4);
}

#[test]
fn what_is_out_of_limits_is_refused_before_the_drive_moves() {
    let (mut bus, drive) = bus_with(|_| {});
    let options = MotionOptions { speed: Some(Rpm(2_000.0)), ..MotionOptions::default() };
    let error = bus.block_on(drive.move_absolute(Turns(1.0), options)).unwrap_err();
    let limits = |error: &Error| match error {
        Error::OutOfLimits { asked, limits, .. } => (*asked, limits.low, limits.high),
        _ => panic!("{error}"),
    };
    assert_eq!(limits(&error), (2_000, 1, 1_000));
    let error = bus.block_on(drive.torque(Amperes(40.0))).unwrap_err();
    assert_eq!(limits(&error), (40_000, -30_000, 30_000));
    assert!(bus.network.moved().is_empty());
}

#[test]
fn an_unknown_model_is_neither_moved_nor_stored_but_can_be_stopped() {
    let (mut bus, _) = bus_with(|_| {});
    let drive = Drive::of_unknown_model(bus.network.node(node(4)));
    assert!(matches!(bus.block_on(drive.save()), Err(Error::UnknownModel { .. })));
    let moved = bus.block_on(drive.move_absolute(Turns(1.0), MotionOptions::default()));
    assert!(matches!(moved, Err(Error::UnknownModel { .. })));
    assert!(bus.log.is_empty());
    bus.block_on(drive.enable()).unwrap();
    bus.block_on(drive.quick_stop()).unwrap();
    assert_eq!(toy(&bus).controlwords, [0x06, 0x07, 0x0F, 0x02]);
}

#[test]
fn saving_writes_the_model_s_own_command() {
    let (mut bus, drive) = bus_with(|_| {});
    bus.block_on(drive.save()).unwrap();
    // Quick start guide 5.1.
    assert!(bus.frames().contains(&"604#2B09200002000000".to_owned()), "{:?}", bus.frames());
}

#[test]
fn disabling_ramps_down_before_it_releases_the_motor() {
    let (mut bus, drive) = bus_with(|_| {});
    bus.block_on(drive.enable()).unwrap();
    bus.block_on(drive.disable()).unwrap();
    assert_eq!(toy(&bus).controlwords[3..], [0x06, 0x00]);
}

#[test]
fn the_stop_guard_quick_stops_what_was_moved_and_only_that() {
    let mut bus = Bus::new(vec![zlac8030l(4), zlac8030l(5)]);
    let network = bus.network.clone();
    let [four, five] = [4, 5].map(|id| Drive::new(network.node(node(id)), model("zlac8030l").unwrap()));
    bus.block_on(async {
        five.enable().await.unwrap();
        let guard = network.stop_guard();
        // Cut short in the middle of the move, as by Ctrl-C.
        let moving = four.move_absolute(Turns(10.0), MotionOptions::default());
        assert!(first(network.sleep(Duration::from_secs(1)), moving).await.is_none());
        drop(guard);
    });
    let words = |bus: &Bus, position: usize| bus.toys[position].drive.as_ref().unwrap().controlwords.clone();
    // Quick stop and halt.
    assert_eq!(words(&bus, 0).last(), Some(&0x0102));
    assert_eq!(words(&bus, 1), [0x06, 0x07, 0x0F]);
}

#[test]
fn stop_all_moved_answers_for_each_node() {
    let mut bus = Bus::new(vec![zlac8030l(4), zlac8030l(5)]);
    let network = bus.network.clone();
    let options = MotionOptions { wait: false, ..MotionOptions::default() };
    for id in [4, 5] {
        let drive = Drive::new(network.node(node(id)), model("zlac8030l").unwrap());
        bus.block_on(drive.velocity(Rpm(30.0), options)).unwrap();
    }
    bus.toys[1].drive.as_mut().unwrap().silent_at = Some(Instant::ZERO);
    let stopped = bus.block_on(network.stop_all_moved());
    assert_eq!(
        stopped.iter().map(|stopped| (stopped.node.raw(), stopped.outcome.is_ok())).collect::<Vec<_>>(),
        [(4, true), (5, false)]
    );
    assert!(network.moved().contains(node(5)) && !network.moved().contains(node(4)));
}

#[test]
fn state_reads_everything_in_physical_units() {
    let (mut bus, drive) = bus_with(|toy| {
        toy.objects.insert((0x6064, 0), 2048_u32.to_le_bytes().to_vec());
        toy.objects.insert((0x6077, 0), (-15_i16).to_le_bytes().to_vec());
    });
    let state = bus.block_on(drive.state()).unwrap();
    assert_eq!(state.angle, Some(Degrees(180.0)));
    assert!((state.current.unwrap().0 + 1.5).abs() < 1e-9);
    assert!((state.supply.unwrap().0 - 48.0).abs() < 1e-9);
    assert!((state.motor_temperature.unwrap().0 - 25.0).abs() < 1e-9);
    assert_eq!(state.power, Some(PowerState::SwitchOnDisabled));
}

#[test]
fn a_scan_finds_who_answers_and_who_only_beats() {
    let mut silent = Toy::new(9);
    silent.answers_left = Some(0);
    silent.send(0x700, &[4]);
    let mut bus = Bus::new(vec![zlac8030l(4), Toy::new(7).u32(0x1000, 0, 1), silent]);
    let network = bus.network.clone();
    let mut progress = Vec::new();
    let found = bus.block_on(network.scan(Duration::from_millis(100), |asked| progress.push(asked)));
    assert_eq!(found.iter().map(|node| node.node.raw()).collect::<Vec<_>>(), [4, 7, 9]);
    assert_eq!(found[0].models.first().map(|model| model.name), Some("zlac8030l"));
    assert!(found[0].doubt().is_some(), "the maker gives two models this identity");
    assert!(found[1].doubt().unwrap().contains("no model known"));
    assert!(found[2].identity.is_none());
    assert_eq!(progress, [32, 64, 96, 127]);
    // Four windows of 100 ms and the wait for late answers, not 127 times 100 ms.
    assert!(bus.now - Instant::from_secs(5) < Duration::from_millis(1_300), "{}", bus.now);
}

/// Nodes that are not there are waited for side by side: three times half a second behind the first, and for 3 s.
#[test]
fn a_scan_with_a_long_timeout_takes_that_long_once() {
    let mut bus = Bus::new(vec![zlac8030l(4), zlac8030l(127)]);
    let (network, began) = (bus.network.clone(), bus.now);
    let found = bus.block_on(network.scan(Duration::from_secs(3), |_| {}));
    assert_eq!(found.iter().map(|node| node.node.raw()).collect::<Vec<_>>(), [4, 127]);
    let took = bus.now - began;
    assert!((Duration::from_millis(4_400)..Duration::from_millis(4_700)).contains(&took), "{took:?}");
}

/// Web handlers and multi-threaded runtimes need it.
#[test]
fn futures_can_be_sent_between_threads() {
    fn assert_send<T: Send>(_: T) {}
    let (bus, drive) = bus_with(|_| {});
    let node = bus.network.node(node(4));
    assert_send(drive.enable());
    assert_send(drive.disable());
    assert_send(drive.quick_stop());
    assert_send(drive.stop());
    assert_send(drive.reset_fault());
    assert_send(drive.velocity(Rpm(1.0), MotionOptions::default()));
    assert_send(drive.move_absolute(Turns(1.0), MotionOptions::default()));
    assert_send(drive.state());
    assert_send(node.reset(Duration::ZERO));
    assert_send(bus.network.scan(Duration::ZERO, |_| {}));
    assert_send(bus.network.stop_all_moved());
}

#[test]
fn a_move_after_a_stop_replaces_the_halted_one() {
    let (mut bus, drive) = bus_with(|_| {});
    let network = bus.network.clone();
    bus.block_on(async {
        let options = MotionOptions { wait: false, ..MotionOptions::default() };
        drive.move_absolute(Turns(10.0), options).await.unwrap();
        network.sleep(Duration::from_secs(1)).await;
        drive.stop().await.unwrap();
    });
    let halted_at = object(&bus, 0x6064);
    assert!((8_000..8_600).contains(&halted_at), "{halted_at}");
    bus.block_on(drive.move_absolute(Turns(1.0), MotionOptions::default())).unwrap();
    assert_eq!(object(&bus, 0x6064), 4096);
    // Halt stays until the edge that takes the new set-point at once (bit 5).
    assert_eq!(toy(&bus).controlwords[6..], [0x010F, 0x010F, 0x3F, 0x0F]);
}

/// Two axes of one node, 800h apart (CiA 402), of which the second is the one looked at.
#[test]
fn the_second_axis_of_a_node_is_asked_at_its_own_objects() {
    static SERVO: Description =
        Description { axes: &[axis(Placement::FIRST, MODES), axis(Placement::IndexOffset(0x800), MODES)], ..CIA402 };
    let toy = Toy::new(4).u16(0x6041, 0, 0x0250).u16(0x6841, 0, 0x0237).u16(0x6840, 0, 0x0F).u8(0x6861, 0, 3);
    let mut bus = Bus::new(vec![toy]);
    let first = Drive::new(bus.network.node(node(4)), &SERVO);
    let second = first.axis(AxisId(1)).unwrap();
    assert_eq!((first.axis_id(), second.axis_id()), (AxisId::FIRST, AxisId(1)));
    let states = [&first, &second].map(|axis| bus.block_on(axis.statusword()).unwrap().state());
    assert_eq!(states, [Some(PowerState::SwitchOnDisabled), Some(PowerState::OperationEnabled)]);
    // Enabled already, by its own statusword: nothing is written.
    bus.block_on(second.enable()).unwrap();
    let error = first.axis(AxisId(2)).unwrap_err();
    assert!(matches!(error, Error::NoSuchAxis { axes: 2, .. }), "{error}");
    let unknown = Drive::of_unknown_model(bus.network.node(node(4)));
    assert!(matches!(unknown.axis(AxisId(1)), Err(Error::UnknownModel { .. })));
}

#[test]
fn a_value_that_was_sent_before_the_last_write_to_the_drive_is_not_believed() {
    let mut toy = Toy::new(4).u16(0x6041, 0, 0x0231).u16(0x6040, 0, 0);
    toy = toy.u8(0x6061, 0, 0);
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let drive = Drive::new(network.node(node(4)), model("zlim42c").unwrap());
    let map = PdoMap(vec![MappingRecord::from_raw(0x6041_0010)]);
    network.with_core(|core| core.image_mut().set_tpdo(node(4), PdoNumber::FIRST, 0x184, map));
    bus.toys[0].send(0x180, &[0x37, 0x02]);
    bus.settle();
    // Just come: believed, and not asked for.
    assert_eq!(bus.block_on(drive.statusword()).unwrap().0, 0x0237);
    assert!(bus.toys[0].requests.is_empty());
    // Written to since: asked.
    bus.block_on(drive.node().write(mux(0x6040, 0), 6_u16)).unwrap();
    assert_eq!(bus.block_on(drive.statusword()).unwrap().0, 0x0231);
    // Come again, and believed until it is as old as a poll.
    bus.toys[0].send(0x180, &[0x37, 0x02]);
    bus.settle();
    assert_eq!(bus.block_on(drive.statusword()).unwrap().0, 0x0237);
    bus.block_on(network.sleep(Duration::from_millis(10)));
    assert_eq!(bus.block_on(drive.statusword()).unwrap().0, 0x0231);
}
