//! What the explanation says of a drive that has just moved, was stopped, or cannot move: its first cause is the true one, and its
//! remedy sets nothing going that is over. Sources: CiA 402-2, 10.1 to 10.3 (profile position), and the manuals where they are named.

use std::time::Duration;

use crate::explain::{Bench, NODE, rules};
use crate::support::mux;
use canopen::NodeId;
use master::Error;
use master::drive::MotionOptions;
use master::explain::{Explained, Finding, Overheard, Weight};
use master::units::{Rpm, Turns};
use sim::block_on;

fn causes(explained: &Explained) -> Vec<Finding> {
    explained.findings.iter().filter(|finding| finding.weight == Weight::Cause).cloned().collect()
}

/// CiA 402-2, 10.1: a relative set-point stays in 607Ah when it has been gone, and bit 4 would start it again.
#[test]
fn after_a_relative_move_the_drive_is_said_to_be_there_and_its_distance_is_not_to_be_started_again() {
    for name in ["zlac8030l", "zlim42c", "m4230e17b50", "cia402"] {
        let mut bench = Bench::new(name);
        // A watch by silence would end while the bus is listened to.
        if name == "zlac8030l" {
            bench.write(mux(0x2000, 0), 0);
        }
        let drive = bench.drive.clone();
        bench.done(drive.move_relative(Turns(0.5), MotionOptions::default()));
        let explained = bench.explain();
        let first = causes(&explained).first().map(|finding| finding.rule);
        assert_eq!(first, Some("at_target"), "{name}: {:?}", rules(&explained));
        for finding in &explained.findings {
            assert!(!finding.remedy.contains("5Fh") && !finding.remedy.contains("1Fh"), "{name}: {finding:?}");
        }
    }
}

/// 6064h of a stepper without an encoder counts the steps that were made ("ZLIM42-C user manual V1.03": an integrated open-loop stepper).
#[test]
fn a_stepper_is_not_said_to_be_where_its_steps_are() {
    for (name, has_encoder) in [("zlim42c", false), ("zlac8030l", true), ("cia402", true)] {
        let mut bench = Bench::new(name);
        if name == "zlac8030l" {
            bench.write(mux(0x2000, 0), 0);
        }
        let drive = bench.drive.clone();
        bench.done(drive.move_absolute(Turns(0.5), MotionOptions::default()));
        let explained = bench.explain();
        let finding = causes(&explained).into_iter().find(|finding| finding.rule == "at_target");
        let finding = finding.unwrap_or_else(|| panic!("{name}: {explained:?}"));
        assert_eq!(!format!("{finding:?}").contains("has no encoder"), has_encoder, "{name}: {finding:?}");
    }
}

/// M joint manual, 5.11.2: two seconds without the heartbeat of its host stop it with alarm 20h; the next one has it go on. In mode 7
/// its target is a position.
#[test]
fn a_joint_that_has_lost_its_host_is_not_sent_to_zero_nor_said_to_be_without_power() {
    [1, 3, 7].into_iter().for_each(lose_host_in);
}

fn lose_host_in(mode: i64) {
    let mut bench = Bench::new("m4230e17b50");
    let heartbeat = |bench: &mut Bench, period| {
        bench.other.heartbeat(NodeId::MAX, period);
        bench.world.refresh();
        bench.world.run_for(Duration::from_secs(3));
    };
    bench.enable(mode);
    heartbeat(&mut bench, Some(Duration::from_millis(500)));
    bench.write(mux(0x607A, 0), 600_000);
    if mode == 1 {
        bench.write(mux(0x6040, 0), 0x1F);
    }
    bench.world.run_for(Duration::from_millis(20));
    heartbeat(&mut bench, None);
    let explained = bench.explain();
    assert_eq!(rules(&explained)[..2], ["host_heartbeat_missing", "fault"], "{explained:?}");
    for finding in &explained.findings {
        let text = format!("{} {}", finding.follows, finding.remedy);
        assert!(!text.contains("no power") && !text.contains("to zero"), "{finding:?}");
    }
    assert!(explained.findings[..2].iter().all(|finding| finding.remedy.contains("quick-stop 4")), "{explained:?}");
    // What the remedy says keeps the shaft where it is.
    let (drive, stands) = (bench.drive.clone(), bench.world.report(NODE).unwrap().position);
    bench.done(drive.quick_stop());
    heartbeat(&mut bench, Some(Duration::from_millis(500)));
    bench.done(drive.enable());
    bench.world.run_for(Duration::from_secs(2));
    let moved = bench.world.report(NODE).unwrap().position - stands;
    assert!(moved.abs() < 100, "mode {mode}: {moved}");
}

/// CiA 402-2, table of error codes: 2310h is over-current, 8130h the heartbeat. They share bits, and are not sums of faults.
#[test]
fn another_fault_of_a_servo_is_not_that_of_its_watch_over_a_host() {
    let mut bench = Bench::new("cia402");
    bench.write(mux(0x1016, 1), 127 << 16 | 2000);
    bench.enable(3);
    bench.stimulus("supply 10");
    let explained = bench.explain();
    assert!(rules(&explained).contains(&"fault"), "{explained:?}");
    assert!(!rules(&explained).contains(&"host_heartbeat_missing"), "{explained:?}");
}

