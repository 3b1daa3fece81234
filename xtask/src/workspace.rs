//! The workspace as Cargo sees it: where it is, which packages it has, what they build and depend on.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::process;

/// What is built beside these has the features that it has in the quick list, and what was built there is not built again.
pub(crate) const AS_TESTS_ARE_BUILT: [&str; 4] = ["--package", "ferrodrive", "--package", "ferrodrive-tests"];

/// A package of the workspace.
#[derive(Debug, Clone)]
pub(crate) struct Package {
    pub(crate) name: String,
    /// The folder of the package, relative to the workspace root, with `/` between parts.
    pub(crate) folder: String,
    pub(crate) dependencies: Vec<Dependency>,
    pub(crate) examples: Vec<String>,
}

/// One line of a manifest's dependency tables.
#[derive(Debug, Clone)]
pub(crate) struct Dependency {
    pub(crate) name: String,
    /// Only used by tests, examples and benches.
    pub(crate) dev: bool,
}

/// The workspace root: the folder above this crate, unless Cargo runs us from a copy.
pub(crate) fn root() -> PathBuf {
    let manifest = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_else(|_| env!("CARGO_MANIFEST_DIR").to_owned());
    Path::new(&manifest).parent().map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

/// Where Cargo puts what it builds.
pub(crate) fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// The Cargo that runs us.
pub(crate) fn cargo() -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(root());
    cargo
}

/// All packages of the workspace.
pub(crate) fn packages() -> Result<Vec<Package>, String> {
    let text = process::output(cargo().args(["metadata", "--no-deps", "--format-version", "1"]))?;
    let metadata: Value = serde_json::from_str(&text).map_err(|error| format!("cargo metadata: {error}"))?;
    Ok(list(&metadata, "packages").iter().map(|package| read(package, &root())).collect())
}

fn read(package: &Value, root: &Path) -> Package {
    let manifest = PathBuf::from(string(package, "manifest_path"));
    let folder = manifest.parent().unwrap_or(root);
    let folder = folder.strip_prefix(root).unwrap_or(folder).to_string_lossy().replace('\\', "/");
    let is_example = |target: &&Value| list(target, "kind").iter().any(|kind| kind == "example");
    Package {
        name: string(package, "name"),
        folder,
        dependencies: list(package, "dependencies")
            .iter()
            .map(|entry| Dependency { name: string(entry, "name"), dev: entry["kind"] == "dev" })
            .collect(),
        examples: list(package, "targets").iter().filter(is_example).map(|target| string(target, "name")).collect(),
    }
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().map_or(&[], Vec::as_slice)
}

fn string(value: &Value, key: &str) -> String {
    value[key].as_str().unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_workspace_lists_its_packages_with_their_folders() {
        let packages = packages().unwrap();
        let can = packages.iter().find(|package| package.name == "ferrodrive-can").unwrap();
        assert_eq!(can.folder, "crates/can");
    }
}
