//! `ferrodrive conform`: the conformance suite against one node of a bus.

use std::path::{Path, PathBuf};

use canopen::{Mux, NodeId};
use conform::{Capture, Case, CaseResult, Options, Outcome, Subject, Suite, SuiteError, all, html, junit, selected};
use serde::Serialize;

use crate::context::{Context, Restorer};
use crate::failure::{Failure, refuse_missing_folder};
use crate::frames::stamp::to_the_minute;
use crate::global::Global;
use crate::output::{Format, Report, html_path, junit_path};
use crate::session;
use plot::{Paint, Table};
use words::models::{Description, is_from_file, resolve};
use words::node::node;

/// Test whether a node conforms to CiA 301, CiA 305 and CiA 402
///
/// Sends right and wrong requests and looks at the answers, case by case; docs/conformance.md lists the cases. A result is
/// pass, fail, expected (the maker's manual states the departure), not applicable (with the reason) or not run. The node is reset
/// several times. What is written is put back after each case, and the node is left in its NMT state, also when the
/// command is interrupted. No motor is energised without --allow-motion, and nothing is stored without --allow-store.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive conform 4\n  \
    ferrodrive conform 4 --only SDO,PDO --skip 'SDO 30'\n  \
    ferrodrive --bus can0 conform 5 --html report.html --junit report.xml\n  \
    ferrodrive conform --list")]
pub(crate) struct Conform {
    /// Node-ID
    #[arg(value_parser = node, required_unless_present = "list")]
    node: Option<NodeId>,
    /// EDS or DCF of the device (default: the model that its identity names)
    #[arg(long, value_name = "FILE.eds", value_parser = resolve)]
    eds: Option<&'static Description>,
    /// Run cases that energise the motor: a twentieth of a turn, or some seconds at 20 r/min of the drive's shaft
    #[arg(long)]
    allow_motion: bool,
    /// Run cases that store parameters in the device's memory; what it had is stored again
    #[arg(long)]
    allow_store: bool,
    /// Run only these cases or groups, e.g. 'SDO 07' or PDO; may be repeated
    #[arg(long, value_name = "CASES", value_delimiter = ',')]
    only: Vec<String>,
    /// Leave out these cases or groups; may be repeated
    #[arg(long, value_name = "CASES", value_delimiter = ',')]
    skip: Vec<String>,
    /// List the cases; no node is asked
    #[arg(long, conflicts_with_all = ["node", "allow_motion", "allow_store"])]
    list: bool,
    /// Also write the report as one page of HTML
    #[arg(long, value_name = "FILE.html", value_parser = html_path)]
    html: Option<PathBuf>,
    /// Also write the result as JUnit XML, as build servers read it
    #[arg(long, value_name = "FILE.xml", value_parser = junit_path)]
    junit: Option<PathBuf>,
}

impl Conform {
    /// Runs the suite and reports, or lists the cases.
    pub(crate) fn run(&self, global: &Global, format: Format) -> Result<(), Failure> {
        let cases = selected(&self.only, &self.skip).map_err(|error| bad_selection(&error))?;
        let Some(node) = self.node.filter(|_| !self.list) else {
            return format.print(&CaseList::of(&cases)).map_err(Failure::of_stdout);
        };
        for path in self.html.iter().chain(&self.junit) {
            refuse_missing_folder("the report", path)?;
        }
        let report = session::run(global, async |context| self.test(context, node).await)?;
        if let Some(path) = &self.html {
            write(path, &html(&report, &self.circumstances(global)))?;
        }
        if let Some(path) = &self.junit {
            write(path, &junit(&report))?;
        }
        let failure = failure(&report, node);
        format.print_judged(&ReportLine { report: &report }, failure)
    }

    /// What is asked of a page a year later.
    fn circumstances(&self, global: &Global) -> [(&'static str, String); 3] {
        let given =
            |option: &str, is_given: bool| format!("{option}: {}", if is_given { "given" } else { "not given" });
        let mut options = vec![given("--allow-motion", self.allow_motion), given("--allow-store", self.allow_store)];
        for (option, cases) in [("--only", &self.only), ("--skip", &self.skip)] {
            options.extend((!cases.is_empty()).then(|| format!("{option} {}", cases.join(","))));
        }
        [("Date", to_the_minute()), ("Bus", global.bus.to_string()), ("Options", options.join("; "))]
    }

    async fn test(&self, context: &Context, node: NodeId) -> Result<conform::Report, Failure> {
        let subject = self.subject(context, node).await?;
        if self.eds.is_some() {
            warn_of_another(context, subject).await;
        }
        let capture = Capture::new();
        context.traffic.hand_on(capture.clone());
        let options = Options {
            allow_motion: self.allow_motion,
            allow_store: self.allow_store,
            only: self.only.clone(),
            skip: self.skip.clone(),
            timeout: context.timeout(),
        };
        let suite = Suite::new(context.network.clone(), capture, subject, options);
        context.restore_at_end(Restorer::Conform(suite.restorer()));
        let progress = |at: conform::CaseProgress<'_>| {
            if at.result.is_none() {
                context.progress.count(format!("{} of {}: {} {}", at.number, at.of, at.case.id, at.case.title));
            }
        };
        suite.run(progress).await.map_err(|error| not_run(&error, node))
    }

    async fn subject(&self, context: &Context, node: NodeId) -> Result<Subject, Failure> {
        let description = match self.eds {
            Some(description) => description,
            None => match context.known_drive(node).await.map_err(with_sheet)?.description() {
                Some(description) => description,
                None => return Err(Failure::unknown_model(node)),
            },
        };
        Ok(if is_from_file(description) {
            Subject::of_file(node, description)
        } else {
            Subject::of_model(node, description)
        })
    }
}

