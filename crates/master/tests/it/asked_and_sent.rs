//! What is asked for in physical units and what the drive is sent for it: rounded to whole counts and reported, refused
//! where nothing would be left of it, and held to the limits in force. On the three drives, in their manuals' units.

use std::time::Duration;

use crate::explain::{Bench, NODE};
use crate::support::{mux, node};
use can::{Bitrate, Instant};
use devices::{all, model};
use drives::mjoint::Model;
use master::drive::{Commanded, MotionOptions};
use master::units::{Amperes, Counts, Degrees, Ramp, Rpm, Shown, Turns};
use master::{Drive, Error, Network};
use sim::machine::{mjoint, zlac8030l, zlim42c};
use sim::{World, block_on};

const JOINT: u8 = 1;
const STEPPER: u8 = 2;
const SERVO: u8 = 4;
const K500: u16 = 1;

fn bench() -> (World, [Drive; 3]) {
    let mut world = World::new(Bitrate::K500, 5);
    let network = Network::new();
    world.add_station(network.clone());
    world.add_drive(JOINT, Box::new(mjoint(Model::named("m4230e17b50").unwrap(), JOINT, Bitrate::K500))).unwrap();
    world.add_drive(STEPPER, Box::new(zlim42c(STEPPER, K500))).unwrap();
    world.add_drive(SERVO, Box::new(zlac8030l(SERVO, K500))).unwrap();
    let drives = [(JOINT, "m4230e17b50"), (STEPPER, "zlim42c"), (SERVO, "zlac8030l")]
        .map(|(id, name)| Drive::new(network.node(node(id)), model(name).unwrap()));
    world.run_until(Instant::from_secs(2));
    (world, drives)
}

fn no_wait() -> MotionOptions {
    MotionOptions { wait: false, ..MotionOptions::default() }
}

/// What, how much was asked for, how much was sent, in counts, and whether that is reported.
fn values(commanded: &[Commanded]) -> Vec<(&'static str, f64, f64, i64, bool)> {
    commanded.iter().map(|sent| (sent.what, sent.requested, sent.commanded, sent.raw, sent.is_rounded())).collect()
}

#[test]
fn a_speed_between_two_counts_is_reported_with_what_was_sent_on_all_three_drives() {
    let (mut world, drives) = bench();
    for drive in &drives {
        // 60FFh counts whole r/min on each of them.
        let report = block_on(&mut world, drive.velocity(Rpm(2.7), MotionOptions::default())).unwrap().unwrap();
        assert_eq!(values(&report.commanded), [("speed", 2.7, 3.0, 3, true)], "{drive:?}");
        let target = block_on(&mut world, drive.node().read::<i32>(mux(0x60FF, 0))).unwrap().unwrap();
        assert_eq!(target, 3);
        let report = block_on(&mut world, drive.velocity(Rpm(-60.0), no_wait())).unwrap().unwrap();
        assert_eq!(values(&report.commanded), [("speed", -60.0, -60.0, -60, false)], "{drive:?}");
    }
}

#[test]
fn what_would_come_to_nothing_is_refused_with_the_worth_of_a_count_and_what_makes_it_finer() {
    let (mut world, drives) = bench();
    for drive in &drives {
        let error = block_on(&mut world, drive.velocity(Rpm(0.4), no_wait())).unwrap().unwrap_err();
        assert!(matches!(error, Error::TooFine { step: Shown(1.0), .. }), "{error}");
        let error = block_on(&mut world, drive.move_relative(Degrees(0.004), no_wait())).unwrap().unwrap_err();
        assert!(matches!(error, Error::TooFine { unit: "deg", .. }), "{error}");
        assert!(!drive.node().network().moved().contains(drive.node().id()), "nothing was begun");
        // Zero is not rounded.
        block_on(&mut world, drive.velocity(Rpm(0.0), no_wait())).unwrap().unwrap();
    }
    let error = block_on(&mut world, drives[2].velocity(Rpm(0.4), no_wait())).unwrap().unwrap_err().to_string();
    assert!(
        error.contains("0.4 r/min is too little for 60FFh:00 target_velocity: one count of it is 1 r/min"),
        "{error}"
    );
    assert!(error.contains("by 202Fh:05 set_speed_resolution = 1"), "{error}");
}

