//! `ferrodrive sim`: drives for other programs, over socketcand and slcan, with EEPROM contents that outlive it.

use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::time::Duration;

use processes::{Simulator, command, done, scratch};

const DRIVE: [&str; 2] = ["--drive", "zlac8030l@4"];
const SERVE: [&str; 4] = ["--serve", "socketcand://127.0.0.1:0", "--serve", "slcan://127.0.0.1:0"];

fn simulator(more: &[&str]) -> Simulator {
    Simulator::start(&[&DRIVE[..], &SERVE[..], more].concat())
}

#[test]
fn a_machine_file_and_the_command_line_put_drives_on_one_bus() {
    let directory = scratch("served-machine");
    let file = directory.join("machine.toml");
    let text = "bitrate = '250k'\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nsupply_v = 30\n\
                [[drive]]\nmodel = 'zlim42c'\nnode = 2\nswitches = { X0 = ['min', 'max'] }\n";
    std::fs::write(&file, text).unwrap();
    let path = file.to_str().unwrap();
    let serve = ["--serve", "socketcand://127.0.0.1:0"];
    let mut simulator = Simulator::start(&[&["--machine", path, "--drive", "m4230e17b50@1"][..], &serve].concat());
    let bus = simulator.bus("socketcand");
    let read = |bus: &str, node: &str, object: &str| done(&["--bus", bus, "--json", "read", node, object]).json();
    let supplies = ["4", "2", "1"].map(|node| simulator.ask(&format!("{node} get"))["supply_v"].as_f64().unwrap());
    assert!((supplies[0] - 30.0).abs() < 0.5 && supplies[1] < 25.0 && supplies[2] > 35.0, "{supplies:?}");
    assert_eq!(read(&bus, "4", "200E")["meaning"], "250 kbit/s");
    assert_eq!(read(&bus, "1", "1000")["value"], 0x2_0192);
    // Without --drive, and at the command line's own rate.
    let mut alone = Simulator::start(&[&["--machine", path, "--bitrate", "500k"][..], &serve].concat());
    assert_eq!(read(&alone.bus("socketcand"), "4", "200E")["meaning"], "500 kbit/s");
    assert_eq!(alone.ask("1 get")["ok"], false);
}

#[test]
fn the_ready_line_names_every_listener_with_its_port() {
    let simulator = simulator(&[]);
    assert!(simulator.ready.starts_with("ready "), "{:?}", simulator.ready);
    for protocol in ["socketcand", "slcan"] {
        let address = simulator.address(protocol);
        let port: u16 = address.rsplit_once(':').unwrap().1.parse().unwrap();
        assert_ne!(port, 0);
    }
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

#[test]
fn what_was_saved_is_there_after_quit_and_only_then() {
    let directory = scratch("state");
    let state = ["--state", directory.to_str().unwrap()];
    let mut first = simulator(&state);
    let bus = first.bus("socketcand");
    done(&["--bus", &bus, "--model", "4=zlac8030l", "write", "4", "200A", "500"]);
    assert_eq!(first.ask("quit")["ok"], true);
    assert_eq!(first.wait(), Some(0));
    let second = simulator(&state);
    let bus = second.bus("socketcand");
    assert_eq!(done(&["--bus", &bus, "--json", "read", "4", "200A"]).json()["value"], 500);
    drop(second);
    let fresh = simulator(&[]);
    let bus = fresh.bus("socketcand");
    assert_eq!(done(&["--bus", &bus, "--json", "read", "4", "200A"]).json()["value"], 1000);
}
