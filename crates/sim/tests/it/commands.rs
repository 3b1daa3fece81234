//! World commands against a world with drives.

use std::time::Duration;

use crate::common::{TestDrive, frame, heard, texts};
use can::{Bitrate, Instant};
use serde_json::Value;
use sim::Place;
use sim::command::{MAX_LINE_LENGTH, Service, answer, answer_served};
use sim::recorder::{Channel, Recorder, Signal};
use sim::{StationId, World, WorldError};

fn world() -> (World, StationId) {
    let mut world = World::new(Bitrate::K500, 1);
    let probe = world.add_probe();
    world.add_drive(4, Box::new(TestDrive::new(4))).unwrap();
    world.add_drive(2, Box::new(TestDrive::new(2))).unwrap();
    world.run_until(Instant::from_millis(500));
    (world, probe)
}

fn ask(world: &mut World, line: &str) -> Value {
    let answer = answer(world, line).unwrap();
    assert!(!answer.json.contains('\n'));
    assert_eq!(answer.quit, line.trim() == "quit");
    serde_json::from_str(&answer.json).unwrap()
}

fn refusal(world: &mut World, line: &str) -> String {
    let before = world.digest();
    let answer = ask(world, line);
    assert_eq!(answer["ok"], false, "{line}");
    assert_eq!(world.digest(), before);
    answer["error"]["message"].as_str().unwrap().to_string()
}

#[test]
fn drives_boot_when_they_are_added_and_answer_on_the_bus() {
    let (mut world, probe) = world();
    assert_eq!(texts(&world), ["702#00", "704#00"]);
    heard(&mut world, probe);
    world.send(probe, frame("604#4041600000000000")).unwrap();
    world.run_for(std::time::Duration::from_millis(2));
    assert_eq!(heard(&mut world, probe), ["584#0000000000000000"]);
    let twice = world.add_drive(4, Box::new(TestDrive::new(9)));
    assert_eq!(twice, Err(WorldError::DuplicateDrive(4)));
}

