//! A command that is killed (kill -9), and what is said before of what a drive does then. What each drive does in each motion is asked in
//! virtual time (`crates/master/tests/it/guard.rs` and `stopping`).
//!
//! Times are the manuals': 2000h of the ZLAC8030L is 1000 ms as delivered (quick start guide, chapter 9); 1016h:01 of the
//! joint is node 7Fh within 2000 ms (M joint manual, 5.11.2); the ZLIM42-C has no such object (user manual, 5.4).
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use processes::{Simulator, command, done, wait_until};
use serde_json::Value;

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
