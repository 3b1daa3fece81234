//! `--log`, `--record` and `plot`: what is written while drives are served, and what is left of it when the simulator dies.

use std::path::Path;

use processes::{Simulator, done, ferrodrive, scratch, wait_for, wait_until};
use recording::{Kind, Recorded, read};
use serde_json::Value;

fn recorded(path: &Path) -> Recorded {
    let kind = Kind::of_name(path.to_str().unwrap()).unwrap();
    read(kind, &std::fs::read(path).unwrap()).unwrap()
}

/// The time of the last sample.
fn last(recorded: &Recorded) -> f64 {
    recorded.series.first().and_then(|series| series.points.last()).map_or(0.0, |(at, _)| *at)
}

fn simulator(record: &Path, more: &[&str]) -> Simulator {
    let drives =
        ["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0", "--record", record.to_str().unwrap()];
    Simulator::start_heard(&[&drives[..], more].concat())
}

/// The frames of a log as `decode` prints them.
fn frames(log: &str) -> Vec<String> {
    let ended = done(&["--json", "decode", log]);
    let lines = ended.out.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    lines.map(|line| line["frame"].as_str().expect("a frame").to_owned()).collect()
}

/// In every form of each.
#[test]
fn what_is_on_the_disk_of_a_killed_simulator_is_a_log_and_a_record() {
    let place = scratch("killed-record");
    for (log, record) in [("log", "mcap"), ("asc", "csv"), ("blf", "mcap"), ("pcapng", "csv")] {
        let (log, path) = (place.path(&format!("sim.{log}")), place.join(format!("of_{log}.{record}")));
        let signals = ["--record-period", "5ms", "--record-signals", "supply,4.position*"];
        let mut simulator = simulator(&path, &[&signals[..], &["--log", &log]].concat());
        done(&["--bus", &simulator.bus("socketcand"), "--model", "4=zlac8030l", "read", "4", "1018:01"]);
        let before = wait_for("half a second of a record", || {
            let found = std::fs::read(&path).ok().and_then(|bytes| read(Kind::of_name(path.to_str()?)?, &bytes).ok());
            let at = found.map(|recorded| last(&recorded));
            at.filter(|at| *at > 0.5).ok_or_else(|| format!("{record}: {at:?}"))
        });
        // It need not be whole yet.
        wait_until("the answer is on the disk", || {
            ferrodrive(&["--json", "decode", &log]).out.contains("584#43181001")
        });
        simulator.kill();
        // Boot-up, request and answer.
        let frames = frames(&log);
        for part in ["704#00", "604#4018100100000000", "584#43181001"] {
            assert!(frames.iter().any(|frame| frame.starts_with(part)), "{log}: {part} in {frames:?}");
        }
        let left = recorded(&path);
        assert!(last(&left) >= before && left.series.len() == 3, "{record}: {} of {before}", last(&left));
        // And it can be drawn.
        let svg = place.join("run.svg");
        let drawn = done(&["plot", path.to_str().unwrap(), "--signals", "supply", "--svg", svg.to_str().unwrap()]);
        assert!(std::fs::read_to_string(&svg).unwrap().contains("Supply"), "{}", drawn.out);
    }
}

/// The most memory that a process ever had, in bytes (`proc_pid_status(5)`).
#[cfg(target_os = "linux")]
fn most_memory(process: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("a line VmHWM");
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() * 1024
}

/// All signals of three drives each millisecond: the file grows with time, the simulator does not.
#[test]
#[cfg(target_os = "linux")]
fn a_long_record_takes_no_more_memory_than_a_short_one() {
    let place = scratch("long-record");
    for name in ["run.mcap", "run.csv"] {
        let path = place.join(name);
        let mut simulator =
            simulator(&path, &["--drive", "zlim42c@2", "--drive", "m4230e17b50@1", "--clock", "manual"]);
        let mut run = |time: &str| {
            assert_eq!(simulator.ask(&format!("run {time}"))["ok"], true);
            (most_memory(simulator.id()), std::fs::metadata(&path).unwrap().len())
        };
        let (early, small) = run("10s");
        let (late, large) = run("60s");
        // More than the memory may grow by; MCAP is compressed.
        assert!(large > small + (4 << 20), "{name}: {small} bytes, then {large}");
        assert!(
            late < early + (3 << 20),
            "{name}: {early} bytes of memory, then {late}; the file grew by {}",
            large - small
        );
    }
}
