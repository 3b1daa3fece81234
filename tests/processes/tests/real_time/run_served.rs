//! `ferrodrive run --serve`: scenarios whose host is a program outside.

use std::path::{Path, PathBuf};

use processes::{Scratch, Simulator, ferrodrive, scratch};
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
    let host = ferrodrive(&["--bus", &bus, "--timeout", "2s", "--model", "4=zlac8030l", "velocity", "4", "60rpm"]);
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
