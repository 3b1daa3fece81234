//! `ferrodrive eds lint`: what is wrong with a file, line by line.

use std::path::{Path, PathBuf};

use eds::{Explanation, Finding, Rule, Severity};
use serde::Serialize;

use super::source;
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;
use plot::Table;
use words::counted;

/// The column of severities.
const SEVERITY: usize = 2;

/// Check EDS and DCF files: report errors with their lines, and what is used instead
///
/// Errors are what had to be guessed or left out, and what strict tools refuse; warnings can still be read.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  ferrodrive eds lint vendor.eds\n  ferrodrive eds lint left.dcf right.dcf --strict\n  \
    ferrodrive eds lint --list --json\n  ferrodrive eds lint --explain EDS216"
)]
pub(crate) struct Lint {
    /// EDS or DCF files
    #[arg(required_unless_present_any = ["list", "explain"], value_name = "FILE")]
    files: Vec<PathBuf>,
    /// List the rules
    #[arg(long, conflicts_with = "files")]
    list: bool,
    /// Explain a rule: why it matters, wrong lines and right ones
    #[arg(long, value_name = "RULE", value_parser = rule, conflicts_with_all = ["files", "list"])]
    explain: Option<Rule>,
    /// Fail on warnings too
    #[arg(long)]
    pub(super) strict: bool,
}

/// What was found.
#[derive(Debug, Serialize)]
pub(crate) struct LintReport {
    /// False if the command fails.
    ok: bool,
    files: Vec<OfFile>,
}

#[derive(Debug, Serialize)]
struct OfFile {
    file: String,
    /// Why it is not read at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<RefusedFile>,
    /// The same, where the file itself cannot be read.
    #[serde(skip)]
    unread: Option<Failure>,
    objects: usize,
    values: usize,
    errors: usize,
    warnings: usize,
    /// Counted, not listed.
    beyond: u32,
    findings: Vec<FindingRow>,
}

#[derive(Debug, Serialize)]
struct RefusedFile {
    message: String,
    next: String,
}

#[derive(Debug, Serialize)]
struct FindingRow {
    /// 0 for the file as a whole.
    line: u32,
    section: String,
    key: Option<String>,
    rule: &'static str,
    severity: &'static str,
    what: String,
    taken_instead: Option<String>,
}

fn rule(text: &str) -> Result<Rule, String> {
    Rule::of(text).ok_or_else(|| "expected a rule such as EDS216; `ferrodrive eds lint --list` has them".into())
}

impl Lint {
    /// The rules that are asked for, if it is not files that are.
    pub(super) fn rules(&self) -> Option<RuleList> {
        let asked = self.explain.as_ref().map(std::slice::from_ref).or_else(|| self.list.then_some(Rule::ALL))?;
        let rules = asked.iter().map(|rule| RuleRow::of(rule.explanation())).collect();
        Some(RuleList { rules, in_full: self.explain.is_some() })
    }

    /// Looks into all files.
    pub(super) fn run(&self) -> LintReport {
        let mut report = LintReport { ok: true, files: self.files.iter().map(|path| OfFile::of(path)).collect() };
        report.ok = report.failure(self.strict).is_none();
        report
    }
}

impl LintReport {
    /// Why the command fails, if it does: that a file cannot be read weighs more than what is wrong in the others.
    pub(super) fn failure(&self, strict: bool) -> Option<Failure> {
        let bad = |file: &&OfFile| file.refused.is_some() || file.errors > 0 || (strict && file.warnings > 0);
        let count = self.files.iter().filter(bad).count();
        let of = self.files.len();
        let what = if strict { "errors or warnings" } else { "errors" };
        let failure = Failure::new(format!("{count} of {} with {what}", counted(of, "file")));
        let next = "correct the lines listed above; CiA 306 defines the format";
        // Of a file that cannot be read there is no line to correct.
        let refused = self.files.iter().filter(|file| file.refused.is_some()).count();
        let next = match refused {
            all if all == count => "see why beside the file's name: give an EDS or DCF file (CiA 306)",
            _ => next,
        };
        (count > 0).then(|| match self.files.iter().find_map(|file| file.unread.as_ref()) {
            None => failure.of_kind("lint").next(next),
            Some(unread) => {
                let because = unread.because.iter().fold(failure.because(&unread.what), Failure::because);
                unread.next.iter().fold(because.of_kind("bad_file"), Failure::next)
            }
        })
    }
}

