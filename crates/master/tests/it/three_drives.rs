//! The same intents on a servo, a joint and a stepper of three manuals, on one virtual bus.

use std::time::Duration;

use crate::support::{mux, node};
use can::{Bitrate, Instant};
use cia402::{ModeOfOperation, PowerState};
use devices::{Departure, Description, HostWatch, PowerStyle, all, model};
use drives::mjoint::Model;
use master::drive::{Fact, HomingOptions, HostLoss, MotionOptions, Note};
use master::units::{Amperes, Degrees, Ramp, Rpm, Turns};
use master::{Drive, Error, Network};
use sim::machine::TimingMode;
use sim::machine::{mjoint, zlac8030l, zlim42c};
use sim::{Place, SwitchRange, World, block_on};

const JOINT: u8 = 1;
const STEPPER: u8 = 2;
const SERVO: u8 = 4;

/// The value of the ZL drives' bit rate objects for 500 kbit/s.
const K500: u16 = 1;

fn bench() -> (World, Network, [Drive; 3]) {
    let mut world = World::new(Bitrate::K500, 5);
    let network = Network::new();
    world.add_station(network.clone());
    let joint = Model::named("m4230e17b50").unwrap();
    world.add_drive(JOINT, Box::new(mjoint(joint, JOINT, Bitrate::K500))).unwrap();
    world.add_drive(STEPPER, Box::new(zlim42c(STEPPER, K500))).unwrap();
    world.add_drive(SERVO, Box::new(zlac8030l(SERVO, K500))).unwrap();
    let drives = [(JOINT, "m4230e17b50"), (STEPPER, "zlim42c"), (SERVO, "zlac8030l")]
        .map(|(id, name)| Drive::new(network.node(node(id)), model(name).unwrap()));
    world.run_until(Instant::from_secs(2));
    (world, network, drives)
}

fn id(drive: &Drive) -> u8 {
    drive.node().id().raw()
}

fn slowly() -> MotionOptions {
    let ramp = Some(Ramp::Time(Duration::from_millis(300)));
    MotionOptions { speed: Some(Rpm(60.0)), acceleration: ramp, deceleration: ramp, ..MotionOptions::default() }
}

fn range(low: Option<i64>, high: Option<i64>) -> SwitchRange {
    SwitchRange { low, high }
}

#[test]
fn sixty_revolutions_a_minute_are_the_same_at_every_shaft() {
    let (mut world, network, drives) = bench();
    for drive in &drives {
        for wanted in [60.0, -60.0] {
            block_on(&mut world, drive.velocity(Rpm(wanted), slowly())).unwrap().unwrap();
            block_on(&mut world, drive.supervise(Duration::from_secs(1))).unwrap().unwrap();
            // The rotor of a stepper swings about its speed: the mean of a tenth of a second.
            let mut sum = 0.0;
            for _ in 0..100 {
                world.run_for(Duration::from_millis(1));
                sum += world.report(id(drive)).unwrap().velocity_rpm;
            }
            assert!((sum / 100.0 - wanted).abs() < 1.5, "{drive:?}: {}", sum / 100.0);
            let state = block_on(&mut world, drive.state()).unwrap().unwrap();
            let Rpm(shown) = state.velocity.unwrap();
            assert!((shown - wanted).abs() < 3.0, "{drive:?} shows {shown}");
        }
        block_on(&mut world, drive.stop()).unwrap().unwrap();
        assert!(world.report(id(drive)).unwrap().velocity_rpm.abs() < 3.0, "{drive:?}");
    }
    assert!(network.moved().is_empty());
}

