//! What programs read: failures as one line of JSON on standard output, numbers with the digits that were meant, and values
//! apart from their names.

use std::process::Stdio;

use processes::{Ended, Simulator, command, done, ferrodrive, scratch};
use serde_json::{Value, json};

/// Ends with `status`, and with exactly one line of JSON on standard output and nothing else; its `error`.
#[track_caller]
fn failed(arguments: &[&str], status: i32) -> Value {
    let ended: Ended = ferrodrive(&[arguments, &["--json"]].concat());
    assert_eq!(ended.status, Some(status), "{arguments:?}: {}{}", ended.out, ended.err);
    assert_eq!(ended.err, "", "{arguments:?}");
    assert_eq!(ended.out.lines().count(), 1, "{arguments:?}: {}", ended.out);
    let said = ended.json();
    assert_eq!(said["ok"], false, "{arguments:?}");
    let keys: Vec<_> = said["error"].as_object().unwrap().keys().cloned().collect();
    assert_eq!(keys, ["abort", "kind", "message", "next", "node", "object"], "{arguments:?}");
    said["error"].clone()
}

#[track_caller]
fn is(error: &Value, kind: &str, node: Option<u8>, object: Option<&str>, abort: Option<u32>) {
    let place = (&error["kind"], &error["node"], &error["object"], &error["abort"]);
    assert_eq!(place, (&json!(kind), &json!(node), &json!(object), &json!(abort)), "{error}");
    assert!(!error["message"].as_str().unwrap().is_empty());
}

#[test]
fn what_a_drive_refuses_is_reported_with_node_object_and_abort_code() {
    // CiA 301, table 22: attempt to write a read-only object; object does not exist.
    is(&failed(&["write", "4", "6064", "5"], 1), "aborted", Some(4), Some("6064h:00"), Some(0x0601_0002));
    is(&failed(&["read", "4", "6502"], 1), "aborted", Some(4), Some("6502h:00"), Some(0x0602_0000));
}

#[test]
fn silence_a_missing_mode_and_a_motion_that_fails_have_their_kinds() {
    let silent = failed(&["read", "9", "6064"], 1);
    is(&silent, "no_answer", Some(9), Some("6064h:00"), None);
    assert!(silent["next"].as_str().unwrap().contains("node-ID"), "{silent}");
    is(&failed(&["torque", "2", "500mA"], 1), "no_such_mode", Some(2), None, None);
    is(&failed(&["home", "4", "--method", "17"], 1), "no_such_mode", Some(4), None, None);
    let late = failed(&["home", "2", "--method", "17", "--within", "1s"], 1);
    is(&late, "not_reached", Some(2), None, None);
    assert!(late["message"].as_str().unwrap().contains("seen: statusword"), "{late}");
    assert!(late["next"].as_str().unwrap().contains("switch"), "{late}");
}

#[test]
fn a_command_line_that_makes_no_sense_is_reported_in_json_too() {
    for arguments in [
        &["velocity", "4", "fast"][..],
        &["reed", "4"],
        &["scan", "--jsn"],
        &[],
        &["move", "4", "1.5"],
        &["--bus", "log:trace.log", "scan"],
        &["sim"],
        &["sim", "--drive", "zlac8030@4"],
        &["sim", "--drive", "zlac8030l@4", "--drive", "zlac8030l@4"],
        &["demo", "--drive", "toaster"],
        &["write", "4", "6060", "profile_velocty"],
    ] {
        let error = failed(arguments, 2);
        assert_eq!(error["kind"], "usage", "{arguments:?}: {error}");
        assert!(!error["message"].as_str().unwrap().contains('\n'), "{error}");
    }
    let error = failed(&["write", "4", "6060", "profile_velocty"], 2);
    assert_eq!((&error["node"], &error["object"]), (&json!(4), &json!("6060h:00")));
    assert!(ferrodrive(&["--json", "--help"]).out.contains("Usage:"), "help stays help");
}

