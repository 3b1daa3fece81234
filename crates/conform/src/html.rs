//! A report as one page that needs nothing else: to keep, to send, to print.

use std::fmt::Write;

use plot::escaped;

use crate::case::Group;
use crate::cases;
use crate::report::{CaseResult, Outcome, Report};

const STYLE: &str = "
:root{--ink:#1d2430;--dim:#5d6675;--line:#dfe3ea;--pass:#1a7f4b;--fail:#c0272d;--expected:#96650a;--na:#6b7382}
*{box-sizing:border-box}body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);margin:0 auto;max-width:1080px;padding:32px 24px}
h1{font-size:26px;margin:0 0 4px}h2{font-size:17px;margin:32px 0 8px;border-bottom:2px solid var(--ink);padding-bottom:4px}
p{margin:6px 0;color:var(--dim)}dl{display:grid;grid-template-columns:max-content 1fr;gap:2px 16px;margin:16px 0}
dt{color:var(--dim)}dd{margin:0}.sum{display:flex;gap:12px;margin:20px 0;flex-wrap:wrap}
.sum div{flex:1;min-width:120px;border:1px solid var(--line);border-top:4px solid;border-radius:6px;padding:10px 14px}
.sum b{display:block;font-size:26px;line-height:1.2}
.pass{color:var(--pass)}.fail{color:var(--fail)}.expected{color:var(--expected)}.na{color:var(--na)}
.sum div span{color:var(--dim)}table{border-collapse:collapse;width:100%}
td,th{text-align:left;vertical-align:top;padding:6px 10px 6px 0;border-bottom:1px solid var(--line)}
th{font-weight:600;color:var(--dim);font-size:13px}td.id{white-space:nowrap;font-variant-numeric:tabular-nums}
td.r{white-space:nowrap;font-weight:600}td.c{white-space:nowrap;color:var(--dim);font-size:13px}
.why{color:var(--dim);font-size:13.5px;overflow-wrap:anywhere}details{margin-top:2px}summary{cursor:pointer;color:var(--dim);font-size:13px}
pre{font:12.5px/1.45 ui-monospace,monospace;background:#f5f7fa;border-radius:4px;padding:8px 10px;margin:4px 0;overflow-x:auto}
tr.f{background:#fdf3f3}footer{margin-top:32px;color:var(--dim);font-size:13px}
@media print{details>pre{display:block}body{padding:0}}";

/// The report as one self-contained page of HTML: no script, nothing that is loaded.
pub fn html(report: &Report) -> String {
    let mut out = String::from("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">");
    let title = escaped(&format!("CANopen conformance: {}, node {}", report.model, report.node));
    let _ = write!(
        out,
        "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>{title}</title><style>{STYLE}</style></head><body>"
    );
    head(&mut out, report);
    for group in groups() {
        let of_group = |case: &&CaseResult| cases::all().any(|row| row.id == case.id && row.group() == group);
        let results: Vec<&CaseResult> = report.cases.iter().filter(of_group).collect();
        if !results.is_empty() {
            table(&mut out, group, &results);
        }
    }
    let _ = writeln!(
        out,
        "<footer>Made by ferrodrive conform {}. Case numbers up to 50 are those that CiA's conformance test prints; numbers from 51 on and 402 are the suite's own. This is a report of a test, not a certificate of CiA.</footer></body></html>",
        env!("CARGO_PKG_VERSION")
    );
    out
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

fn head(out: &mut String, report: &Report) {
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
    let _ = write!(out, "<dt>Judged by</dt><dd>{}</dd></dl><div class=\"sum\">", escaped(&report.source));
    for (class, count, words) in [
        ("pass", summary.pass, "passed"),
        ("fail", summary.fail, "failed"),
        ("expected", summary.expected, "depart as the manual states"),
        ("na", summary.not_applicable, "do not apply"),
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
            Outcome::NotApplicable => ("na", ""),
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