#[test]
fn a_refusal_begins_as_every_answer_does_and_says_what_is_expected() {
    let (mut world, _) = world();
    let json = answer(&mut world, "fly").unwrap().json;
    assert!(json.starts_with(r#"{"ok":false,"error":{"kind":""#), "{json}");
    let error = refusal(&mut world, "4");
    assert!(error.contains("after node 4") && error.contains("power") && error.contains("4 get"), "{error}");
}

#[test]
fn get_answers_what_can_be_measured() {
    let (mut world, _) = world();
    // Half a turn at 60 r/min.
    let got = answer(&mut world, "4 get").unwrap().json;
    assert!(
        got.starts_with(
            r#"{"ok":true,"t":0.5,"node":4,"model":"testdrive","powered":true,"power":"on","position":2048,"#
        ),
        "{got}"
    );
    let got: Value = serde_json::from_str(&got).unwrap();
    assert_eq!(got["velocity_rpm"], 60.0);
    assert_eq!(got["current_a"], 1.25);
    assert_eq!(got["supply_v"], 48.0);
    assert_eq!(got["outputs"], serde_json::json!({"Y0": 0, "Y1": 1}));
    assert_eq!(got["brake"], "released");
    assert_eq!(got["bus"], "error-active");
    assert_eq!(got["bitrate"], 500_000);
}

#[test]
fn now_and_quit_answer_the_time_and_blank_lines_and_comments_nothing() {
    let (mut world, _) = world();
    assert_eq!(answer(&mut world, "now").unwrap().json, r#"{"ok":true,"t":0.5,"behind_ms":0,"frames_lost":0}"#);
    assert_eq!(ask(&mut world, "quit")["ok"], true);
    for unanswered in ["", "  ", "\t\r\n", "# quit", "  #now\n"] {
        assert_eq!(answer(&mut world, unanswered), None);
    }
}

#[test]
fn now_and_get_answer_what_the_one_who_serves_the_world_knows() {
    let (mut world, _) = world();
    let service = Service { behind: Duration::from_micros(12_900), frames_lost: 3 };
    let json = |world: &mut World, line| -> Value {
        serde_json::from_str(&answer_served(world, line, service).unwrap().json).unwrap()
    };
    assert_eq!(json(&mut world, "now")["behind_ms"], 12);
    assert_eq!(json(&mut world, "now")["frames_lost"], 3);
    assert_eq!(json(&mut world, "4 get")["behind_ms"], 12);
    assert_eq!(ask(&mut world, "4 get")["behind_ms"], 0, "a world that is not served is never late");
}

#[test]
fn help_has_a_line_for_every_command() {
    let (mut world, _) = world();
    let help = ask(&mut world, "help");
    assert_eq!(help["ok"], true);
    let forms: Vec<&str> = help["help"].as_array().unwrap().iter().map(|form| form.as_str().unwrap()).collect();
    // The verbs that an unknown one is answered with, and what needs no node.
    let verbs = refusal(&mut world, "4 fly");
    let verbs = verbs.split_once("expected ").unwrap().1.replace(" or ", ", ");
    for verb in verbs.split(", ") {
        assert!(forms.iter().any(|form| form.starts_with(&format!("NODE {verb}"))), "{verb} in {forms:?}");
    }
    assert!(["now", "help", "quit"].iter().all(|word| forms.contains(word)));
    assert_eq!(refusal(&mut world, "help me"), "expected: help");
}

#[test]
fn a_line_too_long_and_one_with_escapes_are_refused_without_an_echo_of_either() {
    let (mut world, _) = world();
    let long = format!("4 input {} 1", "x".repeat(MAX_LINE_LENGTH));
    assert!(refusal(&mut world, &long).contains("longer than 4096 bytes"));
    for line in ["\u{1b}[31mred", "4 \u{9b}2J", "4 supply \u{7}", "4 input \u{1b}c 1", "\u{9d}0;title 4"] {
        let json = answer(&mut world, line).unwrap().json;
        assert!(!json.chars().any(char::is_control), "{json:?}");
    }
}

#[test]
fn errors_say_what_is_there_and_change_nothing() {
    let (mut world, _) = world();
    assert_eq!(refusal(&mut world, "7 get"), "no drive at node 7; running: 4, 2");
    assert_eq!(refusal(&mut world, "4 input X9 1"), "a testdrive has no input \"X9\"; it has X0, X1");
    assert_eq!(refusal(&mut world, "4 battery off"), "a testdrive has no battery");
    assert_eq!(refusal(&mut world, "4 fault hall on"), "a testdrive has no Hall sensor");
    assert_eq!(refusal(&mut world, "4 temperature driver 5"), "a testdrive has no driver temperature sensor");
    assert_eq!(refusal(&mut world, "4 supply 1000"), "supply voltage must be 0 to 100 V, not 1000");
    assert_eq!(refusal(&mut world, "4 supply"), "expected: NODE supply VOLTS [limit AMPERES] [resistance OHMS]");
    assert!(refusal(&mut world, "\u{7}\"quoted\\").starts_with("unknown command"));
    assert_eq!(refusal(&mut World::new(Bitrate::M1, 1), "4 get"), "no drive at node 4; running: none");
}

#[test]
fn commands_reach_the_machine_under_the_number_given_at_the_start() {
    let (mut world, _) = world();
    world.with_drive(4, |_, _| ()).unwrap();
    for line in ["4 supply 24", "4 temperature motor 95.5", "4 load torque -2.5", "4 load inertia 0.02", "4 input x1 1"]
    {
        assert_eq!(ask(&mut world, line), serde_json::json!({"ok": true, "t": 0.5}), "{line}");
    }
    let got = ask(&mut world, "4 get");
    assert_eq!((&got["supply_v"], &got["motor_c"]), (&Value::from(24.0), &Value::from(95.5)));
    ask(&mut world, "4 temperature motor auto");
    ask(&mut world, "4 rotor lock");
    let got = ask(&mut world, "4 get");
    assert_eq!((&got["motor_c"], &got["velocity_rpm"]), (&Value::Null, &Value::from(0.0)));
    ask(&mut world, "4 rotor free");
    ask(&mut world, "4 switch X0 2000 max");
    ask(&mut world, "4 fault phase on");
}

#[test]
fn time_that_is_moved_by_a_line_comes_to_where_it_says() {
    let (mut world, tap) = world();
    assert_eq!(ask(&mut world, "run 20ms")["t"], 0.52);
    assert_eq!(ask(&mut world, "run 1us")["t"], 0.520_001);
    assert_eq!(ask(&mut world, "run until 2.5s")["t"], 2.5);
    assert_eq!(ask(&mut world, "run until 1s")["t"], 2.5);
    heard(&mut world, tap);
    world.send(tap, frame("604#4041600000000000")).unwrap();
    let run = ask(&mut world, "run 5ms");
    assert_eq!((&run["t"], &run["frames"], &run["changes"]), (&2.505.into(), &2.into(), &serde_json::json!([])));
}

#[test]
fn power_and_cable_take_a_drive_off_the_bus() {
    let (mut world, probe) = world();
    heard(&mut world, probe);
    ask(&mut world, "4 power off");
    let got = ask(&mut world, "4 get");
    assert_eq!((&got["bus"], &got["node"]), (&Value::from("off"), &Value::from(4)));
    world.send(probe, frame("604#4041600000000000")).unwrap();
    world.run_for(std::time::Duration::from_millis(2));
    assert_eq!(heard(&mut world, probe), [""; 0]);
    ask(&mut world, "4 power on");
    world.run_for(std::time::Duration::from_millis(2));
    assert_eq!(heard(&mut world, probe), ["704#00"]);
    ask(&mut world, "4 power cycle");
    ask(&mut world, "4 cable cut");
    world.run_for(std::time::Duration::from_millis(50));
    assert_eq!(heard(&mut world, probe), [""; 0]);
    let got = ask(&mut world, "4 get");
    assert_eq!((&got["bus"], &got["tec"]), (&Value::from("cut"), &Value::from(128)));
    ask(&mut world, "4 cable join");
    world.run_for(std::time::Duration::from_millis(2));
    assert_eq!(heard(&mut world, probe), ["704#00"]);
}

#[test]
fn a_record_taken_in_pieces_is_the_whole_record() {
    let recorded = |pieces: u64| {
        let (mut world, _) = world();
        let channels = Signal::ALL.map(|signal| Channel { place: Place::node(4), signal });
        world.start_recording(Recorder::new(std::time::Duration::from_millis(5), channels));
        let mut rows = Vec::new();
        for piece in 1..=pieces {
            world.run_until(Instant::from_micros(1_100_000 * piece / pieces));
            world.mark("piece");
            let taken = world.take_recorded().unwrap();
            assert_eq!(taken.marks().len(), 1);
            let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
            rows.extend(taken.rows().map(|(at, values)| (at, bits(values))));
        }
        rows
    };
    let whole = recorded(1);
    // The world begins at 0.5 s; first and last moment count both.
    assert_eq!(whole.len(), 121);
    assert_eq!(recorded(7), whole);
}

#[test]
fn a_recorder_samples_at_its_period_and_changes_nothing() {
    let (mut plain, _) = world();
    let (mut world, _) = world();
    let channels = [Signal::Position, Signal::Velocity, Signal::MotorTemperature];
    let channels = channels.map(|signal| Channel { place: Place::node(4), signal });
    world.start_recording(Recorder::new(std::time::Duration::from_millis(100), channels));
    world.run_until(Instant::from_millis(650));
    ask(&mut world, "4 rotor lock");
    world.mark("rotor locked, \"hard\"");
    world.run_until(Instant::from_millis(900));
    let recorder = world.stop_recording().unwrap();
    assert_eq!(recorder.samples(0).collect::<Vec<_>>(), [2048.0, 2457.0, 2662.0, 2662.0, 2662.0]);
    assert_eq!(recorder.samples(3).count(), 0);
    let rows: Vec<(u64, f64, f64)> =
        recorder.rows().map(|(at, values)| (at.as_nanos() / 1_000_000, values[0], values[1])).collect();
    assert_eq!(
        rows,
        [(500, 2048.0, 60.0), (600, 2457.0, 60.0), (700, 2662.0, 0.0), (800, 2662.0, 0.0), (900, 2662.0, 0.0)]
    );
    // The scripted drive has no sensor of its motor's temperature.
    assert!(recorder.samples(2).all(f64::is_nan));
    assert_eq!(recorder.marks(), [(Instant::from_millis(650), "rotor locked, \"hard\"".to_owned())]);
    plain.run_until(Instant::from_millis(650));
    ask(&mut plain, "4 rotor lock");
    plain.run_until(Instant::from_millis(900));
    assert_eq!(crate::common::frames(&plain), crate::common::frames(&world));
}
