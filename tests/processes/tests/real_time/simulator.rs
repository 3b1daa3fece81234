//! `ferrodrive sim`: drives for other programs, over socketcand and slcan.

use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::time::Duration;

use processes::{Simulator, command, done};

const DRIVE: [&str; 2] = ["--drive", "zlac8030l@4"];
const SERVE: [&str; 4] = ["--serve", "socketcand://127.0.0.1:0", "--serve", "slcan://127.0.0.1:0"];

fn simulator(more: &[&str]) -> Simulator {
    Simulator::start(&[&DRIVE[..], &SERVE[..], more].concat())
}

#[test]
fn the_end_of_input_leaves_it_running() {
    let mut simulator = simulator(&[]);
    simulator.close_input();
    // Time in which it would end, if it ended.
    std::thread::sleep(Duration::from_millis(300));
    assert!(simulator.is_running());
    let bus = simulator.bus("socketcand");
    assert_eq!(done(&["--bus", &bus, "--json", "read", "4", "200B"]).json()["value"], 1024);
}

#[test]
fn commands_reach_it_over_socketcand_and_slcan() {
    let mut simulator = simulator(&[]);
    assert!(simulator.ready.starts_with("ready "), "{:?}", simulator.ready);
    for protocol in ["socketcand", "slcan"] {
        let bus = simulator.bus(protocol);
        let on = |arguments: &[&str]| {
            done(&[&["--bus", &bus, "--model", "4=zlac8030l", "--json"], arguments].concat()).json()
        };
        assert_eq!(on(&["scan"])["nodes"][0]["node"], 4);
        assert_eq!(on(&["write", "4", "2002", "50"])["value"], 50);
        assert_eq!(on(&["read", "4", "in_position_threshold"])["value"], 50);
        assert_eq!(on(&["velocity", "4", "30rpm", "--for", "500ms"])["reached"], true);
        let moved = on(&["move", "4", "--relative", "45deg", "--profile-velocity", "60rpm"]);
        assert_eq!(moved["reached"], true);
        // What the drive says of its position is where the machine is.
        let position = simulator.ask("4 get")["position"].as_i64().unwrap();
        assert!((position - moved["position"].as_i64().unwrap()).abs() <= 5, "{position} and {moved}");
    }
}

/// Lines of JSON and nothing else, from the first on.
#[test]
fn with_json_the_line_that_it_is_ready_is_json_too() {
    let mut simulator = Simulator::start(&["--json", "--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let ready: serde_json::Value = serde_json::from_str(&simulator.ready).unwrap();
    let places = ready["ready"].as_array().unwrap();
    assert!(ready["ok"] == true && places.len() == 1, "{ready}");
    let bus = format!("{}/can0", places[0].as_str().unwrap());
    assert_eq!(done(&["--bus", &bus, "--json", "read", "4", "200B"]).json()["value"], 1024);
    assert_eq!(simulator.ask("now")["ok"], true);
}

#[test]
fn two_simulators_joined_by_a_bus_hear_each_other() {
    let first = simulator(&[]);
    let bus = first.bus("socketcand");
    let second = Simulator::start(&["--drive", "zlac8030l@5", "--bus", &bus]);
    assert_eq!(second.ready, format!("ready {bus}"));
    let found = done(&["--bus", &bus, "--json", "scan"]).json();
    let nodes: Vec<_> = found["nodes"].as_array().unwrap().iter().map(|node| node["node"].as_u64().unwrap()).collect();
    assert_eq!(nodes, [4, 5]);
    assert_eq!(
        done(&["--bus", &bus, "--model", "5=zlac8030l", "--json", "velocity", "5", "60rpm", "--for", "300ms"]).json()["reached"],
        true
    );
}

/// `dump` goes on where the server is back, and a command that waits for an answer ends with what happened.
#[test]
fn a_lost_connection_is_told_and_made_again() {
    let beating = |drive: &str, place: &str| Simulator::start(&["--drive", drive, "--serve", place]);
    let mut first = beating("zlac8030l@4,1017=100", "socketcand://127.0.0.1:0");
    let bus = first.bus("socketcand");
    let place = bus.trim_end_matches("/can0").to_owned();
    let mut dump = command(&["--bus", &bus, "dump"]).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(dump.stdout.take().unwrap()).lines().map(Result::unwrap);
    let mut until = |part: &str| lines.by_ref().find(|line| line.contains(part)).unwrap_or_default();
    assert!(until("704#").contains("heartbeat"));
    first.kill();
    // The report depends on the moment: reset, or refused when it is tried again.
    let lost = until("is lost");
    assert!(lost.contains("the connection to the bus is lost: ") && lost.contains("127.0.0.1:"), "{lost}");
    let second = beating("zlac8030l@5,1017=100", &place);
    assert!(until("is back").contains("the connection to the bus is back"));
    assert!(until("705#").contains("heartbeat"), "frames come again");
    dump.kill().unwrap();
    dump.wait().unwrap();
    drop(second);
}
