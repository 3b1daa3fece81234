//! What the studio's page computes and says, by node: the parts of it that need no browser.

use std::process::Command;

use crate::debian;
use crate::process;
use crate::say::say;
use crate::tally::Tally;
use crate::workspace;

/// What runs JavaScript, with the package of Debian that it is in.
const PROGRAMS: &[(&str, &str)] = &[("node", "nodejs")];

pub(crate) fn step() -> Tally {
    if let Err(reason) = debian::install(PROGRAMS) {
        return Tally::skipped(reason);
    }
    tests(Command::new("node").current_dir(workspace::root().join("crates/studio")), "page_tests/")
}

/// Runs the tests of a folder by `node`, one file after the other.
pub(crate) fn tests(node: &mut Command, folder: &str) -> Tally {
    let mut tally = Tally::default();
    node.args(["--test", "--test-concurrency=1", "--test-reporter=tap", folder]);
    let ended = process::run(node, |line| match line.split_once("ok ") {
        Some(("", _)) => tally.passed += 1,
        Some(("not ", name)) => {
            tally.failed += 1;
            say(format_args!("not ok {name}"));
        }
        _ if tally.failed > 0 && !line.starts_with('#') => say(line),
        _ => {}
    });
    match ended {
        Err(error) => Tally::failed(error),
        Ok(false) if tally.failed == 0 => Tally::failed("node --test failed"),
        Ok(_) if tally.passed + tally.failed == 0 => Tally::failed("no test was found"),
        Ok(_) => tally,
    }
}
