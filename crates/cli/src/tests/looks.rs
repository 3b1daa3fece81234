//! What is read, listened to and given up on a bus whose drives the command does not know.

use std::time::Duration;

use processes::scratch;
use serde_json::{Value, json};

use super::virtual_bus::{VirtualBus, without_bus};

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).expect("a JSON value a line")).collect()
}

/// The letter of the standard's error status with which a node ended.
fn letter(report: &Value, node: u64) -> Option<String> {
    let nodes = report["nodes"].as_array().expect("nodes");
    let found = nodes.iter().find(|found| found["node"] == node).expect("the node");
    found["letter"].as_str().map(str::to_owned)
}

#[test]
fn the_data_sheet_of_another_device_is_told_with_what_differs_and_nothing_is_written() {
    let folder = scratch("boot_wrong_eds");
    let [sheet, machine] = ["other.eds", "machine.toml"].map(|name| folder.join(name));
    let bench = VirtualBus::of(&["zlac8030l@4"]);
    std::fs::write(&sheet, &without_bus(&["eds", "cia402"]).out).expect("an EDS");
    std::fs::write(&machine, "[[drive]]\nmodel = \"other.eds\"\nnode = 4\n[drive.start_up]\n1017 = 200\n")
        .expect("a file");
    let on = |words: &[&str]| bench.run(words);
    // A hub motor driver of this maker says 40192h of itself, a servo 20192h (CiA 402-1): device type is letter C.
    let ended = on(&["boot", machine.to_str().expect("UTF-8"), "--json"]);
    assert_eq!((ended.status, letter(&ended.json(), 4).as_deref()), (Some(1), Some("C")), "{}{}", ended.out, ended.err);
    let text = on(&["boot", machine.to_str().expect("UTF-8")]).out;
    assert!(text.contains("1000h:00") && text.contains("20192h") && text.contains("40192h"), "{text}");
    // Its heartbeat is as it was delivered (ZLAC8030L quick start guide V1.00, chapter 9: 1017h is 0).
    assert_eq!(on(&["read", "4", "1017", "--json"]).json()["value"], 0);
}

#[test]
fn a_scan_tells_who_beats_each_second_who_never_and_who_has_not_been_heard_yet() {
    let bench = VirtualBus::of(&["m4230e17b50@1", "zlac8030l@4"]);
    let on_bus = |words: &[&str]| bench.done(words);
    let found = on_bus(&["--json", "--timeout", "1s", "scan"]).json();
    let said = |place: usize| {
        let node = &found["nodes"][place];
        (node["node"].as_u64(), node["nmt_state"].clone(), node["heartbeat_ms"].clone())
    };
    // "M Robot Joint Motor CanOpen Manual", 5.04: 1017h is 1000 ms; "ZLAC8030L quick start guide V1.00", chapter 9: 0.
    assert_eq!(said(0), (Some(1), json!("operational"), json!(1000)));
    assert_eq!(said(1), (Some(4), Value::Null, json!(0)));
    let text = on_bus(&["--timeout", "1s", "scan"]).out;
    assert!(text.contains("sends no heartbeat") && !text.contains("not heard yet"), "{text}");

    on_bus(&["--model", "4=zlac8030l", "write", "4", "1017", "30000"]);
    let text = on_bus(&["--timeout", "1s", "scan"]).out;
    assert!(text.contains("heartbeat every 30000 ms, not heard yet"), "{text}");
}

#[test]
fn several_objects_of_an_unknown_node_are_found_by_asking() {
    let bench = VirtualBus::of(&["zlac8030l@4"]);
    let read = |options: &[&str]| lines(&bench.done(&[options, &["--json", "read", "4", "1000..1018"]].concat()).out);
    let (found, listed) = (read(&[]), read(&["--model", "4=zlac8030l"]));
    let of =
        |lines: &[Value]| lines.iter().map(|line| (line["object"].clone(), line["bytes"].clone())).collect::<Vec<_>>();
    assert_eq!(of(&found), of(&listed));
}

#[test]
fn a_motion_that_takes_longer_than_it_may_is_given_up_and_stopped() {
    let bench = VirtualBus::of(&["zlac8030l@4"]).with(&["--model", "4=zlac8030l"]);
    let late = bench.run(&["move", "4", "1.9turn", "--relative", "--profile-velocity", "60rpm", "--within", "2s"]);
    assert_eq!(late.status, Some(1), "{}", late.err);
    assert!(late.err.contains("node 4 was set in motion and has been quick-stopped"), "{}", late.err);
    let speed = bench.report(4).velocity_rpm;
    assert!(speed.abs() < 20.0, "{speed}");
}

