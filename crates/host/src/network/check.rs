//! What goes wrong with a described bus, as a report.

use std::path::Path;

use serde::Serialize;

use machine::check::{self, Checked, CheckedNode, Finding, LiveNode, Prediction, Severity};
use words::counted;
use words::document::{BadFile, read_text};
use words::failure::{Failure, FailureBody};
use words::plain;

/// What is wrong with a machine file, what is predicted of its bus, and how the nodes differ from it.
#[derive(Debug, Serialize)]
pub struct CheckReport {
    /// False if the command fails.
    pub ok: bool,
    /// Why the command fails, if it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<FailureBody>,
    /// The file.
    pub file: String,
    /// The nodes that it describes.
    pub nodes: Vec<CheckedNode>,
    /// How many findings are errors.
    pub errors: usize,
    /// How many are warnings.
    pub warnings: usize,
    /// How many are notes.
    pub notes: usize,
    /// What was found, by line.
    pub findings: Vec<Finding>,
    /// How the bus boots and what is sent then; `null` if the file does not say enough for that.
    pub predicted: Option<Prediction>,
    /// The drives that were asked; `null` if no bus was named.
    pub live: Option<Vec<LiveNode>>,
}

/// Reads a description of a bus, by its ending: a `bus.yml` of ros2_canopen, or a machine file.
///
/// # Errors
/// It is neither, or makes no sense.
pub fn read(path: &Path) -> Result<Checked, Failure> {
    let file = path.display().to_string();
    match path.extension().and_then(|ending| ending.to_str()).unwrap_or_default() {
        "yml" | "yaml" => read_as(path, check::of_bus_yml, "docs/handbook/ros2-canopen.md has a bus.yml that boots"),
        "toml" => read_as(path, check::of_machine, "docs/machine-file.md describes each key"),
        _ => Err(Failure::usage(format!("'{}' is neither NAME.yml nor NAME.toml", plain(&file)))
            .because("the extension decides what it is: a bus.yml of ros2_canopen, or a machine file")
            .next("ferrodrive eds lint FILE checks a data sheet")),
    }
}

fn read_as(
    path: &Path,
    of: fn(&str, &Path) -> Result<Checked, BadFile>,
    next: &'static str,
) -> Result<Checked, Failure> {
    let file = path.display().to_string();
    let unread = |reason| {
        Failure::bad_file(format!("cannot read {}", plain(&file)))
            .because(reason)
            .next("give the path of a bus.yml or of a machine file")
    };
    let text = read_text(path).map_err(unread)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    of(&text, folder).map_err(|bad| {
        let what = format!("cannot use {}", plain(&file));
        Failure::bad_file(what).because(plain(&bad.named(&file).to_string())).next(next)
    })
}

impl CheckReport {
    /// What was found in a file, how its bus boots, and who is on a real one; with `strict` warnings are as bad as errors.
    pub fn new(
        file: &Path,
        checked: Checked,
        predicted: Option<Prediction>,
        live: Option<Vec<LiveNode>>,
        strict: bool,
    ) -> Self {
        let file = file.display().to_string();
        let Checked { nodes, findings, .. } = checked;
        let count = |severity| findings.iter().filter(|finding: &&Finding| finding.severity == severity).count();
        let (errors, warnings, notes) = (count(Severity::Error), count(Severity::Warning), count(Severity::Note));
        let mut report =
            CheckReport { ok: true, error: None, file, nodes, errors, warnings, notes, findings, predicted, live };
        let failure = report.failure(strict);
        report.ok = failure.is_none();
        report.error = failure.as_ref().map(FailureBody::from);
        report
    }

    /// Why the command fails, if it does.
    pub fn failure(&self, strict: bool) -> Option<Failure> {
        let bad = self.errors + if strict { self.warnings } else { 0 };
        let what =
            format!("{}: {bad} of {} to be corrected", plain(&self.file), counted(self.findings.len(), "finding"));
        (bad > 0).then(|| Failure::new(what).of_kind("check").next("each line above says what to do"))
    }
}
