//! Motions that are cut short: by Ctrl-C, and by a bus that goes away.
#![cfg(unix)]

mod common;

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use common::{Simulator, done};

const DRIVES: [(&str, &str, &str); 3] =
    [("4", "zlac8030l", "4=zlac8030l"), ("2", "zlim42c", "2=zlim42c"), ("1", "m4230e17b50", "1=m4230e17b50")];

fn bench() -> Simulator {
    let specs = DRIVES.map(|(node, model, _)| format!("{model}@{node}"));
    let mut arguments: Vec<&str> = specs.iter().flat_map(|spec| ["--drive", spec]).collect();
    arguments.extend(["--serve", "socketcand://127.0.0.1:0"]);
    Simulator::start(&arguments)
}

fn start(bus: &str, model: &str, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_ferrodrive"))
        .args(["--bus", bus, "--model", model])
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn interrupt(child: Child) -> Output {
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    child.wait_with_output().unwrap()
}

fn speed(simulator: &mut Simulator, node: &str) -> f64 {
    simulator.ask(&format!("{node} get"))["velocity_rpm"].as_f64().unwrap()
}

fn wait_until_it_turns(simulator: &mut Simulator, node: &str) {
    let begin = Instant::now();
    while speed(simulator, node).abs() < 50.0 {
        assert!(begin.elapsed() < Duration::from_secs(20), "node {node} does not turn");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn ctrl_c_stops_every_drive_before_it_ends_with_130() {
    let mut simulator = bench();
    let bus = simulator.bus("socketcand");
    for (node, _, model) in DRIVES {
        let velocity = ["velocity", node, "100rpm", "--for", "60s"];
        let position = ["move", node, "200turn", "--relative", "--profile-velocity", "100rpm"];
        let home = ["home", node, "--method", "17"];
        let torque = ["torque", node, "1A", "--for", "60s"];
        let last = if node == "4" { &torque[..] } else { &home[..] };
        for motion in [&velocity[..], &position, last] {
            let moving = start(&bus, model, motion);
            wait_until_it_turns(&mut simulator, node);
            let ended = interrupt(moving);
            let speed = speed(&mut simulator, node);
            assert!(speed.abs() < 20.0, "{motion:?}: still at {speed} r/min");
            assert_eq!(ended.status.code(), Some(130), "{motion:?}");
            let said = String::from_utf8(ended.stderr).unwrap();
            assert!(said.contains(&format!("node {node} was moving and has been quick-stopped")), "{motion:?}: {said}");
            done(&["--bus", &bus, "--model", model, "disable", node]);
        }
    }
}

#[test]
fn a_joint_that_looks_for_its_reference_can_be_disabled() {
    let mut simulator = bench();
    let bus = simulator.bus("socketcand");
    let on =
        |arguments: &[&str]| done(&[&["--bus", &bus, "--json", "--model", "1=m4230e17b50"], arguments].concat()).json();
    on(&["home", "1", "--method", "17", "--no-wait"]);
    wait_until_it_turns(&mut simulator, "1");
    assert_eq!(on(&["disable", "1"])["state"], "Switch on disabled");
}

#[test]
fn an_interrupted_simulator_ends_with_130_and_without_a_word() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_ferrodrive"))
        .args(["sim", "--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut ready = String::new();
    BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut ready).unwrap();
    assert!(ready.starts_with("ready"), "{ready:?}");
    let ended = interrupt(child);
    assert_eq!(ended.status.code(), Some(130));
    assert_eq!(String::from_utf8(ended.stderr).unwrap(), "");
}

#[test]
fn a_bus_lost_in_a_move_is_told_with_what_was_moving_and_what_to_do() {
    let mut simulator = bench();
    let bus = simulator.bus("socketcand");
    let moving = start(&bus, "4=zlac8030l", &["move", "4", "200turn", "--relative", "--profile-velocity", "100rpm"]);
    wait_until_it_turns(&mut simulator, "4");
    simulator.kill();
    let ended = moving.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(1));
    let said = String::from_utf8(ended.stderr).unwrap();
    for part in ["node 4 was moving, and cannot be reached any more", "next:", "ferrodrive state 4"] {
        assert!(said.contains(part), "{part:?} in {said}");
    }
}
