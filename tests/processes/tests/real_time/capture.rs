//! `ferrodrive capture` over a socket in the time of the clock: what was had, and a kill (kill -9) while it captures. What is not put back
//! by a program that dies is put back by the next, from the journal.
#![allow(clippy::print_stdout, reason = "how late a busy machine is can be shown and not judged")]
#![cfg(unix)]

use std::path::Path;
use std::process::{Output, Stdio};

use processes::{Scratch, Simulator, command, scratch, wait_until};
use serde_json::Value;

struct Served {
    /// It ends with this.
    _simulator: Simulator,
    bus: String,
    /// Where journals are kept.
    folder: Scratch,
}

impl Served {
    fn new(name: &str) -> Self {
        let simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
        let served = Self { bus: simulator.bus("socketcand"), _simulator: simulator, folder: scratch(name) };
        wait_until("the drive boots", || served.run(&["read", "4", "1000"]).status.success());
        served
    }

    fn command(&self, arguments: &[&str]) -> std::process::Command {
        let mut command =
            command(&[&["--bus", &self.bus, "--model", "4=zlac8030l", "--timeout", "10s"], arguments].concat());
        command.current_dir(&self.folder).stdin(Stdio::null());
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the binary runs")
    }

    fn json(&self, arguments: &[&str]) -> Value {
        let output = self.run(&[arguments, &["--json"]].concat());
        let text = String::from_utf8(output.stdout).expect("UTF-8");
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{arguments:?}: {error} in {text}"))
    }

    /// Identifier, type, timers and mapping of each TPDO.
    fn tpdos(&self) -> Vec<Value> {
        let shown = self.json(&["pdo", "show", "4"]);
        let all = shown["nodes"][0]["pdos"].as_array().expect("rows").iter();
        all.filter(|pdo| pdo["pdo"].as_str().is_some_and(|name| name.starts_with("TPDO"))).cloned().collect()
    }
}

#[test]
fn a_capture_over_a_socket_has_what_the_drive_sent_in_time() {
    let served = Served::new("captured-live");
    let before = served.tpdos();
    let report = served.json(&["capture", "4", "velocity", "position", "--rate", "2ms", "--for", "1s", "-o", "x.csv"]);
    let traces = report["captures"][0]["traces"].as_array().expect("traces");
    assert_eq!(traces.len(), 2, "{report}");
    for trace in traces {
        // How late a busy machine is cannot be said: what came belongs to a TPDO, and has a period.
        let [period_s, jitter_s] = [&trace["period_s"], &trace["jitter_s"]].map(|time| time.as_f64().expect("a time"));
        println!(
            "{}: {} ms, jitter {} ms, {} readings",
            trace["quantity"],
            period_s * 1e3,
            jitter_s * 1e3,
            trace["readings"]
        );
        assert!(trace["by"].as_str().is_some_and(|by| by.starts_with("TPDO")) && period_s > 0.0, "{trace}");
    }
    let csv = std::fs::read_to_string(served.folder.join("x.csv")).expect("it is written");
    assert!(csv.starts_with("t_s,") && csv.lines().count() > 10, "{} lines", csv.lines().count());
    assert_eq!(served.tpdos(), before);
    assert!(!served.folder.join("ferrodrive-node4.journal").exists());
}

/// The law: whatever kills a capture, its journal leads the TPDOs back, and no other capture begins over it.
#[test]
fn a_capture_that_is_killed_leaves_a_journal_that_leads_back() {
    let served = Served::new("captured-killed");
    let (before, journal) = (served.tpdos(), served.folder.join("ferrodrive-node4.journal"));
    let mut child = served
        .command(&["capture", "4", "velocity", "current", "--for", "1h", "-o", "x.mcap"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("it runs");
    wait_until("its TPDOs are mapped", || is_whole(&journal) && served.tpdos() != before);
    // It may be between two writes, or capture by now.
    child.kill().expect("it runs for an hour");
    child.wait().expect("it has ended");
    assert!(journal.exists());
    // The answer to its last request may be on its way.
    wait_until("the drive answers", || served.run(&["read", "4", "1000"]).status.success());
    assert_ne!(served.tpdos(), before);
    let refused = served.run(&["capture", "4", "velocity", "--for", "20ms"]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(1) && said.contains("params rollback 4"), "{said}");
    let back = served.run(&["params", "rollback", "4"]);
    assert!(back.status.success(), "{}", String::from_utf8_lossy(&back.stderr));
    assert_eq!(served.tpdos(), before);
    assert!(!journal.exists());
    // And it can be captured again.
    let again = served.json(&["capture", "4", "velocity", "--for", "20ms"]);
    assert_eq!(again["ok"], true, "{again}");
    assert_eq!(served.tpdos(), before);
}

fn is_whole(journal: &Path) -> bool {
    std::fs::read_to_string(journal).is_ok_and(|text| text.contains("whole = true"))
}
