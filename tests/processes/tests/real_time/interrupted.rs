//! Motions that are cut short: by Ctrl-C and the other signals that ask for an end, and by a bus that goes away. Which motions of which
//! drives, and what a conformance test had written, is asked in virtual time (`crates/cli/src/tests/interrupted.rs`).
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use processes::{Simulator, command, done, ferrodrive, is_heard, wait_until};

/// How long a command asks a drive that is gone: the whole of it passes.
const LOSS: &str = "2s";

fn bench() -> Simulator {
    Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"])
}

fn start(bus: &str, arguments: &[&str]) -> Child {
    command(&[&["--bus", bus, "--model", "4=zlac8030l"], arguments].concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

fn speed(simulator: &mut Simulator) -> f64 {
    simulator.ask("4 get")["velocity_rpm"].as_f64().unwrap()
}

fn wait_until_it_turns(simulator: &mut Simulator) {
    wait_until("node 4 turns", || speed(simulator).abs() > 50.0);
}

/// The statuses are those of a shell: 128 and the signal's number (POSIX, 2.8.2).
#[test]
fn every_signal_that_asks_for_an_end_stops_the_drive_first() {
    let mut simulator = bench();
    let bus = simulator.bus("socketcand");
    let signals =
        [("HUP", 129, "SIGHUP"), ("INT", 130, "interrupted"), ("QUIT", 131, "SIGQUIT"), ("TERM", 143, "SIGTERM")];
    for (signal, status, said) in signals.into_iter().filter(|(signal, ..)| is_heard(signal)) {
        let moving = start(&bus, &["velocity", "4", "100rpm", "--for", "1h"]);
        wait_until_it_turns(&mut simulator);
        send(signal, &moving);
        let ended = moving.wait_with_output().unwrap();
        let speed = speed(&mut simulator);
        assert!(speed.abs() < 20.0, "{signal}: still at {speed} r/min");
        let error = String::from_utf8(ended.stderr).unwrap();
        assert_eq!(ended.status.code(), Some(status), "{signal}: {error}");
        for part in [said, "node 4 was set in motion and has been quick-stopped"] {
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
    let moving = start(&bus, &["velocity", "4", "450rpm", "--for", "1h"]);
    wait_until("node 4 is at its speed", || speed(&mut simulator).abs() > 440.0);
    // Passed on by a shell beside it: one wish. The drive has its quick stop, and is on its way.
    send("INT", &moving);
    send("INT", &moving);
    wait_until("node 4 slows down", || speed(&mut simulator).abs() < 380.0);
    send("INT", &moving);
    let ended = moving.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(said.contains("node 4 may still be moving: its quick stop was ordered"), "{said}");
    assert!(said.contains("make sure that it stands still"), "{said}");
    wait_until("node 4 stands", || speed(&mut simulator).abs() < 1.0);
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
    wait_until_it_turns(&mut simulator);
    send("HUP", &moving);
    let ended = moving.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(0), "{}", String::from_utf8_lossy(&ended.stderr));
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
        let moving = start(&bus, &["velocity", "4", "100rpm", "--for", "1h", "--timeout", LOSS]);
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
    let moving = start(&bus, &motion);
    wait_until_it_turns(&mut simulator);
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
