//! Other people's software against ours: canopen-python, python-can and pymodbus talk to `ferrodrive sim`;
//! cantools, mcap, tshark and can-utils read what it writes.
//!
//! They start it with `ferrodrive.Simulator` of our own Python package. The packages of others go into a private environment
//! under `target/`, in pinned versions, and stay there for the next run. A machine without Python or without a network skips
//! this step and reports it; it never fails for that.

use std::process::Command;

use crate::say::say;
use crate::tally::Tally;
use crate::{debian, process, program, python, workspace};

/// The pinned packages: one file that people can also give to `pip install -r`.
pub(crate) const REQUIREMENTS: &str = "tests/peers/requirements.txt";

/// The environment that has them.
pub(crate) const VENV: &str = "peers-venv";

const SCRIPT: &str = "tests/peers/run.py";

/// Programs of Debian packages that read log files. Checks that miss theirs are skipped.
const PROGRAMS: &[(&str, &str)] = &[("tshark", "tshark"), ("editcap", "wireshark-common"), ("asc2log", "can-utils")];

/// What the step takes of others.
pub(crate) fn fetch() -> Result<(), String> {
    debian::install(PROGRAMS)
}

pub(crate) fn run() -> Tally {
    let program = match program::build("sim") {
        Ok(program) => program,
        Err(tally) => return tally,
    };
    // The wheel is built in an environment of its own.
    let environments =
        python::environment(python::VENV, python::REQUIREMENTS).and_then(|_| python::environment(VENV, REQUIREMENTS));
    let python = match environments {
        Ok(python) => python,
        Err(reason) => return Tally::skipped(reason),
    };
    if let Err(error) = python::install_wheel(&python) {
        return Tally::failed(error);
    }
    if let Err(reason) = fetch() {
        say(format_args!("without {reason}"));
    }
    let root = workspace::root();
    let mut command = Command::new(&python);
    command.current_dir(&root).arg("-u").arg(root.join(SCRIPT)).arg("--program").arg(program);
    let mut tally = Tally::default();
    let ended_well = process::run(&mut command, |line| {
        say(line);
        count(line, &mut tally);
    });
    match ended_well {
        Ok(true) if tally == Tally::default() => Tally::failed("the peers checked nothing"),
        Ok(true) => tally,
        Ok(false) => {
            tally.failed = tally.failed.max(1);
            tally.note = "a peer disagrees: read the lines above".to_owned();
            tally
        }
        Err(error) => Tally::failed(error),
    }
}

/// Counts one line of the script: `ok NAME`, `FAILED NAME: why`, `skipped NAME: why`.
pub(crate) fn count(line: &str, tally: &mut Tally) {
    match line.split_once(' ').map(|(word, _)| word) {
        Some("ok") => tally.passed += 1,
        Some("FAILED") => tally.failed += 1,
        Some("skipped") => tally.skipped += 1,
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_the_script_are_counted_by_their_first_word() {
        let mut tally = Tally::default();
        let lines = ["ok boots up", "FAILED reads 1000h: timeout", "skipped torque: no motor", "a remark"];
        lines.iter().for_each(|line| count(line, &mut tally));
        assert_eq!((tally.passed, tally.failed, tally.skipped), (1, 1, 1));
    }
}
