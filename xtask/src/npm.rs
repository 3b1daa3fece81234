//! What judges the studio's page and makes its module smaller, from npm: nothing that is built needs it.

use std::path::PathBuf;
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use serde_json::Value;

use crate::debian;
use crate::process::quietly;
use crate::say::say;
use crate::workspace;

/// Fetches a package in this version, unless it is there already, and returns the path of a file of it. Each package has a folder of
/// its own, `target/npm/NAME`: npm removes from a folder what it is not asked for.
///
/// # Errors
/// A sentence: why it cannot be had.
pub(crate) fn install(name: &str, version: &str, file: &str) -> Result<PathBuf, String> {
    // Steps run side by side.
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = workspace::target().join("npm").join(name);
    let package = folder.join("node_modules").join(name);
    let manifest = std::fs::read_to_string(package.join("package.json")).ok();
    let manifest = manifest.and_then(|text| serde_json::from_str::<Value>(&text).ok());
    if manifest.is_none_or(|manifest| manifest["version"] != version) {
        debian::install(&[("npm", "npm")])?;
        let wanted = format!("{name}@{version}");
        say(format_args!("installing {wanted}"));
        let mut npm = Command::new("npm");
        quietly(npm.args(["install", "--no-save", "--no-audit", "--no-fund", "--prefix"]).arg(&folder).arg(&wanted))
            .map_err(|error| format!("{wanted} cannot be installed: {}", debian::last_line(&error)))?;
    }
    Ok(package.join(file))
}