#[test]
fn the_resolution_that_is_set_on_the_drive_counts() {
    let (mut world, [_, _, servo]) = bench();
    // "ZLAC8030L quick start guide V1.00", 5.3: 10 makes a count 0.1 r/min, after saving and a restart.
    let restart = async {
        servo.node().write(mux(0x202F, 5), 10_u16).await?;
        servo.save().await?;
        servo.node().reset(Duration::from_secs(5)).await?;
        servo.velocity(Rpm(2.7), MotionOptions::default()).await
    };
    let report = block_on(&mut world, restart).unwrap().unwrap();
    assert_eq!(values(&report.commanded), [("speed", 2.7, 2.7, 27, false)]);
    world.run_for(Duration::from_secs(1));
    let speed = world.report(SERVO).unwrap().velocity_rpm;
    assert!((speed - 2.7).abs() < 0.2, "{speed}");
    let limits = block_on(&mut world, servo.limits(mux(0x60FF, 0))).unwrap().unwrap();
    assert_eq!((limits.low, limits.high, limits.counts_per_unit()), (-10_000, 10_000, 10));
}

#[test]
fn angles_currents_ramps_and_profile_velocities_are_reported_too() {
    let (mut world, [joint, stepper, servo]) = bench();
    let options = MotionOptions {
        speed: Some(Rpm(30.4)),
        acceleration: Some(Ramp::Time(Duration::from_micros(300_600))),
        ..MotionOptions::default()
    };
    // 4096 counts a turn (200Bh = 1024 lines): 1 degree is 11.4 of them.
    let report = block_on(&mut world, servo.move_absolute(Degrees(1.0), options)).unwrap().unwrap();
    let counts = 11.0 * 360.0 / 4096.0;
    let expected = [
        ("position", 1.0, counts, 11, true),
        ("profile velocity", 30.4, 30.0, 30, true),
        ("acceleration", 300.6, 301.0, 301, true),
    ];
    assert_eq!(values(&report.commanded), expected);
    let report = block_on(&mut world, servo.move_absolute(Counts(32), no_wait())).unwrap().unwrap();
    assert_eq!(values(&report.commanded), [("position", 32.0, 32.0, 32, false)]);
    let report = block_on(&mut world, servo.torque(Amperes(0.0107))).unwrap().unwrap();
    assert_eq!(values(&report.commanded), [("current", 0.0107, 0.011, 11, true)]);
    let error = block_on(&mut world, servo.torque(Amperes(0.0004))).unwrap().unwrap_err();
    assert!(matches!(error, Error::TooFine { unit: "A", .. }), "{error}");

    // The joint has one acceleration for both: the gentler of two wishes, and the other wish learns of it.
    let ramps = MotionOptions {
        acceleration: Some(Ramp::RpmPerSecond(100.0)),
        deceleration: Some(Ramp::RpmPerSecond(200.0)),
        ..no_wait()
    };
    let report = block_on(&mut world, joint.velocity(Rpm(60.0), ramps)).unwrap().unwrap();
    assert_eq!(report.commanded[1..].iter().map(Commanded::is_rounded).collect::<Vec<_>>(), [false, true]);
    assert_eq!(values(&report.commanded)[2], ("deceleration", 200.0, 100.0, 100, true));

    // A rate steeper than a millisecond can say gets that: 0 ms would be no ramp at all.
    let steep = MotionOptions { acceleration: Some(Ramp::RpmPerSecond(1e6)), ..no_wait() };
    let report = block_on(&mut world, stepper.velocity(Rpm(60.0), steep)).unwrap().unwrap();
    assert_eq!(values(&report.commanded)[1], ("acceleration", 1e6, 60_000.0, 1, true));
    let short = MotionOptions { acceleration: Some(Ramp::Time(Duration::from_micros(300))), ..no_wait() };
    let error = block_on(&mut world, stepper.velocity(Rpm(-60.0), short)).unwrap().unwrap_err();
    assert!(matches!(error, Error::TooFine { unit: "ms", .. }), "{error}");
}

