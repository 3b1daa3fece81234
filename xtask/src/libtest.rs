//! What programs with tests print: their tests are counted and timed, and only what a person wants to see is shown.

use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::process;
use crate::say::say;
use crate::tally::Tally;

/// Whether tests report how long they take (`--timings`).
static TIMED: AtomicBool = AtomicBool::new(false);

/// How many of the slowest are shown.
const SLOWEST: usize = 20;

/// A test, and how long it took in s.
pub(crate) type Timed = (f64, String);

/// From here on tests report how long they take.
pub(crate) fn time_all() {
    TIMED.store(true, Ordering::Relaxed);
}

/// Has a program report how long its tests take, if that is asked for. The harness of a stable compiler does so only with this
/// variable set.
pub(crate) fn tell_times(program: &mut Command) {
    if TIMED.load(Ordering::Relaxed) {
        program.env("RUSTC_BOOTSTRAP", "1").args(["-Z", "unstable-options", "--report-time"]);
    }
}

/// Shows those that took longest.
pub(crate) fn show_slowest(mut timed: Vec<Timed>) {
    timed.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    for (seconds, name) in timed.iter().take(SLOWEST) {
        say(format_args!("{seconds:7.2} s  {name}"));
    }
}

/// Runs a `cargo test` command and counts its tests.
pub(crate) fn run(command: &mut Command) -> Tally {
    let mut read = Reader::default();
    let ended = process::run(command, |line| read.line(line));
    read.end("cargo test", ended).0
}

/// Reads the lines of one or several programs.
#[derive(Debug, Default)]
pub(crate) struct Reader {
    tally: Tally,
    failed: Vec<String>,
    shown: Vec<String>,
    timed: Vec<Timed>,
}

impl Reader {
    pub(crate) fn line(&mut self, line: &str) {
        count(line, &mut self.tally);
        self.failed.extend(failed_test(line));
        self.timed.extend(time_of(line));
        if line.contains(" has been running for over ") {
            say(line);
        } else if worth_showing(line) {
            self.shown.push(line.to_owned());
        }
    }

    /// What was found, once the program has ended. One that ends badly without naming a failed test (it crashed, it did not
    /// compile) counts as one failure.
    pub(crate) fn end(mut self, name: &str, ended: Result<bool, String>) -> (Tally, Vec<Timed>) {
        match ended {
            Ok(true) => {}
            Ok(false) if self.tally.failed > 0 => {
                self.tally.note = self.failed.join(", ");
                self.tally.output = output_of_failed_tests(&self.shown);
            }
            Ok(false) => self.tally.add(&Tally::failed(format!("{name} ended badly: read the lines above"))),
            Err(error) => self.tally.add(&Tally::failed(error)),
        }
        self.shown.iter().for_each(say);
        (self.tally, self.timed)
    }
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

/// The name of a test that failed, from a line such as `test frame::a_law ... FAILED <0.1s>`.
pub(crate) fn failed_test(line: &str) -> Option<String> {
    let (name, outcome) = line.strip_prefix("test ")?.split_once(" ... ")?;
    outcome.starts_with("FAILED").then(|| name.to_owned())
}

/// Of the lines of a program, those between the heading of the first failed test and the list of their names; without the
/// frames of backtraces.
fn output_of_failed_tests(lines: &[String]) -> Vec<String> {
    let heading = |line: &&String| line.starts_with("---- ");
    let from_first = lines.iter().skip_while(|line| !heading(line)).take_while(|line| *line != "failures:");
    let is_frame = |line: &str| {
        let words = line.strip_prefix("  ").map(str::trim_start).unwrap_or_default();
        words.starts_with("at ") || words.split_once(": ").is_some_and(|(number, _)| number.parse::<u32>().is_ok())
    };
    from_first.filter(|line| !is_frame(line)).cloned().collect()
}

/// The time of a test, if reported: `test frame::a_law ... ok <0.123s>`.
fn time_of(line: &str) -> Option<Timed> {
    let (name, outcome) = line.strip_prefix("test ")?.split_once(" ... ")?;
    let (_, time) = outcome.strip_suffix("s>")?.split_once('<')?;
    Some((time.parse().ok()?, name.to_owned()))
}

/// Passing tests and harnesses in which all is well say nothing that the count does not say.
fn worth_showing(line: &str) -> bool {
    let passing = line.starts_with("test ") && (line.contains(" ... ok") || line.contains(" ... ignored"));
    let frame = line.is_empty() || line.starts_with("running ") || line.starts_with("test result: ok.");
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
    fn what_failed_tests_printed_is_kept_without_their_backtraces() {
        let printed = [
            "test a ... FAILED",
            "failures:",
            "---- a stdout ----",
            "thread 'a' panicked at src/a.rs:3:5:",
            "1: not 2",
            "stack backtrace:",
            "  17: tokio::runtime::block_on",
            "             at ./src/a.rs:3:5",
            "failures:",
            "    a",
            "test result: FAILED. 0 passed; 1 failed; 0 ignored",
        ];
        let mut read = Reader::default();
        printed.iter().for_each(|line| read.line(line));
        let (tally, _) = read.end("a", Ok(false));
        assert_eq!((tally.failed, tally.note.as_str()), (1, "a"));
        assert_eq!(
            tally.output,
            ["---- a stdout ----", "thread 'a' panicked at src/a.rs:3:5:", "1: not 2", "stack backtrace:"]
        );
    }

    #[test]
    fn a_failed_test_is_named_and_a_timed_one_has_its_time() {
        assert_eq!(failed_test("test frame::a_law ... FAILED").as_deref(), Some("frame::a_law"));
        assert_eq!(failed_test("test frame::a_law ... FAILED <0.100s>").as_deref(), Some("frame::a_law"));
        assert_eq!(failed_test("test frame::a_law ... ok"), None);
        assert_eq!(time_of("test frame::a_law ... ok <1.250s>"), Some((1.25, "frame::a_law".to_owned())));
        assert_eq!(time_of("test frame::a_law ... ok"), None);
    }

    #[test]
    fn failures_and_their_output_are_shown() {
        assert!(!worth_showing("test frame::a_law ... ok") && !worth_showing("test frame::a_law ... ok <0.1s>"));
        assert!(worth_showing("test frame::a_law ... FAILED"));
        assert!(worth_showing("thread 'frame::a_law' panicked at src/frame.rs:1:1:"));
    }

    #[test]
    fn a_program_that_dies_is_a_failure() {
        let mut read = Reader::default();
        read.line("test result: ok. 2 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out");
        let (tally, _) = read.end("it", Ok(false));
        assert_eq!((tally.passed, tally.failed), (2, 1));
    }
}
