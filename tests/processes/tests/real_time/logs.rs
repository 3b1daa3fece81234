//! Logs of every form, written by any command, read, converted and sent again.

use std::io::Write;
use std::path::Path;
use std::process::Stdio;

use processes::{Simulator, command, done, ferrodrive, scratch, wait_until};
use serde_json::Value;

/// The extensions of what can be written.
const WRITTEN: [&str; 4] = ["log", "asc", "blf", "pcapng"];

/// The frames of a log as `decode` prints them, with their direction.
fn frames(log: &Path) -> Vec<(String, Option<bool>)> {
    let ended = done(&["--json", "decode", log.to_str().unwrap()]);
    let lines = ended.out.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    lines.map(|line| (line["frame"].as_str().expect("a frame").to_owned(), line["sent"].as_bool())).collect()
}

#[test]
fn a_log_is_read_from_standard_input() {
    for arguments in [&["decode", "-"][..], &["--bus", "log:-", "dump"]] {
        let mut child = command(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(b"(1.5) can0 704#00\n(2.5) can0 704#05").unwrap();
        let output = child.wait_with_output().unwrap();
        let out = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{arguments:?}");
        assert_eq!(out.lines().count(), 2, "{out}");
        assert!(out.contains("boot-up node 4") && out.contains("heartbeat node 4: operational"), "{out}");
    }
}

#[test]
fn a_replay_does_to_a_drive_what_was_done_when_the_log_was_written() {
    let directory = scratch("replayed");
    let log = directory.join("enable.blf");
    let log = log.to_str().unwrap();
    let start = || Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let first = start();
    done(&["--bus", &first.bus("socketcand"), "--model", "4=zlac8030l", "enable", "4", "--log", log]);
    drop(first);
    let second = start();
    let bus = second.bus("socketcand");
    let state = || done(&["--bus", &bus, "--model", "4=zlac8030l", "--json", "state", "4"]).json()["state"].clone();
    assert_ne!(state(), "Operation enabled");
    done(&["--bus", &bus, "replay", log, "--only", "sent", "--allow-motion"]);
    assert_eq!(state(), "Operation enabled");
}

#[test]
fn a_log_of_a_killed_simulator_can_be_read_in_every_form() {
    let directory = scratch("killed_logs");
    for extension in WRITTEN {
        let log = directory.join(format!("sim.{extension}"));
        let path = log.to_str().unwrap();
        let simulator =
            Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0", "--log", path]);
        done(&["--bus", &simulator.bus("socketcand"), "--model", "4=zlac8030l", "read", "4", "1018:01"]);
        // It need not be whole yet.
        let shown = || ferrodrive(&["--json", "decode", path]).out;
        wait_until("the answer is on the disk", || shown().contains("584#43181001"));
        simulator.signal("-KILL");
        drop(simulator);
        let frames = frames(&log);
        assert!(frames.iter().any(|(frame, _)| frame.starts_with("584#43181001")), "{extension}: {frames:?}");
    }
}

#[test]
fn what_a_base_cannot_do_is_said_with_what_it_does_instead() {
    let base = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/base.toml");
    let mut base = command(&["drive-base", base]);
    let base = base.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = base.spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    input.write_all(b"1e308 0\n1e308 0\n0.1 0\n").unwrap();
    drop(input);
    let ended = child.wait_with_output().unwrap();
    let err = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success(), "{err}");
    assert_eq!(err.matches("are beyond the limits of the base: it is driven at").count(), 1, "{err}");
}

/// What the same lines on standard input write where time is moved by hand, in bytes.
fn by_hand(folder: &std::path::Path, number: usize, record: &str) -> [Vec<u8>; 2] {
    let [log, record] = ["run.log", record].map(|name| folder.join(format!("{number}-{name}")));
    let drives = ["--drive", "zlac8030l@4", "--drive", "m4230e17b50@1", "--clock", "manual"];
    let files = ["--log", log.to_str().unwrap(), "--record", record.to_str().unwrap()];
    let mut command = command(&[&["sim"], &drives[..], &files].concat());
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let lines = b"run 2s\n4 load torque 0.5\n1 load torque 1\nrun 1s\n4 fault hall on\nrun 1500us\n4 fault hall off\nrun 1s\nquit\n";
    child.stdin.take().unwrap().write_all(lines).unwrap();
    assert!(child.wait().unwrap().success());
    [log, record].map(|path| std::fs::read(path).unwrap())
}

#[test]
fn moved_by_hand_a_simulator_writes_the_same_log_and_record_to_the_byte() {
    let folder = scratch("by-hand");
    for record in ["run.csv", "run.mcap"] {
        let first = by_hand(&folder, 0, record);
        let log = String::from_utf8_lossy(&first[0]);
        assert!(log.starts_with("(0000000000.") && log.lines().count() > 3, "{log}");
        for number in 1..4 {
            assert!(by_hand(&folder, number, record) == first, "{record}, run {number}");
        }
    }
}