#[test]
fn the_same_606ch_is_a_tenth_of_a_revolution_a_minute_on_the_zlac_and_a_whole_one_on_the_zlim42_c() {
    let (mut world, _, [_, stepper, servo]) = bench();
    // "ZLAC8030L quick start guide V1.00", chapter 9; "ZLIM42-C user manual V1.03", 5.4.
    for (drive, counts_a_rpm) in [(&servo, 10.0), (&stepper, 1.0)] {
        block_on(&mut world, drive.velocity(Rpm(60.0), slowly())).unwrap().unwrap();
        block_on(&mut world, drive.supervise(Duration::from_secs(1))).unwrap().unwrap();
        let raw = block_on(&mut world, drive.node().read::<i32>(mux(0x606C, 0))).unwrap().unwrap();
        assert!((f64::from(raw) / counts_a_rpm - 60.0).abs() < 3.0, "{drive:?}: {raw}");
        let Rpm(shown) = block_on(&mut world, drive.state()).unwrap().unwrap().velocity.unwrap();
        assert!((shown - 60.0).abs() < 3.0, "{drive:?}: {shown}");
        block_on(&mut world, drive.stop()).unwrap().unwrap();
    }
}

#[test]
fn torque_is_mode_4_and_not_6_velocity_is_mode_3_and_not_2_on_both_zl_drives() {
    let (mut world, _, [_, stepper, servo]) = bench();
    let write = |world: &mut World, drive: &Drive, mode: i8| {
        block_on(world, drive.node().write(mux(0x6060, 0), mode)).unwrap().is_ok()
    };
    // 1 position, 3 velocity, 4 torque; 6 is homing, which only the stepper has. 2 is the velocity mode of CiA 402.
    let taken = |world: &mut World, drive: &Drive| [1, 2, 3, 4, 6].map(|mode| write(world, drive, mode));
    assert_eq!(taken(&mut world, &servo), [true, false, true, true, false]);
    assert_eq!(taken(&mut world, &stepper), [true, false, true, false, true]);
    block_on(&mut world, servo.torque(Amperes(0.2))).unwrap().unwrap();
    assert_eq!(block_on(&mut world, servo.node().read::<i8>(mux(0x6061, 0))).unwrap().unwrap(), 4);
    for drive in [&servo, &stepper] {
        block_on(&mut world, drive.stop()).unwrap().unwrap();
        block_on(&mut world, drive.velocity(Rpm(30.0), slowly())).unwrap().unwrap();
        assert_eq!(block_on(&mut world, drive.node().read::<i8>(mux(0x6061, 0))).unwrap().unwrap(), 3);
    }
}

#[test]
fn a_shaft_that_is_reported_to_have_reached_its_target_stands_there() {
    // As delivered: the joint's ramp is 20000 (r/min)/s, and its bit 10 comes while it still turns.
    let (mut world, _, drives) = bench();
    for drive in &drives {
        for degrees in [90.0, -30.0] {
            let moved = drive.move_absolute(Degrees(degrees), MotionOptions::default());
            block_on(&mut world, moved).unwrap().unwrap();
            let state = block_on(&mut world, drive.state()).unwrap().unwrap();
            let (Rpm(shown), Degrees(at)) = (state.velocity.unwrap(), state.angle.unwrap());
            assert!(shown.abs() < 1.0, "{drive:?}: {shown} r/min at {at} of {degrees} degrees");
            let turning = world.report(id(drive)).unwrap().velocity_rpm;
            assert!(turning.abs() < 2.0 && (at - degrees).abs() < 0.5, "{drive:?}: {turning} r/min at {at} degrees");
        }
    }
}

#[test]
fn ninety_degrees_are_a_quarter_turn_of_every_shaft() {
    let (mut world, _, drives) = bench();
    // Counts in a turn: 32768 of the encoder, 4000 pulses (2006h = 10), four edges of 1024 lines.
    for (drive, turn) in drives.iter().zip([32_768, 4_000, 4_096]) {
        let near = |world: &mut World, wanted: i64| {
            let report = world.report(id(drive)).unwrap();
            let at = report.rotor_position.unwrap_or(report.position);
            assert!((at - wanted).abs() <= turn / 100, "{drive:?}: {at} instead of {wanted}");
        };
        let began = world.now();
        block_on(&mut world, drive.move_absolute(Degrees(90.0), slowly())).unwrap().unwrap();
        near(&mut world, turn / 4);
        // A quarter turn at a turn a second with ramps of 0.3 s: 0.55 s.
        let seconds = (world.now() - began).as_secs_f64();
        assert!((0.5..1.2).contains(&seconds), "{drive:?}: {seconds}");
        block_on(&mut world, drive.move_relative(Turns(-0.5), slowly())).unwrap().unwrap();
        near(&mut world, -turn / 4);
        let Degrees(angle) = block_on(&mut world, drive.state()).unwrap().unwrap().angle.unwrap();
        assert!((angle + 90.0).abs() < 4.0, "{drive:?}: {angle}");
    }
}

