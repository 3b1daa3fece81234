//! Reads what `cargo test` prints: counts its tests and passes on only what a person wants to see.

use std::process::Command;

use crate::process;
use crate::tally::Tally;

/// Runs a `cargo test` command and counts its tests. A run that ends badly without naming a failed test (it did not
/// compile, it crashed) counts as one failure.
pub(crate) fn run(command: &mut Command) -> Tally {
    let mut tally = Tally::default();
    let mut names = Vec::new();
    let ended_well = process::run(command, |line| {
        count(line, &mut tally);
        names.extend(failed_test(line));
        if worth_showing(line) {
            println!("{line}");
        }
    });
    match ended_well {
        Ok(true) => {}
        Ok(false) if tally.failed > 0 => tally.note = names.join(", "),
        Ok(false) => tally.add(&Tally::failed("cargo test ended badly: read the lines above")),
        Err(error) => tally.add(&Tally::failed(error)),
    }
    if tally == Tally::default() {
        tally = Tally::skipped("no tests");
    }
    tally
}

/// Adds a line such as `test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out`.
pub(crate) fn count(line: &str, tally: &mut Tally) {
    let Some(result) = line.strip_prefix("test result: ") else { return };
    for part in result.split(['.', ';']) {
        let mut words = part.split_whitespace();
        let (Some(number), Some(word)) = (words.next().and_then(|word| word.parse::<u32>().ok()), words.next()) else {
            continue;
        };
        match word {
            "passed" => tally.passed += number,
            "failed" => tally.failed += number,
            "ignored" => tally.skipped += number,
            _ => {}
        }
    }
}

pub(crate) fn failed_test(line: &str) -> Option<String> {
    let name = line.strip_prefix("test ")?.strip_suffix(" ... FAILED")?;
    Some(name.to_owned())
}

/// Passing tests and empty harnesses say nothing that the count does not say.
fn worth_showing(line: &str) -> bool {
    let passing = line.starts_with("test ") && line.ends_with(" ... ok");
    let frame = line.is_empty()
        || line.starts_with("running ")
        || line.starts_with("test result: ok. 0 passed; 0 failed; 0 ignored");
    !(passing || frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_of_several_harnesses_add_up() {
        let mut tally = Tally::default();
        count(
            "test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.01s",
            &mut tally,
        );
        count("test result: FAILED. 3 passed; 2 failed; 0 ignored; 0 measured; 4 filtered out", &mut tally);
        count("running 5 tests", &mut tally);
        assert_eq!((tally.passed, tally.failed, tally.skipped), (15, 2, 1));
    }

    #[test]
    fn a_failed_test_is_named() {
        assert_eq!(failed_test("test frame::a_law ... FAILED").as_deref(), Some("frame::a_law"));
        assert_eq!(failed_test("test frame::a_law ... ok"), None);
    }

    #[test]
    fn failures_and_their_output_are_shown() {
        assert!(!worth_showing("test frame::a_law ... ok"));
        assert!(worth_showing("test frame::a_law ... FAILED"));
        assert!(worth_showing("thread 'frame::a_law' panicked at src/frame.rs:1:1:"));
    }
}
