//! Logs of a simulator that is killed.

use std::path::Path;

use processes::{Simulator, done, ferrodrive, scratch, wait_until};
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
        // Boot-up, request and answer.
        for part in ["704#00", "604#4018100100000000", "584#43181001"] {
            assert!(frames.iter().any(|(frame, _)| frame.starts_with(part)), "{extension}: {part} in {frames:?}");
        }
    }
}
