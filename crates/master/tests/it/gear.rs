//! A gear behind a drive's shaft: what is asked of its output, what the drive is sent for it, and what the shaft does
//! then. Expected counts are the closed form: turns of the output times the ratio times the counts of one turn of the
//! shaft.

use std::time::Duration;

use crate::support::{mux, node};
use can::{Bitrate, Instant};
use cia402::ModeOfOperation;
use devices::model;
use drives::mjoint::Model;
use master::cyclic::{CyclicError, CyclicOptions, Demand};
use master::drive::MotionOptions;
use master::units::{Along, Angle, Degrees, Ramp, Rpm};
use master::{Drive, Error, Gear, Network};
use sim::machine::{mjoint, zlac8030l, zlim42c};
use sim::{Place, Stimulus, World, block_on};

const JOINT: u8 = 1;
const STEPPER: u8 = 2;
const SERVO: u8 = 4;
const K500: u16 = 1;

/// Counts in a turn of the shaft: "M-series joint motor manual", 607Ah; ZLIM42-C, 2006h = 10 as delivered; ZLAC8030L, 200Bh
/// as delivered (1024 lines, four counts each).
const COUNTS: [f64; 3] = [32_768.0, 4000.0, 4096.0];

const RATIO: f64 = 12.5;

fn bench() -> (World, [Drive; 3]) {
    let mut world = World::new(Bitrate::K500, 5);
    let network = Network::new();
    world.add_station(network.clone());
    world.add_drive(JOINT, Box::new(mjoint(Model::named("m4230e17b50").unwrap(), JOINT, Bitrate::K500))).unwrap();
    world.add_drive(STEPPER, Box::new(zlim42c(STEPPER, K500))).unwrap();
    world.add_drive(SERVO, Box::new(zlac8030l(SERVO, K500))).unwrap();
    let gear = Gear::new(RATIO).unwrap().with_feed(0.010).unwrap();
    let drives = [(JOINT, "m4230e17b50"), (STEPPER, "zlim42c"), (SERVO, "zlac8030l")]
        .map(|(id, name)| Drive::new(network.node(node(id)), model(name).unwrap()).behind(gear));
    world.run_until(Instant::from_secs(2));
    (world, drives)
}

#[test]
fn a_move_of_the_output_is_the_ratio_times_as_many_counts_and_the_shaft_gets_there() {
    let (mut world, drives) = bench();
    for (drive, counts) in drives.iter().zip(COUNTS) {
        let options = MotionOptions { speed: Some(Rpm(4.0)), ..MotionOptions::default() };
        let report = block_on(&mut world, drive.move_absolute(Degrees(36.0), options)).unwrap().unwrap();
        let [position, speed] = &report.commanded[..] else { panic!("{:?}", report.commanded) };
        assert_eq!(position.raw as f64, 0.1 * RATIO * counts, "{drive:?}");
        assert!((position.commanded - 36.0).abs() < 1e-9 && position.unit == "deg");
        // 6081h counts r/min of the shaft on all three.
        assert_eq!((speed.raw, speed.requested, speed.commanded), (50, 4.0, 4.0));
        // 1.25 turns of the shaft at 50 r/min are 1.5 s, and ramps.
        let took = report.reached_after.expect("it was waited for");
        assert!((1.4..3.5).contains(&took.as_secs_f64()), "{drive:?}: {took:?}");
        let actual = block_on(&mut world, drive.node().read::<i32>(mux(0x6064, 0))).unwrap().unwrap();
        assert!((f64::from(actual) - 0.1 * RATIO * counts).abs() < 0.02 * counts, "{drive:?}: {actual}");
        let state = block_on(&mut world, drive.state()).unwrap().unwrap();
        let angle = state.angle.expect("it shows its position").0;
        assert!((angle - 36.0).abs() < 0.5, "{drive:?}: {angle}");
        assert_eq!(state.position.map(|counts| counts.0), Some(actual.into()), "counts stay the drive's own");
    }
}

#[test]
fn a_speed_of_the_output_and_its_ramps_are_those_of_the_shaft_divided_by_the_ratio() {
    let (mut world, drives) = bench();
    for drive in &drives {
        let options = MotionOptions { acceleration: Some(Ramp::RpmPerSecond(16.0)), ..MotionOptions::default() };
        let report = block_on(&mut world, drive.velocity(Rpm(-8.0), options)).unwrap().unwrap();
        let target = block_on(&mut world, drive.node().read::<i32>(mux(0x60FF, 0))).unwrap().unwrap();
        assert_eq!(target, -100, "{drive:?}");
        // 8 r/min at 16 (r/min)/s: 500 ms, or 200 (r/min)/s of the shaft.
        let ramp = report.commanded[1].raw;
        let expected = if drive.node().id().raw() == JOINT { 200 } else { 500 };
        assert_eq!((ramp, report.commanded[1].commanded), (expected, 16.0 * sign_of(report.commanded[1].commanded)));
        let state = block_on(&mut world, drive.state()).unwrap().unwrap();
        let speed = state.velocity.expect("it shows its speed").0;
        assert!((speed + 8.0).abs() < 0.5, "{drive:?}: {speed}");
        block_on(&mut world, drive.stop()).unwrap().unwrap();
    }
}

/// A ramp is reported with the sign of its change.
fn sign_of(value: f64) -> f64 {
    if value < 0.0 { -1.0 } else { 1.0 }
}

