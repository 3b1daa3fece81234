//! What a wheel asks of the machine that it is installed on, as its tag says it: `manylinux_2_34` for a C library of 2.34 or later
//! (PEP 600). An index of packages takes no wheel that says `linux` alone.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{process, python};

/// The environment of the tool, which reads the versions of the symbols that program and module want.
const VENV: &str = "auditwheel-venv";
const PACKAGES: &str = "auditwheel==6.8.2\npatchelf==0.19.3.0\n";

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