#[test]
fn a_bus_that_is_not_there_and_a_log_that_cannot_be_written_are_failures_of_the_same_form() {
    is(&failed(&["--bus", "socketcand://127.0.0.1:1/can0", "scan"], 1), "bus", None, None, None);
    let directory = scratch("nowhere");
    let picture = directory.join("no such folder").join("demo.svg");
    let error = failed(&["demo", "--drive", "zlim42c", "--svg", picture.to_str().unwrap()], 1);
    is(&error, "file", None, None, None);
    let log = picture.with_extension("log");
    let error = failed(&["sim", "--drive", "zlac8030l@4", "--log", log.to_str().unwrap()], 1);
    assert!(error["message"].as_str().unwrap().contains("cannot write the log"), "{error}");
}

/// What people read on standard error, programs have in the report.
#[test]
fn a_base_that_is_driven_by_a_program_prints_json_alone() {
    use std::io::Write;
    let base = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/base.toml");
    let mut command = command(&["--json", "drive-base", base]);
    let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = piped.spawn().unwrap();
    child.stdin.take().unwrap().write_all(b"0.1 0\nfoo\n9 9\n").unwrap();
    let output = child.wait_with_output().unwrap();
    let (out, err) = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap()).into();
    assert_eq!(err, "");
    let said: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&said["ok"], &said["bad_lines"]), (&json!(true), &json!(1)), "{said}");
}

#[test]
fn an_error_behind_lines_of_a_log_says_that_they_are_not_all() {
    let directory = scratch("partial");
    let log = directory.join("bad.log");
    std::fs::write(&log, "(1.5) can0 20000004#0000000000000000\nno frame\n").unwrap();
    let ended = ferrodrive(&["--json", "decode", log.to_str().unwrap()]);
    assert_eq!(ended.status, Some(1));
    let lines: Vec<Value> = ended.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let (last, before) = lines.split_last().unwrap();
    assert_eq!(before.len(), 1, "{}", ended.out);
    assert_eq!(
        (&last["ok"], &last["partial"], &last["error"]["kind"]),
        (&json!(false), &json!(true), &json!("no_log"))
    );
    // Where nothing was printed before it, nothing is partial: of a file that is not a log its error is all.
    std::fs::write(&log, "no frame\nnor this\n").unwrap();
    for (path, kind) in [("/no/such/a.log", "bad_file"), (log.to_str().unwrap(), "no_log")] {
        let ended = ferrodrive(&["--json", "decode", path]);
        assert_eq!((ended.status, ended.out.lines().count()), (Some(1), 1), "{}", ended.out);
        let said = ended.json();
        assert_eq!((&said["ok"], &said["error"]["kind"]), (&json!(false), &json!(kind)), "{said}");
        assert!(said.get("partial").is_none(), "{said}");
    }
}

/// Of several objects as of one: which it was, and the node's abort code. CiA 301, 7.2.4.3.17: 0602 0000h, 0609 0011h.
#[test]
fn an_error_behind_objects_that_were_read_says_which_it_was_and_that_they_are_not_all() {
    for (line, printed, object, code) in [
        ("read 4 6064 5FFF", 1, "5FFFh:00", 0x0602_0000),
        ("read 4 1018:* 5FFF 6064", 4, "5FFFh:00", 0x0602_0000),
        ("read 4 6064 1018:9", 1, "1018h:09", 0x0609_0011),
        ("read 4 5FFF 6064", 0, "5FFFh:00", 0x0602_0000),
        ("read 4 1018:7..9", 0, "1018h:07", 0x0609_0011),
    ] {
        let words: Vec<_> = ["--json"].into_iter().chain(line.split(' ')).collect();
        let ended = ferrodrive(&words);
        let lines: Vec<Value> = ended.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let (last, before) = lines.split_last().unwrap();
        assert_eq!((ended.status, before.len()), (Some(1), printed), "{line}: {}", ended.out);
        assert!(before.iter().all(|value| value["ok"] == true), "{}", ended.out);
        let partial = if printed > 0 { json!(true) } else { Value::Null };
        let error = &last["error"];
        assert_eq!(
            (&last["ok"], &last["partial"], &error["kind"]),
            (&json!(false), &partial, &json!("aborted")),
            "{last}"
        );
        assert_eq!(
            (&error["node"], &error["object"], &error["abort"]),
            (&json!(4), &json!(object), &json!(code)),
            "{last}"
        );
        assert!(error["next"].is_string(), "{last}");
    }
}

