//! Motions that are cut short: by Ctrl-C and the other signals that ask for an end, and by a bus that goes away.
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use processes::{Simulator, command, done, ferrodrive, is_heard, scratch, wait_until};

const DRIVES: [(&str, &str, &str); 4] = [
    ("4", "zlac8030l", "4=zlac8030l"),
    ("2", "zlim42c", "2=zlim42c"),
    ("1", "m4230e17b50", "1=m4230e17b50"),
    ("5", "cia402", "5=cia402"),
];

/// How long a command asks a drive that is gone: the whole of it passes.
const LOSS: &str = "2s";

fn bench() -> Simulator {
    let specs = DRIVES.map(|(node, model, _)| format!("{model}@{node}"));
    let mut arguments: Vec<&str> = specs.iter().flat_map(|spec| ["--drive", spec]).collect();
    arguments.extend(["--serve", "socketcand://127.0.0.1:0"]);
    Simulator::start(&arguments)
}

fn start(bus: &str, model: &str, arguments: &[&str]) -> Child {
    command(&[&["--bus", bus, "--model", model], arguments].concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

fn speed(simulator: &mut Simulator, node: &str) -> f64 {
    simulator.ask(&format!("{node} get"))["velocity_rpm"].as_f64().unwrap()
}

fn wait_until_it_turns(simulator: &mut Simulator, node: &str) {
    // More than once: a stepper's rotor snaps to its field when the current comes, before anything moves it.
    let mut turning = 0;
    wait_until(&format!("node {node} turns"), || {
        turning = if speed(simulator, node).abs() < 50.0 { 0 } else { turning + 1 };
        turning == 3
    });
}

/// The commands that move a drive until they are ended: velocity and position on each model; torque where the model has it,
/// home where it looks for a switch that is not there.
fn motions(node: &str) -> [Vec<&str>; 3] {
    let velocity = vec!["velocity", node, "100rpm", "--for", "1h"];
    let position = vec!["move", node, "200turn", "--relative", "--profile-velocity", "100rpm"];
    let last = match node {
        "4" => vec!["torque", node, "1A", "--for", "1h"],
        "5" => vec!["torque", node, "100mA", "--for", "1h"],
        _ => vec!["home", node, "--method", "17"],
    };
    [velocity, position, last]
}

#[test]
fn ctrl_c_stops_every_drive_before_it_ends_with_130() {
    let mut simulator = bench();
    let bus = simulator.bus("socketcand");
    for (node, _, model) in DRIVES {
        for motion in motions(node) {
            let moving = start(&bus, model, &motion);
            wait_until_it_turns(&mut simulator, node);
            send("INT", &moving);
            let ended = moving.wait_with_output().unwrap();
            let speed = speed(&mut simulator, node);
            assert!(speed.abs() < 20.0, "{motion:?}: still at {speed} r/min");
            let said = String::from_utf8(ended.stderr).unwrap();
            assert_eq!(ended.status.code(), Some(130), "{motion:?}: {said}");
            assert!(said.contains(&format!("node {node} was moving and has been quick-stopped")), "{motion:?}: {said}");
            done(&["--bus", &bus, "--model", model, "disable", node]);
        }
    }
}

/// The statuses are those of a shell: 128 and the signal's number (POSIX, 2.8.2).
#[test]
fn every_signal_that_asks_for_an_end_stops_the_drive_first() {
    let mut simulator = bench();
    let bus = simulator.bus("socketcand");
    let signals =
        [("HUP", 129, "SIGHUP"), ("INT", 130, "interrupted"), ("QUIT", 131, "SIGQUIT"), ("TERM", 143, "SIGTERM")];
    for (signal, status, said) in signals.into_iter().filter(|(signal, ..)| is_heard(signal)) {
        let moving = start(&bus, "4=zlac8030l", &["velocity", "4", "100rpm", "--for", "1h"]);
        wait_until_it_turns(&mut simulator, "4");
        send(signal, &moving);
        let ended = moving.wait_with_output().unwrap();
        let speed = speed(&mut simulator, "4");
        assert!(speed.abs() < 20.0, "{signal}: still at {speed} r/min");
        let error = String::from_utf8(ended.stderr).unwrap();
        assert_eq!(ended.status.code(), Some(status), "{signal}: {error}");
        for part in [said, "node 4 was moving and has been quick-stopped"] {
            assert!(error.contains(part), "{signal}: {part:?} in {error}");
        }
        done(&["--bus", &bus, "--model", "4=zlac8030l", "disable", "4"]);
    }
}

/// A quick stop by the ramp of 6085h (605Ah = 6): some seconds from 450 r/min.
#[test]
fn ctrl_c_once_more_ends_at_once_and_says_what_was_not_seen() {
    let mut simulator = bench();
    let bus = simulator.bus("socketcand");
    let on = |arguments: &[&str]| done(&[&["--bus", &bus, "--model", "4=zlac8030l"], arguments].concat());
    on(&["write", "4", "605A", "6"]);
    on(&["write", "4", "6085", "3000"]);
    let moving = start(&bus, "4=zlac8030l", &["velocity", "4", "450rpm", "--for", "1h"]);
    wait_until("node 4 is at its speed", || speed(&mut simulator, "4").abs() > 440.0);
    // Passed on by a shell beside it: one wish. The drive has its quick stop, and is on its way.
    send("INT", &moving);
    send("INT", &moving);
    wait_until("node 4 slows down", || speed(&mut simulator, "4").abs() < 380.0);
    send("INT", &moving);
    let ended = moving.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(said.contains("node 4 may still be moving: its quick stop was ordered"), "{said}");
    assert!(said.contains("make sure that it stands still"), "{said}");
    wait_until("node 4 stands", || speed(&mut simulator, "4").abs() < 1.0);
}

/// What `nohup` and `trap '' HUP` ask for.
#[test]
fn a_command_that_is_to_outlive_its_terminal_does() {
    let mut simulator = bench();
    let bus = simulator.bus("socketcand");
    let line = r#"trap '' HUP; exec "$0" "$@""#;
    let moving = Command::new("sh")
        .args(["-c", line, processes::program(), "--bus", &bus, "--model", "4=zlac8030l"])
        .args(["velocity", "4", "100rpm", "--for", "3s"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_until_it_turns(&mut simulator, "4");
    send("HUP", &moving);
    let ended = moving.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(0), "{}", String::from_utf8_lossy(&ended.stderr));
}

#[test]
fn a_simulator_that_is_asked_to_end_does_so_without_a_word() {
    let signals = [("HUP", 129), ("INT", 130), ("QUIT", 131), ("TERM", 143)];
    for (signal, status) in signals.into_iter().filter(|(signal, _)| is_heard(signal)) {
        simulator_ends(signal, status);
    }
}

#[track_caller]
fn simulator_ends(signal: &str, status: i32) {
    let mut child = Command::new(processes::program())
        .args(["sim", "--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut ready = String::new();
    BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut ready).unwrap();
    assert!(ready.starts_with("ready"), "{ready:?}");
    send(signal, &child);
    let ended = child.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(status), "{signal}");
    assert_eq!(String::from_utf8(ended.stderr).unwrap(), "", "{signal}");
}

/// Its drives leave another program's bus as if their cable was cut; the bus and its master stay.
#[test]
fn a_simulator_on_somebody_elses_bus_leaves_it_when_it_is_asked_to_end() {
    let owner = Simulator::start(&["--drive", "cia402@5", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = owner.bus("socketcand");
    for (signal, status) in [("INT", 130), ("TERM", 143)] {
        let mut child = Command::new(processes::program())
            .args(["sim", "--drive", "zlac8030l@4", "--bus", &bus])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut ready = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut ready).unwrap();
        let read = |node: &str| ferrodrive(&["--bus", &bus, "--timeout", "10s", "read", node, "1000"]);
        wait_until("node 4 answers", || read("4").status == Some(0));
        let moving = start(&bus, "4=zlac8030l", &["velocity", "4", "100rpm", "--for", "1h", "--timeout", LOSS]);
        // It drives for a while.
        std::thread::sleep(Duration::from_secs(1));
        send(signal, &child);
        let ended = child.wait_with_output().unwrap();
        assert_eq!(ended.status.code(), Some(status), "{signal}: {}", String::from_utf8_lossy(&ended.stderr));
        // The program that moved it reports the loss; the owner's drive still answers.
        let ended = moving.wait_with_output().unwrap();
        assert_eq!(ended.status.code(), Some(1), "{}", String::from_utf8_lossy(&ended.stderr));
        let reported = String::from_utf8(ended.stderr).unwrap();
        assert!(reported.contains("node 4"), "{reported}");
        done(&["--bus", &bus, "--timeout", "10s", "read", "5", "1000"]);
    }
}

#[test]
fn a_bus_lost_in_a_move_is_reported_with_what_was_moving_and_what_to_do() {
    let mut simulator = bench();
    let bus = simulator.bus("socketcand");
    let motion = ["move", "4", "200turn", "--relative", "--profile-velocity", "100rpm", "--timeout", LOSS];
    let moving = start(&bus, "4=zlac8030l", &motion);
    wait_until_it_turns(&mut simulator, "4");
    simulator.kill();
    let ended = moving.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(1));
    let said = String::from_utf8(ended.stderr).unwrap();
    // The report of the connection depends on the moment: reset, or refused when it is tried again.
    for part in [
        "node 4 may still be moving",
        "the connection to the bus is lost: ",
        "127.0.0.1:",
        "next:",
        "ferrodrive state 4",
    ] {
        assert!(said.contains(part), "{part:?} in {said}");
    }
}

/// A conformance test writes many objects; whenever it is interrupted, they have again what they had.
#[test]
fn a_conformance_test_that_is_interrupted_puts_back_what_it_wrote() {
    let mut simulator = bench();
    let bus = simulator.bus("socketcand");
    let value = |object: &str| {
        done(&["--bus", &bus, "--model", "5=cia402", "read", "5", object, "--json"]).json()["value"].clone()
    };
    done(&["--bus", &bus, "--model", "5=cia402", "write", "5", "1017", "777"]);
    let folder = scratch("interrupted_conformance");
    let log = folder.join("frames.log");
    let before = [value("1017"), value("1800:02"), value("1A00:01")];
    let path = log.to_str().unwrap();
    let testing = start(&bus, "5=cia402", &["--log", path, "conform", "5", "--only", "PDO"]);
    wait_until("a mapping is changed", || {
        std::fs::read_to_string(&log).is_ok_and(|text| text.contains("605#2F001A00"))
    });
    send("INT", &testing);
    let ended = testing.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(said.contains("what had been written was put back"), "{said}");
    assert_eq!([value("1017"), value("1800:02"), value("1A00:01")], before);
    assert!(simulator.is_running());
}
