//! `cargo xtask test --quick-since REVISION`: the tests nearest to a change, in the time that a person waits for.
//!
//! Those of the packages that were changed, and the tests of the whole from outside (`tests`), which every crate below the command
//! line is under. Packages that use a changed one are left to the quick list, and so are tests that name other drives than the one
//! that was changed.

use std::process::{Command, ExitCode};
use std::time::Instant;

use crate::process;
use crate::steps::{self, STEPS};
use crate::table;
use crate::workspace::{self, Package};

/// The tests from outside, and a package that has the command line's features but neither library nor test program: a selection
/// with both shares what is built with the quick list, and builds nothing above `tests`.
const BESIDE: [&str; 2] = ["ferrodrive-tests", "ferrodrive-examples"];

/// The packages in which some files are one drive's alone, by their folders.
const DRIVES_IN: [&str; 3] = ["crates/devices/", "crates/drives/", "crates/sim/src/machine/models/"];

/// A drive: its name in tests, and the words in the paths of its files.
const DRIVES: [(&str, &[&str]); 4] =
    [("zlac8030l", &["zlac8030l"]), ("zlim42c", &["zlim42c"]), ("mjoint", &["mjoint"]), ("cia402", &["servo", "node"])];

/// The test program of most packages, and that of the command line.
const IT: [&str; 2] = ["--test", "it"];
const COMMAND_LINE: [&str; 3] = ["--bins", "--test", "command_line"];

