//! The step that packs each crate as `cargo publish` would: what a package is, without what only this folder has.

use crate::say::say;
use crate::tally::Tally;
use crate::workspace;

/// Packs every crate without building it. A real verification builds them all once more:
/// `cargo package --workspace --exclude xtask --exclude ferrodrive-tests --exclude ferrodrive-examples`.
pub(crate) fn run() -> Tally {
    let packages = match workspace::packages() {
        Ok(packages) => packages,
        Err(error) => return Tally::failed(error),
    };
    let mut cargo = workspace::cargo();
    cargo.args(["package", "--workspace", "--no-verify", "--allow-dirty", "--offline", "--quiet"]);
    for package in packages.iter().filter(|package| !package.folder.starts_with("crates/")) {
        cargo.args(["--exclude", &package.name]);
    }
    let output = match cargo.output() {
        Ok(output) => output,
        Err(error) => return Tally::failed(format!("cannot run cargo: {error}")),
    };
    // A warning here is a manifest that says too little, or a file that will be missing.
    let said = String::from_utf8_lossy(&output.stderr);
    said.lines().for_each(say);
    Tally::of_check(output.status.success() && !said.contains("warning"), "a crate does not pack: read the lines above")
}
