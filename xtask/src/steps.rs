//! The steps of `cargo xtask test`, cheapest first, as one table.
//!
//! Everything is built in one profile (dev) and with the features that the whole workspace asks for, so that nothing
//! is compiled twice: clippy only checks, and the later steps use what the test step has built.

use crate::tally::Tally;
use crate::{browser, cargo_tests, dist, examples, packages, peers, process, program, python, tidy, vcan, workspace};

/// One step: its name for `--only`, what it does for the progress line, and the function that does it.
pub(crate) struct Step {
    pub(crate) name: &'static str,
    pub(crate) does: &'static str,
    pub(crate) run: fn() -> Tally,
}

pub(crate) const STEPS: &[Step] = &[
    Step { name: "fmt", does: "is every file formatted as cargo fmt would", run: fmt },
    Step { name: "tidy", does: "the house rules that a program can check", run: tidy::step },
    Step { name: "clippy", does: "lints of every target, warnings are errors", run: clippy },
    Step { name: "tests", does: "unit, property and integration tests of every crate", run: tests },
    Step { name: "doctests", does: "the code in the documentation", run: doctests },
    Step { name: "docs", does: "the documentation builds and its links lead somewhere", run: docs },
    Step { name: "packages", does: "every crate packs, as cargo publish would", run: packages::run },
    Step { name: "no_std", does: "the core crates build for a Cortex-M4", run: no_std },
    Step { name: "examples", does: "every example runs, to its end or until it is ready to serve", run: examples::run },
    Step {
        name: "demo",
        does: "ferrodrive demo: the manuals' procedures against the virtual drives",
        run: program::demo,
    },
    Step {
        name: "python",
        does: "the Python package: its wheel builds, and its tests pass against the installed wheel",
        run: python::step,
    },
    Step { name: "dist", does: "what is released can be made, and works from an empty folder", run: dist::step },
    Step { name: "peers", does: "canopen-python, python-can and pymodbus against ferrodrive sim", run: peers::run },
    Step {
        name: "studio",
        does: "the studio's page in a real browser: enable, move, jog, close the tab",
        run: browser::step,
    },
    Step { name: "vcan", does: "CAN interfaces of Linux, in a virtual machine that has them", run: vcan::step },
];

/// The target of the `no_std` step: a Cortex-M4F microcontroller, which has no operating system to lean on.
const BARE_TARGET: &str = "thumbv7em-none-eabihf";

fn fmt() -> Tally {
    if !process::works("cargo", &["fmt", "--version"]) {
        return Tally::skipped("rustfmt is not installed: rustup component add rustfmt");
    }
    cargo(&["fmt", "--all", "--check"], &[], "run cargo fmt")
}

fn clippy() -> Tally {
    if !process::works("cargo", &["clippy", "--version"]) {
        return Tally::skipped("clippy is not installed: rustup component add clippy");
    }
    let words = ["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"];
    cargo(&words, &[], "clippy has something to say: read the lines above")
}

fn tests() -> Tally {
    let words = ["test", "--workspace", "--lib", "--bins", "--tests", "--examples", "--no-fail-fast"];
    cargo_tests::run(workspace::cargo().args(words))
}

fn doctests() -> Tally {
    cargo_tests::run(workspace::cargo().args(["test", "--workspace", "--doc", "--no-fail-fast"]))
}

fn docs() -> Tally {
    let words = ["doc", "--workspace", "--no-deps", "--quiet"];
    cargo(&words, &[("RUSTDOCFLAGS", "-D warnings")], "a documentation link or example is broken")
}

fn no_std() -> Tally {
    let installed = process::output(std::process::Command::new("rustc").args([
        "--print",
        "target-libdir",
        "--target",
        BARE_TARGET,
    ]));
    if !installed.is_ok_and(|folder| std::path::Path::new(folder.trim()).is_dir()) {
        return Tally::skipped(format!("the target is not installed: rustup target add {BARE_TARGET}"));
    }
    let mut words = vec!["check", "--quiet", "--target", BARE_TARGET];
    let packages: Vec<String> = tidy::NO_STD.iter().map(|name| format!("ferrodrive-{name}")).collect();
    packages.iter().for_each(|package| words.extend(["--package", package]));
    cargo(&words, &[], "a core crate needs an operating system")
}

fn cargo(words: &[&str], environment: &[(&str, &str)], note_when_failed: &str) -> Tally {
    let mut cargo = workspace::cargo();
    cargo.args(words).envs(environment.iter().copied());
    match process::run(&mut cargo, |line| println!("{line}")) {
        Ok(ended_well) => Tally::of_check(ended_well, note_when_failed),
        Err(error) => Tally::failed(error),
    }
}
