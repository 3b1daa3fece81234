//! The `ferrodrive` binary, as the steps that run it want it.

use std::path::PathBuf;
use std::process::Command;

use crate::tally::Tally;
use crate::{process, workspace};

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
    let mut cargo = workspace::cargo();
    cargo.args(["build", "--workspace", "--bins", "--quiet"]);
    if !process::run(&mut cargo, |_| ())? {
        return Err("ferrodrive does not build".to_owned());
    }
    Ok(workspace::target().join("debug").join(format!("ferrodrive{}", std::env::consts::EXE_SUFFIX)))
}

/// `ferrodrive demo`, which compares every procedure of the manuals with what the drives do.
pub(crate) fn demo() -> Tally {
    let program = match build("demo") {
        Ok(program) => program,
        Err(tally) => return tally,
    };
    let folder = workspace::target().join("demo");
    if let Err(error) = std::fs::create_dir_all(&folder) {
        return Tally::failed(format!("{}: {error}", folder.display()));
    }
    let mut lines = 0;
    let ended_well = process::run(Command::new(program).arg("demo").current_dir(folder), |line| {
        lines += 1;
        println!("   {line}");
    });
    match ended_well {
        Ok(_) if lines == 0 => Tally::failed("the demo showed nothing"),
        Ok(ended_well) => Tally::of_check(ended_well, "a drive differs from its manual"),
        Err(error) => Tally::failed(error),
    }
}
