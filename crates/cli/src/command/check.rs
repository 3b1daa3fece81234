//! `ferrodrive check`: what goes wrong with a described bus, before it is started.

use std::path::{Path, PathBuf};

use serde::Serialize;
use testbench::check::{self, CheckedNode, Finding, Severity};
use testbench::document::read_text;
use testbench::machine_file;

use crate::failure::{Failure, FailureBody};
use crate::output::Report;
use crate::paint::Paint;
use crate::plain::plain;
use crate::table::Table;

/// Check the description of a bus: a bus.yml of ros2_canopen with its data sheets, or a machine file
///
/// Nothing is sent. A bus.yml (also what Lely's dcfgen reads) is held against its EDS files and against what is known of the drives that
/// they describe: node-IDs, heartbeats, boot times, PDOs, drivers. A machine file is read and its machine built. Ends with status 1 if
/// there is an error, with --strict also for a warning.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive check config/bus.yml\n  \
    ferrodrive check machine.toml\n  \
    ferrodrive --json check bus.yml")]
pub(crate) struct Check {
    /// NAME.yml, NAME.yaml or NAME.toml
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Fail for warnings too
    #[arg(long)]
    strict: bool,
}

/// What was found.
#[derive(Debug, Serialize)]
pub(crate) struct CheckReport {
    /// False if the command fails.
    ok: bool,
    /// Why the command fails, if it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<FailureBody>,
    file: String,
    nodes: Vec<CheckedNode>,
    errors: usize,
    warnings: usize,
    notes: usize,
    findings: Vec<Finding>,
}

impl Check {
    /// Looks into the file.
    pub(crate) fn run(&self) -> Result<CheckReport, Failure> {
        let file = self.file.display().to_string();
        let ending = self.file.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        let (nodes, findings) = match ending {
            "yml" | "yaml" => self.bus_yml(&file)?,
            "toml" => (self.machine(&file)?, Vec::new()),
            _ => {
                return Err(Failure::usage(format!("'{}' is neither NAME.yml nor NAME.toml", plain(&file)))
                    .because("the ending tells what it is: a bus.yml of ros2_canopen, or a machine file")
                    .next("ferrodrive eds lint FILE checks a data sheet"));
            }
        };
        let count = |severity| findings.iter().filter(|finding: &&Finding| finding.severity == severity).count();
        let (errors, warnings, notes) = (count(Severity::Error), count(Severity::Warning), count(Severity::Note));
        let mut report = CheckReport { ok: true, error: None, file, nodes, errors, warnings, notes, findings };
        let failure = report.failure(self.strict);
        report.ok = failure.is_none();
        report.error = failure.as_ref().map(FailureBody::from);
        Ok(report)
    }

    /// Whether the command is to fail for warnings.
    pub(crate) const fn strict(&self) -> bool {
        self.strict
    }

    fn bus_yml(&self, file: &str) -> Result<(Vec<CheckedNode>, Vec<Finding>), Failure> {
        let unread = |reason| Failure::new(format!("cannot read {}", plain(file))).of_kind("file").because(reason);
        let text = read_text(&self.file).map_err(unread)?;
        let folder = self.file.parent().unwrap_or(Path::new(""));
        let checked = check::of_bus_yml(&text, folder).map_err(|bad| {
            Failure::usage(format!("cannot use {}", plain(file)))
                .because(plain(&bad.named(file).to_string()))
                .next("docs/handbook/ros2-canopen.md has a bus.yml that boots")
        })?;
        Ok((checked.nodes, checked.findings))
    }

    /// The drives of a machine file, which are built and thrown away.
    fn machine(&self, file: &str) -> Result<Vec<CheckedNode>, Failure> {
        let unusable = |reason: String| {
            Failure::usage(format!("cannot use {}", plain(file)))
                .because(plain(&reason))
                .next("docs/machine-file.md describes each key")
        };
        let machine = machine_file::machine(&self.file.to_string_lossy()).map_err(unusable)?;
        machine.build().map_err(|bad| unusable(bad.to_string()))?;
        let row = |(node, model): (canopen::NodeId, &devices::Description)| CheckedNode {
            name: model.name.to_owned(),
            node: Some(node.raw()),
            device: Some(model.title.to_owned()),
        };
        Ok(machine.models().map(row).collect())
    }
}

impl CheckReport {
    /// Why the command fails, if it does.
    pub(crate) fn failure(&self, strict: bool) -> Option<Failure> {
        let bad = self.errors + if strict { self.warnings } else { 0 };
        let what = format!("{}: {bad} of {} findings have to be mended", plain(&self.file), self.findings.len());
        (bad > 0).then(|| Failure::new(what).of_kind("check").next("each line above says what to do"))
    }
}

impl Report for CheckReport {
    fn text(&self, paint: Paint) -> String {
        let mut nodes = Table::new(&["node", "name", "device"]);
        for row in &self.nodes {
            let node = row.node.map_or_else(|| "-".to_owned(), |node| node.to_string());
            nodes.row([node, plain(&row.name), row.device.as_deref().map_or_else(|| "-".to_owned(), plain)]);
        }
        let mut text = nodes.plain(paint);
        for finding in &self.findings {
            let word = finding.severity.word();
            let word = match finding.severity {
                Severity::Error => paint.bad(word),
                Severity::Warning => paint.strong(word),
                Severity::Note => word.to_owned(),
            };
            let (place, what, next) = (finding.at, plain(&finding.what), plain(&finding.next));
            let node = finding.node.map(|node| format!("node {node}: ")).unwrap_or_default();
            text += &format!(
                "\n{}:{}:{}: {word}: {node}{what} [{}]\n  next: {next}",
                plain(&self.file),
                place.line,
                place.column,
                finding.rule
            );
        }
        let counts = format!("{} errors, {} warnings, {} notes", self.errors, self.warnings, self.notes);
        let counts = if self.errors > 0 { paint.bad(&counts) } else { paint.good(&counts) };
        format!("{text}\n{counts}")
    }
}
