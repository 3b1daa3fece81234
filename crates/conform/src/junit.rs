//! A report as JUnit XML, which build servers read.

use std::fmt::Write;

use crate::report::{Outcome, Report};

/// The report in the form of JUnit: a test case each; those that do not apply, and departures that the manual states, are
/// skipped with the reason.
pub fn junit(report: &Report) -> String {
    let summary = report.summary;
    let skipped = summary.expected + summary.not_applicable;
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
            Outcome::NotApplicable => {
                let _ = write!(out, "<skipped message=\"{why}\"/>");
            }
        }
        out.push_str("</testcase>\n");
    }
    out.push_str("</testsuite>\n");
    out
}

/// Text as it may stand in XML and HTML, in an attribute too.
pub(crate) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' => out.push('\n'),
            control if control.is_control() => out.push('?'),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    #[test]
    fn nothing_that_a_device_says_ends_an_element() {
        assert_eq!(super::escaped("a<b>&\"\u{1b}"), "a&lt;b&gt;&amp;&quot;?");
    }
}