#[test]
fn every_drive_enables_stops_quickly_comes_back_and_lets_go() {
    let (mut world, _, drives) = bench();
    let power = |world: &mut World, drive: &Drive| block_on(world, drive.state()).unwrap().unwrap().power;
    for drive in &drives {
        assert_eq!(power(&mut world, drive), Some(PowerState::SwitchOnDisabled), "{drive:?}");
        block_on(&mut world, drive.enable()).unwrap().unwrap();
        assert_eq!(power(&mut world, drive), Some(PowerState::OperationEnabled), "{drive:?}");
        block_on(&mut world, drive.velocity(Rpm(60.0), slowly())).unwrap().unwrap();
        block_on(&mut world, drive.quick_stop()).unwrap().unwrap();
        assert_ne!(power(&mut world, drive), Some(PowerState::OperationEnabled), "{drive:?}");
        world.run_for(Duration::from_millis(100));
        assert!(world.report(id(drive)).unwrap().velocity_rpm.abs() < 2.0, "{drive:?}");
        // The speed from before is not taken up again.
        block_on(&mut world, drive.enable()).unwrap().unwrap();
        world.run_for(Duration::from_millis(500));
        assert!(world.report(id(drive)).unwrap().velocity_rpm.abs() < 2.0, "{drive:?}");
        block_on(&mut world, drive.disable()).unwrap().unwrap();
        assert_eq!(power(&mut world, drive), Some(PowerState::SwitchOnDisabled), "{drive:?}");
    }
}

#[test]
fn a_move_that_was_halted_gives_way_to_the_next_one_on_every_drive() {
    let (mut world, _, drives) = bench();
    for drive in &drives {
        let not_waiting = MotionOptions { wait: false, ..slowly() };
        block_on(&mut world, drive.move_absolute(Turns(20.0), not_waiting)).unwrap().unwrap();
        world.run_for(Duration::from_millis(500));
        block_on(&mut world, drive.stop()).unwrap().unwrap();
        block_on(&mut world, drive.move_absolute(Turns(0.0), slowly())).unwrap().unwrap();
        let Degrees(angle) = block_on(&mut world, drive.state()).unwrap().unwrap().angle.unwrap();
        assert!(angle.abs() < 4.0, "{drive:?}: {angle}");
    }
}

#[test]
fn a_move_after_a_speed_stops_first_and_reports_it_on_every_drive() {
    let (mut world, _, drives) = bench();
    for drive in &drives {
        block_on(&mut world, drive.velocity(Rpm(120.0), slowly())).unwrap().unwrap();
        let moved = block_on(&mut world, drive.move_absolute(Turns(1.0), slowly())).unwrap().unwrap();
        let note = Note::StoppedFirst { before: ModeOfOperation::PROFILE_VELOCITY };
        assert!(moved.notes.contains(&note), "{drive:?}: {moved:?}");
        let Degrees(angle) = block_on(&mut world, drive.state()).unwrap().unwrap().angle.unwrap();
        assert!((angle - 360.0).abs() < 4.0, "{drive:?}: {angle}");
        let again = block_on(&mut world, drive.move_absolute(Turns(0.0), slowly())).unwrap().unwrap();
        assert!(!again.notes.contains(&note), "{drive:?}: {again:?}");
    }
}

#[test]
fn a_current_is_pushed_where_the_model_has_a_torque_mode_and_refused_where_not() {
    let (mut world, _, [joint, stepper, servo]) = bench();
    block_on(&mut world, servo.torque(Amperes(0.5))).unwrap().unwrap();
    for drive in [joint, stepper] {
        let error = block_on(&mut world, drive.torque(Amperes(0.5))).unwrap().unwrap_err();
        assert!(matches!(error, Error::NoSuchMode { mode: ModeOfOperation::PROFILE_TORQUE, .. }), "{error}");
        assert!(error.to_string().contains(drive.description().unwrap().title), "{error}");
    }
}

