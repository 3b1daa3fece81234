//! What the studio's page computes and says, by node, and its types, by the TypeScript compiler: what needs no browser.

use std::process::Command;

use crate::debian;
use crate::npm;
use crate::process;
use crate::say::say;
use crate::tally::Tally;
use crate::workspace;

/// What runs JavaScript, with the package of Debian that it is in.
const PROGRAMS: &[(&str, &str)] = &[("node", "nodejs")];

/// What checks the types of the page, which `jsconfig.json` switches on.
pub(crate) const TYPESCRIPT: (&str, &str, &str) = ("typescript", "5.9.3", "bin/tsc");

pub(crate) fn step() -> Tally {
    if let Err(reason) = debian::install(PROGRAMS) {
        return Tally::skipped(reason);
    }
    with_types(tests(Command::new("node").current_dir(workspace::root().join("crates/studio")), "page_tests/"))
}

/// Runs the tests of a folder by `node`, one file after the other.
pub(crate) fn tests(node: &mut Command, folder: &str) -> Tally {
    let mut tally = Tally::default();
    node.args(["--test", "--test-concurrency=1", "--test-reporter=tap", folder]);
    let ended = process::run(node, |line| match line.split_once("ok ") {
        Some(("", test)) if test.contains(" # SKIP") => {
            tally.skipped += 1;
            say(test);
        }
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
        Ok(_) if tally.passed + tally.failed + tally.skipped == 0 => Tally::failed("no test was found"),
        Ok(_) => tally,
    }
}

/// The same and the types.
fn with_types(tally: Tally) -> Tally {
    let compiler = match npm::install(TYPESCRIPT.0, TYPESCRIPT.1, TYPESCRIPT.2) {
        Ok(compiler) => compiler,
        Err(reason) if tally.failed == 0 => return Tally { skipped: tally.skipped + 1, note: reason, ..tally },
        Err(_) => return tally,
    };
    let mut node = Command::new("node");
    node.current_dir(workspace::root().join("crates/studio")).arg(compiler).args(["-p", "jsconfig.json"]);
    match process::run(&mut node, |line| say(line)) {
        Ok(true) => Tally { passed: tally.passed + 1, ..tally },
        Ok(false) => Tally { failed: tally.failed + 1, note: "types of the page".into(), ..tally },
        Err(error) => Tally::failed(error),
    }
}
