//! Everything on a bus is stopped by a program that has not set it in motion, and only what was seen to stand is reported to stand.

use processes::{Simulator, done, ferrodrive, scratch};
use serde_json::{Value, json};

/// Two drives that another program has set in motion, and the bus that they are on.
fn two_that_turn() -> (Simulator, String) {
    let serve = ["--serve", "socketcand://127.0.0.1:0"];
    let simulator = Simulator::start(&[&["--drive", "cia402@5", "--drive", "zlim42c@2"][..], &serve].concat());
    let bus = format!("socketcand://{}/can0", simulator.address("socketcand"));
    for node in ["5", "2"] {
        done(&["--bus", &bus, "--model", "2=zlim42c", "velocity", node, "60rpm"]);
    }
    (simulator, bus)
}

fn speed(simulator: &mut Simulator, node: u8) -> f64 {
    simulator.send(&format!("{node} get"));
    let got: Value = serde_json::from_str(&simulator.line()).unwrap();
    got["velocity_rpm"].as_f64().unwrap()
}

#[test]
fn everything_stops_and_each_drive_is_said_to_stand() {
    for command in [&["estop"][..], &["quick-stop", "all"], &["stop", "all"]] {
        let (mut simulator, bus) = two_that_turn();
        assert!(speed(&mut simulator, 5).abs() > 50.0 && speed(&mut simulator, 2).abs() > 50.0);
        let said = done(&[&["--json", "--bus", &bus, "--model", "2=zlim42c"], command].concat()).json();
        let nodes = said["nodes"].as_array().unwrap();
        assert_eq!(nodes.iter().map(|row| &row["node"]).collect::<Vec<_>>(), [2, 5], "{said}");
        assert!(said["ok"] == true && nodes.iter().all(|row| row["stands"] == true), "{said}");
        for node in [2, 5] {
            assert!(speed(&mut simulator, node).abs() < 1.0, "{command:?}: {said}");
        }
    }
}

#[test]
fn a_drive_that_was_not_seen_to_stand_may_still_be_moving() {
    let (mut simulator, bus) = two_that_turn();
    simulator.send("2 cable cut");
    assert!(simulator.line().starts_with(r#"{"ok":true"#));
    let directory = scratch("estop");
    let machine = directory.join("machine.toml");
    std::fs::write(&machine, "[[drive]]\nmodel = 'cia402'\nnode = 5\n[[drive]]\nmodel = 'zlim42c'\nnode = 2\n")
        .unwrap();
    let line = ["--bus", &bus, "--machine", machine.to_str().unwrap(), "estop"];
    let ended = ferrodrive(&[&line[..], &["--json"]].concat());
    assert_eq!(ended.status, Some(1), "{}", ended.out);
    let said = ended.json();
    let stands: Vec<_> = said["nodes"].as_array().unwrap().iter().map(|row| (&row["node"], &row["stands"])).collect();
    assert_eq!(stands, [(&json!(2), &json!(false)), (&json!(5), &json!(true))], "{said}");
    assert_eq!((&said["ok"], &said["error"]["kind"]), (&json!(false), &json!("not_stopped")), "{said}");
    let people = ferrodrive(&line);
    assert!(people.out.contains("node 2 (zlim42c): may still be moving"), "{}", people.out);
    assert!(people.err.contains("emergency stop"), "{}", people.err);
    assert!(speed(&mut simulator, 2).abs() > 50.0, "it was said rightly");
}

#[test]
fn a_bus_where_nobody_answers_is_not_said_to_stand() {
    let simulator = Simulator::start(&["--drive", "cia402@5", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = format!("socketcand://{}/can0", simulator.address("socketcand"));
    let mut simulator = simulator;
    simulator.send("5 cable cut");
    simulator.line();
    let ended = ferrodrive(&["--bus", &bus, "--json", "estop"]);
    assert_eq!((ended.status, &ended.json()["error"]["kind"]), (Some(1), &json!("no_node")), "{}", ended.out);
}