#[test]
fn a_note_describes_what_each_drive_does_without_its_host() {
    let (mut world, _, drives) = bench();
    for drive in &drives {
        let report = block_on(&mut world, drive.velocity(Rpm(30.0), slowly())).unwrap().unwrap();
        let [Note::HostLoss(loss)] = report.notes[..] else { panic!("{drive:?}: {:?}", report.notes) };
        // 2000h is 1000 ms as delivered; the joint's watch is not armed; the stepper has none.
        let expected = match id(drive) {
            SERVO => HostLoss::StopsInSilence { object: mux(0x2000, 0), time: Duration::from_secs(1) },
            JOINT => HostLoss::NotArmed { object: mux(0x1016, 1) },
            _ => HostLoss::GoesOn,
        };
        assert_eq!(loss, expected, "{drive:?}");
        block_on(&mut world, drive.stop()).unwrap().unwrap();
    }
}

#[test]
fn the_stepper_homes_on_a_limit_switch() {
    let (mut world, network, [_, stepper, _]) = bench();
    // 2030h:02 = 3: X0 is the negative limit ("ZLIM42-C user manual V1.03", 5.4).
    block_on(&mut world, stepper.node().write(mux(0x2030, 2), 3_u16)).unwrap().unwrap();
    let set = |drive: &mut dyn sim::VirtualDrive, now| drive.set_switch(0, range(None, Some(-2000)), now);
    world.with_drive(STEPPER, |drive, now| set(drive, now)).unwrap().unwrap();
    let report = block_on(&mut world, stepper.home(17, HomingOptions::default())).unwrap().unwrap();
    // Half a turn at 120 r/min and its ramps.
    let seconds = report.reached_after.unwrap().as_secs_f64();
    assert!((0.25..2.0).contains(&seconds), "{seconds}");
    // The edge is 0 now: the shaft has gone on from there by its ramp only.
    let Degrees(angle) = block_on(&mut world, stepper.state()).unwrap().unwrap().angle.unwrap();
    assert!(angle.abs() < 90.0, "{angle}");
    assert!(network.moved().is_empty());
    // It homes again, though the bits of the run before still say that it has.
    block_on(&mut world, stepper.move_absolute(Turns(0.5), slowly())).unwrap().unwrap();
    let again = block_on(&mut world, stepper.home(17, HomingOptions::default())).unwrap().unwrap();
    assert!(again.reached_after.unwrap() > Duration::from_millis(250), "{again:?}");
}

#[test]
fn the_joint_homes_as_soon_as_its_mode_is_written() {
    let (mut world, network, [joint, ..]) = bench();
    let dir =
        world.with_drive(JOINT, |drive, _| drive.inputs().iter().position(|name| *name == "DIR")).unwrap().unwrap();
    let switch = range(None, Some(-16_384));
    world.with_drive(JOINT, |drive, now| drive.set_switch(dir, switch, now)).unwrap().unwrap();
    for _ in 0..2 {
        let report = block_on(&mut world, joint.home(17, HomingOptions::default())).unwrap().unwrap();
        assert!(report.reached_after.is_some());
        let state = block_on(&mut world, joint.state()).unwrap().unwrap();
        assert!(state.statusword_words().contains(&"homing attained"), "{state:?}");
        assert!(state.angle.unwrap().0.abs() < 45.0, "{state:?}");
        // Half a turn back, and once more.
        block_on(&mut world, joint.move_absolute(Turns(0.5), slowly())).unwrap().unwrap();
    }
    assert!(network.moved().is_empty());
}

