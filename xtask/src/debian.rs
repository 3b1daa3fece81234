//! Programs of others that steps use where they can be had: Debian packages, installed if this user may.

use std::path::PathBuf;
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use crate::process::{self, quietly};
use crate::say::say;

/// Installs those of these programs that are missing: each with the package that it is in, or several.
///
/// # Errors
/// A sentence: which are missing, and why they cannot be installed.
pub(crate) fn install(programs: &[(&str, &str)]) -> Result<(), String> {
    // A second step finds what the first has installed.
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let missing: Vec<&str> =
        programs.iter().filter(|(program, _)| !there(program)).flat_map(|(_, packages)| packages.split(' ')).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let names = missing.join(" ");
    let install = || {
        let mut apt = apt();
        quietly(apt.args(["install", "--no-install-recommends"]).args(&missing))
    };
    if !process::works("apt-get", &["--version"]) {
        return Err(format!("not installed, and no apt-get: {names}"));
    }
    say(format_args!("installing {names}"));
    let installed = install().or_else(|_| quietly(apt().arg("update")).and_then(|()| install()));
    installed.map_err(|error| format!("cannot be installed ({names}): {}", last_line(&error)))
}

fn there(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let more = ["/usr/sbin", "/sbin"].map(PathBuf::from);
    std::env::split_paths(&path).chain(more).any(|folder| folder.join(program).is_file())
}

/// `apt-get` that asks nothing.
pub(crate) fn apt() -> Command {
    let mut apt = Command::new("apt-get");
    // Downloads are made by this user, who owns the folder that they go to.
    apt.args(["-q", "-y", "-o", "APT::Sandbox::User=root", "-o", "DPkg::Lock::Timeout=60"]);
    apt.env("DEBIAN_FRONTEND", "noninteractive");
    apt
}

/// What matters of what `apt-get` says.
pub(crate) fn last_line(text: &str) -> &str {
    text.lines().last().unwrap_or_default()
}