#[test]
fn a_ramp_for_a_speed_that_does_not_change_is_left_as_it_is() {
    let (mut world, [_, _, servo]) = bench();
    block_on(&mut world, servo.velocity(Rpm(60.0), MotionOptions::default())).unwrap().unwrap();
    block_on(&mut world, servo.supervise(Duration::from_secs(1))).unwrap().unwrap();
    let again = MotionOptions { acceleration: Some(Ramp::RpmPerSecond(120.0)), ..no_wait() };
    let report = block_on(&mut world, servo.velocity(Rpm(60.0), again)).unwrap().unwrap();
    assert_eq!(report.commanded.len(), 1);
    // As delivered: 500 ms.
    assert_eq!(block_on(&mut world, servo.node().read::<u32>(mux(0x6083, 0))).unwrap().unwrap(), 500);
}

#[test]
fn a_refusal_names_the_limit_in_force_and_where_it_comes_from() {
    let (mut world, [_, stepper, servo]) = bench();
    let said = |world: &mut World, drive: &Drive, rpm| {
        let error = block_on(world, drive.velocity(Rpm(rpm), no_wait())).unwrap().unwrap_err();
        assert!(matches!(error, Error::OutOfLimits { .. }), "{error}");
        error.to_string()
    };
    // 60FFh: -1000 to 1000 r/min on the one, -3000 to 3000 on the other.
    let text = said(&mut world, &servo, 9999.0);
    assert!(text.contains("60FFh:00 target_velocity, which takes -1000 to 1000 in units of r/min"), "{text}");
    assert!(text.contains("by 202Fh:05 set_speed_resolution = 1"), "{text}");
    assert!(said(&mut world, &stepper, 9999.0).contains("takes -3000 to 3000"));

    // 200Ah, the motor's largest speed, is taken by the drive and held to: said before anything moves.
    block_on(&mut world, servo.node().write(mux(0x200A, 0), 500_u16)).unwrap().unwrap();
    let text = said(&mut world, &servo, -800.0);
    assert!(text.contains("acts up to 500, by 200Ah:00 maximum_speed_of_motor = 500"), "{text}");
    block_on(&mut world, servo.velocity(Rpm(500.0), no_wait())).unwrap().unwrap();
    let fast = MotionOptions { speed: Some(Rpm(501.0)), ..no_wait() };
    let error = block_on(&mut world, servo.move_absolute(Turns(1.0), fast)).unwrap().unwrap_err().to_string();
    assert!(error.contains("6081h:00") && error.contains("maximum_speed_of_motor = 500"), "{error}");
    // 2015h in 0.1 A holds 6071h in mA.
    block_on(&mut world, servo.disable()).unwrap().unwrap();
    block_on(&mut world, servo.node().write(mux(0x2015, 0), 100_u16)).unwrap().unwrap();
    let error = block_on(&mut world, servo.torque(Amperes(10.1))).unwrap().unwrap_err().to_string();
    assert!(error.contains("acts up to 10000, by 2015h:00 maximum_current = 100"), "{error}");
    block_on(&mut world, servo.torque(Amperes(10.0))).unwrap().unwrap();
}

#[test]
fn what_a_row_says_of_its_limits_names_objects_of_the_same_model_in_units_that_fit() {
    /// Base units in one count, and the base unit.
    fn worth(unit: &str) -> (f64, &str) {
        match unit {
            "mA" => (1e-3, "A"),
            "0.1 A" => (0.1, "A"),
            _ => (1.0, unit),
        }
    }
    let mut found = 0;
    for profile in all().iter() {
        for row in profile.dictionary.rows() {
            let moved_by = [row.resolution, row.held_to.map(|held_to| held_to.object)];
            for object in moved_by.into_iter().flatten() {
                found += 1;
                assert!(profile.row(object).is_some(), "{} of the {}: {object}", row.mux(), profile.name);
            }
            let Some(held_to) = row.held_to else { continue };
            let ((count, unit), (other, same)) = (worth(row.unit), worth(profile.row(held_to.object).unwrap().unit));
            assert_eq!(unit, same, "{} of the {}", row.mux(), profile.name);
            assert!((held_to.counts as f64 * count - other).abs() < 1e-12, "{} of the {}", row.mux(), profile.name);
        }
    }
    assert!(found >= 4, "{found}");
}

