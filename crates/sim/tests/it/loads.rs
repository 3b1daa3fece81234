//! Loads at virtual drives: what their words do, what is said of a free shaft, what is refused.

use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use drives::mjoint::Model;
use serde_json::Value;
use sim::command::answer;
use sim::machine::{Order, mjoint, order, zlac8030l, zlim42c};
use sim::{Report, World};

const COUNTS_PER_TURN: f64 = 4096.0;

/// A wheel, a stepper and a joint, none of them enabled.
fn world() -> World {
    let mut world = World::new(Bitrate::K500, 1);
    world.add_probe();
    world.add_drive(4, Box::new(zlac8030l(4, 1))).unwrap();
    world.add_drive(2, Box::new(zlim42c(2, 1))).unwrap();
    world.add_drive(1, Box::new(mjoint(Model::named("m4230e17b50").unwrap(), 1, Bitrate::K500))).unwrap();
    world.run_for(Duration::from_millis(100));
    world
}

fn reported(world: &mut World, line: &str) -> Value {
    serde_json::from_str(&answer(world, line).unwrap().json).unwrap()
}

fn done(world: &mut World, line: &str) -> Option<String> {
    let answer = reported(world, line);
    assert_eq!(answer["ok"], true, "{line}: {answer}");
    answer["note"].as_str().map(str::to_owned)
}

fn refused(world: &mut World, line: &str) -> String {
    let before = world.digest();
    let answer = reported(world, line);
    assert_eq!((&answer["ok"], world.digest()), (&Value::Bool(false), before), "{line}: {answer}");
    answer["error"]["message"].as_str().unwrap().to_owned()
}

fn after(world: &mut World, node: u8, seconds: f64) -> Report {
    world.run_for(Duration::from_secs_f64(seconds));
    world.report(node).unwrap()
}

#[test]
fn a_load_on_a_free_shaft_says_where_it_will_end_and_it_ends_there() {
    let mut world = world();
    let note = done(&mut world, "4 load torque 2.5").unwrap();
    let foretold: f64 = note.split_whitespace().find_map(|word| word.parse().ok()).unwrap();
    assert!(note.contains("the shaft is free") && foretold < -500.0, "{note}");
    let came = after(&mut world, 4, 10.0).velocity_rpm;
    assert!((came - foretold).abs() < 0.03 * foretold.abs(), "{note}; it came to {came}");
    // The load goes: friction takes the rest, and the shaft coasts down to rest.
    assert_eq!(done(&mut world, "4 load torque 0"), None);
    assert_eq!(after(&mut world, 4, 30.0).velocity_rpm, 0.0);
    assert!(done(&mut world, "4 load torque 0.05").unwrap().contains("friction"));
    assert!(done(&mut world, "4 load pulley 1000 1").unwrap().contains("seize"));
}

#[test]
fn every_machine_coasts_down_by_the_friction_of_its_motor() {
    for model in sim::machine::models() {
        let mut world = World::new(Bitrate::K500, 1);
        world.add_probe();
        let node = NodeId::new(5).unwrap();
        world.add_drive(5, order(model, &Order::new(model, node, Bitrate::K500)).unwrap()).unwrap();
        world.run_for(Duration::from_millis(100));
        // A joint holds its output from power-on on, and without power hardly turns from outside: it gets what its reducer bears.
        let is_joint = model.name.starts_with('m');
        let torque = if is_joint { 25.0 } else { 0.3 };
        if is_joint {
            done(&mut world, "5 power cut");
        }
        done(&mut world, &format!("5 load torque {torque}"));
        let fast = after(&mut world, 5, 0.5).velocity_rpm.abs();
        assert!(fast > 3.0, "{} turns at {fast}", model.name);
        done(&mut world, "5 load torque 0");
        let slow = after(&mut world, 5, 60.0).velocity_rpm;
        assert!(slow == 0.0, "{} still turns at {slow}", model.name);
    }
}

