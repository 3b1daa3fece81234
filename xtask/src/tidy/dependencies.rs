//! Which crate may depend on which: the direction in which knowledge flows.
//!
//! The table is the one of ARCHITECTURE.md. Tests, examples and benches may look sideways.

use super::finding::Finding;
use crate::workspace::Package;

/// The crates that run without an operating system and without an allocator.
pub(crate) const NO_STD: &[&str] = &["can", "canopen", "cia402", "motion", "plant", "devices", "drives"];

/// What a crate of `crates/` may use: the project's own crates by folder name.
const MAY_USE: &[(&str, &[&str])] = &[
    ("can", &[]),
    ("canopen", &["can"]),
    ("cia402", &["canopen"]),
    ("motion", &[]),
    ("plant", &[]),
    ("devices", &["can", "canopen", "cia402"]),
    ("eds", &["can", "canopen", "cia402", "devices"]),
    ("drives", &["can", "canopen", "cia402", "motion", "devices"]),
    ("sim", &["can", "canopen", "cia402", "plant", "devices", "drives"]),
    ("master", &["can", "canopen", "cia402", "devices"]),
    ("canlog", &["can"]),
    ("plot", &[]),
    ("tune", &["plot"]),
    ("conform", &["can", "canopen", "cia402", "devices", "master", "plot"]),
    ("slcan", &["can", "canlog"]),
    ("transport", &["can", "canlog", "slcan"]),
    ("showcase", &["can", "canopen", "cia402", "devices", "drives", "sim", "master", "plot"]),
    ("words", &["can", "canopen", "cia402", "devices", "eds", "master", "plot", "sim"]),
    ("fmu", &["can", "cia402", "devices", "master", "sim", "words"]),
    ("machine", &["can", "canopen", "cia402", "motion", "plant", "devices", "eds", "drives", "sim", "master", "words"]),
    ("recording", &["can", "canopen", "plot", "sim", "words"]),
    ("foxglove", &["can", "recording"]),
    ("scenario", &["can", "canopen", "cia402", "devices", "host", "machine", "master", "sim", "words"]),
    (
        "host",
        &[
            "can",
            "canopen",
            "cia402",
            "devices",
            "eds",
            "machine",
            "master",
            "plot",
            "recording",
            "sim",
            "tune",
            "words",
        ],
    ),
    ("console", &["can", "canopen", "cia402", "devices", "host", "master", "plot", "words"]),
    ("serve", &["can", "canlog", "foxglove", "host", "master", "recording", "scenario", "sim", "transport", "words"]),
    ("studio", &["can", "canlog", "canopen", "host", "machine", "master", "recording", "words"]),
    ("web", &["can", "canopen", "console", "host", "machine", "master", "scenario", "sim", "slcan", "words"]),
    (
        "python",
        &[
            "can",
            "canopen",
            "cia402",
            "devices",
            "eds",
            "host",
            "machine",
            "master",
            "plant",
            "recording",
            "scenario",
            "serve",
            "sim",
            "transport",
            "words",
        ],
    ),
    (
        "cli",
        &[
            "can",
            "canopen",
            "cia402",
            "motion",
            "plant",
            "devices",
            "eds",
            "foxglove",
            "drives",
            "sim",
            "fmu",
            "master",
            "conform",
            "console",
            "transport",
            "tune",
            "canlog",
            "plot",
            "showcase",
            "slcan",
            "host",
            "serve",
            "studio",
            "machine",
            "recording",
            "scenario",
            "words",
        ],
    ),
];

/// The crates of others that a `no_std` crate may use. None of them wants an allocator.
const FOREIGN_IN_NO_STD: &[&str] = &["heapless", "libm", "embedded-can"];

/// Where a finding stands: `manifest` gives the text of a package's `Cargo.toml` by its folder.
pub(super) fn directions(packages: &[Package], manifest: impl Fn(&str) -> String) -> Vec<Finding> {
    let crates = packages.iter().filter_map(|package| Some((package.folder.strip_prefix("crates/")?, package)));
    crates.flat_map(|(name, package)| of_crate(name, package, packages, &manifest(&package.folder))).collect()
}

/// What the table allows and no manifest has: a direction that is open for no reason.
pub(super) fn allowances(packages: &[Package]) -> Vec<Finding> {
    let used = |name: &str, other: &str| {
        let folder = |name: &str| packages.iter().find(|package| package.folder == format!("crates/{name}"));
        let (Some(package), Some(other)) = (folder(name), folder(other)) else { return false };
        package.dependencies.iter().any(|dependency| !dependency.dev && dependency.name == other.name)
    };
    let allowed = MAY_USE.iter().flat_map(|(name, may_use)| may_use.iter().map(move |other| (*name, *other)));
    let unused = allowed.filter(|(name, other)| !used(name, other));
    let finding = |(name, other): (&str, &str)| Finding {
        path: "xtask/src/tidy/dependencies.rs".to_owned(),
        line: 1,
        rule: "dependencies",
        what: format!("{name} may use {other} and does not"),
        why: "the table is as narrow as what is built",
        remedy: "take it out of MAY_USE and of the table in ARCHITECTURE.md",
    };
    unused.map(finding).collect()
}