/// CiA 402-2, 10.3: 6081h is the speed of a position move. As the servo has it, in increments per second, a quarter of its turn of
/// 131072 increments takes 9.1 h at 1.
#[test]
fn a_move_that_would_not_end_is_refused_before_anything_moves_with_the_object_and_what_to_do() {
    for (name, raw, why) in [
        ("cia402", 0, "profile velocity (6081h:00) is 0"),
        ("m4230e17b50", 0, "profile velocity (6081h:00) is 0"),
        ("cia402", 1, "profile velocity (6081h:00) of 0.000458 r/min"),
    ] {
        let mut bench = Bench::new(name);
        bench.write(mux(0x6081, 0), raw);
        let (drive, began) = (bench.drive.clone(), bench.world.now());
        let mut turn = |options| block_on(&mut bench.world, drive.move_absolute(Degrees(90.0), options)).unwrap();
        let error = turn(MotionOptions::default()).unwrap_err();
        let Error::NotReached(refused) = &error else { panic!("{name}: {error}") };
        assert!(refused.conclusion.contains(why), "{error}");
        assert!(refused.advice.contains("--profile-velocity"), "{error}");
        assert!(!drive.node().network().moved().contains(node(NODE)), "{name}");
        // With a speed of its own it is not refused.
        let at = |rpm| MotionOptions { speed: Some(Rpm(rpm)), ..MotionOptions::default() };
        assert!(turn(at(30.0)).is_ok(), "{name}");
        assert!(bench.world.now() - began < Duration::from_secs(10), "{name}");
    }
    let mut bench = Bench::new("cia402");
    bench.write(mux(0x6081, 0), 1);
    let (drive, within) = (bench.drive.clone(), Some(Duration::from_secs(3)));
    let options = MotionOptions { within, ..MotionOptions::default() };
    let error = block_on(&mut bench.world, drive.move_absolute(Degrees(90.0), options)).unwrap().unwrap_err();
    // 90 degrees at 30 / 65536 r/min.
    assert!(error.to_string().contains("the way takes 32768.0 s, and 3 s were given. Nothing has moved"), "{error}");
    assert!(!bench.drive.node().network().moved().contains(node(NODE)));
}

/// A free shaft coasts for seconds when its torque is taken away: its friction alone brakes it.
#[test]
fn a_free_shaft_in_profile_torque_is_brought_to_rest_by_a_stop_and_its_torque_does_not_come_back() {
    for (name, current_a) in [("zlac8030l", 1.5), ("cia402", 0.5)] {
        let mut bench = Bench::new(name);
        let drive = bench.drive.clone();
        bench.done(drive.torque(Amperes(current_a)));
        bench.done(drive.supervise(Duration::from_secs(2)));
        assert!(bench.world.report(NODE).unwrap().velocity_rpm > 100.0, "{name}");
        let began = bench.world.now();
        bench.done(drive.stop());
        assert!(bench.world.now() - began < Duration::from_secs(2), "{name}");
        assert!(bench.world.report(NODE).unwrap().velocity_rpm.abs() < 1.0, "{name}");
        assert!(drive.node().network().moved().is_empty(), "{name}");
        bench.done(drive.enable());
        bench.world.run_for(Duration::from_secs(1));
        assert!(bench.world.report(NODE).unwrap().velocity_rpm.abs() < 1.0, "{name}");
    }
}

/// ZLAC8030L: 2015h is the largest current, in 0.1 A. CiA 402-2, torque profile: 6072h and 6073h are thousandths of what is rated.
#[test]
fn what_limits_a_current_is_the_least_of_the_objects_that_do() {
    let limit = |bench: &mut Bench| {
        let drive = bench.drive.clone();
        bench.done(drive.current_limit()).map(|Amperes(current)| current)
    };
    let mut servo = Bench::new("zlac8030l");
    servo.write(mux(0x2015, 0), 100);
    assert_eq!(limit(&mut servo), Some(10.0));
    let mut cia402 = Bench::new("cia402");
    cia402.write(mux(0x6072, 0), 1000);
    let rated = limit(&mut cia402).unwrap();
    cia402.write(mux(0x6072, 0), 500);
    assert!((limit(&mut cia402).unwrap() / rated - 0.5).abs() < 1e-9);
    assert_eq!(limit(&mut Bench::new("zlim42c")), None);
}
