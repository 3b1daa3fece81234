//! `cargo xtask test --quick-since REVISION`: the tests nearest to a change, in the time that a person waits for.
//!
//! Those of the packages that were changed, and the tests of the whole from outside (`tests`), which every crate below the command
//! line is under. Packages that use a changed one are left to the quick list.

use std::process::{Command, ExitCode};
use std::time::Instant;

use crate::process;
use crate::steps::{self, STEPS};
use crate::table;
use crate::workspace::{self, Package};

/// The packages whose features are those of all: a selection with both shares what is built with the quick list.
const BESIDE: [&str; 2] = ["ferrodrive", "ferrodrive-tests"];

/// The test program of most packages, and that of the command line.
const IT: [&str; 2] = ["--test", "it"];
const COMMAND_LINE: [&str; 3] = ["--bins", "--test", "command_line"];

pub(crate) fn command(revision: &str) -> ExitCode {
    match changed(revision).and_then(|files| Ok((selection(&files, &workspace::packages()?), files.len()))) {
        Ok((_, 0)) => {
            println!("no file differs from {revision}");
            ExitCode::SUCCESS
        }
        Ok((words, files)) => {
            println!("{files} changed files: cargo test {}", words.join(" "));
            run(&words)
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn run(words: &[String]) -> ExitCode {
    let start = Instant::now();
    let mut rows = Vec::new();
    for step in STEPS.iter().filter(|step| ["fmt", "tidy"].contains(&step.name)) {
        let began = Instant::now();
        let tally = (step.run)();
        rows.push((step.name, began.elapsed(), tally));
    }
    let began = Instant::now();
    let tally = steps::tests_of(&words.iter().map(String::as_str).collect::<Vec<_>>());
    rows.push(("tests", began.elapsed(), tally));
    let ended = table::conclude(&rows, start.elapsed());
    println!("left out: the tests of packages that use what was changed (cargo xtask test runs them)");
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
    let matters = |file: &&String| file.ends_with(".rs") || file.ends_with(".toml") || file.ends_with(".lock");
    if files.iter().filter(matters).any(|file| of(file).is_none()) {
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
        assert_eq!(drives, "--lib --test it -p ferrodrive-drives -p ferrodrive -p ferrodrive-tests");
    }

    #[test]
    fn the_command_line_has_a_program_of_its_own_and_what_all_share_is_tested_by_all() {
        assert_eq!(
            words(&["crates/cli/src/main.rs"]),
            "--lib --test it --bins --test command_line -p ferrodrive -p ferrodrive-tests"
        );
        assert_eq!(words(&["Cargo.lock"]), "--lib --bins --tests");
    }
}
