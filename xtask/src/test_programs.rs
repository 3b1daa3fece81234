//! The programs that `cargo test` builds, run side by side.
//!
//! cargo runs one after the other, so that a test that waits lets every core wait. Here some programs run at a time. What each
//! prints is kept until it ends.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::time::Instant;

use serde_json::Value;

use crate::libtest::{self, Timed};
use crate::say;
use crate::table::seconds;
use crate::tally::Tally;
use crate::{process, program, workspace};

/// The tests that need processes and the clock, as `cargo test` selects them: beside packages whose features are those of the
/// default members, so that what is built is shared.
pub(crate) const REAL_TIME: &[&str] =
    &["-p", "ferrodrive", "-p", "ferrodrive-tests", "-p", "ferrodrive-processes", "--test", "real_time"];

/// The tests with large libraries of others.
pub(crate) const SCHEMA_AND_BROWSER: &[&str] = &["-p", "ferrodrive-browser-and-schema"];

/// A program with tests in it.
#[derive(Debug)]
pub(crate) struct Program {
    pub(crate) path: PathBuf,
    /// The folder of its package, in which its tests begin.
    folder: PathBuf,
}

impl Program {
    /// It, as cargo runs it.
    pub(crate) fn command(&self) -> Command {
        let mut command = Command::new(&self.path);
        command.current_dir(&self.folder).env("CARGO_MANIFEST_DIR", &self.folder);
        command
    }
}

/// How they are run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct How<'a> {
    /// Programs at a time.
    pub(crate) programs: usize,
    /// Tests of one program at a time. More than there are cores, where tests wait.
    pub(crate) threads: usize,
    /// Further arguments, such as a filter.
    pub(crate) arguments: &'a [&'a str],
}

/// Builds tests, as `cargo test` with these words selects them.
///
/// # Errors
/// A sentence; what the compiler says goes to standard error.
pub(crate) fn build(words: &[&str]) -> Result<Vec<Program>, String> {
    build_with(workspace::cargo(), words)
}

/// The same with a cargo that was given the folder.
///
/// # Errors
/// A sentence; what the compiler says goes to standard error.
pub(crate) fn build_with(mut cargo: Command, words: &[&str]) -> Result<Vec<Program>, String> {
    cargo.args(["test", "--quiet", "--no-run", "--message-format=json-render-diagnostics"]).args(words);
    let mut programs = Vec::new();
    let built = process::run(&mut cargo, |line| programs.extend(serde_json::from_str(line).ok().and_then(program_of)))?;
    if !built {
        return Err("the tests do not build: read the lines above".to_owned());
    }
    // The largest have most tests, and are begun first.
    let size = |program: &Program| std::fs::metadata(&program.path).map_or(0, |file| file.len());
    programs.sort_by_key(|program| std::cmp::Reverse(size(program)));
    Ok(programs)
}

fn program_of(message: Value) -> Option<Program> {
    let folder = Path::new(message["manifest_path"].as_str()?).parent()?.to_path_buf();
    let path = message["executable"].as_str().map(PathBuf::from)?;
    (message["profile"]["test"] == true).then_some(Program { path, folder })
}

/// Tests that start the program.
pub(crate) fn of_processes(words: &[&str], how: How<'_>) -> Tally {
    match program::built() {
        Ok(_) => build_and_run(words, how),
        Err(error) => Tally::failed(error),
    }
}

/// Builds tests and runs them; shows how long each of the two took.
pub(crate) fn build_and_run(words: &[&str], how: How<'_>) -> Tally {
    let start = Instant::now();
    let programs = match build(words) {
        Ok(programs) => programs,
        Err(error) => return Tally::failed(error),
    };
    let built = start.elapsed();
    let tally = run(programs, how);
    say::say(format_args!("built in {}, ran in {}", seconds(built), seconds(start.elapsed() - built)));
    tally
}

/// Runs them all, whatever fails; shows what failed, and the slowest tests if that is asked for.
pub(crate) fn run(programs: Vec<Program>, how: How<'_>) -> Tally {
    if programs.is_empty() {
        return Tally::failed("cargo built no tests");
    }
    let queue = Mutex::new(programs.into_iter());
    let found = Mutex::new((Tally::default(), Vec::new()));
    let step = say::step();
    std::thread::scope(|scope| {
        for _ in 0..how.programs {
            scope.spawn(|| {
                say::work_for(step);
                loop {
                    // The lock is held while one is taken, not while it runs.
                    let next = queue.lock().ok().and_then(|mut queue| queue.next());
                    let Some(program) = next else { break };
                    let (tally, timed) = run_one(&program, how);
                    if let Ok(mut found) = found.lock() {
                        found.0.add(&tally);
                        found.1.extend(timed);
                    }
                }
            });
        }
    });
    let (tally, timed) = found.into_inner().unwrap_or_default();
    libtest::show_slowest(timed);
    // A filter that names nothing any more must not pass for a step that has been done.
    if tally == Tally::default() { Tally::failed("no test ran") } else { tally }
}

fn run_one(program: &Program, how: How<'_>) -> (Tally, Vec<Timed>) {
    let name = program.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut command = program.command();
    command.arg(format!("--test-threads={}", how.threads)).args(how.arguments);
    let mut read = libtest::Reader::default();
    libtest::tell_times(&mut command);
    let ended = process::run(&mut command, |line| read.line(line));
    read.end(&name, ended)
}
