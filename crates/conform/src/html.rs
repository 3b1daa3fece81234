//! A report as one page that needs nothing else: to keep, to send, to print.

use std::fmt::Write;

use plot::escaped;

use crate::case::Group;
use crate::cases;
use crate::report::{CaseResult, Outcome, Report};

/// Under which circumstances a device was tested, for the page: a name and a value each, as "Date" and "2026-03-01 12:00 UTC".
pub type Circumstances<'a> = [(&'a str, String)];

/// The report as one self-contained page of HTML: no script, nothing that is loaded.
pub fn html(report: &Report, circumstances: &Circumstances<'_>) -> String {
    let mut out = String::new();
    head(&mut out, report, circumstances);
    for group in groups() {
        let of_group = |case: &&CaseResult| cases::all().any(|row| row.id == case.id && row.group() == group);
        let results: Vec<&CaseResult> = report.cases.iter().filter(of_group).collect();
        if !results.is_empty() {
            table(&mut out, group, &results);
        }
    }
    let _ = writeln!(
        out,
        "<footer>Made by ferrodrive conform {}. Case numbers up to 50 are those that CiA's conformance test prints; numbers from 51 on and 402 are the suite's own, and what OD 07 and OD 08 ask. This is a report of a test, not a certificate of CiA.</footer>",
        env!("CARGO_PKG_VERSION")
    );
    plot::html::page(&format!("CANopen conformance: {}, node {}", report.model, report.node), &out)
}

fn groups() -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for case in cases::all() {
        if !groups.contains(&case.group()) {
            groups.push(case.group());
        }
    }
    groups
}

fn head(out: &mut String, report: &Report, circumstances: &Circumstances<'_>) {
    let summary = report.summary;
    let verdict = match summary.fail {
        0 => "<span class=\"pass\">No case failed</span>".to_owned(),
        1 => "<span class=\"fail\">1 case failed</span>".to_owned(),
        many => format!("<span class=\"fail\">{many} cases failed</span>"),
    };
    let _ = write!(out, "<h1>{}</h1><p>CANopen conformance test: {verdict}</p>", escaped(&report.model));
    let names = ["Device type 1000h", "Vendor-ID", "Product code", "Revision", "Serial number"];
    let _ = write!(out, "<dl><dt>Node-ID</dt><dd>{}</dd>", report.node);
    for (name, number) in names.iter().zip(&report.identity) {
        let _ = write!(out, "<dt>{name}</dt><dd>{number:08X}h</dd>");
    }
    let _ = write!(out, "<dt>Judged by</dt><dd>{}</dd>", escaped(&report.source));
    for (name, value) in circumstances {
        let _ = write!(out, "<dt>{}</dt><dd>{}</dd>", escaped(name), escaped(value));
    }
    out.push_str("</dl><div class=\"sum\">");
    for (class, count, words) in [
        ("pass", summary.pass, "passed"),
        ("fail", summary.fail, "failed"),
        ("expected", summary.expected, "depart as the manual states"),
        ("na", summary.not_applicable, "do not apply"),
        ("na", summary.not_run, "were not run"),
    ] {
        let _ = write!(out, "<div class=\"{class}\"><b>{count}</b><span>{words}</span></div>");
    }
    out.push_str("</div>");
    if !report.not_restored.is_empty() {
        let _ = write!(out, "<p class=\"fail\">Not put back: {}</p>", escaped(&report.not_restored.join("; ")));
    }
}

fn table(out: &mut String, group: Group, results: &[&CaseResult]) {
    let title = group.title();
    let (first, rest) = title.split_at(1);
    let _ = write!(
        out,
        "<h2>{}{}</h2><table><tr><th>Case</th><th>Asked and seen</th><th>Clause</th><th>Result</th></tr>",
        first.to_uppercase(),
        escaped(rest)
    );
    for case in results {
        let (class, row) = match case.result {
            Outcome::Pass => ("pass", ""),
            Outcome::Fail => ("fail", " class=\"f\""),
            Outcome::Expected => ("expected", ""),
            Outcome::NotApplicable | Outcome::NotRun => ("na", ""),
        };
        let _ = write!(
            out,
            "<tr{row}><td class=\"id\">{}</td><td>{}<div class=\"why\">{}</div>",
            escaped(case.id),
            escaped(case.title),
            escaped(&case.why)
        );
        if !case.frames.is_empty() {
            // What failed is shown at once.
            let open = if case.result == Outcome::Fail { " open" } else { "" };
            let _ = write!(
                out,
                "<details{open}><summary>{} frames</summary><pre>{}</pre></details>",
                case.frames.len(),
                escaped(&case.frames.join("\n"))
            );
        }
        let _ = write!(
            out,
            "</td><td class=\"c\">{}</td><td class=\"r {class}\">{}</td></tr>",
            escaped(case.clause),
            case.result.word()
        );
    }
    out.push_str("</table>");
}
