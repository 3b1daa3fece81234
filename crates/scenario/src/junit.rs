//! Outcomes in JUnit's XML, which build servers read: a test suite for each scenario, a test case for each row; of a sweep a test case
//! for each run.

use std::fmt::{self, Write};

use words::escaped;

use super::outcome::{Outcome, Row, Verdict};
use super::sweep::results::RunResult;

/// A file of test suites: of each scenario the outcome of its run under its title, or under its name why it could not be run.
pub fn junit<'a>(scenarios: impl IntoIterator<Item = (impl AsRef<str>, Result<&'a Outcome, String>)>) -> String {
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n");
    for (name, outcome) in scenarios {
        // Writing into a text does not fail.
        let _ = match outcome {
            Ok(outcome) => suite(&mut xml, outcome),
            Err(reason) => broken_suite(&mut xml, name.as_ref(), &reason),
        };
    }
    xml.push_str("</testsuites>\n");
    xml
}

impl Outcome {
    /// As a test suite in JUnit's XML, which build servers read: a test case for each row.
    pub fn to_junit(&self) -> String {
        junit([(&self.title, Ok(self))])
    }
}

fn suite(xml: &mut String, outcome: &Outcome) -> fmt::Result {
    let count = |verdict| outcome.rows.iter().filter(|row| row.verdict == verdict).count();
    let (failed, skipped) = (count(Verdict::Failed), count(Verdict::Skipped));
    let title = escaped(&outcome.title);
    let (tests, time) = (outcome.rows.len(), outcome.end);
    writeln!(
        xml,
        "  <testsuite name=\"{title}\" tests=\"{tests}\" failures=\"{failed}\" skipped=\"{skipped}\" time=\"{time}\">"
    )?;
    outcome.rows.iter().try_for_each(|row| case(xml, &title, row, outcome))?;
    if !outcome.last_frames.is_empty() {
        writeln!(xml, "    <system-out>{}</system-out>", escaped(&outcome.last_frames.join("\n")))?;
    }
    writeln!(xml, "  </testsuite>")
}

fn case(xml: &mut String, title: &str, row: &Row, outcome: &Outcome) -> fmt::Result {
    let name = escaped(&format!("line {}: {} {}", row.place, row.kind.word(), row.asked));
    let time = row.at.unwrap_or(outcome.end);
    write!(xml, "    <testcase classname=\"{title}\" name=\"{name}\" time=\"{time}\"")?;
    let seen = escaped(&row.seen);
    match row.verdict {
        Verdict::Passed => writeln!(xml, "/>"),
        Verdict::Failed => writeln!(xml, "><failure message=\"{seen}\"/></testcase>"),
        Verdict::Skipped => writeln!(xml, "><skipped message=\"{seen}\"/></testcase>"),
    }
}

/// The suite of a sweep, of its test cases, some of which failed.
pub(crate) fn suite_of_runs(title: &str, (runs, failed): (u64, u64), cases: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n  <testsuite name=\"{}\" tests=\"{runs}\" failures=\"{failed}\" \
         skipped=\"0\">\n{cases}  </testsuite>\n</testsuites>\n",
        escaped(title)
    )
}

/// A run of a sweep: the options that repeat it, and what was asked first that was not so.
pub(crate) fn case_of_run(title: &str, options: &str, result: &RunResult) -> String {
    let time = result.end_s.unwrap_or_default();
    let case = format!("    <testcase classname=\"{}\" name=\"{}\" time=\"{time}\"", escaped(title), escaped(options));
    if result.passed {
        return format!("{case}/>\n");
    }
    let [asked, seen] = [&result.asked, &result.seen].map(|text| escaped(text.as_deref().unwrap_or_default()));
    format!("{case}><failure message=\"{asked}: {seen}\"/></testcase>\n")
}

/// A scenario that could not be run: one test case with an error.
fn broken_suite(xml: &mut String, name: &str, reason: &str) -> fmt::Result {
    let (name, reason) = (escaped(name), escaped(reason));
    writeln!(
        xml,
        "  <testsuite name=\"{name}\" tests=\"1\" failures=\"0\" errors=\"1\" skipped=\"0\" time=\"0\">\n    \
         <testcase classname=\"{name}\" name=\"the file\" time=\"0\"><error message=\"{reason}\"/></testcase>\n  </testsuite>"
    )
}
