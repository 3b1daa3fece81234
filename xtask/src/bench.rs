//! `cargo xtask bench [--compare COMMIT] [ROW..]`: what frames, control periods and cycles of a master cost, in one call.
//!
//! Instructions first, by callgrind, as the difference of two lengths: the same number on any machine, whatever else it does.
//! Then, against a commit, processor time of whole worlds: both builds run in turn, and the ratio of each pair is taken, since a
//! busy machine slows both of a pair. The digest of each world is compared as well: what is faster has to do the same.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use crate::times::ticks_of_children;
use crate::{process, workspace};

/// What counts: an example of the benches, what it is asked for, and two lengths whose difference is so many of the unit.
struct BenchRow {
    name: String,
    example: &'static str,
    arguments: Vec<String>,
    lengths: [u32; 2],
    /// Units in the difference of the lengths.
    units: f64,
    /// It ends with a line that holds the digest of what it did.
    is_world: bool,
}

const EXAMPLES: [&str; 3] = ["count_instructions", "run_world", "count_cycle"];

/// The frames of the workload that `count_instructions` knows by number.
const FRAMES: [&str; 6] = [
    "SDO expedited upload, server",
    "SDO expedited download, server",
    "RPDO with 3 objects into the dictionary",
    "RPDO with 1 object",
    "TPDO with 3 objects on SYNC",
    "a frame not for this node",
];

/// Control periods of 50 us in a millisecond.
const PERIODS_A_MS: f64 = 20.0;
/// Pairs of runs whose processor times are compared.
const PAIRS: usize = 5;
/// Virtual milliseconds of such a run, by all its drives: about a second of a turning one.
const TIMED_MS: u32 = 700_000;
/// Worlds of more drives than this are timed and not counted: callgrind is some 50 times slower.
const COUNTED_DRIVES: u32 = 16;

/// Two builds of the same examples.
struct Builds {
    now: PathBuf,
    before: Option<(String, PathBuf)>,
}

pub(crate) fn command(words: &[&str]) -> ExitCode {
    let (commit, rows) = match words {
        ["--compare", commit, rows @ ..] => (Some(*commit), rows),
        ["--compare"] => {
            eprintln!("--compare needs a commit, e.g. cargo xtask bench --compare HEAD~1");
            return ExitCode::from(2);
        }
        rows => (None, rows),
    };
    match measure(commit, rows) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// False if a world does something else than before.
fn measure(commit: Option<&str>, wanted: &[&str]) -> Result<bool, String> {
    process::output(Command::new("valgrind").arg("--version"))
        .map_err(|error| format!("{error}\ncallgrind counts the instructions: install valgrind"))?;
    let builds = Builds::make(commit)?;
    let rows: Vec<BenchRow> = frames().chain(worlds(&builds.now)?).chain([cycle()]).collect();
    let rows: Vec<&BenchRow> =
        rows.iter().filter(|row| wanted.is_empty() || wanted.iter().any(|word| row.name.contains(word))).collect();
    if rows.is_empty() {
        return Err(format!("no row has {} in its name", wanted.join(" or ")));
    }
    count(&builds, &rows)?;
    match &builds.before {
        None => Ok(true),
        Some((commit, before)) => time(commit, &builds.now, before, &rows),
    }
}

fn count(builds: &Builds, rows: &[&BenchRow]) -> Result<(), String> {
    let before = builds.before.as_ref().map(|(commit, _)| commit.as_str());
    println!("Instructions (a frame, a control period of 50 us, a cycle of six drives):\n");
    match before {
        None => println!("| | now |\n|---|---|"),
        Some(commit) => println!("| | {commit} | now | |\n|---|---|---|---|"),
    }
    for row in rows.iter().filter(|row| row.drives() <= COUNTED_DRIVES) {
        let now = row.instructions(&builds.now)?;
        // A row that the commit does not know has no figure there.
        let before = builds.before.as_ref().map(|(_, folder)| row.instructions(folder).ok());
        let cells = match before {
            None => format!("{now:.1}"),
            Some(None) => format!("- | {now:.1} | new"),
            Some(Some(before)) => format!("{before:.1} | {now:.1} | {:+.1} %", (now / before - 1.0) * 100.0),
        };
        println!("| {} | {cells} |", row.name);
    }
    Ok(())
}

fn time(commit: &str, now: &Path, before: &Path, rows: &[&BenchRow]) -> Result<bool, String> {
    println!("\nProcessor time now / {commit}, {PAIRS} pairs of runs in turn:\n");
    println!("| | median | least | most | digest |\n|---|---|---|---|---|");
    let mut same = true;
    for row in rows.iter().filter(|row| row.is_world) {
        let mut ratios = Vec::new();
        let mut digest = "the same";
        for _ in 0..PAIRS {
            let length = TIMED_MS / row.drives().max(1);
            let (Ok(old), new) = (row.run(before, length), row.run(now, length)?) else { break };
            if old.said != new.said {
                (digest, same) = ("DIFFERS", false);
            }
            ratios.push(new.ticks / old.ticks.max(1.0));
        }
        ratios.sort_by(f64::total_cmp);
        match ratios.as_slice() {
            [] => println!("| {} | new | | | |", row.name),
            [least, .., most] => {
                println!("| {} | {:.3} | {least:.3} | {most:.3} | {digest} |", row.name, ratios[ratios.len() / 2]);
            }
            [one] => println!("| {} | {one:.3} | | | {digest} |", row.name),
        }
    }
    Ok(same)
}

impl Builds {
    fn make(commit: Option<&str>) -> Result<Self, String> {
        let now = build(&workspace::root(), &workspace::target())?;
        let Some(commit) = commit else { return Ok(Self { now, before: None }) };
        let place = workspace::target().join("bench");
        let clone = place.join("clone");
        let _ = std::fs::remove_dir_all(&clone);
        let git = |words: &[&str], folder: &Path| process::quietly(Command::new("git").args(words).current_dir(folder));
        process::quietly(
            Command::new("git").args(["clone", "--quiet", "--no-checkout"]).arg(workspace::root()).arg(&clone),
        )?;
        let revision = process::output(Command::new("git").args(["rev-parse", commit]).current_dir(workspace::root()))?;
        git(&["checkout", "--quiet", "--detach", revision.trim()], &clone)?;
        let before = build(&clone, &place.join("target"))?;
        Ok(Self { now, before: Some((commit.to_owned(), before)) })
    }
}

/// The examples of a tree in the profile of what is released; the folder that they are in.
fn build(tree: &Path, target: &Path) -> Result<PathBuf, String> {
    println!("building the benches of {}", tree.display());
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(tree).env_remove("CARGO_MANIFEST_DIR").env("CARGO_TARGET_DIR", target);
    cargo.args(["build", "--quiet", "--locked", "--profile", "dist", "-p", "ferrodrive-benches"]);
    EXAMPLES.iter().for_each(|example| _ = cargo.args(["--example", example]));
    process::quietly(&mut cargo)?;
    Ok(target.join("dist").join("examples"))
}

/// What a run took, and the last line that it said.
struct RunCost {
    ticks: f64,
    said: String,
}

impl BenchRow {
    /// How many drives its world has.
    fn drives(&self) -> u32 {
        self.name.split(' ').next().and_then(|word| word.parse().ok()).unwrap_or(3)
    }

    fn program(&self, folder: &Path, length: u32) -> Vec<String> {
        let path = folder.join(format!("{}{}", self.example, std::env::consts::EXE_SUFFIX));
        let program = [path.display().to_string()];
        program.into_iter().chain(self.arguments.clone()).chain([length.to_string()]).collect()
    }

    fn run(&self, folder: &Path, length: u32) -> Result<RunCost, String> {
        let words = self.program(folder, length);
        let before = ticks_of_children()?;
        let said = process::output(Command::new(&words[0]).args(&words[1..]))?;
        Ok(RunCost { ticks: ticks_of_children()? - before, said: said.lines().last().unwrap_or_default().to_owned() })
    }

    /// Instructions of one unit.
    fn instructions(&self, folder: &Path) -> Result<f64, String> {
        let [short, long] = self.lengths.map(|length| self.counted(folder, length));
        Ok((long? - short?) / self.units)
    }

    fn counted(&self, folder: &Path, length: u32) -> Result<f64, String> {
        let mut callgrind = Command::new("valgrind");
        callgrind.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).args(self.program(folder, length));
        let output = callgrind.output().map_err(|error| format!("cannot run valgrind: {error}"))?;
        let said = String::from_utf8_lossy(&output.stderr);
        collected(&said).filter(|_| output.status.success()).ok_or_else(|| format!("{}: {}", self.name, said.trim()))
    }
}

