//! The steps of `cargo xtask test`, as one table: first the quick list, then what `--all` adds.
//!
//! Everything is built in one profile (dev) and with the features of the same packages ([`workspace`]'s default members), so that
//! nothing is compiled twice.

use crate::say::say;
use crate::tally::Tally;
use crate::test_programs::{self, How, REAL_TIME, SCHEMA_AND_BROWSER};
use crate::{
    bare_metal, browser, dist, examples, libtest, packages, page, peers, process, program, python, tidy, vcan, web,
    wheel, workspace,
};

/// One step: its name for `--only`, what it does for the progress line, when it runs, and the function that does it.
pub(crate) struct TestStep {
    pub(crate) name: &'static str,
    pub(crate) does: &'static str,
    pub(crate) when: When,
    pub(crate) run: fn() -> Tally,
}

/// When a step runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum When {
    /// In the quick list, one after the other.
    Quick,
    /// With `--all`, after the quick list: what the others build first, which keeps every core busy.
    Building,
    /// Then steps that keep the processor busy, one after the other,
    Busy,
    /// and, beside them, two at a time, steps that mostly wait for time to pass, for a browser, for a virtual machine; in
    /// the order of the table.
    Waiting,
    /// Only where it is named: it would make the usual list longer by minutes, and is about few files.
    Named,
}

pub(crate) const STEPS: &[TestStep] = &[
    TestStep { name: "fmt", does: "is every file formatted as cargo fmt would", when: When::Quick, run: fmt },
    TestStep { name: "tidy", does: "the house rules that a program can check", when: When::Quick, run: tidy::step },
    TestStep {
        name: "tests",
        does: "unit, property and integration tests of every crate, in virtual time",
        when: When::Quick,
        run: tests,
    },
    TestStep { name: "doctests", does: "the code in the documentation", when: When::Quick, run: doctests },
    TestStep {
        name: "demo",
        does: "every procedure of the manuals against the virtual drives",
        when: When::Quick,
        run: program::demo,
    },
    TestStep {
        name: "core",
        does: "the core crates compile for a Cortex-M4F",
        when: When::Quick,
        run: bare_metal::step,
    },
    TestStep {
        name: "build",
        does: "the programs and tests that the steps behind this one run",
        when: When::Building,
        run: build,
    },
    TestStep { name: "clippy", does: "lints of every target, warnings are errors", when: When::Busy, run: clippy },
    TestStep { name: "docs", does: "the documentation builds and its links work", when: When::Busy, run: docs },
    TestStep {
        name: "packages",
        does: "every crate packs, as cargo publish would",
        when: When::Busy,
        run: packages::run,
    },
    TestStep {
        name: "no_std",
        does: "what a node and a drive take of a Cortex-M4F",
        when: When::Busy,
        run: bare_metal::sizes_step,
    },
    TestStep {
        name: "python",
        does: "the Python package: its wheel builds, and its tests pass against the installed wheel",
        when: When::Busy,
        run: python::step,
    },
    TestStep {
        name: "dist",
        does: "what is released can be made, and works from an empty folder",
        when: When::Busy,
        run: dist::step,
    },
    TestStep {
        name: "examples",
        does: "every example runs, to its end or until it is ready to serve",
        when: When::Busy,
        run: examples::run,
    },
    TestStep {
        name: "page",
        does: "what the studio's page computes and says, by node",
        when: When::Busy,
        run: page::step,
    },
    TestStep {
        name: "web",
        does: "the page without a server: runs equal to the native ones, in node and a browser",
        when: When::Busy,
        run: web::step,
    },
    TestStep {
        name: "studio",
        does: "the studio's page in a real browser: enable, move, jog, close the tab",
        when: When::Waiting,
        run: browser::step,
    },
    TestStep {
        name: "vcan",
        does: "CAN interfaces of Linux, in a virtual machine that has them",
        when: When::Waiting,
        run: vcan::step,
    },
    TestStep {
        name: "real_time",
        does: "processes in real time: servers, signals, sockets, terminals",
        when: When::Waiting,
        run: real_time,
    },
    TestStep {
        name: "schema",
        does: "JSON of every command, and control connections, by their schemas",
        when: When::Waiting,
        run: schema,
    },
    TestStep {
        name: "peers",
        does: "canopen-python, python-can and pymodbus against ferrodrive sim",
        // Last: by then the wheel that it installs is being built.
        when: When::Waiting,
        run: peers::run,
    },
    TestStep {
        name: "aarch64",
        does: "what is released for aarch64, by cross tools, its program run by QEMU; everything is compiled anew",
        when: When::Named,
        run: dist::cross_step,
    },
];