#[test]
fn a_run_that_fails_has_its_error_where_other_commands_have_it() {
    const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/scenarios/homing_stuck_switch.toml");
    let directory = scratch("run_error");
    let fails = directory.join("fails.toml");
    let text = "title = 'fails'\nend = '100ms'\n[[machine.drive]]\nmodel = 'zlac8030l'\nnode = 4\n\
                [[expect]]\nthat = '4 velocity > 50'\nwithin = '50ms'\n";
    std::fs::write(&fails, text).unwrap();
    let fails = fails.to_str().unwrap();
    let error = |words: &[&str], kind: &str| {
        let ended = ferrodrive(&[&["--json", "run"], words].concat());
        assert_eq!((ended.status, ended.out.lines().count()), (Some(1), 1), "{words:?}: {}{}", ended.out, ended.err);
        let said = ended.json();
        assert_eq!((&said["ok"], &said["error"]["kind"]), (&json!(false), &json!(kind)), "{words:?}: {said}");
        assert!(said["error"]["next"].is_string() && said["error"]["message"].is_string(), "{said}");
    };
    error(&[fails], "scenario");
    error(&[fails, SCENARIO], "scenario");
    error(&[fails, "--seeds", "1..2"], "scenario");
    error(&[SCENARIO, "/no/such/file.toml"], "bad_file");
    assert_eq!(done(&["--json", "run", SCENARIO, SCENARIO]).json()["error"], Value::Null);
}

#[test]
fn a_mode_is_a_number_with_its_name_beside_it() {
    let state = done(&["--json", "velocity", "4", "60rpm"]).json();
    assert_eq!((&state["mode"], &state["mode_name"]), (&json!(3), &json!("profile velocity")));
    assert!(done(&["state", "4"]).out.contains("0 (no mode)"));
}

#[test]
fn a_factory_value_is_a_number_and_what_the_node_id_is_added_to_is_said_apart() {
    let default = |object| done(&["--json", "objects", "zlac8030l", object]).json()["objects"][0]["default"].clone();
    // "ZLAC8030L quick start guide V1.00", chapter 9.
    assert_eq!(default("6081"), 120);
    assert_eq!(default("1400:01"), json!({ "plus_node_id": 0x200 }));
    let saved = done(&["--json", "save", "4"]).json();
    let after = saved["effective_after_restart"].as_array().unwrap();
    assert!(after.contains(&json!({ "object": "200Dh:00", "name": "can_custom_driver_node_number" })), "{saved}");
}

#[test]
fn three_tenths_are_three_tenths() {
    // 6077h, and 606Ch, count tenths: 0.1 is not a binary fraction.
    let directory = scratch("tenths");
    let file = directory.join("warm.toml");
    std::fs::write(&file, "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\ntemperatures_c = { motor = 30.3 }\n").unwrap();
    let bus = format!("sim:{}", file.display());
    let read = done(&["--bus", &bus, "--json", "read", "4", "2026:01"]).out;
    assert!(read.contains("\"value\":303,\"quantity\":30.3,"), "{read}");
}

#[test]
fn no_number_of_a_report_or_of_the_simulator_has_more_digits_than_a_millionth() {
    let mut simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    simulator.send("4 get");
    let got = simulator.line();
    let moved = done(&["--json", "velocity", "4", "61rpm", "--for", "300ms"]).out;
    for text in [got, moved] {
        let numbers = text.split(|c: char| !matches!(c, '0'..='9' | '.' | '-' | 'e' | 'E'));
        for number in numbers.filter(|number| number.parse::<f64>().is_ok()) {
            let decimals = number.split_once('.').map_or(0, |(_, decimals)| decimals.len());
            assert!(decimals <= 6 && !number.contains('e'), "{number} in {text}");
        }
    }
}
