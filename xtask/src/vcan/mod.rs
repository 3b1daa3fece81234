//! `cargo xtask vcan-test`: the tests that need CAN interfaces, inside a small virtual machine whose kernel has them.
//!
//! Few machines that build this have CAN in their kernel. So a Debian kernel is booted under QEMU ([`image`], [`guest`]) with
//! `vcan0`, `vcan1` and two emulated Kvaser cards on one bus, `can0` and `can1`. The guest's files are the host's, read-only,
//! so that what was built here runs there. A machine without QEMU, or where it cannot be installed, skips this and reports it.

mod guest;
mod image;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::say::say;
use crate::tally::Tally;
use crate::{libtest, peers, python, test_programs, workspace};

/// The tests that are run inside.
const TESTS: &str = "socketcan::";

/// canopen-python on the same interfaces.
const PEER: &str = "tests/peers/on_socketcan.py";

/// `cargo xtask vcan-test`.
pub(crate) fn command() -> ExitCode {
    let tally = step();
    println!("vcan: {} {}\n{}", tally.verdict(), tally.note, tally.summary());
    if tally.failed > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

/// What the step takes of others.
pub(crate) fn fetch() -> Result<(), String> {
    image::prepare().and_then(|_| python::environment(peers::VENV, peers::REQUIREMENTS)).map(|_| ())
}

/// The step of `cargo xtask test`.
pub(crate) fn step() -> Tally {
    let image = match image::prepare() {
        Ok(image) => image,
        Err(reason) => return Tally::skipped(reason),
    };
    let tests = match test_program() {
        Ok(tests) => tests,
        Err(error) => return Tally::failed(error),
    };
    let peer = python::environment(peers::VENV, peers::REQUIREMENTS);
    let checks = checks(&tests, peer.as_ref().ok());
    say("booting a guest with CAN interfaces");
    let output = match guest::run(&image, &checks) {
        Ok(output) => output,
        Err(error) => return Tally::failed(error),
    };
    let mut tally = read(&output);
    if let Err(reason) = peer {
        tally.add(&Tally::skipped(format!("canopen-python: {reason}")));
    }
    tally
}

/// The program with the tests of processes, one of which are those that are run inside.
fn test_program() -> Result<PathBuf, String> {
    let mut programs = test_programs::build(test_programs::REAL_TIME)?;
    programs.pop().map(|program| program.path).ok_or_else(|| "cargo built no tests of processes".to_owned())
}

/// What the guest runs, as a shell script. Each line of its output says how a check ended.
fn checks(tests: &Path, python: Option<&PathBuf>) -> String {
    let root = workspace::root();
    let path = std::env::var("PATH").unwrap_or_default();
    let quoted = |path: &Path| format!("'{}'", path.display().to_string().replace('\'', "'\\''"));
    let mut script =
        format!("export PATH={}:/usr/sbin:/sbin HOME=/tmp\ncd {}\n", quoted(Path::new(&path)), quoted(&root));
    script += &format!("{} {TESTS} --ignored --test-threads=1\nstatus=$?\n", quoted(tests));
    if let Some(python) = python {
        let program = workspace::target().join("debug/ferrodrive");
        script += &format!(
            "{} -B -u {} --program {} || status=1\n",
            quoted(python),
            quoted(&root.join(PEER)),
            quoted(&program)
        );
    }
    script + "exit $status\n"
}

/// Counts the lines of both kinds of checks, and shows them.
fn read(output: &guest::Output) -> Tally {
    let mut tally = Tally::default();
    let mut failed = Vec::new();
    for line in output.text.lines() {
        say(line);
        libtest::count(line, &mut tally);
        failed.extend(libtest::failed_test(line));
        peers::count(line, &mut tally);
    }
    if !output.ended_well && tally.failed == 0 {
        tally.failed = 1;
        failed.push("the checks ended badly: read the lines above".to_owned());
    }
    if tally == Tally::default() {
        return Tally::failed("the guest checked nothing");
    }
    tally.note = failed.join(", ");
    tally
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checks_of_both_kinds_are_counted() {
        let text =
            "test a ... ok\ntest b ... FAILED\ntest result: FAILED. 1 passed; 1 failed; 0 ignored\nok reads 1008h\n";
        let tally = read(&guest::Output { text: text.to_owned(), ended_well: false });
        assert_eq!((tally.passed, tally.failed, tally.note.as_str()), (2, 1, "b"));
        let died = read(&guest::Output { text: "ok one\n".to_owned(), ended_well: false });
        assert_eq!((died.passed, died.failed), (1, 1));
        assert_eq!(read(&guest::Output { text: String::new(), ended_well: true }).failed, 1);
    }
}
