//! The `ferrodrive` binary, as the steps that run it want it.

use std::path::PathBuf;
use std::process::Command;

use crate::say::say;
use crate::tally::Tally;
use crate::{builder, process, workspace};

/// The binary of the tests, which is built if need be; or what to report when it does not build or does not know `command`.
pub(crate) fn build(command: &str) -> Result<PathBuf, Tally> {
    let program = built().map_err(Tally::failed)?;
    if !process::works(&program.to_string_lossy(), &[command, "--help"]) {
        return Err(Tally::failed(format!("this ferrodrive has no command `{command}`")));
    }
    Ok(program)
}

/// Builds the binary as the test step built it, in the same profile with the same features, and returns its path.
pub(crate) fn built() -> Result<PathBuf, String> {
    build_bin("ferrodrive")
}

/// Builds the binary in the profile of what is released.
pub(crate) fn of_dist() -> Result<PathBuf, String> {
    say("building the binary (dist)");
    let words = ["build", "--quiet", "--profile", "dist", "--package", "ferrodrive", "--bin", "ferrodrive"];
    let mut cargo = workspace::cargo();
    builder::leave_out(&mut cargo);
    process::output(cargo.args(words))?;
    Ok(workspace::target().join("dist").join(format!("ferrodrive{}", std::env::consts::EXE_SUFFIX)))
}

fn build_bin(name: &str) -> Result<PathBuf, String> {
    if !process::run(workspace::cargo().args(["build", "--quiet", "--bin", name]), |line| say(line))? {
        return Err(format!("{name} does not build"));
    }
    Ok(workspace::target().join("debug").join(format!("{name}{}", std::env::consts::EXE_SUFFIX)))
}

/// The demo, which compares every procedure of the manuals with what the drives do.
pub(crate) fn demo() -> Tally {
    let program = match build_bin("demo") {
        Ok(program) => program,
        Err(error) => return Tally::failed(error),
    };
    let folder = workspace::target().join("demo");
    if let Err(error) = std::fs::create_dir_all(&folder) {
        return Tally::failed(format!("{}: {error}", folder.display()));
    }
    let mut last = String::new();
    let ended_well = process::run(Command::new(program).current_dir(folder), |line| {
        if line.contains("DIFFERS") {
            say(line);
        }
        last = line.to_owned();
    });
    match ended_well {
        Ok(_) if last.is_empty() => Tally::failed("the demo showed nothing"),
        Ok(ended_well) => {
            say(&last);
            Tally::of_check(ended_well, "a drive differs from its manual")
        }
        Err(error) => Tally::failed(error),
    }
}