/// CiA 402-2, 10.1 and 10.3: bit 4 has risen and bit 12 acknowledges it; 6081h is what there is no way to go by.
#[test]
fn a_profile_velocity_of_0_comes_first_and_a_start_bit_that_has_risen_is_not_blamed() {
    let mut bench = Bench::new("cia402");
    bench.write(mux(0x6081, 0), 0);
    bench.enable(1);
    bench.write(mux(0x607A, 0), 100_000);
    bench.write(mux(0x6040, 0), 0x1F);
    let found = causes(&bench.explain());
    assert_eq!(found.first().map(|finding| finding.rule), Some("profile_velocity_zero"), "{found:?}");
    assert!(!found.iter().any(|finding| finding.rule == "start_bit_left_set"), "{found:?}");
}

/// ZLAC8030L, L083 of its page: 2000h without a request it stops, sets its target to 0 and stays enabled without a fault.
#[test]
fn a_drive_that_its_watch_for_silence_has_stopped_is_said_to_be_perhaps_that() {
    let first = |watch| {
        let mut bench = Bench::new("zlac8030l");
        bench.write(mux(0x2000, 0), watch);
        bench.enable(3);
        bench.write(mux(0x60FF, 0), if watch == 0 { 0 } else { 60 });
        bench.world.run_for(Duration::from_secs(3));
        // It is asked something again: its silence is over.
        bench.done(bench.drive.clone().state());
        let drive = bench.drive.clone();
        let heard = Overheard::from(bench.world.now());
        let explained = block_on(&mut bench.world, drive.explain(&heard)).unwrap();
        causes(&explained).into_iter().find(|finding| finding.rule == "target_zero").unwrap()
    };
    let (stopped, commanded) = (first(1000), first(0));
    assert!(stopped.follows.contains("2000h:00") && stopped.remedy.contains("each 1000 ms"), "{stopped:?}");
    assert!(!commanded.follows.contains("2000h:00"), "{commanded:?}");
}

/// 1000 increments/s of a turn of 131072 are 0.46 r/min. What CiA 402-2 gives a rate of 0 no meaning for turns the shaft all the same.
#[test]
fn a_ramp_of_0_is_a_cause_where_the_shaft_stands_alone() {
    for (target, rotor, is_cause) in [(1000, "rotor free", false), (1000, "rotor lock", true), (0, "rotor free", true)]
    {
        let mut bench = Bench::new("cia402");
        bench.write(mux(0x6083, 0), 0);
        bench.stimulus(rotor);
        bench.enable(3);
        bench.write(mux(0x60FF, 0), target);
        bench.world.run_for(Duration::from_secs(1));
        let found = causes(&bench.explain());
        assert_eq!(found.iter().any(|finding| finding.rule == "ramp_zero"), is_cause, "{target} {rotor}: {found:?}");
        assert!(is_cause || found.is_empty(), "{found:?}");
    }
}

/// What keeps a motion from its target is looked for before the stop of a program that fails hides it.
#[test]
fn a_motion_that_does_not_get_there_names_what_the_drive_shows_of_the_cause() {
    let why = |name, prepare: fn(&mut Bench), by_speed: bool| {
        let mut bench = Bench::new(name);
        prepare(&mut bench);
        let (drive, within) = (bench.drive.clone(), Some(Duration::from_secs(3)));
        let options = MotionOptions { within, ..MotionOptions::default() };
        let ended = match by_speed {
            true => block_on(&mut bench.world, drive.velocity(Rpm(60.0), options)),
            false => block_on(&mut bench.world, drive.move_absolute(Turns(2.0), options)),
        };
        match ended.unwrap().unwrap_err() {
            Error::NotReached(why) => format!("{} {}", why.conclusion, why.advice),
            error => panic!("{name}: {error}"),
        }
    };
    let no_torque = |bench: &mut Bench| bench.write(mux(0x6072, 0), 0);
    let limited = |bench: &mut Bench| {
        bench.write(mux(0x607D, 1), -1000);
        bench.write(mux(0x607D, 2), 1000);
    };
    // ZLIM42-C, 5.4: function 2 of an input is the positive limit switch. ZLAC8030L, 2030h:02: X0 is the emergency stop as delivered.
    let at_limit = |bench: &mut Bench| {
        bench.write(mux(0x2030, 3), 2);
        bench.write(mux(0x2030, 1), 0b10);
    };
    let stopped = |bench: &mut Bench| bench.stimulus("input X0 1");
    let blocked = |bench: &mut Bench| bench.stimulus("rotor lock");
    for (name, prepare, by_speed, part) in [
        ("cia402", no_torque as fn(&mut Bench), true, "6072h"),
        ("cia402", limited, true, "607Dh"),
        ("zlim42c", at_limit, true, "X1"),
        ("zlac8030l", stopped, true, "X0"),
    ] {
        let text = why(name, prepare, by_speed);
        assert!(text.contains(part), "{name}: {text}");
        assert!(!text.contains("another master") && !text.contains("blocked"), "{name}: {text}");
    }
    let text = why("cia402", blocked, true);
    assert!(text.contains("blocked") && text.contains("ferrodrive explain 4"), "{text}");
}