#[test]
fn stops_stand_at_positions_of_the_drive_and_give_a_little() {
    let mut world = world();
    done(&mut world, "4 load stop -1000 2000");
    done(&mut world, "4 load torque -2");
    let report = after(&mut world, 4, 3.0);
    // 2 N·m less 0.1 of friction at 1000 N·m/rad, the usual stiffness at this drive; it may rest anywhere within the friction.
    let beyond = (report.position as f64 - 2000.0) / COUNTS_PER_TURN * core::f64::consts::TAU * 1000.0;
    assert!((1.0..=3.0).contains(&beyond) && report.velocity_rpm == 0.0, "{beyond} N·m: {report:?}");
    done(&mut world, "4 load torque 2");
    assert!((after(&mut world, 4, 3.0).position + 1001).abs() <= 2);
    let error = refused(&mut world, "4 load stop 0 2000");
    assert!(error.contains("the shaft stands at -100") && error.contains("both sides"), "{error}");
    // The joint's stops are at its output: 32768 counts of the motor are a fiftieth of a turn there.
    done(&mut world, "1 power cut");
    done(&mut world, "1 load stop -32768 32768 5000 20");
    done(&mut world, "1 load torque -15");
    let report = after(&mut world, 1, 3.0);
    let output = report.output.unwrap();
    let beyond = (output.angle_rad - core::f64::consts::TAU / 50.0) * 5000.0;
    assert!((11.0..=19.0).contains(&beyond), "{beyond} N·m: {output:?}");
}

#[test]
fn a_spring_pulls_back_to_where_the_shaft_stood_and_none_takes_all_away() {
    let mut world = world();
    done(&mut world, "4 load spring 3 90");
    done(&mut world, "4 load friction 0 viscous 0.3");
    // It comes to rest where its spring is within the friction: 0.1 N·m are 2 degrees.
    let turned = after(&mut world, 4, 5.0).shaft_angle_rad.to_degrees();
    assert!((turned - 90.0).abs() < 2.2, "{turned}");
    done(&mut world, "4 load none");
    done(&mut world, "4 load torque 1");
    assert!(after(&mut world, 4, 1.0).velocity_rpm < -300.0, "nothing holds it");
}

#[test]
fn what_makes_no_sense_is_refused_with_the_range_and_changes_nothing() {
    let mut world = world();
    for (line, expected) in [
        ("4 load pulley 1e9 0.1", "mass must be 0 to 10000 kg"),
        ("4 load pulley 1 11", "radius of the drum must be -10 to 10 m"),
        ("4 load fan 1 0", "speed of the fan must be 1 to 100000 r/min"),
        ("4 load stop min max 0", "stiffness of the stops must be 1 to 1e7 N·m/rad"),
        ("4 load friction 2 static 1", "friction at rest must be not less than the friction in motion"),
        ("4 load gear 0 1", "ratio of the gear must be 0.01 to 1000"),
        ("1 load gear 10 1", "has no room for a second gear"),
        ("4.2 load fan 1 100", "has no axis 2"),
    ] {
        let error = refused(&mut world, line);
        assert!(error.contains(expected), "{line}: {error}");
    }
    done(&mut world, "2 load gear 10 1");
    done(&mut world, "2 load stop min max");
    assert!(refused(&mut world, "2 load gear 5 1").contains("take them off"), "its stops would move");
}

#[test]
fn loads_are_noted_in_a_recording_and_do_the_same_again() {
    let lines = ["4 load gear 5 2", "4 load pulley 3 0.1", "4 load friction 0.2 static 0.4", "2 load fan 0.3 500"];
    let run = |words: &[String]| {
        let mut world = world();
        for line in words {
            done(&mut world, line);
            world.run_for(Duration::from_millis(300));
        }
        world
    };
    let mut first = world();
    first.start_recording(sim::recorder::Recorder::new(Duration::from_millis(10), []));
    for line in lines {
        done(&mut first, line);
        first.run_for(Duration::from_millis(300));
    }
    let recorded = first.recorder().unwrap().stimuli().to_vec();
    let words: Vec<String> = recorded.iter().map(|(_, place, stimulus)| format!("{place} {stimulus}")).collect();
    assert_eq!(words, lines);
    assert_eq!(run(&words).digest(), first.digest());
}
