//! `--record` and `plot`: what is written while drives are served, and what is left of it when the simulator dies.

use std::path::Path;

use processes::{Simulator, done, scratch, wait_for};
use recording::{Kind, Recorded, read};

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

#[test]
fn what_is_on_the_disk_of_a_killed_simulator_is_a_record() {
    let place = scratch("killed-record");
    for name in ["run.mcap", "run.csv"] {
        let path = place.join(name);
        let mut simulator = simulator(&path, &["--record-period", "5ms", "--record-signals", "supply,4.position*"]);
        let before = wait_for("half a second of a record", || {
            let found = std::fs::read(&path).ok().and_then(|bytes| read(Kind::of_name(name)?, &bytes).ok());
            let at = found.map(|recorded| last(&recorded));
            at.filter(|at| *at > 0.5).ok_or_else(|| format!("{name}: {at:?}"))
        });
        simulator.kill();
        let left = recorded(&path);
        assert!(last(&left) >= before && left.series.len() == 3, "{name}: {} of {before}", last(&left));
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
