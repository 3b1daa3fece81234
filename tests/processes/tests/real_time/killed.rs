//! What each drive does when the command that moves it is killed (kill -9), and what was said of it before.
//!
//! Times are the manuals': 2000h of the ZLAC8030L is 1000 ms as delivered (quick start guide, chapter 9); 1016h:01 of the
//! joint is node 7Fh within 2000 ms (M joint manual, 5.11.2); the ZLIM42-C has no such object (user manual, 5.4).
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use processes::{Simulator, command, done, wait_until};
use serde_json::{Value, json};

const JOINT: (&str, &str) = ("1", "1=m4230e17b50");
const STEPPER: (&str, &str) = ("2", "2=zlim42c");
const SERVO: (&str, &str) = ("4", "4=zlac8030l");

/// Stopping from 60 r/min with the ramps as delivered, and what was on its way. Times are of the drives; that they do not stop
/// sooner is tested in virtual time, since on a busy machine it is not known when a delayed command was last received.
const SLACK: Duration = Duration::from_millis(1500);

/// Far longer than any of them takes to boot.
const BOOT: Duration = Duration::from_secs(1);

struct Bench {
    simulator: Simulator,
    bus: String,
}

impl Bench {
    fn new() -> Self {
        let drives = ["--drive", "m4230e17b50@1", "--drive", "zlim42c@2", "--drive", "zlac8030l@4"];
        let simulator = Simulator::start(&[&drives[..], &["--serve", "socketcand://127.0.0.1:0"]].concat());
        let bus = simulator.bus("socketcand");
        Self::booted(simulator, bus)
    }

    fn booted(mut simulator: Simulator, bus: String) -> Self {
        // A drive that boots hears nothing.
        simulator.pass(BOOT);
        Self { simulator, bus }
    }

    fn position(&mut self, node: &str) -> i64 {
        self.simulator.ask(&format!("{node} get"))["position"].as_i64().unwrap()
    }

    /// By its way, since the rotor of a stepper swings about its speed: 60 r/min is several hundred counts in this time on
    /// each of the drives.
    fn turns(&mut self, node: &str) -> bool {
        let before = self.position(node);
        self.simulator.pass(Duration::from_millis(100));
        self.position(node).abs_diff(before) > 100
    }

    /// A command that moves a drive, once the drive turns.
    fn moving(&mut self, drive: (&str, &str), options: &[&str]) -> Child {
        let (node, _) = drive;
        self.moving_by(drive, &["velocity", node, "60rpm", "--for", "1h"], options)
    }

    fn moving_by(&mut self, (node, model): (&str, &str), motion: &[&str], options: &[&str]) -> Child {
        let child = command(&[&["--bus", &self.bus, "--model", model], motion, options].concat())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        wait_until("it turns", || self.turns(node));
        child
    }

    /// Waits until the drive stands, which takes no longer than this. In the drive's time, which a busy machine does not lengthen.
    #[track_caller]
    fn stops(&mut self, node: &str, longest: Duration) {
        let begin = self.simulator.time();
        loop {
            let before = self.simulator.time();
            if !self.turns(node) {
                return;
            }
            assert!(before - begin < longest, "node {node} turns on");
        }
    }

    /// Kills the command; what it had said on standard error.
    fn kill(&mut self, mut child: Child) -> String {
        child.kill().unwrap();
        let mut said = String::new();
        child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        child.wait().unwrap();
        said
    }

    fn json(&self, (_, model): (&str, &str), arguments: &[&str]) -> Value {
        done(&[&["--json", "--timeout", "10s", "--bus", &self.bus, "--model", model], arguments].concat()).json()
    }
}

#[test]
fn a_servo_stops_a_second_after_its_master_was_killed() {
    let mut bench = Bench::new();
    let child = bench.moving(SERVO, &[]);
    assert_eq!(bench.kill(child), "");
    bench.stops("4", Duration::from_millis(1000) + SLACK);
}

/// Whatever it was doing: the watch is the drive's, not a mode's.
#[test]
fn a_drive_with_a_watch_ends_every_kind_of_motion_by_itself() {
    let mut bench = Bench::new();
    let longest = Duration::from_millis(2000) + SLACK;
    for (drive, motion) in [
        (SERVO, &["move", "4", "200turn", "--relative", "--profile-velocity", "60rpm"][..]),
        (SERVO, &["torque", "4", "1A", "--for", "1h"]),
        (JOINT, &["move", "1", "200turn", "--relative", "--profile-velocity", "60rpm"]),
        (JOINT, &["home", "1", "--method", "17"]),
    ] {
        let child = bench.moving_by(drive, motion, &[]);
        bench.kill(child);
        bench.stops(drive.0, longest);
        bench.json(drive, &["reset", drive.0]);
        bench.json(drive, &["disable", drive.0]);
    }
}