impl OfFile {
    fn of(path: &Path) -> Self {
        let empty = Self {
            file: path.display().to_string(),
            refused: None,
            unread: None,
            objects: 0,
            values: 0,
            errors: 0,
            warnings: 0,
            beyond: 0,
            findings: Vec::new(),
        };
        match source::reading(path) {
            Ok(reading) => Self {
                objects: reading.eds.objects.len(),
                values: reading.eds.variables().count(),
                errors: reading.findings.count(Severity::Error),
                warnings: reading.findings.count(Severity::Warning),
                beyond: reading.findings.beyond(),
                findings: reading.findings.iter().map(FindingRow::of).collect(),
                ..empty
            },
            Err(failure) => {
                let message = format!("{}: {}", failure.what, failure.because.join("; "));
                let refused = Some(RefusedFile { message, next: failure.next.join("; ") });
                Self { refused, unread: (failure.kind == "bad_file").then_some(failure), ..empty }
            }
        }
    }

    fn text(&self, paint: Paint) -> String {
        if let Some(refused) = &self.refused {
            return format!("{}\n  next: {}", paint.bad(&plain(&refused.message)), plain(&refused.next));
        }
        let counts = format!("{}, {}", counted(self.errors, "error"), counted(self.warnings, "warning"));
        let counts = match (self.errors, self.warnings) {
            (0, 0) => paint.good("no findings"),
            (0, _) => counts,
            _ => paint.bad(&counts),
        };
        let file = plain(&self.file);
        let head =
            format!("{file}: {} with {}; {counts}", counted(self.objects, "object"), counted(self.values, "value"));
        if self.findings.is_empty() {
            return head;
        }
        let mut table = Table::new(&["line", "rule", "severity", "section", "key", "what", "taken instead"]);
        for row in &self.findings {
            let line = if row.line > 0 { row.line.to_string() } else { String::new() };
            let texts = [&row.section, row.key.as_ref().unwrap_or(&String::new()), &row.what].map(|text| plain(text));
            let [section, key, what] = texts;
            let taken = row.taken_instead.as_deref().map(plain).unwrap_or_default();
            table.row([line, row.rule.to_owned(), row.severity.to_owned(), section, key, what, taken]);
        }
        let error = |_: usize, column: usize, cell: &str| {
            (column == SEVERITY && cell == Severity::Error.name()).then(|| paint.bad(cell))
        };
        let beyond = match self.beyond {
            0 => String::new(),
            more => format!("\nand {more} more"),
        };
        let more = format!("`ferrodrive eds lint --explain {}` explains a rule", self.findings[0].rule);
        format!("{head}\n\n{}{beyond}\n{more}", table.text(paint, error))
    }
}

impl FindingRow {
    fn of(finding: &Finding) -> Self {
        Self {
            line: finding.line,
            section: finding.section.clone(),
            key: finding.key.clone(),
            rule: finding.rule.id(),
            severity: finding.severity().name(),
            what: finding.what.clone(),
            taken_instead: finding.taken_instead.clone(),
        }
    }
}

impl Report for LintReport {
    fn text(&self, paint: Paint) -> String {
        self.files.iter().map(|file| file.text(paint)).collect::<Vec<_>>().join("\n\n")
    }
}

/// Rules, for people and programs.
#[derive(Debug, Serialize)]
pub(crate) struct RuleList {
    rules: Vec<RuleRow>,
    /// As text: all that is said, not a line each.
    #[serde(skip)]
    in_full: bool,
}

#[derive(Debug, Serialize)]
struct RuleRow {
    id: &'static str,
    severity: &'static str,
    title: &'static str,
    taken_instead: &'static str,
    clause: &'static str,
    why: &'static str,
    wrong: &'static str,
    right: &'static str,
}

impl RuleRow {
    fn of(rule: &Explanation) -> Self {
        let Explanation { id, severity, title, taken: taken_instead, clause, why, wrong, right } = *rule;
        Self { id, severity: severity.name(), title, taken_instead, clause, why, wrong, right }
    }

    fn text(&self, paint: Paint) -> String {
        let Self { id, severity, title, taken_instead, clause, why, wrong, right } = self;
        let lines = |text: &str| text.lines().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n");
        let (wrong, right) = (paint.bad(&lines(wrong)), paint.good(&lines(right)));
        format!(
            "{id} ({severity}): {title}\n{clause}\n\n{why}\nTaken instead: {taken_instead}.\n\nwrong:\n{wrong}\nright:\n{right}"
        )
    }
}

impl Report for RuleList {
    fn text(&self, paint: Paint) -> String {
        if self.in_full {
            return self.rules.iter().map(|rule| rule.text(paint)).collect::<Vec<_>>().join("\n\n");
        }
        let mut table = Table::new(&["rule", "finding", "severity", "taken instead"]);
        self.rules.iter().for_each(|rule| table.row([rule.id, rule.title, rule.severity, rule.taken_instead]));
        table.plain(paint)
    }
}
