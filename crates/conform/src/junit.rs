//! A report as JUnit XML, which build servers read.

use std::fmt::Write;

use plot::escaped;

use crate::report::{Outcome, Report};

/// The report in the form of JUnit: a test case each; those that do not apply, and departures that the manual states, are
/// skipped with the reason.
pub fn junit(report: &Report) -> String {
    let summary = report.summary;
    let skipped = summary.expected + summary.not_applicable + summary.not_run;
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let name = escaped(&format!("conformance of node {} ({})", report.node, report.model));
    let _ = writeln!(
        out,
        "<testsuite name=\"{name}\" tests=\"{}\" failures=\"{}\" errors=\"0\" skipped=\"{skipped}\">",
        report.cases.len(),
        summary.fail
    );
    for case in &report.cases {
        let (id, title, clause) = (escaped(case.id), escaped(case.title), escaped(case.clause));
        let why = escaped(&case.why);
        let _ = write!(out, "  <testcase classname=\"{clause}\" name=\"{id} {title}\">");
        match case.result {
            Outcome::Pass => {}
            Outcome::Fail => {
                let frames = escaped(&case.frames.join("\n"));
                let _ = write!(out, "<failure message=\"{why}\">{frames}</failure>");
            }
            Outcome::Expected => {
                let _ = write!(out, "<skipped message=\"expected: {why}\"/>");
            }
            Outcome::NotApplicable | Outcome::NotRun => {
                let _ = write!(out, "<skipped message=\"{why}\"/>");
            }
        }
        out.push_str("</testcase>\n");
    }
    out.push_str("</testsuite>\n");
    out
}