pub(crate) fn command(revision: &str) -> ExitCode {
    match changed(revision).and_then(|files| Ok((selection(&files, &workspace::packages()?), files))) {
        Ok((_, files)) if files.is_empty() => {
            println!("no file differs from {revision}");
            ExitCode::SUCCESS
        }
        Ok((words, files)) => {
            let left_out = other_drives(&files);
            let skips = left_out.iter().flat_map(|drive| ["--skip", drive]).collect::<Vec<_>>();
            println!("{} changed files: cargo test {} -- {}", files.len(), words.join(" "), skips.join(" "));
            run(&words, &skips)
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn run(words: &[String], skips: &[&str]) -> ExitCode {
    let start = Instant::now();
    let mut rows = Vec::new();
    for step in STEPS.iter().filter(|step| ["fmt", "tidy"].contains(&step.name)) {
        let began = Instant::now();
        let tally = (step.run)();
        rows.push((step.name, began.elapsed(), tally));
    }
    let began = Instant::now();
    let tally = steps::tests_of(&words.iter().map(String::as_str).collect::<Vec<_>>(), skips);
    rows.push(("tests", began.elapsed(), tally));
    let ended = table::conclude(&rows, start.elapsed());
    let drives = if skips.is_empty() { "" } else { ", and the tests that name another drive" };
    println!("left out: the tests of packages that use what was changed{drives} (cargo xtask test runs them)");
    println!("{}", table::sum(&rows).summary());
    ended
}

/// The files that differ from a revision, new ones too.
fn changed(revision: &str) -> Result<Vec<String>, String> {
    let git = |words: &[&str]| process::output(Command::new("git").current_dir(workspace::root()).args(words));
    let differing = git(&["diff", "--name-only", revision, "--"])?;
    let new = git(&["ls-files", "--others", "--exclude-standard"])?;
    Ok(differing.lines().chain(new.lines()).map(str::to_owned).collect())
}

/// The arguments of `cargo test` for these files. A file that is in no package may matter to all of them.
fn selection(files: &[String], packages: &[Package]) -> Vec<String> {
    let of = |file: &String| {
        let holds = |package: &&Package| file.starts_with(&format!("{}/", package.folder));
        packages.iter().filter(holds).max_by_key(|package| package.folder.len())
    };
    if files.iter().filter(|file| matters(file)).any(|file| of(file).is_none()) {
        return ["--lib", "--bins", "--tests"].map(str::to_owned).to_vec();
    }
    let mut names: Vec<&str> = files.iter().filter_map(of).map(|package| package.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let mut words = vec!["--lib"];
    words.extend(IT);
    if names.contains(&"ferrodrive") {
        words.extend(COMMAND_LINE);
    }
    names.extend(BESIDE.iter().filter(|beside| !files.iter().filter_map(of).any(|package| package.name == **beside)));
    words.extend(names.into_iter().flat_map(|name| ["-p", name]));
    words.into_iter().map(str::to_owned).collect()
}

/// The drives that have nothing to do with a change: all but one, if each changed file of Rust is that one's alone.
fn other_drives(files: &[String]) -> Vec<&'static str> {
    let is_of = |file: &str, words: &[&str]| {
        DRIVES_IN
            .iter()
            .filter_map(|folder| file.strip_prefix(folder))
            .any(|place| place.split(['/', '.']).any(|part| words.contains(&part)))
    };
    let mut code = files.iter().filter(|file| matters(file)).peekable();
    let Some(first) = code.peek() else { return Vec::new() };
    let Some((changed, words)) = DRIVES.iter().find(|(_, words)| is_of(first, words)) else { return Vec::new() };
    if !code.all(|file| is_of(file, words)) {
        return Vec::new();
    }
    DRIVES.iter().map(|(drive, _)| *drive).filter(|drive| drive != changed).collect()
}

/// A file that tests may depend on, whatever package it is in.
fn matters(file: &str) -> bool {
    [".rs", ".toml", ".lock"].iter().any(|end| file.ends_with(end))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(files: &[&str]) -> String {
        let files: Vec<String> = files.iter().map(|file| (*file).to_owned()).collect();
        selection(&files, &workspace::packages().unwrap()).join(" ")
    }

    #[test]
    fn a_change_in_one_drive_is_tested_by_its_package_and_from_outside() {
        let drives = words(&["crates/drives/src/zlac8030l/mod.rs", "docs/drives/zlac8030l.md"]);
        assert_eq!(drives, "--lib --test it -p ferrodrive-drives -p ferrodrive-tests -p ferrodrive-examples");
    }

    #[test]
    fn a_package_that_is_selected_for_its_features_alone_has_them_and_builds_nothing() {
        let packages = workspace::packages().unwrap();
        let examples = packages.iter().find(|package| package.name == BESIDE[1]).unwrap();
        assert!(examples.dependencies.iter().any(|dependency| dependency.name == "ferrodrive"));
        let folder = workspace::root().join(&examples.folder);
        assert!(!folder.join("src").exists() && !folder.join("tests/it").exists());
    }

    #[test]
    fn a_change_in_one_drive_leaves_out_the_tests_that_name_another_and_no_other_change_does() {
        let left_out = |files: &[&str]| other_drives(&files.iter().map(|file| (*file).to_owned()).collect::<Vec<_>>());
        let wheel = "crates/drives/src/zlac8030l/mod.rs";
        assert_eq!(left_out(&[wheel, "docs/drives/zlac8030l.md"]), ["zlim42c", "mjoint", "cia402"]);
        assert_eq!(left_out(&["crates/sim/src/machine/models/servo.rs"]), ["zlac8030l", "zlim42c", "mjoint"]);
        assert_eq!(left_out(&["crates/devices/src/mjoint/rows.rs", wheel]), [""; 0]);
        for shared in ["crates/drives/src/engine/axis/mod.rs", "crates/drives/Cargo.toml", "tests/src/zlac8030l.rs"] {
            assert_eq!(left_out(&[wheel, shared]), [""; 0], "{shared}");
            assert_eq!(left_out(&[shared, wheel]), [""; 0], "{shared}");
        }
        assert_eq!(left_out(&["README.md"]), [""; 0]);
    }

    #[test]
    fn each_drive_has_a_folder_of_its_own_and_one_of_tests() {
        for (drive, words) in DRIVES {
            for word in words {
                assert!(workspace::root().join("crates/drives/src").join(word).is_dir(), "{word}");
            }
            assert!(workspace::root().join(format!("tests/tests/it/virtual_{drive}")).is_dir(), "{drive}");
        }
    }

    #[test]
    fn the_command_line_has_a_program_of_its_own_and_what_all_share_is_tested_by_all() {
        assert_eq!(
            words(&["crates/cli/src/main.rs"]),
            "--lib --test it --bins --test command_line -p ferrodrive -p ferrodrive-tests -p ferrodrive-examples"
        );
        assert_eq!(words(&["Cargo.lock"]), "--lib --bins --tests");
    }
}