#[test]
fn homing_that_fails_or_finds_nothing_is_explained_and_stopped() {
    let (mut world, _, [joint, stepper, servo]) = bench();
    let error = block_on(&mut world, servo.home(17, HomingOptions::default())).unwrap().unwrap_err();
    assert!(matches!(error, Error::NoSuchMode { mode: ModeOfOperation::HOMING, .. }), "{error}");
    let error = block_on(&mut world, joint.home(24, HomingOptions::default())).unwrap().unwrap_err();
    assert!(matches!(&error, Error::OutOfLimits { limits, .. } if (limits.low, limits.high) == (17, 22)), "{error}");
    // A joint has its speed of the search in the ones digit of 6083h ("M Robot Joint Motor CanOpen Manual", 5.01), and in no object of its own.
    let slowly = HomingOptions { speed: Some(Rpm(2.0)), ..HomingOptions::default() };
    let error = block_on(&mut world, joint.home(17, slowly)).unwrap().unwrap_err();
    assert!(matches!(error, Error::NoSuchQuantity { .. }), "{error}");
    assert!(world.report(JOINT).unwrap().velocity_rpm == 0.0, "nothing moves");
    // Method 0 is accepted and fails at once ("ZLIM42-C user manual V1.03", 5.3.6: bit 8 off, 10 on, 14 off).
    let error = block_on(&mut world, stepper.home(0, HomingOptions::default())).unwrap().unwrap_err();
    assert!(error.to_string().contains("ended homing with method 0"), "{error}");
    let options = HomingOptions { limit: Duration::from_secs(2), ..HomingOptions::default() };
    for drive in [joint, stepper] {
        let error = block_on(&mut world, drive.home(17, options)).unwrap().unwrap_err();
        assert!(error.to_string().contains("still looks for its reference"), "{error}");
        assert!(error.to_string().contains("it has been quick-stopped and stands"), "{error}");
        assert!(world.report(id(&drive)).unwrap().velocity_rpm.abs() < 2.0, "{drive:?} goes on");
    }
}

#[test]
fn homing_cut_short_by_the_guard_stops_and_is_not_taken_up_again() {
    let (mut world, network, [joint, stepper, _]) = bench();
    for drive in [joint, stepper] {
        let not_waiting = HomingOptions { wait: false, ..HomingOptions::default() };
        block_on(&mut world, drive.home(17, not_waiting)).unwrap().unwrap();
        world.run_for(Duration::from_millis(500));
        assert!(world.report(id(&drive)).unwrap().velocity_rpm < -50.0, "{drive:?}");
        block_on(&mut world, async {
            drop(network.stop_guard());
            network.sleep(Duration::from_millis(500)).await;
        })
        .unwrap();
        assert!(world.report(id(&drive)).unwrap().velocity_rpm.abs() < 2.0, "{drive:?} goes on");
        block_on(&mut world, drive.enable()).unwrap().unwrap();
        world.run_for(Duration::from_millis(500));
        assert!(world.report(id(&drive)).unwrap().velocity_rpm.abs() < 2.0, "{drive:?} goes on");
    }
}

#[test]
fn a_blocked_joint_is_explained_by_its_alarm_and_enabled_after_a_reset() {
    let (mut world, _, [joint, ..]) = bench();
    world.with_drive(JOINT, |drive, now| drive.set_rotor_locked(true, now)).unwrap().unwrap();
    let moving = MotionOptions { speed: Some(Rpm(500.0)), ..MotionOptions::default() };
    let error = block_on(&mut world, joint.move_relative(Turns(200.0), moving)).unwrap().unwrap_err();
    let Error::NotReached(explanation) = &error else { panic!("{error}") };
    let coded = |fact: &Fact| matches!(fact, Fact::FaultCode(code, rows) if *code != 0 && rows.len() == 1);
    assert!(explanation.facts.iter().any(coded), "{error}");
    assert!(explanation.conclusion.starts_with("The drive is at fault: "), "{error}");
    let state = block_on(&mut world, joint.state()).unwrap().unwrap();
    assert_eq!(state.power, Some(PowerState::Fault), "{state:?}");
    let error = block_on(&mut world, joint.enable()).unwrap().unwrap_err();
    assert!(error.to_string().contains("The drive is at fault: "), "{error}");
    world.with_drive(JOINT, |drive, now| drive.set_rotor_locked(false, now)).unwrap().unwrap();
    block_on(&mut world, joint.reset_fault()).unwrap().unwrap();
    let state = block_on(&mut world, joint.state()).unwrap().unwrap();
    assert_eq!(
        (state.power, state.fault_code),
        (Some(PowerState::SwitchOnDisabled), Some(0)),
        "the reset moves nothing"
    );
    block_on(&mut world, joint.enable()).unwrap().unwrap();
}

