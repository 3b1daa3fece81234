//! `ferrodrive group` and `ferrodrive drive-base`: what they do on the virtual bus of a command's own, what ends them on one that is
//! served, and what stops the drives then.
#![cfg(unix)]

use std::io::Write;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use processes::{Ended, Simulator, command, done, ferrodrive, wait_until};
use serde_json::Value;

fn example(name: &str) -> String {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "..", "..", "examples", name].iter().collect();
    path.display().to_string()
}

fn with_input(arguments: &[&str], input: &str) -> Ended {
    let mut child = processes::command(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    let ended = child.wait_with_output().unwrap();
    Ended {
        status: ended.status.code(),
        out: String::from_utf8(ended.stdout).unwrap(),
        err: String::from_utf8(ended.stderr).unwrap(),
    }
}

#[track_caller]
fn refused(arguments: &[&str], status: i32, part: &str) {
    let ended = ferrodrive(arguments);
    assert_eq!(ended.status, Some(status), "{arguments:?}: {}", ended.err);
    assert!(ended.err.contains(part), "{arguments:?} should say {part:?}, but says: {}", ended.err);
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

#[test]
fn axes_that_are_named_go_where_they_are_sent_in_the_time_that_is_given() {
    let moved = done(&["--json", "group", "move", "1=90deg", "4=0.5turn", "--within", "3s"]).json();
    assert_eq!(number(&moved["time_s"]), 3.0);
    assert_eq!(moved["missed_cycles"], 0);
    for (axis, (node, to)) in moved["axes"].as_array().unwrap().iter().zip([(1, 90.0), (4, 180.0)]) {
        assert_eq!((axis["node"].as_u64(), number(&axis["to_deg"])), (Some(node), to), "{axis}");
        assert!((number(&axis["at_deg"]) - to).abs() < 1.0, "{axis}");
        assert_eq!(number(&axis["limits"]["velocity_rpm"]), 30.0, "{axis}");
    }
}

#[test]
fn the_limits_of_the_command_line_are_those_of_the_path() {
    let limits = ["--velocity", "60rpm", "--acceleration", "300rpm/s", "--rounding", "100ms"];
    let moved = done(&[&["--json", "group", "move", "4=1turn"], &limits[..]].concat()).json();
    // v = 1 turn/s, a = 5 turns/s^2, j = 50 turns/s^3: L/v + v/a + a/j.
    assert!((number(&moved["time_s"]) - 1.3).abs() < 1e-6, "{moved}");
}

#[test]
fn a_group_of_the_file_holds_the_axes_that_are_not_named_and_keeps_to_its_software_limits() {
    let file = example("two_axes.toml");
    let moved = done(&["--json", "group", "move", &file, "2=-45deg"]).json();
    let [joint, stepper] = &moved["axes"].as_array().unwrap()[..] else { panic!("{moved}") };
    assert!((number(&joint["at_deg"]) - number(&joint["from_deg"])).abs() < 0.5, "{joint}");
    assert!((number(&stepper["at_deg"]) + 45.0).abs() < 1.0, "{stepper}");
    assert_eq!(stepper["limits"]["range_deg"], serde_json::json!([-360.0, 360.0]));
    refused(&["group", "move", &file, "1=181deg"], 1, "outside its software limits of -180 to 180 deg");
    refused(&["group", "move", &file, "1=1deg", "--group", "legs"], 1, "the machine file has: pair");
    refused(&["group", "move", &file, "4=1deg"], 1, "node 4");
    refused(&["group", "move", &file, "1=90deg", "--within", "10ms"], 1, "give more time, or raise a limit");
}

#[test]
fn what_is_no_group_move_is_refused() {
    refused(&["group", "move", "1=90deg", "1=0deg"], 2, "two positions for node 1");
    refused(&["group", "move", "90deg"], 2, "expected a machine file, FILE.toml, or NODE=POSITION");
    refused(&["group", "move", "4=NaN"], 2, "does not begin with a number");
    refused(&["group", "move", "4=1turn", "--acceleration", "300ms"], 2, "expected a rate above 0");
    refused(&["group", "move", "4=1turn", "--velocity", "9000rpm"], 1, "the drive does 1000 r/min at most");
    refused(&["group", "move", "/no/such/file.toml", "4=1turn"], 1, "cannot use the machine file");
}

#[test]
fn a_base_goes_the_way_of_its_twist() {
    let file = example("base.toml");
    let driven = done(&["--json", "drive-base", &file, "--linear", "0.3", "--angular", "0.2", "--for", "3s"]).json();
    let pose = &driven["pose"];
    let heading = number(&pose["heading_deg"]);
    // Ramps up and down are alike, so that the way is speed times time: 0.6 rad on a circle of 1.5 m; whole r/min and cycles.
    assert!((heading - 0.6_f64.to_degrees()).abs() < 1.5, "{pose}");
    let (x, y) = (1.5 * 0.6_f64.sin(), 1.5 * (1.0 - 0.6_f64.cos()));
    assert!((number(&pose["x_m"]) - x).abs() < 0.02 && (number(&pose["y_m"]) - y).abs() < 0.02, "{pose}");
    assert_eq!(driven["dead_man_stops"], 0);
}

#[test]
fn lines_of_twists_are_driven_one_after_the_other_and_bad_ones_are_told() {
    let file = example("base.toml");
    // Ten lines of 100 ms each; a line that is not a twist takes no time.
    let lines = format!("{}\nnan 0\nfast\n0.2\n1 2 3\n", "0.3 0\n".repeat(10));
    let driven = with_input(&["--json", "drive-base", &file], &lines);
    assert_eq!(driven.status, Some(0), "{}", driven.err);
    let report = driven.json();
    assert!((number(&report["pose"]["x_m"]) - 0.3).abs() < 0.02, "{report}");
    assert_eq!(report["bad_lines"], 4);
    assert_eq!(driven.err, "");
    let said = with_input(&["drive-base", &file], &lines).err;
    assert!(said.contains("expected a twist of two numbers, m/s and rad/s, e.g. 0.3 -0.1, got 'fast'"), "{said}");
}

#[test]
fn what_is_no_drive_of_a_base_is_refused() {
    let file = example("base.toml");
    refused(&["drive-base"], 2, "expected a machine file with a [base]");
    refused(&["drive-base", &example("two_axes.toml")], 1, "the machine file has no [base]");
    refused(&["drive-base", &file, "--linear", "0.3"], 2, "--for");
    refused(&["drive-base", &file, "--linear", "nan", "--for", "1s"], 2, "expected a finite number");
    refused(&["drive-base", &file, "--for", "1s", "--dead-man", "1s"], 2, "cannot be used with");
    refused(&["drive-base", &file, "--dead-man", "0s"], 2, "the limit watchdog in seconds is 0");
}

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
                    said.contains(&format!("node {node} was moving and has been quick-stopped")),
                    "{signal}: {said}"
                );
            }
        }
        // Killed, it stopped nothing: the drives' own watch over their host ends the motion (2000h).
        bench.wait(false);
    }
}

#[test]
fn a_base_stops_when_no_line_comes_and_drives_on_with_the_next() {
    let mut bench = Bench::new();
    let file = example("base.toml");
    let mut driving = bench.start(&["drive-base", &file]);
    let mut lines = driving.stdin.take().unwrap();
    // A line with each look, as often as a program gives them.
    let mut drives = |bench: &mut Bench| {
        writeln!(lines, "0.5 0").unwrap();
        bench.turns(4) && bench.turns(5)
    };
    wait_until("it drives", || drives(&mut bench));
    // The program that gives the lines hangs; its pipe is open.
    bench.wait(false);
    wait_until("it drives on", || drives(&mut bench));
    drop(lines);
    let ended = driving.wait_with_output().unwrap();
    let (out, err) = (String::from_utf8(ended.stdout).unwrap(), String::from_utf8(ended.stderr).unwrap());
    assert_eq!(ended.status.code(), Some(0), "{out}{err}");
    let report: Value = serde_json::from_str(&out).unwrap();
    assert!(report["dead_man_stops"].as_u64().unwrap() >= 1, "{report}");
    assert_eq!(err, "", "a program has it in the report");
    bench.wait(false);
}
