//! Runs every example of the workspace: an example that is never run is wrong before long.
//!
//! An example either runs to its end, or serves until it is stopped and reports it with a line that begins with `ready`.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use crate::say::say;
use crate::tally::Tally;
use crate::{process, workspace};

/// An example is for a person to watch. One that takes longer does not end.
const TIME_LIMIT: Duration = Duration::from_secs(600);

/// How an example ended.
#[derive(Debug, PartialEq, Eq)]
enum Ending {
    Success,
    /// It serves, so it was stopped.
    Ready,
    Failure,
    TooLate,
}

/// Builds the examples, and names them.
///
/// # Errors
/// A sentence; what the compiler says goes to standard error.
pub(crate) fn build() -> Result<Vec<String>, String> {
    let packages = workspace::packages()?.into_iter().filter(|package| !package.examples.is_empty());
    let packages: Vec<_> = packages.collect();
    let mut cargo = workspace::cargo();
    cargo.args(["build", "--examples", "--quiet"]).args(workspace::AS_TESTS_ARE_BUILT);
    cargo.args(packages.iter().flat_map(|package| ["--package", &package.name]));
    if !process::run(&mut cargo, |_| ())? {
        return Err("the examples do not build".to_owned());
    }
    Ok(packages.into_iter().flat_map(|package| package.examples).collect())
}

/// Runs each example without arguments. They all run on an embedded virtual bus when given none.
pub(crate) fn run() -> Tally {
    let names = match build() {
        Ok(names) if names.is_empty() => return Tally::skipped("the workspace has no examples"),
        Ok(names) => names,
        Err(error) => return Tally::failed(error),
    };
    let folder = workspace::target().join("debug").join("examples");
    let mut tally = Tally::default();
    for name in names {
        say(&name);
        tally.add(&run_one(&name, &folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX))));
    }
    tally
}

fn run_one(name: &str, program: &Path) -> Tally {
    let mut command = Command::new(program);
    command.current_dir(workspace::root());
    let (ending, output) = match watch(command, TIME_LIMIT) {
        Ok(ended) => ended,
        Err(error) => return Tally::failed(format!("example {name}: {error}")),
    };
    if matches!(ending, Ending::Success | Ending::Ready) {
        return Tally::passed();
    }
    output.iter().for_each(say);
    let what = if ending == Ending::TooLate { "did not end and did not say ready" } else { "ended badly" };
    Tally::failed(format!("example {name} {what}"))
}

/// Runs `command` until it ends, says `ready`, or `limit` has passed; returns what it printed.
fn watch(mut command: Command, limit: Duration) -> Result<(Ending, Vec<String>), String> {
    let spawned = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn();
    let mut child = spawned.map_err(|error| error.to_string())?;
    let lines = lines_of(&mut child);
    let deadline = Instant::now() + limit;
    let mut output = Vec::new();
    loop {
        match lines.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            Ok(line) if line.starts_with("ready") => return stop(child).map(|()| (Ending::Ready, output)),
            Ok(line) => output.push(line),
            Err(RecvTimeoutError::Timeout) => return stop(child).map(|()| (Ending::TooLate, output)),
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    let status = child.wait().map_err(|error| error.to_string())?;
    Ok((if status.success() { Ending::Success } else { Ending::Failure }, output))
}

fn lines_of(child: &mut Child) -> Receiver<String> {
    let (sender, receiver) = channel();
    if let Some(output) = child.stdout.take() {
        std::thread::spawn(move || {
            BufReader::new(output).lines().map_while(Result::ok).try_for_each(|line| sender.send(line))
        });
    }
    receiver
}

/// Ends the process that we started, and waits for it to be gone.
fn stop(mut child: Child) -> Result<(), String> {
    child.kill().and_then(|()| child.wait()).map(|_| ()).map_err(|error| error.to_string())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// A watchdog against hangs.
    const PATIENCE: Duration = Duration::from_secs(600);

    fn shell(script: &str, limit: Duration) -> (Ending, Vec<String>) {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        watch(command, limit).unwrap()
    }

    #[test]
    fn an_example_that_ends_is_judged_by_its_status() {
        assert_eq!(shell("echo hello", PATIENCE), (Ending::Success, vec!["hello".to_owned()]));
        assert_eq!(shell("exit 3", PATIENCE).0, Ending::Failure);
    }

    #[test]
    fn a_server_is_stopped_once_it_is_ready_and_anything_else_that_stays_is_too_late() {
        assert_eq!(shell("echo ready here; exec sleep 3600", PATIENCE).0, Ending::Ready);
        assert_eq!(shell("exec sleep 3600", Duration::from_millis(300)).0, Ending::TooLate);
    }
}