#[test]
fn a_quick_stop_does_not_energise_a_motor_without_power() {
    let (mut world, _, [joint, ..]) = bench();
    block_on(&mut world, joint.quick_stop()).unwrap().unwrap();
    let state = block_on(&mut world, joint.state()).unwrap().unwrap();
    assert_eq!((state.power, state.statusword.0), (Some(PowerState::SwitchOnDisabled), 0x0404));
}

#[test]
fn an_alarm_that_stops_nothing_is_reset_or_explained_and_does_not_stop_the_joint() {
    let (mut world, network, [joint, ..]) = bench();
    block_on(&mut world, joint.velocity(Rpm(60.0), slowly())).unwrap().unwrap();
    world.apply(sim::Place::node(JOINT), &sim::Stimulus::Battery(false)).unwrap().unwrap();
    block_on(&mut world, network.sleep(Duration::from_millis(100))).unwrap();
    // 10h: the turns are unknown until an origin is set ("M Robot Joint Motor CanOpen Manual", 5.12).
    let error = block_on(&mut world, joint.reset_fault()).unwrap().unwrap_err();
    assert!(error.to_string().contains("battery lost") && error.to_string().contains("60006"), "{error}");
    block_on(&mut world, joint.supervise(Duration::from_millis(500))).unwrap().unwrap();
    assert!(world.report(JOINT).unwrap().velocity_rpm > 50.0);
    for step in [60_006_u16, 60_016] {
        block_on(&mut world, joint.node().write(mux(0x260A, 0), step)).unwrap().unwrap();
    }
    block_on(&mut world, joint.reset_fault()).unwrap().unwrap();
    assert_eq!(block_on(&mut world, joint.state()).unwrap().unwrap().fault_code, Some(0));
}

#[test]
fn saving_a_zlac_writes_2009h_2_and_the_same_bytes_set_250_kbit_s_on_a_zlim42_c() {
    let (mut world, _, [_, stepper, servo]) = bench();
    let probe = world.add_probe();
    block_on(&mut world, servo.save()).unwrap().unwrap();
    let mut heard = Vec::new();
    while let Some((_, frame)) = world.poll_received(probe) {
        heard.push(frame.to_string());
    }
    assert!(heard.contains(&"604#2B09200002000000".to_owned()), "{heard:?}");

    let rate = || stepper.node().read::<u16>(mux(0x2009, 0));
    assert_eq!(block_on(&mut world, rate()).unwrap().unwrap(), K500);
    // A program that takes the stepper for a ZLAC, whose identity it has, is stopped before it writes.
    let mistaken = Drive::new(stepper.node().clone(), model("zlac8030l").unwrap());
    for outcome in [block_on(&mut world, mistaken.save()).unwrap(), block_on(&mut world, mistaken.restore()).unwrap()] {
        let error = outcome.unwrap_err();
        assert!(matches!(error, Error::OtherModel { object, .. } if object == mux(0x2029, 0)), "{error}");
    }
    assert_eq!(block_on(&mut world, rate()).unwrap().unwrap(), K500);
    // One that is not given the model, too.
    let unknown = Drive::of_unknown_model(stepper.node().clone());
    assert!(matches!(block_on(&mut world, unknown.save()).unwrap(), Err(Error::UnknownModel { .. })));
    // This is what would have happened.
    block_on(&mut world, stepper.node().write(mux(0x2009, 0), 2_u16)).unwrap().unwrap();
    assert_eq!(block_on(&mut world, rate()).unwrap().unwrap(), 2);
    let table = model("zlim42c").unwrap().dictionary;
    assert_eq!(table.row(table.find(mux(0x2009, 0)).unwrap()).meaning(2), Some("250 kbit/s"));
}

