//! A description of a bus, held against what its data sheets and the known models say, before anything is started.
//!
//! [`of_bus_yml`] reads the `bus.yml` of ros2_canopen; what goes wrong with such a bus is a table of rules. [`of_machine`]
//! takes a machine file. [`Checked::predict`] then boots the bus that is meant, with virtual drives of its models in virtual time, and
//! [`Checked::ask`] holds it against the drives of a live one.

mod base;
mod bus_yml;
mod device;
mod finding;
mod generated;
mod groups;
mod intended;
mod joints;
mod live;
mod machine;
mod predict;
mod traps;
mod yaml;

use std::path::Path;

use canopen::NodeId;
use master::{Network, Node};
use serde::Serialize;
use sim::World;

pub use finding::{Finding, Findings, Place, Severity};
pub use generated::Planned;
pub use intended::{Intended, IntendedNode, MovedAt};
pub use live::{LiveDeviation, LiveNode};
pub use machine::of_machine;
pub use predict::{PredictedFrame, PredictedNode, Prediction};

use crate::file::Machine;
use finding::Reporter;
use traps::Case;
use words::document::BadFile;

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
    /// The bus that is meant, or why none can be made of the file.
    pub intended: Result<Intended, String>,
    /// The machine, where the file is one of it: with what is around its drives.
    machine: Option<Machine>,
}

impl Checked {
    /// How many findings are that bad.
    pub fn count(&self, severity: Severity) -> usize {
        self.findings.iter().filter(|finding| finding.severity == severity).count()
    }

    /// Boots the bus that is meant, in virtual time, and adds what goes wrong to the findings; `None` where none can be made of the
    /// file, or its drives cannot be had, which is a finding too.
    pub fn predict(&mut self) -> Option<Prediction> {
        let mut found = Findings::of(std::mem::take(&mut self.findings));
        let mut report = Reporter { found: &mut found, rule: "prediction", node: None };
        let predicted = match &self.intended {
            Ok(intended) => self
                .world(intended)
                .and_then(|world| predict::predict(intended, self.machine.as_ref(), world, &mut report))
                .map_err(|why| (intended.at, why)),
            Err(why) => Err((Place { line: 1, column: 1 }, why.clone())),
        };
        // For a file without a node that is reported already.
        if let Some((at, why)) = predicted.as_ref().err().filter(|_| !self.nodes.is_empty()) {
            report.rule = "prediction";
            let next = "fix the findings above; then the boot-up is predicted";
            report.say(Severity::Note, *at, format!("the boot-up of this bus cannot be predicted: {why}"), next);
        }
        self.findings = found.into_sorted();
        predicted.ok()
    }
}

impl Checked {
    /// Asks the drives of a live bus who they are and what they have, and adds what differs to the findings. Reads only. `node_of`
    /// gives a node with the caller's patience for answers. Nothing where no bus can be made of the file.
    pub async fn ask(&mut self, network: &Network, node_of: impl Fn(NodeId) -> Node) -> Vec<LiveNode> {
        let Ok(intended) = &self.intended else { return Vec::new() };
        let mut found = Findings::of(std::mem::take(&mut self.findings));
        let mut report = Reporter { found: &mut found, rule: "live", node: None };
        let live = live::ask(intended, network, node_of, &mut report).await;
        self.findings = found.into_sorted();
        live
    }

    /// The bus that is meant, without its master.
    fn world(&self, intended: &Intended) -> Result<World, String> {
        match &self.machine {
            Some(machine) => machine.build().map_err(|bad| bad.to_string()),
            None => predict::world(intended),
        }
    }
}

/// Checks the text of a `bus.yml` whose data sheets are in `folder`.
///
/// # Errors
/// It is not YAML.
pub fn of_bus_yml(text: &str, folder: &Path) -> Result<Checked, BadFile> {
    yaml::with_document(text, |document| {
        let mut found = Findings::default();
        let mut report = Reporter { found: &mut found, rule: "shape", node: None };
        let mut nodes = Vec::new();
        let mut intended = Err("it describes no bus".to_owned());
        if let Some(bus) = bus_yml::read(&document, folder, &mut report) {
            traps::of_bus(&bus, &mut report);
            let mut devices = Vec::new();
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
                let title = device.as_ref().map(device::Device::title);
                nodes.push(CheckedNode { name: slave.name.clone(), node, device: title });
                devices.push(device);
            }
            intended = intended::of_bus_yml(&bus, &devices);
        }
        Checked { nodes, findings: found.into_sorted(), intended, machine: None }
    })
}