fn of_crate(name: &str, package: &Package, packages: &[Package], manifest: &str) -> Vec<Finding> {
    let path = format!("{}/Cargo.toml", package.folder);
    let Some((_, may_use)) = MAY_USE.iter().find(|(known, _)| *known == name) else {
        let what = format!("the crate {name} has no place in the house");
        let why = "a crate is added with its direction";
        let remedy = "add it to ARCHITECTURE.md and to MAY_USE in xtask/src/tidy/dependencies.rs";
        return vec![Finding { path, line: 1, rule: "dependencies", what, why, remedy }];
    };
    let folder_of = |name: &str| {
        let known = packages.iter().find(|package| package.name == name);
        known.and_then(|package| package.folder.strip_prefix("crates/")).map(str::to_owned)
    };
    let mut found = Vec::new();
    for dependency in package.dependencies.iter().filter(|dependency| !dependency.dev) {
        let own = folder_of(&dependency.name);
        let line = line_of(manifest, own.as_deref().unwrap_or(&dependency.name));
        match own {
            Some(own) if !may_use.contains(&own.as_str()) => found.push(Finding {
                path: path.clone(),
                line,
                rule: "dependencies",
                what: format!("{name} depends on {own}"),
                why: "knowledge flows one way through the house",
                remedy: "move the code to the crate that may know both, or hand plain values across",
            }),
            None if NO_STD.contains(&name) && !FOREIGN_IN_NO_STD.contains(&dependency.name.as_str()) => {
                found.push(Finding {
                    path: path.clone(),
                    line,
                    rule: "dependencies",
                    what: format!("{name} depends on {}", dependency.name),
                    why: "the core crates run without an operating system and without an allocator",
                    remedy: "write the little that is needed, or name it in FOREIGN_IN_NO_STD",
                })
            }
            _ => {}
        }
    }
    found
}

/// The line of a manifest that begins with the dependency's name.
fn line_of(manifest: &str, name: &str) -> usize {
    let names_it = |line: &str| line.strip_prefix(name).is_some_and(|rest| rest.starts_with(['.', ' ', '=']));
    manifest.lines().position(names_it).map_or(1, |at| at + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::Dependency;

    fn package(name: &str, folder: &str, dependencies: &[(&str, bool)]) -> Package {
        let dependencies = dependencies.iter().map(|&(name, dev)| Dependency { name: name.into(), dev }).collect();
        Package { name: name.into(), folder: folder.into(), dependencies, examples: Vec::new() }
    }

    fn whats(packages: &[Package]) -> Vec<String> {
        directions(packages, |_| "[dependencies]\nplant.workspace = true\n".to_owned())
            .into_iter()
            .map(|finding| format!("{}: {}", finding.line, finding.what))
            .collect()
    }

    #[test]
    fn a_drive_that_knows_physics_is_found_at_its_line() {
        let packages = [
            package("ferrodrive-plant", "crates/plant", &[]),
            package("ferrodrive-drives", "crates/drives", &[("ferrodrive-plant", false)]),
        ];
        assert_eq!(whats(&packages), ["2: drives depends on plant"]);
    }

    #[test]
    fn tests_may_look_sideways() {
        let packages = [
            package("ferrodrive-plant", "crates/plant", &[]),
            package("ferrodrive-drives", "crates/drives", &[("ferrodrive-plant", true), ("proptest", true)]),
        ];
        assert_eq!(whats(&packages), Vec::<String>::new());
    }

    #[test]
    fn a_foreign_crate_in_a_core_crate_is_found() {
        assert_eq!(whats(&[package("ferrodrive-can", "crates/can", &[("tokio", false)])]), ["1: can depends on tokio"]);
    }

    #[test]
    fn what_is_allowed_and_not_used_is_found() {
        let drives = |name: &str, others: &[&str]| {
            let others: Vec<_> = others.iter().map(|other| format!("ferrodrive-{other}")).collect();
            let dependencies: Vec<_> = others.iter().map(|other| (other.as_str(), false)).collect();
            package(&format!("ferrodrive-{name}"), &format!("crates/{name}"), &dependencies)
        };
        let whole: Vec<Package> = MAY_USE.iter().map(|(name, may_use)| drives(name, may_use)).collect();
        assert_eq!(allowances(&whole), []);
        let mut less = whole;
        less[1] = drives("canopen", &[]);
        let found: Vec<_> = allowances(&less).into_iter().map(|finding| finding.what).collect();
        assert_eq!(found, ["canopen may use can and does not"]);
    }

    #[test]
    fn a_crate_without_a_place_in_the_house_is_found() {
        let found = whats(&[package("ferrodrive-extra", "crates/extra", &[])]);
        assert_eq!(found, ["1: the crate extra has no place in the house"]);
    }
}