/// The number behind `Collected :`, which callgrind says at the end.
fn collected(said: &str) -> Option<f64> {
    said.rsplit("Collected :").next().filter(|rest| rest.len() < said.len())?.split_whitespace().next()?.parse().ok()
}

fn frames() -> impl Iterator<Item = BenchRow> {
    let row = |name: String, subject: &str, number: usize| BenchRow {
        name,
        example: "count_instructions",
        arguments: vec![subject.to_owned(), number.to_string()],
        lengths: [10_000, 20_000],
        units: 10_000.0,
        is_world: false,
    };
    let of = move |subject: &'static str| {
        FRAMES.iter().enumerate().map(move |(number, frame)| row(format!("{subject}: {frame}"), subject, number))
    };
    of("node").chain(of("firmware")).chain([row("node: idle call".to_owned(), "idle", 0)])
}

/// The worlds that the example lists: their number and name.
fn worlds(folder: &Path) -> Result<Vec<BenchRow>, String> {
    let example = folder.join(format!("run_world{}", std::env::consts::EXE_SUFFIX));
    let list = process::output(&mut Command::new(example))?;
    let row = |(number, name): (&str, &str)| BenchRow {
        name: name.to_owned(),
        example: "run_world",
        arguments: vec![number.to_owned()],
        lengths: [500, 1500],
        units: 1000.0 * PERIODS_A_MS,
        is_world: true,
    };
    Ok(list.lines().filter_map(|line| line.split_once(' ')).map(row).collect())
}

fn cycle() -> BenchRow {
    BenchRow {
        name: "a cycle of six drives in the master".to_owned(),
        example: "count_cycle",
        arguments: Vec::new(),
        lengths: [1000, 2000],
        units: 1000.0,
        is_world: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_count_of_callgrind_is_read_and_nothing_else() {
        let said = "==7== Events    : Ir\n==7== Collected : 456347151\n==7==\n==7== I   refs:      456,347,151\n";
        assert_eq!(collected(said), Some(456_347_151.0));
        assert_eq!(collected("==7== I refs: 5"), None);
    }

    #[test]
    fn a_world_has_as_many_drives_as_its_name_says() {
        let named = |name: &str| BenchRow { name: name.to_owned(), ..cycle() }.drives();
        assert_eq!([named("127 hub servos turning, silent bus"), named("one of each turning, silent bus")], [127, 3]);
    }
}