/// One r/min of the output is 12.5 of the shaft, which turns: thresholds are the shaft's.
#[test]
fn a_shaft_that_turns_behind_a_great_ratio_does_not_stand_still() {
    let (mut world, [_, _, servo]) = bench();
    let slow = servo.behind(Gear::new(1000.0).unwrap());
    block_on(&mut world, slow.velocity(Rpm(0.05), MotionOptions::default())).unwrap().unwrap();
    let target = block_on(&mut world, slow.node().read::<i32>(mux(0x60FF, 0))).unwrap().unwrap();
    assert_eq!(target, 50);
    block_on(&mut world, slow.stop()).unwrap().unwrap();
    let speed = block_on(&mut world, slow.state()).unwrap().unwrap().velocity.expect("it shows its speed").0;
    assert!(speed.abs() < 1.0 / 1000.0, "stopped is when the shaft has stopped: {speed}");
    // A gear that makes faster: 10 r/min of the output are one of the shaft.
    let fast = slow.behind(Gear::new(0.1).unwrap());
    let options =
        MotionOptions { acceleration: Some(Ramp::Time(Duration::from_millis(250))), ..MotionOptions::default() };
    let report = block_on(&mut world, fast.velocity(Rpm(600.0), options)).unwrap().unwrap();
    assert_eq!(report.commanded.iter().map(|sent| sent.raw).collect::<Vec<_>>(), [60, 250]);
    block_on(&mut world, fast.stop()).unwrap().unwrap();
}

/// What is less than an r/min of the output is hundreds of the shaft.
#[test]
fn a_shaft_that_its_load_turns_behind_a_great_ratio_is_not_noted_as_one_that_stands() {
    let (mut world, [_, _, servo]) = bench();
    let slow = servo.behind(Gear::new(1000.0).unwrap());
    block_on(&mut world, slow.velocity(Rpm(0.05), MotionOptions::default())).unwrap().unwrap();
    world.apply(Place::node(SERVO), &Stimulus::LoadTorque(-2.0)).unwrap().unwrap();
    block_on(&mut world, slow.disable()).unwrap().unwrap();
    let turning = world.report(SERVO).unwrap().velocity_rpm;
    assert!((5.0..1000.0).contains(&turning), "{turning} r/min");
    assert!(slow.node().network().moved().contains(node(SERVO)), "noted as standing at {turning} r/min");
}

/// By speeds and by positions, what passes each cycle is in the units of the output too.
#[test]
fn what_is_streamed_is_the_outputs() {
    const PERIOD: Duration = Duration::from_millis(4);
    let (mut world, [joint, _, servo]) = bench();
    for (drive, mode) in [(servo, ModeOfOperation::PROFILE_VELOCITY), (joint, ModeOfOperation::INTERPOLATED_POSITION)] {
        let network = drive.node().network().clone();
        let run = async {
            drive.configure_cyclic(mode).await?;
            let mut cyclic = drive.cyclic(mode, CyclicOptions::default()).await?;
            network.sync(Some(PERIOD));
            let mut seen = None;
            // 4 r/min of the output, which is 50 of the shaft, for 2 s: a tenth of a turn takes 1.5 s.
            for cycle in 0..500_u32 {
                network.next_sync().await.expect("a cycle");
                let turns = f64::from(cycle) * PERIOD.as_secs_f64() * 4.0 / 60.0;
                let demand = if mode == ModeOfOperation::PROFILE_VELOCITY {
                    Demand::Velocity(Rpm(4.0))
                } else {
                    Demand::Position(Angle::Turns(turns))
                };
                seen = Some(network.exchange(|io| cyclic.step(io, demand)));
            }
            Ok::<_, CyclicError>(seen.expect("it was stepped"))
        };
        let state = block_on(&mut world, run).unwrap().unwrap();
        assert!(state.follows, "{state}");
        // The mean of two cycles: a joint that interpolates is not as fast at each of their ends.
        let mut sum = 0.0;
        for _ in 0..80 {
            sum += world.report(drive.node().id().raw()).unwrap().velocity_rpm;
            world.run_for(2 * PERIOD / 80);
        }
        let speed = sum / 80.0;
        assert!((speed - 50.0).abs() < 3.0, "{drive:?}: {speed} r/min of the shaft");
        match mode {
            ModeOfOperation::PROFILE_VELOCITY => assert!((state.velocity.unwrap().0 - 4.0).abs() < 0.3, "{state}"),
            _ => assert!((state.position.unwrap().0 - 2.0 * 4.0 / 60.0).abs() < 0.01, "{state}"),
        }
        // Without SYNC the drives are stopped before the next one is moved.
        network.sync(None);
        let _ = block_on(&mut world, drive.quick_stop()).unwrap();
    }
}

#[test]
fn a_way_needs_a_feed() {
    let (mut world, [_, stepper, _]) = bench();
    // 25 mm at 10 mm a turn.
    let angle = stepper.turning(Along::<Angle>::Metres(0.025)).unwrap();
    assert_eq!(angle, Angle::Turns(2.5));
    let Rpm(speed) = stepper.turning("5mm/s".parse::<Along<Rpm>>().unwrap()).unwrap();
    assert!((speed - 30.0).abs() < 1e-9);
    assert_eq!(stepper.turning("10mm/s2".parse::<Along<Ramp>>().unwrap()).unwrap(), Ramp::RpmPerSecond(60.0));
    let report =
        block_on(&mut world, stepper.move_relative(angle, MotionOptions { wait: false, ..MotionOptions::default() }));
    assert_eq!(report.unwrap().unwrap().commanded[0].raw as f64, 2.5 * RATIO * COUNTS[1]);
    let error = stepper.behind(Gear::new(50.0).unwrap()).turning(Along::<Angle>::Metres(0.025)).unwrap_err();
    assert!(matches!(error, Error::NoFeed { .. }) && error.to_string().contains("feed_constant"), "{error}");
}
