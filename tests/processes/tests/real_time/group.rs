//! `ferrodrive group` and `ferrodrive drive-base` on a served bus: what ends them, and what stops the drives then.
#![cfg(unix)]

use std::io::Write;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use processes::{Simulator, command, wait_until};
use serde_json::Value;

/// Two hub motors behind a socketcand server, in real time.
struct Bench {
    simulator: Simulator,
    bus: String,
}

impl Bench {
    fn new() -> Self {
        let drives = ["--drive", "zlac8030l@4", "--drive", "zlac8030l@5", "--serve", "socketcand://127.0.0.1:0"];
        let simulator = Simulator::start(&drives);
        let bus = simulator.bus("socketcand");
        let mut bench = Self { simulator, bus };
        // A drive that boots hears nothing.
        bench.simulator.pass(Duration::from_secs(1));
        bench
    }

    /// A busy machine may be late by some hundred milliseconds: that is not what these tests are about.
    fn start(&self, arguments: &[&str]) -> Child {
        let on_bus = ["--bus", &self.bus, "--model", "4=zlac8030l", "--model", "5=zlac8030l", "--json"];
        command(&[&on_bus, arguments].concat())
            .args(["--tolerance", "100"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    fn group(&self) -> Child {
        let limits = ["--velocity", "60rpm", "--following-error", "2turn", "--period", "20ms"];
        self.start(&[&["group", "move", "--relative", "4=50turn", "5=50turn"], &limits[..]].concat())
    }

    fn turns(&mut self, node: u8) -> bool {
        self.simulator.ask(&format!("{node} get"))["velocity_rpm"].as_f64().unwrap().abs() > 20.0
    }

    #[track_caller]
    fn wait(&mut self, turning: bool) {
        let what = if turning { "both turn" } else { "both stand" };
        wait_until(what, || self.turns(4) == turning && self.turns(5) == turning);
    }
}

#[test]
fn a_group_is_stopped_when_its_command_is_asked_to_end_or_killed() {
    for (signal, status) in [("INT", Some(130)), ("TERM", Some(143)), ("KILL", None)] {
        let mut bench = Bench::new();
        let moving = bench.group();
        bench.wait(true);
        let sent = Command::new("kill").args([format!("-{signal}"), moving.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let ended = moving.wait_with_output().unwrap();
        assert_eq!(ended.status.code(), status, "{}", String::from_utf8_lossy(&ended.stderr));
        if status.is_some() {
            let said = String::from_utf8(ended.stdout).unwrap();
            for node in [4, 5] {
                assert!(
                    said.contains(&format!("node {node} was set in motion and has been quick-stopped")),
                    "{signal}: {said}"
                );
            }
        }
        // Killed, it stopped nothing: the drives' own watch over their host ends the motion (2000h).
        bench.wait(false);
    }
}

/// Whatever ends the command before its lines end is shown. A machine that lets nothing run for a second ends it too, by the drives' own
/// watch: that is tried again.
#[test]
fn a_base_stops_when_no_line_comes_and_drives_on_with_the_next() {
    let ended: Vec<_> = (0..3).map_while(|_| drive_by_lines().err()).collect();
    assert!(ended.len() < 3, "it was stopped by something else each time: {ended:#?}");
}

fn drive_by_lines() -> Result<(), Output> {
    let mut bench = Bench::new();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/base.toml");
    let mut driving = bench.start(&["drive-base", file]);
    let mut lines = driving.stdin.take().unwrap();
    // A line with each look, as often as a program gives them; false once they are not read any more.
    let mut is_read = true;
    let mut drives = |bench: &mut Bench| {
        is_read &= writeln!(lines, "0.5 0").is_ok();
        !is_read || bench.turns(4) && bench.turns(5)
    };
    wait_until("it drives", || drives(&mut bench));
    // The program that gives the lines hangs; its pipe is open.
    bench.wait(false);
    wait_until("it drives on", || drives(&mut bench));
    drop(lines);
    let ended = driving.wait_with_output().unwrap();
    // A program or a bus that gets no processor time stops a base by right: a wheel lags, or cycles are late.
    if !is_read || ended.status.code() != Some(0) {
        return Err(ended);
    }
    let (out, err) = (String::from_utf8(ended.stdout).unwrap(), String::from_utf8(ended.stderr).unwrap());
    let report: Value = serde_json::from_str(&out).unwrap();
    assert!(report["dead_man_stops"].as_u64().unwrap() >= 1, "{report}");
    assert_eq!(err, "", "a program has it in the report");
    bench.wait(false);
    Ok(())
}
