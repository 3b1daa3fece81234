//! What is said of a drive before and after it is moved: whether it stops when the command that moves it dies. What each drive does
//! then is asked in `crates/master/tests/it/guard.rs` and `stopping`, of a program that is killed in `tests/processes`.
//!
//! Times are the manuals': 2000h of the ZLAC8030L is 1000 ms as delivered (quick start guide, chapter 9); 1016h:01 of the
//! joint is node 7Fh within 2000 ms (M joint manual, 5.11.2); the ZLIM42-C has no such object (user manual, 5.4).

use std::time::Duration;

use serde_json::{Value, json};

use super::virtual_bus::VirtualBus;
use crate::signals::Signal;

const JOINT: (&str, &str) = ("1", "1=m4230e17b50");
const STEPPER: (&str, &str) = ("2", "2=zlim42c");
const SERVO: (&str, &str) = ("4", "4=zlac8030l");

/// Before anything moves. What has a watch that is armed has nothing to be said.
#[test]
fn what_nothing_would_stop_is_said_before_it_moves() {
    let bench = VirtualBus::of(&["m4230e17b50@1", "zlim42c@2", "zlac8030l@4", "cia402@5", "zlac8030l@6,2000=0"]);
    for ((node, model), options, parts) in [
        (SERVO, &[][..], &[][..]),
        (JOINT, &[], &[]),
        (("5", "5=cia402"), &[], &[]),
        (STEPPER, &[], &["node 2: if this command dies, nothing stops it", "no watch over its host", "emergency stop"]),
        (JOINT, &["--no-guard"], &["node 1: if this command dies, nothing stops it"]),
        (JOINT, &["--guard", "off"], &["node 1: if this command dies, nothing stops it"]),
        (("5", "5=cia402"), &["--no-guard"], &["node 5: if this command dies", "emergency stop"]),
        (("6", "6=zlac8030l"), &[], &["node 6: if this command dies", "2000h:00) is set to 0; --guard gives it"]),
        (("6", "6=zlac8030l"), &["--guard"], &[]),
    ] {
        let motion = ["velocity", node, "60rpm", "--for", "100ms"];
        let said = bench.done(&[&["--model", model], &motion[..], options].concat()).err;
        assert_eq!(said.contains("if this command dies"), !parts.is_empty(), "{node} {options:?}: {said}");
        for part in parts {
            assert!(said.contains(part), "{node} {options:?}: {part:?} in {said}");
        }
    }
    // The time that --guard gave it is taken back.
    assert_eq!(bench.json(&["--model", "6=zlac8030l", "read", "6", "2000"])["value"], 0);
}

#[test]
fn a_command_that_leaves_a_motor_turning_says_what_happens_then() {
    // Drives that answer at once keep the bus full of requests: a heartbeat, which each of them outranks, goes out late, and may arm
    // the watch of a drive that this command has let go.
    let bench = VirtualBus::of_real_times(&["m4230e17b50@1", "zlim42c@2", "zlac8030l@4", "cia402@5"]);
    let json = |(_, model): (&str, &str), words: &[&str]| bench.json(&[&["--model", model], words].concat());
    // By its way, since the rotor of a stepper swings about its speed: at 60 r/min several hundred counts in this time.
    let turns = |node: u8| {
        let before = bench.report(node).position;
        bench.pass(Duration::from_millis(100));
        bench.report(node).position.abs_diff(before) > 100
    };
    for (drive, armed, after_ms, object, then) in [
        (SERVO, true, json!(1000), json!("2000h:00"), "it stops by itself 1000 ms after"),
        (JOINT, false, Value::Null, json!("1016h:01"), "it keeps moving until it is stopped"),
        (("5", "5=cia402"), false, Value::Null, json!("1016h:01"), "it keeps moving until it is stopped"),
        (STEPPER, false, Value::Null, Value::Null, "it keeps moving until it is stopped"),
    ] {
        let (node, _) = drive;
        let said = json(drive, &["velocity", node, "60rpm", "--no-wait"]);
        let guard = &said["guard"];
        assert_eq!((&guard["armed"], &guard["stops_after_ms"], &guard["object"]), (&json!(armed), &after_ms, &object));
        assert!(said["notes"][0].as_str().unwrap().contains(then), "{said}");
        bench.pass(Duration::from_millis(200));
        assert!(turns(node.parse().unwrap()));
    }
    // Beyond the time of either watch.
    bench.pass(Duration::from_secs(4));
    assert!(!turns(4));
    assert!(turns(1) && turns(2));
    assert_eq!(json(JOINT, &["state", "1"])["fault_code"], 0);
    // A motion that has come to its end leaves nothing to say.
    let moved = json(STEPPER, &["velocity", "2", "60rpm", "--for", "200ms"]);
    assert_eq!((&moved["notes"], &moved["guard"]["armed"]), (&json!([]), &json!(false)));
}

/// No motor is left turning by default: without a time the command stays, and its end is the motor's.
#[test]
fn a_command_without_a_time_turns_the_motor_until_it_is_asked_to_end() {
    let bench = VirtualBus::of(&["m4230e17b50@1", "zlim42c@2", "zlac8030l@4", "cia402@5"]);
    for (node, model) in [SERVO, JOINT, ("5", "5=cia402"), STEPPER] {
        let id = node.parse().unwrap();
        let before = bench.json(&["--model", model, "state", node])["angle_deg"].as_f64().unwrap();
        let words = ["--model", model, "velocity", node, "60rpm"];
        let ended = bench.run_until(&words, &[(Duration::from_secs(6), Signal::Interrupt)]);
        let said = ended.err;
        for part in ["reached after", "limits: ", "until Ctrl-C stops it", "--for TIME", "it was seen to stand"] {
            assert!(said.contains(part), "{node}: {part:?} in {said}");
        }
        let turned = bench.json(&["--model", model, "state", node])["angle_deg"].as_f64().unwrap() - before;
        // At 60 r/min for 6 s, less what the look at the drive and its ramp take: beyond the time of each watch over a host.
        assert!((4.0 * 360.0..6.0 * 360.0).contains(&turned), "{node}: {turned} degrees");
        assert!(bench.report(id).velocity_rpm.abs() < 20.0, "{node}");
    }
}

#[test]
fn a_joint_that_looks_for_its_reference_can_be_disabled() {
    let bench = VirtualBus::of(&["m4230e17b50@1"]).with(&["--model", "1=m4230e17b50"]);
    bench.json(&["home", "1", "--method", "17", "--no-wait"]);
    bench.pass(Duration::from_secs(1));
    assert!(bench.report(1).velocity_rpm.abs() > 50.0, "it looks for its switch");
    assert_eq!(bench.json(&["disable", "1"])["state"], "Switch on disabled");
}
