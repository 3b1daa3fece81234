//! `ferrodrive report`: what is worth keeping about a node, as one page.

use std::path::{Path, PathBuf};

use canopen::NodeId;
use host::network::report::{Made, NodeReport, ReportedCapture, Tuning};
use master::decode::Decoder;
use serde::Serialize;
use words::counted;
use words::document::read_bytes;
use words::node::node;

use crate::command::configure::dcf::{keep, new_file};
use crate::command::record_and_replay::plot::read_record;
use crate::context::Context;
use crate::failure::Failure;
use crate::frames::stamp::to_the_minute;
use crate::output::refuse_json_beside;
use plot::Paint;

/// The largest file of a tuning that is read: some tens of thousands of bytes are usual.
const LARGEST_TUNING: u64 = 16 << 20;

/// Write a report on a node: identity, differences from delivery, limits, faults, PDOs
///
/// The report is one page of HTML that needs nothing else, and prints on A4. The node is only read: nothing is written to
/// it, and it is not moved.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive report 4 -o wheel.html --by 'A. Fitter'\n  \
    ferrodrive --bus can0 report 4 -o w.html --capture run.mcap --tune tune.json")]
pub(crate) struct Report {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Write the page to this file, or with - to standard output
    #[arg(long, short, alias = "html", value_name = "FILE.html", value_parser = page_path)]
    output: PathBuf,
    /// Who makes the report
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
    /// Record of --record, `record` or `capture`, or a log of frames (candump, BLF, ..), whose curves and figures of this node belong to the report; may be repeated
    #[arg(long, value_name = "FILE")]
    capture: Vec<PathBuf>,
    /// What `tune NODE --json` has printed, whose gains and margins before and after belong to the report; may be repeated
    #[arg(long, value_name = "FILE.json")]
    tune: Vec<PathBuf>,
    /// Overwrite an existing file
    #[arg(long)]
    force: bool,
}

fn page_path(text: &str) -> Result<PathBuf, String> {
    if text == "-" || text.to_ascii_lowercase().ends_with(".html") {
        Ok(text.into())
    } else {
        Err("expected FILE.html, or - for standard output; --json prints the report for programs as well".into())
    }
}

/// What was written where, and what it says.
#[derive(Debug, Serialize)]
pub(crate) struct Written {
    file: String,
    #[serde(flatten)]
    report: NodeReport,
    /// The page, if it goes to standard output.
    #[serde(skip)]
    page: Option<String>,
}

impl Report {
    /// Reads the node and writes the page.
    pub(crate) async fn run(&self, context: &Context) -> Result<Written, Failure> {
        refuse_json_beside("a page", Some(&self.output), context.prints_json())?;
        // Before minutes are spent on the bus.
        let place = new_file(Some(&self.output), self.force)?;
        let captures = self
            .capture
            .iter()
            .map(|path| capture(path, self.node, context.decoder()))
            .collect::<Result<Vec<_>, _>>()?;
        let tunings = self.tune.iter().map(|path| tuning(path, self.node)).collect::<Result<Vec<_>, _>>()?;
        let made = Made { at: to_the_minute(), by: self.by.clone(), bus: context.bus().to_string() };
        let drive = context.known_drive(self.node).await?;
        let mut report = NodeReport::read(&context.progress, &drive, made).await?;
        (report.captures, report.tunings) = (captures, tunings);
        let page = report.to_html();
        let file = self.output.display().to_string();
        if let Some(path) = place {
            keep(path, page.as_bytes(), self.force)?;
            return Ok(Written { file, report, page: None });
        }
        Ok(Written { file, report, page: Some(page) })
    }
}

/// What a record has of a node.
fn capture(path: &Path, node: NodeId, decoder: Decoder) -> Result<ReportedCapture, Failure> {
    let recorded = read_record(path, decoder)?;
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    ReportedCapture::of_record(file, recorded, node).map_err(|reason| {
        Failure::bad_file(format!("the record {} has nothing of node {node}", path.display()))
            .because(reason)
            .next("give a record of this node, or omit it")
    })
}

/// What a tuning of a node has printed.
fn tuning(path: &Path, node: NodeId) -> Result<Tuning, Failure> {
    let text = read_bytes(path, LARGEST_TUNING).map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    text.and_then(|text| Tuning::of_json(&text, node)).map_err(|reason| {
        Failure::bad_file(format!("{} is not a tuning of node {node}", path.display()))
            .because(reason)
            .next(format!("make one: ferrodrive --json tune {node} > tune.json; or omit it"))
    })
}

impl crate::output::Report for Written {
    fn text(&self, paint: Paint) -> String {
        if let Some(page) = &self.page {
            return page.trim_end().to_owned();
        }
        let report = &self.report;
        let present = match (&report.fault, &report.fault_not_known) {
            (Some(fault), _) => paint.bad(&format!("fault present: {}", fault.text())),
            (None, None) => "no fault is present".to_owned(),
            (None, Some(why)) => format!("whether a fault is present is not known ({why})"),
        };
        let remembered = match (&report.remembered, &report.remembered_not_known) {
            (Some(errors), _) => format!("{} remembered", counted(errors.len(), "error")),
            (None, None) => "errors are not remembered (1003h does not exist)".to_owned(),
            (None, Some(why)) => format!("remembered errors are not known ({why})"),
        };
        let when = "when the program that moves it dies";
        let guard = match report.guard.stops {
            Some(true) => format!("{} {when}: {}", paint.good("stops"), report.guard.text),
            Some(false) => format!("{} {when}: {}", paint.bad("goes on"), report.guard.text),
            None => format!("what it does {when} is not known: {}", report.guard.text),
        };
        let cut = report.captures.iter().filter(|capture| capture.is_cut_off);
        let cut = cut.map(|capture| format!("{}: {}", capture.file, paint.bad("the end of this record is missing")));
        let lines = [
            format!("node {} ({}): {}", report.node, report.model, self.file),
            format!("{} of {} differ from delivery", report.differences.len(), counted(report.compared, "parameter")),
            format!("{present}, {remembered}"),
            guard,
        ];
        lines.into_iter().chain(cut).collect::<Vec<_>>().join("\n")
    }
}
