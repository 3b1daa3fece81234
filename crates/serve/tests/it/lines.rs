//! Lines of standard input: each is answered once, and means the same wherever it is said.

use serde_json::{Value, json};
use serve::pacer::{Clock, Pacer, Speed};
use serve::service::{Request, read_lines};
use tokio::sync::mpsc;

use crate::bench::{Bench, SERVO, lines, world};

fn bench(machine: &str) -> Bench {
    Bench::new(world(machine), Pacer::new(Clock::Real, Speed::Times(1.0)))
}

#[test]
fn world_commands_are_answered_line_by_line() {
    let mut bench = bench(SERVO);
    let get = bench.ask("4 get");
    assert_eq!((&get["ok"], &get["node"]), (&json!(true), &json!(4)));
    assert!(get["outputs"]["Y0"].is_number() && get["outputs"]["Y1"].is_number(), "{get}");
    assert_eq!(bench.ask("4 supply 36")["ok"], true);
    for wrong in ["fly", "5 get", "4 supply", "4 input X9 1", "4 fault wing on", "128 get"] {
        let answer = bench.ask(wrong);
        assert_eq!(answer["ok"], false, "{wrong}");
        assert!(answer["error"]["message"].as_str().is_some_and(|error| !error.is_empty()), "{answer}");
    }
    assert_eq!(bench.ask("quit")["ok"], true);
    assert_eq!(bench.ended, Some(Ok(())));
}

#[test]
fn every_drive_reports_the_same_fields_of_itself() {
    let joint = "[[drive]]\nmodel = 'm4230e17b50'\nnode = 1\n[[drive]]\nmodel = 'zlim42c'\nnode = 2\n";
    let mut bench = bench(&format!("{SERVO}{joint}"));
    for node in [1, 2, 4] {
        let got = bench.ask(&format!("{node} get"));
        assert_eq!((&got["ok"], &got["node"]), (&json!(true), &json!(node)));
        for field in ["t", "position", "velocity_rpm", "current_a", "supply_v"] {
            assert!(got[field].is_number(), "{field} in {got}");
        }
        assert_eq!(got["brake"], "released", "also where there is none: nothing holds the shaft");
        assert!(got["outputs"].is_object(), "{got}");
    }
}

#[test]
fn each_line_is_answered_once_but_for_blank_ones_and_comments() {
    let mut bench = bench(SERVO);
    let (requests, mut incoming) = mpsc::channel(16);
    let typed = "\n# 4 power off\nhelp\n   \n\u{1b}[31mnow\n# the end\n4 get\n";
    let answers = serve::messages::Messages::warnings_to(std::io::sink());
    read_lines(typed.as_bytes(), &requests, &answers);
    drop(requests);
    while let Ok(request) = incoming.try_recv() {
        bench.request(request);
    }
    let said = bench.said();
    let [help, refused, got] = &said[..] else { panic!("{said:?}") };
    assert!(help["help"].as_array().is_some_and(|forms| forms.contains(&"quit".into())), "{help}");
    assert_eq!(refused["ok"], false);
    assert!(!refused.to_string().contains("\\u001b"), "what would steer a terminal is shown: {refused}");
    assert_eq!(got["powered"], true, "a comment is not a command");
}

/// A line means the same wherever it is written: typed, sent by a program, or as the line of a request.
#[test]
fn a_line_that_is_not_obeyed_has_one_error_on_standard_input_and_on_the_control_connection() {
    let mut bench = bench(SERVO);
    let outbox = bench.control(1);
    let long = "4 ".to_owned() + &"x".repeat(5_000);
    for (words, kind) in [
        ("fly", "usage"),
        ("4", "usage"),
        ("4 fly", "usage"),
        ("130 get", "usage"),
        ("9 get", "no_such_node"),
        ("9 load torque 1", "no_such_node"),
        ("4.2 get", "refused"),
        ("4 load torque 1e9", "refused"),
        ("4 load torque x", "usage"),
        ("4 input X9 1", "refused"),
        ("4 battery off", "refused"),
        ("4 set 6041 5", "refused"),
        ("body arm get", "no_such_body"),
        ("bus corrupt 9", "usage"),
        ("run 20ms", "clock"),
        ("run x", "usage"),
        (&long, "too_long"),
    ] {
        let typed = bench.ask(words);
        let requested = json!({ "request": "world", "line": words }).to_string();
        for sent in [words, &requested] {
            bench.says(1, sent);
            let answers = lines(&outbox);
            assert_eq!(answers.len(), 1, "{sent}: {answers:?}");
            let error: &Value = &answers[0]["error"];
            assert_eq!(error, &typed["error"], "{sent}");
            assert_eq!(error["kind"], kind, "{sent}");
            assert!(error["next"].is_string(), "{error}");
        }
    }
}

#[test]
fn what_ends_the_service_is_what_it_was_asked_with() {
    let mut bench = bench(SERVO);
    let why = words::failure::Failure::new("asked to end").of_kind("interrupted");
    bench.request(Request::Ended(why.clone()));
    assert_eq!(bench.ended, Some(Err(why)));
}