/// Gets what a step takes of others, or says why it cannot be had.
pub(crate) type Fetch = fn() -> Result<(), String>;

/// What steps take of others, in the order in which it is needed. It is fetched while the quick list computes, since a download
/// leaves the processor idle; a step whose part cannot be had reports that itself.
pub(crate) const FETCHES: &[(&str, Fetch)] = &[
    ("core", bare_metal::fetch),
    ("studio", browser::fetch),
    ("vcan", vcan::fetch),
    ("python", python::fetch),
    ("peers", peers::fetch),
    ("dist", wheel::fetch),
];

/// What needs a Python interpreter to build.
const EXCEPT_PYTHON: [&str; 2] = ["--exclude", "ferrodrive-python"];

/// Tests that compute: a few more than a small machine has cores, so that starts and ends overlap.
const COMPUTING: How<'_> = How { programs: 2, threads: 2, arguments: &[] };

/// Tests that wait.
const WAITING: How<'_> = How { programs: 1, threads: 6, arguments: &[] };

fn fmt() -> Tally {
    if !process::works("cargo", &["fmt", "--version"]) {
        return Tally::skipped("rustfmt is not installed: rustup component add rustfmt");
    }
    cargo(&["fmt", "--all", "--check"], &[], "run cargo fmt")
}

fn build() -> Tally {
    let built = program::built().and_then(|_| examples::build());
    let built =
        built.and_then(|_| test_programs::build(REAL_TIME)).and_then(|_| test_programs::build(SCHEMA_AND_BROWSER));
    built.map_or_else(Tally::failed, |_| Tally::passed())
}

fn clippy() -> Tally {
    if !process::works("cargo", &["clippy", "--version"]) {
        return Tally::skipped("clippy is not installed: rustup component add clippy");
    }
    let words = [&["clippy", "--workspace"], &EXCEPT_PYTHON[..], &["--all-targets", "--quiet", "--", "-D", "warnings"]];
    cargo(&words.concat(), &[], "clippy has something to say: read the lines above")
}

fn tests() -> Tally {
    tests_of(&["--lib", "--bins", "--tests"], &[])
}

/// The tests that `cargo test` selects by these words, in virtual time. The programs get further arguments, such as a filter.
pub(crate) fn tests_of(words: &[&str], arguments: &[&str]) -> Tally {
    test_programs::build_and_run(words, How { arguments, ..COMPUTING })
}

fn real_time() -> Tally {
    test_programs::of_processes(REAL_TIME, WAITING)
}

fn schema() -> Tally {
    test_programs::of_processes(SCHEMA_AND_BROWSER, WAITING)
}

fn doctests() -> Tally {
    libtest::run(workspace::cargo().args(["test", "--doc", "--no-fail-fast"]))
}

fn docs() -> Tally {
    let words = [&["doc", "--workspace"], &EXCEPT_PYTHON[..], &["--no-deps", "--quiet"]];
    cargo(&words.concat(), &[("RUSTDOCFLAGS", "-D warnings")], "a documentation link or example is broken")
}

fn cargo(words: &[&str], environment: &[(&str, &str)], note_when_failed: &str) -> Tally {
    let mut cargo = workspace::cargo();
    cargo.args(words).envs(environment.iter().copied());
    match process::run(&mut cargo, |line| say(line)) {
        Ok(ended_well) => Tally::of_check(ended_well, note_when_failed),
        Err(error) => Tally::failed(error),
    }
}