#[test]
fn every_drive_saves_by_its_own_command_and_restores_where_it_can() {
    let (mut world, _, [joint, stepper, servo]) = bench();
    for drive in [&joint, &stepper, &servo] {
        block_on(&mut world, drive.save()).unwrap().unwrap();
    }
    for drive in [&stepper, &servo] {
        block_on(&mut world, drive.restore()).unwrap().unwrap();
    }
    let error = block_on(&mut world, joint.restore()).unwrap().unwrap_err();
    assert!(matches!(error, Error::NoFactorySettings { .. }), "{error}");
    // A joint taken for a servo says another identity.
    let mistaken = Drive::new(joint.node().clone(), model("zlac8030l").unwrap());
    assert!(matches!(block_on(&mut world, mistaken.save()).unwrap(), Err(Error::WrongModel { .. })));
}

/// "After the parameter is saved and sent 1, it will display 2 to indicate that the save is successful" ("M Robot Joint Motor CanOpen
/// Manual", 5.01).
#[test]
fn a_joint_has_saved_when_2614h_reads_2_and_what_it_has_saved_outlives_a_reset() {
    for seed in 1..=8 {
        let mut world = World::new(Bitrate::M1, seed);
        let network = Network::new();
        world.add_station(network.clone());
        let joint = Model::named("m4230e17b50").unwrap();
        world.add_drive(JOINT, Box::new(mjoint(joint, JOINT, Bitrate::M1))).unwrap();
        world.set_timing(TimingMode::Device);
        world.run_until(Instant::from_secs(2));
        let drive = Drive::new(network.node(node(JOINT)), model("m4230e17b50").unwrap());
        let amplitude = mux(0x2618, 0);
        block_on(&mut world, drive.node().write(amplitude, 305_u16)).unwrap().unwrap();
        block_on(&mut world, drive.save()).unwrap().unwrap();
        block_on(&mut world, drive.node().reset(Duration::from_secs(2))).unwrap().unwrap();
        assert_eq!(block_on(&mut world, drive.node().read::<u16>(amplitude)).unwrap().unwrap(), 305, "seed {seed}");

        world.apply(Place::node(JOINT), &"fault eeprom on".parse().unwrap()).unwrap().unwrap();
        let error = block_on(&mut world, drive.save()).unwrap().unwrap_err();
        assert!(matches!(error, Error::NotStored { found: 1, done: 2, .. }), "{error}");
    }
}

#[test]
fn models_of_one_identity_and_different_tables_have_objects_that_distinguish_them() {
    let has = |profile: &Description, object| profile.dictionary.find(object).is_ok();
    for one in all().iter() {
        for other in all().iter() {
            let same_table = one.same_objects(other);
            if one.identity != other.identity || same_table {
                continue;
            }
            let object = one.distinguishing_object.unwrap_or_else(|| panic!("{} and {}", one.name, other.name));
            assert!(has(one, object) && !has(other, object), "{} and {}", one.name, other.name);
            assert!(one.departures(all()).any(|departure| departure == Departure::IdentityShared(Some(object))));
        }
    }
}

#[test]
fn a_description_says_of_power_and_homing_what_its_departures_say() {
    for profile in all().iter() {
        let listed: Vec<_> = profile.departures(all()).map(|departure| departure.key()).collect();
        let departs = |key| listed.contains(&key);
        let (name, axis) = (profile.name, profile.first_axis().unwrap());
        assert_eq!(axis.power != PowerStyle::Cia402, departs("echoes_controlword"), "{name}");
        assert_eq!(axis.mode_display == mux(0x6060, 0), departs("no_mode_display"), "{name}");
        let by_silence = matches!(profile.host_watch, HostWatch::Silence { .. });
        assert_eq!(by_silence, departs("watches_for_silence"), "{name}");
        let half_milliseconds = [profile.pdo.inhibit_unit_ns, profile.pdo.event_timer_unit_ns] == [500_000; 2];
        assert_eq!(half_milliseconds, departs("pdo_timers"), "{name}");
        assert_eq!(axis.homing.is_some(), axis.modes.contains(&ModeOfOperation::HOMING), "{name}");
        assert!(profile.dictionary.find(axis.mode_display).is_ok(), "{name}");
    }
}
