//! The report about a node for Python: what `ferrodrive report` writes, as a page and as values.

use std::path::{Path, PathBuf};

use host::network::report::{Made, NodeReport, ReportedCapture, Tuning};
use pyo3::prelude::*;
use recording::{Kind, read};
use words::document::read_bytes;
use words::failure::Failure;

use super::value::Value;
use super::whole::AskedDrive;
use super::{Job, Network};

/// The largest record that is read.
const LARGEST: u64 = 1 << 30;

/// Reads what is worth keeping about a node: the report, and its page as HTML.
#[pyfunction]
pub(crate) fn report(
    py: Python<'_>,
    network: &Bound<'_, Network>,
    node: u8,
    model: Option<&str>,
    made: (String, Option<String>, String),
    captures: Vec<PathBuf>,
    tunings: Vec<String>,
) -> PyResult<Job> {
    let (at, by, bus) = made;
    let asked = AskedDrive::of(network.get(), node, model)?;
    network.get().begin_said(py, async move {
        let of_records: Result<Vec<_>, _> = captures.iter().map(|path| capture(path, &asked)).collect();
        let of_records = of_records?;
        let tunings: Result<Vec<_>, _> = tunings.iter().map(|text| tuning(text, &asked)).collect();
        let tunings = tunings?;
        let drive = asked.drive().await?;
        let mut report = NodeReport::read(&(), &drive, Made { at, by, bus }).await?;
        (report.captures, report.tunings) = (of_records, tunings);
        Ok(Value::List(vec![Value::report(&report), Value::Text(report.to_html())]))
    })
}

/// What a record has of the node.
fn capture(path: &Path, asked: &AskedDrive) -> Result<ReportedCapture, Failure> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let refused = |reason: String| {
        Failure::bad_file(format!("{} is not a record of node {}", path.display(), asked.node))
            .because(reason)
            .next("give a record of this node, NAME.mcap or NAME.csv, or omit it")
    };
    let kind = Kind::of_name(&name).ok_or_else(|| refused("its name ends in neither .mcap nor .csv".to_owned()))?;
    let recorded = read_bytes(path, LARGEST).and_then(|bytes| read(kind, &bytes)).map_err(refused)?;
    ReportedCapture::of_record(name, recorded, asked.node).map_err(refused)
}

/// What a tuning of the node has given.
fn tuning(text: &str, asked: &AskedDrive) -> Result<Tuning, Failure> {
    Tuning::of_json(text, asked.node).map_err(|reason| {
        Failure::bad_file(format!("a tuning is not one of node {}", asked.node))
            .because(reason)
            .next("give what Drive.tune of this node has returned")
    })
}
