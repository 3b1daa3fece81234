//! Nodes that were operational before and were left as they are (CiA 302-2, error status L), with another configuration than was
//! planned.
//!
//! The standard has a node that must not be reset (1F81h, bit 4) keep what it does: that it has not been configured is
//! not an error of the boot-up. A caller that counts on the configuration has to know.

use std::collections::BTreeMap;

use canopen::{Mux, NodeId};

use super::error_status::ErrorStatus;
use super::expectation::BootPlan;
use super::report::BootReport;
use crate::network::Network;
use crate::parameters::{is_command, verify};

/// A node that was left as it is, and does not have what was planned.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unconfigured {
    /// The node.
    pub node: NodeId,
    /// The objects that have another value.
    pub objects: Vec<Mux>,
}

impl Network {
    /// Of the nodes that a boot-up has left as they are, those that do not have what is planned for them. Only reads, and nothing of a node
    /// for which nothing is planned. Of one that does not answer all counts as missing.
    pub async fn unconfigured(&self, plan: &BootPlan, report: &BootReport) -> Vec<Unconfigured> {
        let mut found = Vec::new();
        let left = report.nodes.iter().filter(|node| node.status == Some(ErrorStatus::InitiallyOperational));
        for node in left.map(|node| node.node) {
            let Some(expected) = plan.nodes.get(&node) else { continue };
            // The last value counts: a PDO is switched off and on again on its way.
            let values = expected.configuration.iter().cloned().collect::<BTreeMap<_, _>>();
            let wanted = values.iter().filter(|(object, _)| !is_command(**object, expected.description));
            // A list, so that the future may be moved between threads.
            let wanted = wanted.collect::<Vec<_>>();
            let differs = match verify(&self.node(node).with_timeout(plan.timeout), wanted.clone()).await {
                // What it does not show cannot be compared.
                Ok(deviations) => deviations.into_iter().filter(|it| it.found.is_ok()).map(|it| it.object).collect(),
                Err(_) => wanted.iter().map(|(object, _)| **object).collect::<Vec<_>>(),
            };
            if !differs.is_empty() {
                found.push(Unconfigured { node, objects: differs });
            }
        }
        found
    }
}
