//! `cargo xtask idle [SECONDS]`: what a simulator takes that waits. One drive of each kind, and six, on a served bus that no client
//! uses; then three joints that a client has interpolate, with SYNC each 2 ms. The processor time of the simulator alone, in per
//! cent of a core, from `/proc/PID/stat`.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use crate::{process, program, workspace};

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

/// What interpolates: joints, whose time base is 2 ms.
const JOINTS: [&str; 3] = ["m4230e17b50@1", "m4230e17b50@2", "m4230e17b50@3"];

/// The points of their path: a turn of the motor forth and back in two seconds, a tenth of a second apart.
const POINTS_A_SECOND: u64 = 10;

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
    let time = Duration::from_secs(seconds);
    // Ticks of /proc: what `getconf` says.
    let ticks = process::output(Command::new("getconf").arg("CLK_TCK"))?;
    let per_s: f64 = ticks.trim().parse().map_err(|_| format!("getconf CLK_TCK says {ticks:?}"))?;
    println!("{seconds} s each, in per cent of a core");
    for (name, drives) in BUSES {
        let (simulator, _) = Simulator::start(&program, drives)?;
        println!("{name:25} {:6.2}", simulator.watch(time)? / per_s);
    }
    let (simulator, bus) = Simulator::start(&program, &JOINTS)?;
    let mut client = interpolate(&program, &bus, seconds)?;
    let used = simulator.watch(time);
    // It ends with its path, a few seconds after the watch: that it still led the joints at the end of the watch shows in how it ends.
    let led = client.wait().map_err(|error| format!("ferrodrive group follow: {error}"))?;
    println!("{:25} {:6.2}", "three joints, 2 ms", used? / per_s);
    if led.success() { Ok(()) } else { Err("ferrodrive group follow has failed: read the lines above".into()) }
}

/// Starts a client that leads the joints along a path for longer than they are watched.
fn interpolate(program: &Path, bus: &str, seconds: u64) -> Result<Child, String> {
    let folder = workspace::target().join("idle");
    let (machine, path) = (folder.join("joints.toml"), folder.join("path.csv"));
    let mut of_machine = String::new();
    let mut of_group = "[[group]]\nname = \"arm\"\nperiod = \"2ms\"\n".to_owned();
    for node in 1..=JOINTS.len() {
        of_machine += &format!("[[drive]]\nmodel = \"m4230e17b50\"\nnode = {node}\n\n");
        of_group += &format!(
            "\n[[group.axis]]\nnode = {node}\nmode = \"ip\"\nvelocity_deg_s = 1000\nacceleration_deg_s2 = 3000\n"
        );
        of_group += "jerk_deg_s3 = 30000\nfollowing_error_deg = 60\n";
    }
    let mut points = "t_s,1.angle_deg,2.angle_deg,3.angle_deg\n".to_owned();
    for point in 0..=(seconds + 4 * SETTLING.as_secs()) * POINTS_A_SECOND {
        let time_s = point as f64 / POINTS_A_SECOND as f64;
        let angle = 180.0 * (1.0 - (std::f64::consts::PI * time_s).cos());
        points += &format!("{time_s},{angle:.3},{angle:.3},{angle:.3}\n");
    }
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for (file, text) in [(&machine, of_machine + &of_group), (&path, points)] {
        std::fs::write(file, text).map_err(|error| format!("{}: {error}", file.display()))?;
    }
    let mut command = Command::new(program);
    command.args(["--bus", bus, "group", "follow", "--relative"]).args([machine, path]);
    let client = command.stdin(Stdio::null()).stdout(Stdio::null()).spawn();
    client.map_err(|error| format!("cannot run ferrodrive: {error}"))
}

/// A simulator that serves its bus, ended when it is dropped.
struct Simulator(Child);

impl Simulator {
    /// Starts it and waits until it is ready; also returns the address of its bus.
    fn start(program: &Path, drives: &[&str]) -> Result<(Self, String), String> {
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
        let bus =
            line.trim().strip_prefix("ready ").ok_or_else(|| format!("ferrodrive sim has not started: {line:?}"))?;
        Ok((simulator, bus.to_owned()))
    }

    /// Lets it settle, then watches it for so long: a hundred times the ticks that it takes a second.
    fn watch(&self, time: Duration) -> Result<f64, String> {
        std::thread::sleep(SETTLING);
        let (began, before) = (Instant::now(), self.ticks()?);
        std::thread::sleep(time);
        Ok(100.0 * (self.ticks()? - before) / began.elapsed().as_secs_f64())
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
