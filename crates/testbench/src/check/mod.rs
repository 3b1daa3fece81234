//! A description of a bus, held against what its data sheets and the known models say, before anything is started.
//!
//! [`of_bus_yml`] reads the `bus.yml` of ros2_canopen; what goes wrong with such a bus is a table of rules.

mod bus_yml;
mod device;
mod finding;
mod traps;
mod yaml;

use std::path::Path;

use serde::Serialize;

pub use finding::{Finding, Findings, Place, Severity};

use crate::document::BadFile;
use finding::Reporter;
use traps::Case;

/// A node of the bus, as it was understood.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CheckedNode {
    /// Its name in the file.
    pub name: String,
    /// Its node-ID.
    pub node: Option<u8>,
    /// What its data sheet describes: a model that is known, or the sheet's own name.
    pub device: Option<String>,
}

/// A bus and what was found in it.
#[derive(Clone, Debug)]
pub struct Checked {
    /// The nodes, in the order of the file.
    pub nodes: Vec<CheckedNode>,
    /// What was found, by line.
    pub findings: Vec<Finding>,
}

impl Checked {
    /// How many findings are that bad.
    pub fn count(&self, severity: Severity) -> usize {
        self.findings.iter().filter(|finding| finding.severity == severity).count()
    }
}

/// Checks the text of a `bus.yml` whose data sheets are in `folder`.
///
/// # Errors
/// It is no YAML.
pub fn of_bus_yml(text: &str, folder: &Path) -> Result<Checked, BadFile> {
    yaml::with_document(text, |document| {
        let mut found = Findings::default();
        let mut report = Reporter { found: &mut found, rule: "shape", node: None };
        let mut nodes = Vec::new();
        if let Some(bus) = bus_yml::read(&document, folder, &mut report) {
            traps::of_bus(&bus, &mut report);
            for slave in &bus.nodes {
                report.node = slave.node();
                let sheet = slave.dcf.as_ref();
                let device = sheet.and_then(|dcf| device::read(&dcf.value, dcf.at, &mut report));
                let case = Case { bus: &bus, slave, device: device.as_ref() };
                for (rule, check) in traps::RULES {
                    report.rule = rule;
                    check(&case, &mut report);
                }
                let node = slave.node().map(canopen::NodeId::raw);
                nodes.push(CheckedNode { name: slave.name.clone(), node, device: device.map(|device| device.title()) });
            }
        }
        Checked { nodes, findings: found.into_sorted() }
    })
}