#[test]
fn errors_that_a_node_remembers_are_shown_with_their_meaning() {
    let bench = VirtualBus::of(&["cia402@5"]);
    let on = |words: &[&str]| bench.json(words);
    assert_eq!(on(&["emcy", "show", "5"])["errors"], json!([]));
    // CiA 301, 7.5.2.19: node 7Fh within 100 ms. One heartbeat begins the watch, and none follows.
    on(&["write", "5", "1016:01", "0x7F0064"]);
    on(&["send", "77F#05"]);
    bench.pass(Duration::from_millis(100));
    let errors = &on(&["emcy", "show", "5"])["errors"];
    // CiA 301, table 26: 8130h is the life guard or heartbeat error.
    assert_eq!((&errors[0]["code"], &errors[0]["node"]), (&json!(0x8130), &json!(5)), "{errors}");
    let text = bench.done(&["emcy", "show", "5"]).out;
    assert!(text.starts_with("node 5: 8130h ") && text.to_lowercase().contains("heartbeat"), "{text}");
}

#[test]
fn pdos_that_come_are_shown_with_their_objects() {
    let bench = VirtualBus::of(&["cia402@5"]);
    // CiA 301, 7.5.2.37: an event timer of 50 ms.
    bench.done(&["write", "5", "1800:05", "50"]);
    bench.done(&["nmt", "5", "start"]);
    let watched = lines(&bench.done(&["--json", "pdo", "watch", "5", "--for", "5s"]).out);
    let first = watched.first().expect("no PDO came");
    assert_eq!((&first["pdo"], &first["node"]), (&json!("TPDO1"), &json!(5)));
    assert_eq!(first["values"][0]["object"], json!("6041h:00"));
    // CiA 402-2, table 30: Switch on disabled is x1xx 0000 in the low byte.
    let bytes = first["bytes"].as_str().unwrap();
    let low = u8::from_str_radix(&bytes[..2], 16).unwrap();
    assert_eq!(low & 0x4F, 0x40, "{bytes}");
}

/// Of what cannot be heard it is never said that it stands.
#[test]
fn an_emergency_stop_that_was_not_seen_ends_with_1() {
    let bench = VirtualBus::of(&["cia402@5"]);
    bench.apply(5, "cable cut");
    for command in [&["estop"][..], &["estop", "all"], &["quick-stop", "all"], &["stop", "all"]] {
        for (known, kind) in [(&[][..], "no_node"), (&["--model", "5=cia402"], "not_stopped")] {
            let ended = bench.run(&[&["--json"][..], known, command].concat());
            assert_eq!(
                (ended.status, &ended.json()["error"]["kind"]),
                (Some(1), &json!(kind)),
                "{command:?}: {}",
                ended.out
            );
        }
    }
}

#[test]
fn what_is_on_a_bus_is_shown_as_it_comes() {
    let bench = VirtualBus::of(&["m4230e17b50@1"]);
    // EMCY of node 9, over-current by its class (CiA 301, table 26), here sent by another node.
    bench.apply(1, "bus babble 089#1023020000000000 100");
    let reported = lines(&bench.done(&["--json", "emcy", "watch", "--for", "1s"]).out);
    assert!((9..=11).contains(&reported.len()), "{reported:?}");
    assert_eq!(
        (&reported[0]["node"], &reported[0]["code"], &reported[0]["error_register"]),
        (&json!(9), &json!(0x2310), &json!(2))
    );
}

#[test]
fn a_node_that_is_stopped_and_sends_no_heartbeat_is_explained_with_how_to_start_it() {
    let bench = VirtualBus::of(&["zlac8030l@4", "m4230e17b50@1"]).with(&["--model", "4=zlac8030l"]);
    // Not in the current folder, where another run of these tests may have its own.
    let folder = scratch("stopped_silent");
    let journal = folder.path("node4.journal");
    let apply = ["pdo", "apply", "4", "tpdo1=statusword", "--type", "255", "--event", "100ms", "--journal", &journal];
    // Pre-operational after its boot-up, and 1017h is 0: no one can hear in which state it is (CiA 301, 7.3.2.2.1: no PDO).
    bench.done(&apply);
    let silent = bench.done(&["explain", "4"]).out;
    assert!(silent.contains("pdo_missing") && silent.contains("operational only: ferrodrive nmt 4 start"), "{silent}");
    bench.done(&["nmt", "4", "start"]);
    assert!(!bench.done(&["explain", "4"]).out.contains("pdo_missing"));
    bench.done(&["nmt", "4", "stop"]);
    let stopped = bench.run(&["explain", "4"]);
    assert_eq!(stopped.status, Some(1), "{}{}", stopped.out, stopped.err);
    assert!(stopped.out.contains("in the NMT state stopped and sends no heartbeat"), "{}", stopped.out);
    assert!(stopped.err.contains("ferrodrive nmt 4 start"), "{}", stopped.err);
}
