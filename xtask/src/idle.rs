//! `cargo xtask idle [SECONDS]`: the cost of an idle simulator. One drive of each kind, and six, on a served bus that no client
//! uses; the processor time that each takes, in per cent of a core, from `/proc/PID/stat`.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use crate::{process, program};

/// Default time for which each is watched.
const SECONDS: u64 = 60;

/// What a drive does at its start, and its thermometers' first way, is not counted.
const SETTLING: Duration = Duration::from_secs(5);

/// What is measured: a name, and the drives.
const BUSES: [(&str, &[&str]); 5] = [
    ("a ZLAC8030L", &["zlac8030l@1"]),
    ("an M joint", &["m4230e17b50@1"]),
    ("a ZLIM42-C", &["zlim42c@1"]),
    ("a cia402", &["cia402@1"]),
    ("six", &["zlac8030l@1", "zlac8030l@2", "m4230e17b50@3", "m4230e17b50@4", "zlim42c@5", "zlim42c@6"]),
];

/// Runs `cargo xtask idle`.
pub(crate) fn command(arguments: &[&str]) -> ExitCode {
    let seconds = match arguments {
        [] => Ok(SECONDS),
        [seconds] => seconds
            .parse()
            .ok()
            .filter(|seconds| *seconds > 0)
            .ok_or(format!("expected whole seconds above 0, got {seconds:?}")),
        _ => Err("expected: cargo xtask idle [SECONDS]".to_owned()),
    };
    match seconds.and_then(measure) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn measure(seconds: u64) -> Result<(), String> {
    if !cfg!(target_os = "linux") {
        return Err("processor time is read from /proc, which Linux has".into());
    }
    let program = program::of_dist()?;
    // Ticks of /proc: what `getconf` says.
    let ticks = process::output(Command::new("getconf").arg("CLK_TCK"))?;
    let per_s: f64 = ticks.trim().parse().map_err(|_| format!("getconf CLK_TCK says {ticks:?}"))?;
    println!("{seconds} s each, in per cent of a core");
    for (name, drives) in BUSES {
        let simulator = Simulator::start(&program, drives)?;
        std::thread::sleep(SETTLING);
        let (began, before) = (Instant::now(), simulator.ticks()?);
        std::thread::sleep(Duration::from_secs(seconds));
        let used_s = (simulator.ticks()? - before) / per_s;
        println!("{name:12} {:6.2}", 100.0 * used_s / began.elapsed().as_secs_f64());
    }
    Ok(())
}

/// A simulator that serves its bus, ended when it is dropped.
struct Simulator(Child);

impl Simulator {
    /// Starts it and waits until it is ready.
    fn start(program: &Path, drives: &[&str]) -> Result<Self, String> {
        let mut command = Command::new(program);
        command.args(["sim", "--serve", "socketcand://127.0.0.1:0"]);
        drives.iter().for_each(|drive| _ = command.args(["--drive", drive]));
        // Its standard input stays open: after its end it could not be quit.
        let started = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let mut child = started.map_err(|error| format!("cannot run ferrodrive: {error}"))?;
        let output = child.stdout.take().ok_or("no standard output")?;
        let simulator = Self(child);
        let mut line = String::new();
        BufReader::new(output).read_line(&mut line).map_err(|error| format!("ferrodrive sim: {error}"))?;
        if line.is_empty() { Err("ferrodrive sim has not started".into()) } else { Ok(simulator) }
    }

    /// Processor time so far, of user and kernel, in ticks.
    fn ticks(&self) -> Result<f64, String> {
        let path = format!("/proc/{}/stat", self.0.id());
        let stat = std::fs::read_to_string(&path).map_err(|error| format!("{path}: {error}"))?;
        processor_ticks(&stat).ok_or_else(|| format!("{path}: {stat:?} has no times"))
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The fields utime and stime of proc(5), 14 and 15. The second field is a name in brackets that may have anything in it.
fn processor_ticks(stat: &str) -> Option<f64> {
    let (_, rest) = stat.rsplit_once(')')?;
    let fields: Vec<f64> = rest.split_whitespace().skip(11).take(2).filter_map(|field| field.parse().ok()).collect();
    (fields.len() == 2).then(|| fields.iter().sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processor_time_is_found_behind_whatever_name() {
        let stat = "42 (a ) name) S 1 42 42 0 -1 4194304 100 0 0 0 350 25 0 0 20 0 3 0 1000 0 0";
        assert_eq!(processor_ticks(stat), Some(375.0));
        assert_eq!(processor_ticks("42 (short) S 1"), None);
    }
}