/// Warns if the node says by 1018h that it is not the device of the file, before minutes are spent on it.
async fn warn_of_another(context: &Context, subject: Subject) {
    let (node, identity) = (context.node(subject.node), subject.description.identity);
    let numbers = [("vendor-ID", identity.vendor_id), ("product code", identity.product_code)];
    for (sub_index, (what, of_file)) in (1..).zip(numbers.into_iter().chain([("revision", identity.revision_number)])) {
        let object = Mux::new(0x1018, sub_index);
        if subject.description.row(object).is_none() {
            continue;
        }
        // A node that does not answer is reported by the suite.
        let Ok(says) = node.upload(object).await.map(|value| value.raw()) else { continue };
        if says != of_file {
            context.note(&format!(
                "node {} has {what} {says:08X}h, the file is of {of_file:08X}h (1018h:{sub_index:02X}): what follows is judged by the \
                 file of another device",
                subject.node
            ));
        }
    }
}

/// A device whose model is not known here has a sheet of its own.
fn with_sheet(failure: Failure) -> Failure {
    if failure.kind == "unknown_model" {
        failure.next("or give the EDS of the device: --eds FILE.eds")
    } else {
        failure
    }
}

fn bad_selection(error: &SuiteError) -> Failure {
    Failure::usage(error.to_string()).next("list the cases: ferrodrive conform --list")
}

fn not_run(error: &SuiteError, node: NodeId) -> Failure {
    let failure = Failure::new(format!("node {node}: {error}")).at_node(node);
    match error {
        SuiteError::Unknown(_) => bad_selection(error),
        SuiteError::NoAnswer(_) => {
            failure.of_kind("no_answer").next("check node-ID, bit rate and cable; `ferrodrive scan` shows who answers")
        }
        SuiteError::Enabled => failure.of_kind("at_work").next(format!("ferrodrive disable {node}")),
    }
}

fn failure(report: &conform::Report, node: NodeId) -> Option<Failure> {
    let failed: Vec<_> = report.failures().collect();
    if report.ok {
        return None;
    }
    let what = format!("node {node} does not conform: {} of {} cases failed", failed.len(), report.cases.len());
    let failure = Failure::new(what).of_kind("conformance").at_node(node);
    let failure =
        failed.iter().take(3).fold(failure, |failure, case| failure.because(format!("{}: {}", case.id, case.why)));
    let left = report.not_restored.iter();
    let failure = left.fold(failure, |failure, left| failure.because(format!("not put back: {left}")));
    Some(match failed.first() {
        Some(case) => {
            failure.next(format!("repeat one with its frames: ferrodrive conform {node} --only '{}' --json", case.id))
        }
        None => failure,
    })
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(|error| Failure::of_writing("the report", path, &error))
}

/// The cases, for people and programs.
#[derive(Serialize)]
struct CaseList {
    cases: Vec<CaseRow>,
}

#[derive(Serialize)]
struct CaseRow {
    id: &'static str,
    group: &'static str,
    title: &'static str,
    clause: &'static str,
}

impl CaseList {
    fn of(cases: &[&'static Case]) -> Self {
        let wanted = |case: &&Case| cases.iter().any(|wanted| wanted.id == case.id);
        let rows = all().filter(wanted).map(|case| CaseRow {
            id: case.id,
            group: case.group().prefix(),
            title: case.title,
            clause: case.clause,
        });
        Self { cases: rows.collect() }
    }
}

impl Report for CaseList {
    fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["case", "asked", "clause"]);
        for case in &self.cases {
            table.row([case.id, case.title, case.clause]);
        }
        format!("{}\n{} cases", table.plain(paint), self.cases.len())
    }
}

/// A report of the suite.
#[derive(Serialize)]
struct ReportLine<'a> {
    #[serde(flatten)]
    report: &'a conform::Report,
}

/// The column of results.
const RESULT: usize = 1;
/// So much of what was seen fits a line; `--json` has all.
const WIDEST: usize = 110;

impl Report for ReportLine<'_> {
    fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["case", "result", "asked", "seen"]);
        for case in &self.report.cases {
            table.row([case.id, case.result.word(), case.title, &seen(case)]);
        }
        let colour = |_, column, cell: &str| match (column, cell) {
            (RESULT, "pass") => Some(paint.good(cell)),
            (RESULT, "fail") => Some(paint.bad(cell)),
            (RESULT, "not applicable" | "not run") => Some(paint.dim(cell)),
            _ => None,
        };
        let mut lines =
            vec![paint.strong(&format!("node {}: {}", self.report.node, self.report.model)), table.text(paint, colour)];
        for case in self.report.failures() {
            lines.push(format!(
                "\n{} {}\n  {}\n  {}",
                paint.bad(case.id),
                case.clause,
                case.why,
                case.frames.join(" ")
            ));
        }
        let summary = self.report.summary;
        lines.push(format!(
            "{} passed, {} failed, {} expected by the manual, {} not applicable, {} not run",
            summary.pass, summary.fail, summary.expected, summary.not_applicable, summary.not_run
        ));
        lines.join("\n")
    }
}

fn seen(case: &CaseResult) -> String {
    let why = case.why.replace('\n', " ");
    match why.char_indices().nth(WIDEST) {
        Some((end, _)) if case.result != Outcome::Fail => format!("{}..", &why[..end]),
        _ => why,
    }
}
