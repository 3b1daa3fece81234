//! `cargo xtask times [ROW..]`: how long a newcomer and a developer wait, each from a fresh clone of what is committed.
//!
//! Processor time stands beside that of the clock, which other programs on the machine lengthen. What is measured is a whole
//! command with all that it starts; the registry's packages are there already.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

use crate::{process, python, workspace};

/// A row: its name, whether it begins with an empty target folder, and what is run.
struct TimedCommand {
    name: &'static str,
    what: &'static str,
    anew: bool,
    command: fn(&Path) -> Result<Command, String>,
}

const ROWS: &[TimedCommand] = &[
    TimedCommand { name: "demo", what: "`cargo demo`", anew: true, command: |clone| Ok(cargo(clone, &["demo"])) },
    TimedCommand {
        name: "quick",
        what: "`cargo xtask test`, the quick list",
        anew: true,
        command: |clone| Ok(cargo(clone, &["xtask", "test"])),
    },
    TimedCommand {
        name: "change",
        what: "after a change in a drive: `cargo xtask test --quick-since HEAD`",
        anew: false,
        command: changed,
    },
    TimedCommand {
        name: "all",
        what: "`cargo xtask test --all`",
        anew: true,
        command: |clone| Ok(cargo(clone, &["xtask", "test", "--all"])),
    },
    TimedCommand { name: "pip", what: "`pip install .` in the clone", anew: true, command: pip },
];

/// The file in which a developer changes something.
const DRIVE: &str = "crates/drives/src/zlac8030l/mod.rs";

pub(crate) fn command(words: &[&str]) -> ExitCode {
    if let Some(word) = words.iter().find(|word| !ROWS.iter().any(|row| row.name == **word)) {
        let names: Vec<&str> = ROWS.iter().map(|row| row.name).collect();
        eprintln!("no row is called {word}: {} are the ones there are", names.join(", "));
        return ExitCode::from(2);
    }
    match measure(|row| words.is_empty() || words.contains(&row.name)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn measure(wanted: impl Fn(&TimedCommand) -> bool) -> Result<(), String> {
    let place = workspace::target().join("times");
    let _ = fs::remove_dir_all(&place);
    fs::create_dir_all(&place).map_err(|error| format!("{}: {error}", place.display()))?;
    let clone = place.join("clone");
    process::quietly(Command::new("git").args(["clone", "--quiet"]).arg(workspace::root()).arg(&clone))?;
    process::quietly(&mut cargo(&clone, &["fetch", "--locked"]))?;
    let per_s = process::output(Command::new("getconf").arg("CLK_TCK"))?;
    let per_s: f64 = per_s.trim().parse().map_err(|_| format!("getconf CLK_TCK says {per_s:?}"))?;
    println!("| | wall, s | processor, s | target folder, GB |\n|---|---|---|---|");
    for row in ROWS.iter().filter(|row| wanted(row)) {
        if row.anew {
            let _ = fs::remove_dir_all(clone.join("target"));
        }
        let log = fs::File::create(place.join(format!("{}.log", row.name))).map_err(|error| error.to_string())?;
        let mut command = (row.command)(&clone)?;
        command.env_remove("CARGO_TARGET_DIR").env_remove("CARGO_MANIFEST_DIR").stdin(Stdio::null());
        command.stdout(log.try_clone().map_err(|error| error.to_string())?).stderr(log);
        let (start, before) = (Instant::now(), ticks_of_children()?);
        let ended_well = command.status().map_err(|error| error.to_string())?.success();
        let (took, used) = (start.elapsed().as_secs_f64(), (ticks_of_children()? - before) / per_s);
        let size = size_of(&clone.join("target")) as f64 / 1e9;
        let verdict = if ended_well { String::new() } else { format!(", FAILED: {}.log", row.name) };
        println!("| {}{verdict} | {took:.0} | {used:.0} | {size:.1} |", row.what);
    }
    println!("\nlogs: {}", place.display());
    Ok(())
}

/// cargo as a person would start it: not as the one that runs us has set it up.
fn cargo(clone: &Path, words: &[&str]) -> Command {
    let mut cargo = Command::new("cargo");
    cargo.current_dir(clone).args(words);
    cargo
}

fn changed(clone: &Path) -> Result<Command, String> {
    let path = clone.join(DRIVE);
    let text = fs::read_to_string(&path).map_err(|error| format!("{DRIVE}: {error}"))?;
    fs::write(&path, text + "\n// A change.\n").map_err(|error| format!("{DRIVE}: {error}"))?;
    Ok(cargo(clone, &["xtask", "test", "--quick-since", "HEAD"]))
}

fn pip(clone: &Path) -> Result<Command, String> {
    let venv = clone.with_file_name("venv");
    process::quietly(Command::new("python3").args(["-m", "venv"]).arg(&venv))?;
    let mut pip = python::pip(&venv.join("bin/python"));
    pip.current_dir(clone).args(["install", "."]);
    Ok(pip)
}

/// Processor time of all that this program has started and that has ended, in ticks (proc(5), fields 16 and 17).
pub(crate) fn ticks_of_children() -> Result<f64, String> {
    let stat = fs::read_to_string("/proc/self/stat").map_err(|error| format!("/proc/self/stat: {error}"))?;
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let number = |place: usize| fields.get(place).and_then(|field| field.parse::<f64>().ok());
    // The first field after the name is the third.
    number(13).zip(number(14)).map(|(user, system)| user + system).ok_or_else(|| "/proc/self/stat is odd".to_owned())
}

/// The size of all files below a folder, in bytes; what has two names counts once.
fn size_of(folder: &Path) -> u64 {
    let mut seen = std::collections::BTreeSet::new();
    let mut folders: Vec<PathBuf> = vec![folder.to_path_buf()];
    let mut size = 0;
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let Ok(metadata) = fs::symlink_metadata(entry.path()) else { continue };
            if metadata.is_dir() {
                folders.push(entry.path());
            } else if seen.insert(identity(&metadata)) {
                size += metadata.len();
            }
        }
    }
    size
}

#[cfg(unix)]
fn identity(metadata: &fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(metadata)
}

#[cfg(not(unix))]
fn identity(_: &fs::Metadata) -> u64 {
    use std::sync::atomic::{AtomicU64, Ordering};
    static NEXT: AtomicU64 = AtomicU64::new(0);
    NEXT.fetch_add(1, Ordering::Relaxed)
}
