//! What judges the studio's page, from npm: nothing that is built needs it.

use std::path::PathBuf;
use std::process::Command;

use crate::debian;
use crate::process::quietly;
use crate::say::say;
use crate::workspace;

/// Where packages are.
pub(crate) fn folder() -> PathBuf {
    workspace::target().join("npm")
}

/// Fetches a package, `name@version`, unless the file of it is there already.
///
/// # Errors
/// A sentence: why it cannot be had.
pub(crate) fn install(package: &str, file: &str) -> Result<PathBuf, String> {
    let file = folder().join("node_modules").join(file);
    if !file.is_file() {
        debian::install(&[("npm", "npm")])?;
        say(format_args!("installing {package}"));
        let mut npm = Command::new("npm");
        quietly(npm.args(["install", "--no-save", "--no-audit", "--no-fund", "--prefix"]).arg(folder()).arg(package))
            .map_err(|error| format!("{package} cannot be installed: {}", debian::last_line(&error)))?;
    }
    Ok(file)
}
