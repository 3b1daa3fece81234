//! The wheel that is released, and what it asks of the machine that it is installed on, as its tag says it: `manylinux_2_34` for a C library of 2.34 or later
//! (PEP 600). An index of packages takes no wheel that says `linux` alone.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use crate::{process, program, python, workspace};

/// The environment of the tool, which reads the versions of the symbols that program and module want.
const VENV: &str = "auditwheel-venv";
const PACKAGES: &str = "auditwheel==6.8.2\npatchelf==0.19.3.0\n";

/// `cargo xtask wheel`: the wheel as it is released, in `dist/`.
pub(crate) fn command() -> ExitCode {
    let built = program::of_dist().and_then(|program| {
        let python = python::environment(python::VENV, python::REQUIREMENTS)?;
        python::wheel(&python, "dist", Some(&program), None, &workspace::root().join("dist"))
    });
    match built {
        Ok(wheel) => {
            let wheel = tag(&wheel).unwrap_or_else(|reason| {
                eprintln!("it is for machines like this one: {reason}");
                wheel
            });
            println!("{}", wheel.display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("no wheel: {error}");
            ExitCode::FAILURE
        }
    }
}

/// What giving a tag takes of others.
pub(crate) fn fetch() -> Result<(), String> {
    python::environment_of(VENV, PACKAGES).map(|_| ())
}

/// Whether a wheel can be given its tag here.
pub(crate) fn can_tag() -> bool {
    cfg!(target_os = "linux") && python::environment_of(VENV, PACKAGES).is_ok()
}

/// Gives the wheel the tag of what it needs; returns its new path, or why it keeps the old one.
pub(crate) fn tag(wheel: &Path) -> Result<PathBuf, String> {
    if !cfg!(target_os = "linux") {
        return Err("only wheels of Linux have such tags".into());
    }
    let python = python::environment_of(VENV, PACKAGES)?;
    let folder = wheel.parent().ok_or("the wheel is in no folder")?;
    let mut repair = Command::new(&python);
    repair.args(["-m", "auditwheel", "repair", "--wheel-dir"]).arg(folder).arg(wheel);
    process::output(repair.env("PATH", python::with_tools_of(&python)?))?;
    std::fs::remove_file(wheel).map_err(|error| format!("{}: {error}", wheel.display()))?;
    python::wheels_in(folder).pop().ok_or_else(|| format!("auditwheel left no wheel in {}", folder.display()))
}
