//! `ferrodrive run --serve`: scenarios whose host is a program outside.

use std::path::{Path, PathBuf};

use processes::raw_bus::RawBus;
use processes::{Scratch, Simulator, done, ferrodrive, scratch};
use serde_json::Value;

const SERVE: [&str; 2] = ["--serve", "socketcand://127.0.0.1:0"];

/// A scenario of a ZLAC8030L at node 4 in a directory of the test's own.
fn scenario(name: &str, rest: &str) -> (Scratch, PathBuf) {
    let folder = scratch(name);
    let file = folder.join("scenario.toml");
    std::fs::write(&file, format!("machine = {{ drive = [{{ model = 'zlac8030l', node = 4 }}] }}\n{rest}")).unwrap();
    (folder, file)
}

fn start(file: &Path, options: &[&str]) -> Simulator {
    Simulator::start_scenario(&[&[file.to_str().expect("UTF-8")], options].concat())
}

/// The exit status, and the line of JSON with the outcome.
fn end(mut served: Simulator) -> (Option<i32>, Value) {
    let lines = served.lines_left();
    let report = lines.last().unwrap_or_else(|| panic!("nothing but {:?}", served.ready));
    (served.wait(), serde_json::from_str(report).unwrap_or_else(|error| panic!("{error} in {report}")))
}

/// What was asked, verdict and what was seen of each row.
fn rows(report: &Value) -> Vec<(&str, &str, &str)> {
    let rows = report["rows"].as_array().expect("rows").iter();
    rows.map(|row| {
        let text = |field: &str| row[field].as_str().unwrap_or_default();
        (text("asked"), text("verdict"), text("seen"))
    })
    .collect()
}

#[test]
fn a_host_outside_meets_what_the_scenario_does_to_its_drive_and_the_end_is_that_of_the_scenario() {
    let (_folder, file) = scenario(
        "served",
        "limit = '60s'\n[[step]]\nname = 'brown-out'\nwhen = '4 event target reached'\ndo = '4 supply 12'\n\
         [[expect]]\nthat = '4 event fault 0x0002'\nafter = 'brown-out'\nwithin = '200ms'\n\
         [[expect]]\nthat = '4 velocity = 60 +- 15'\n",
    );
    let served = start(&file, &[&SERVE[..], &["--json"]].concat());
    assert!(served.ready.starts_with("ready socketcand://127.0.0.1:"), "{}", served.ready);
    let bus = served.bus("socketcand");
    let host = ferrodrive(&["--bus", &bus, "--model", "4=zlac8030l", "velocity", "4", "60rpm"]);
    let (status, report) = end(served);
    assert_eq!(status, Some(0), "{report:#} {} {}", host.out, host.err);
    assert_eq!(report["ok"], true);
    let seen = rows(&report);
    assert!(
        seen.iter().any(|(asked, verdict, seen)| {
            *asked == "4 event fault 0x0002" && *verdict == "passed" && seen.starts_with("node 4: fault 0002h")
        }),
        "{seen:?}"
    );
}

#[test]
fn time_begins_with_the_first_client_and_what_is_open_at_the_limit_has_failed() {
    let (_folder, file) = scenario("served-idle", "limit = '300ms'\n[[expect]]\nthat = '4 velocity > 5'\n");
    let mut served = start(&file, &[&SERVE[..], &["--json"]].concat());
    // Time in which nothing may happen: no client has come.
    std::thread::sleep(std::time::Duration::from_millis(500));
    assert!(served.is_running(), "time stands still until a client is connected");
    let client = RawBus::connect(&served.address("socketcand"));
    let (status, report) = end(served);
    drop(client);
    assert_eq!((status, &report["ok"], &report["end_s"]), (Some(1), &false.into(), &0.3.into()), "{report:#}");
    assert_eq!(rows(&report)[0].2, "not by the end of the run: 0 r/min");
}

#[test]
fn the_adapter_of_a_host_outside_can_be_cut_and_joined() {
    let (_folder, file) = scenario(
        "served-cut",
        "end = '3s'\n[[step]]\nname = 'cut'\nat = '1s'\ndo = 'host cut'\n[[step]]\nname = 'join'\nat = '2s'\ndo = 'host join'\n\
         [[expect]]\nnever = 'frame 604#'\nafter = 'cut'\nuntil = '2s'\n[[expect]]\nthat = 'frame 584#'\nafter = 'join'\n",
    );
    let control = ["--control", "127.0.0.1:0", "--clock", "manual", "--json"];
    let served = start(&file, &[&SERVE[..], &control].concat());
    let place = served.address("control");
    let run = |until: &str| done(&["world", "--control", &place, "run", "until", until]);
    let mut host = RawBus::connect(&served.address("socketcand"));
    run("1.5s");
    assert!(host.say("< send 604 8 40 41 60 0 0 0 0 0 >"));
    // The boot-up message was heard before the cut; of the answer nothing is before the cable is joined again.
    run("1.9s");
    run("2.9s");
    assert!(host.frame("584").is_some());
    run("4s");
    let (status, report) = end(served);
    assert_eq!(status, Some(0), "{report:#}");
    assert_eq!(report["end_s"], 3.0);
}

#[test]
fn moved_by_hand_two_runs_are_the_same_to_the_last_frame() {
    let (_folder, file) = scenario("served-manual", "end = '1s'\n[[step]]\nat = '500ms'\ndo = '4 supply 12'\n");
    let digest = || {
        let served = start(&file, &["--control", "127.0.0.1:0", "--clock", "manual", "--json"]);
        done(&["world", "--control", &served.address("control"), "run", "5s"]);
        let (status, report) = end(served);
        assert_eq!((status, &report["end_s"]), (Some(0), &1.0.into()), "{report:#}");
        report["digest"].clone()
    };
    assert_eq!(digest(), digest());
}

#[cfg(unix)]
#[test]
fn a_signal_ends_it_with_what_was_seen_until_then() {
    let (_folder, file) = scenario("served-signal", "limit = '60min'\n[[expect]]\nthat = '4 velocity > 5'\n");
    let mut served = start(&file, &SERVE);
    served.signal("-TERM");
    assert_eq!(served.wait(), Some(143));
    let text = served.lines_left().join("\n");
    assert!(text.contains("4 velocity > 5") && text.contains("0 of 1 as expected"), "{text}");
}

#[test]
fn what_makes_no_sense_together_is_refused() {
    let (_folder, file) = scenario("served-refused", "end = '1s'\n");
    let file = file.to_str().unwrap();
    for (options, said) in [
        (&["--serve", "socketcand://127.0.0.1:0", "--seeds", "1..3"][..], "a sweep has many"),
        (&["--serve", "socketcand://127.0.0.1:0", "--clock", "manual"], "the time cannot be advanced"),
        (&["--speed", "10"], "--serve"),
        (&["--serve", "nowhere"], "nowhere"),
        (&["--jobs", "2"], "--jobs needs several runs"),
        (&[file, "--serve", "socketcand://127.0.0.1:0"], "takes one scenario, and there are 2"),
        (&[file, "--record", "a.csv"], "takes one scenario, and there are 2"),
    ] {
        let ended = ferrodrive(&[&["run", file], options].concat());
        assert_eq!(ended.status, Some(2), "{options:?}: {}", ended.err);
        assert!(ended.err.contains(said), "{options:?}: {}", ended.err);
    }
}