/// A servo of CiA 402 is delivered without a watch (1016h is 0, as CiA 301, 7.5.2.19 has it); a command gives it one of 2000 ms
/// while it moves it, and what 6007h makes of its loss ends the motion. With `--no-guard` it has none, which is reported.
#[test]
fn a_described_servo_stops_by_itself_where_it_was_given_a_watch_and_else_it_was_said() {
    const DESCRIBED: (&str, &str) = ("5", "5=cia402");
    let simulator = Simulator::start(&["--drive", "cia402@5", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    let mut bench = Bench::booted(simulator, bus);
    let child = bench.moving(DESCRIBED, &["--no-guard"]);
    let said = bench.kill(child);
    assert!(said.contains("node 5: if this command dies") && said.contains("emergency stop"), "{said}");
    bench.json(DESCRIBED, &["stop", "5"]);
    let child = bench.moving(DESCRIBED, &[]);
    bench.kill(child);
    bench.stops("5", Duration::from_millis(2000) + SLACK);
}

/// The watch is the node's, not a mode's.
#[test]
fn a_described_servo_with_a_watch_ends_every_kind_of_motion_by_itself() {
    const DESCRIBED: (&str, &str) = ("5", "5=cia402");
    let simulator = Simulator::start(&["--drive", "cia402@5", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    let mut bench = Bench::booted(simulator, bus);
    for motion in [
        &["move", "5", "200turn", "--relative", "--profile-velocity", "60rpm"][..],
        &["torque", "5", "100mA", "--for", "1h"],
        &["home", "5", "--method", "17"],
    ] {
        let child = bench.moving_by(DESCRIBED, motion, &["--guard"]);
        bench.kill(child);
        bench.stops("5", Duration::from_millis(2000) + SLACK);
        bench.json(DESCRIBED, &["reset", "5"]);
        bench.json(DESCRIBED, &["disable", "5"]);
    }
}

#[test]
fn a_joint_stops_two_seconds_after_its_master_was_killed_and_the_next_command_begins_at_rest() {
    let mut bench = Bench::new();
    let child = bench.moving(JOINT, &[]);
    assert_eq!(bench.kill(child), "");
    bench.stops("1", Duration::from_millis(2000) + SLACK);
    // Alarm 20h: heartbeat of the host lost (M joint manual, alarm table).
    assert_eq!(bench.json(JOINT, &["state", "1"])["fault_code"], 0x20);
    let moved = bench.json(JOINT, &["move", "1", "--relative", "10deg"]);
    assert_eq!((&moved["reached"], &moved["fault_code"]), (&json!(true), &json!(0)));
    assert!(!bench.turns("1"));
}

#[test]
fn a_stepper_turns_on_after_its_master_was_killed_as_was_said_before() {
    let mut bench = Bench::new();
    let child = bench.moving(STEPPER, &[]);
    let said = bench.kill(child);
    for part in ["node 2: if this command dies, nothing stops it", "no watch over its host", "emergency stop"] {
        assert!(said.contains(part), "{part:?} in {said}");
    }
    bench.simulator.pass(Duration::from_secs(4));
    assert!(bench.turns("2"));
}

/// It has no watch (ZLIM42-C user manual, 5.4): a position move ends where it was to end, a search for a switch that is not there
/// goes on.
#[test]
fn a_stepper_finishes_its_move_and_goes_on_with_its_homing_after_its_master_was_killed() {
    /// 4 turns of 60 r/min and the ramps take 5 s; what `get` counts is 4000 steps a turn at the least.
    const TURNS: &str = "4turn";
    let mut bench = Bench::new();
    let whole = |bench: &mut Bench| {
        let said = bench.json(STEPPER, &["move", "2", TURNS, "--relative", "--profile-velocity", "60rpm"]);
        assert_eq!(said["reached"], json!(true));
        bench.position("2")
    };
    let before = bench.position("2");
    let of_a_move = whole(&mut bench) - before;
    let before = bench.position("2");
    let child = bench.moving_by(STEPPER, &["move", "2", TURNS, "--relative", "--profile-velocity", "60rpm"], &[]);
    let said = bench.kill(child);
    assert!(said.contains("node 2: if this command dies"), "{said}");
    bench.stops("2", Duration::from_secs(5) + SLACK);
    let moved = bench.position("2") - before;
    // An open-loop rotor stands within a fraction of a step of its field.
    assert!(moved.abs_diff(of_a_move) <= of_a_move.unsigned_abs() / 100, "{moved} instead of {of_a_move}");
    let child = bench.moving_by(STEPPER, &["home", "2", "--method", "17"], &[]);
    bench.kill(child);
    bench.simulator.pass(Duration::from_secs(3));
    assert!(bench.turns("2"));
    bench.json(STEPPER, &["disable", "2"]);
}

#[test]
fn an_unguarded_joint_turns_on_as_was_said_before() {
    let mut bench = Bench::new();
    for off in [&["--no-guard"][..], &["--guard", "off"]] {
        let child = bench.moving(JOINT, off);
        let said = bench.kill(child);
        assert!(said.contains("node 1: if this command dies, nothing stops it"), "{said}");
        bench.simulator.pass(Duration::from_secs(4));
        assert!(bench.turns("1"));
        bench.json(JOINT, &["stop", "1"]);
    }
}

#[test]
fn a_command_that_leaves_a_motor_turning_says_what_happens_then() {
    let mut bench = Bench::new();
    for (drive, armed, after_ms, object, then) in [
        (SERVO, true, json!(1000), json!("2000h:00"), "it stops by itself 1000 ms after"),
        (JOINT, true, json!(2000), json!("1016h:01"), "it keeps moving until it is stopped"),
        (STEPPER, false, Value::Null, Value::Null, "it keeps moving until it is stopped"),
    ] {
        let (node, _) = drive;
        let said = bench.json(drive, &["velocity", node, "60rpm"]);
        let guard = &said["guard"];
        assert_eq!((&guard["armed"], &guard["stops_after_ms"], &guard["object"]), (&json!(armed), &after_ms, &object));
        assert!(said["notes"][0].as_str().unwrap().contains(then), "{said}");
        assert!(bench.turns(node));
    }
    // Beyond the time of either watch.
    bench.simulator.pass(Duration::from_secs(4));
    assert!(!bench.turns("4"));
    assert!(bench.turns("1") && bench.turns("2"));
    assert_eq!(bench.json(JOINT, &["state", "1"])["fault_code"], 0);
    // A motion that has come to its end leaves nothing to say.
    let moved = bench.json(STEPPER, &["velocity", "2", "60rpm", "--for", "200ms"]);
    assert_eq!((&moved["notes"], &moved["guard"]["armed"]), (&json!([]), &json!(false)));
}

#[test]
fn a_motion_that_is_not_waited_for_goes_on_alone() {
    let mut bench = Bench::new();
    let said = bench.json(JOINT, &["velocity", "1", "60rpm", "--no-wait"]);
    assert!(said["notes"][0].as_str().unwrap().contains("nothing monitors the drive"), "{said}");
    bench.simulator.pass(Duration::from_secs(4));
    assert!(bench.turns("1"));
    assert_eq!(bench.json(JOINT, &["state", "1"])["fault_code"], 0);
}

#[test]
fn a_watch_that_is_switched_off_is_told_and_switched_on_if_asked_for() {
    let mut bench = Bench::new();
    let time = |bench: &Bench| bench.json(SERVO, &["read", "4", "2000"])["value"].clone();
    bench.json(SERVO, &["write", "4", "2000", "0"]);
    let child = bench.moving(SERVO, &[]);
    let said = bench.kill(child);
    assert!(said.contains("2000h:00) is set to 0; --guard gives it"), "{said}");
    assert_eq!(time(&bench), 0);
    let moved = bench.json(SERVO, &["velocity", "4", "60rpm", "--for", "500ms", "--guard"]);
    assert_eq!((&moved["guard"]["armed"], time(&bench)), (&json!(true), json!(0)));
    let child = bench.moving(SERVO, &["--guard", "on"]);
    bench.kill(child);
    bench.stops("4", Duration::from_millis(1000) + SLACK);
}

/// Whatever program moves the drives: `supervise` feeds their watches, and they stop when it dies. The ZLIM42-C has none, which it
/// says.
#[test]
fn drives_that_another_program_moves_stop_when_their_supervisor_is_killed() {
    const DESCRIBED: (&str, &str) = ("5", "5=cia402");
    let drives = ["--drive", "m4230e17b50@1", "--drive", "zlim42c@2", "--drive", "zlac8030l@4", "--drive", "cia402@5"];
    let simulator = Simulator::start(&[&drives[..], &["--serve", "socketcand://127.0.0.1:0"]].concat());
    let bus = simulator.bus("socketcand");
    let mut bench = Bench::booted(simulator, bus);
    let models = [JOINT, STEPPER, SERVO, DESCRIBED].map(|(_, model)| ["--model", model]);
    let mut supervisor = Command::new(processes::program())
        .args(["--json", "--timeout", "10s", "--bus", &bench.bus])
        .args(models.concat())
        .arg("supervise")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut booted = String::new();
    BufReader::new(supervisor.stdout.as_mut().unwrap()).read_line(&mut booted).unwrap();
    let booted: Value = serde_json::from_str(&booted).unwrap();
    let watch = |node: u64| {
        let of_node = booted["nodes"].as_array().unwrap().iter().find(|one| one["node"] == node).unwrap();
        let step = of_node["steps"].as_array().unwrap().iter().find(|step| step["step"] == "host watch").unwrap();
        (step["verdict"].clone(), step["found"].as_str().unwrap().to_owned())
    };
    assert!([1, 4, 5].iter().all(|node| watch(*node).0 == "passed"), "{booted}");
    assert!(watch(2).0 == "noted" && watch(2).1.contains("no watch over its host"), "{booted}");
    for drive in [JOINT, SERVO, DESCRIBED] {
        bench.json(drive, &["velocity", drive.0, "60rpm", "--no-wait", "--no-guard"]);
    }
    // Longer than every watch: another program than the moving one feeds them.
    bench.simulator.pass(Duration::from_secs(4));
    for (node, _) in [JOINT, SERVO, DESCRIBED] {
        assert!(bench.turns(node), "node {node}");
    }
    supervisor.kill().unwrap();
    supervisor.wait().unwrap();
    for (node, _) in [JOINT, SERVO, DESCRIBED] {
        bench.stops(node, Duration::from_millis(2000) + SLACK);
    }
}
