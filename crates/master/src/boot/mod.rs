//! The boot-up of a network by its master, with each step's expectation and finding. Source: CiA 302-2, boot-up procedure.
//!
//! In: a [`BootPlan`], of descriptions of models ([`Expectation::of`]) or of a CANopen manager's dictionary
//! ([`BootPlan::from_objects`]). Out: a [`BootReport`] of nodes, steps and the standard's letters. All nodes are booted at the
//! same time, each within a time that the plan bounds. Nothing here moves a motor.
//!
//! ```
//! # use std::time::Duration;
//! use master::boot::{BootPlan, Expectation};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let network = master::Network::new();
//! # let mut world = sim::World::new(can::Bitrate::K500, 1);
//! # world.add_station(network.clone());
//! # world.add_drive(4, Box::new(sim::machine::zlac8030l(4, 1)))?;
//! # world.run_for(Duration::from_secs(1));
//! let model = devices::model("zlac8030l").ok_or("no such model")?;
//! let node = canopen::NodeId::new(4).ok_or("no such node")?;
//! let plan = BootPlan::new([(node, Expectation::of(model))]);
//! let report = sim::block_on(&mut world, network.boot(&plan))?;
//! assert!(report.is_whole(), "{}", report.nodes[0]);
//! assert_eq!(report.nodes[0].state, Some(canopen::NmtState::Operational));
//! # Ok(())
//! # }
//! ```

mod assignment;
mod error_status;
mod expectation;
mod node;
mod report;
mod step;
mod unconfigured;

use canopen::NmtCommand;

pub use assignment::{Assignment, Startup};
pub use error_status::ErrorStatus;
pub use expectation::{BadPlan, BootPlan, Expectation};
pub use report::{BootReport, NodeReport};
pub use step::{Expected, Found, Heard, Step, StepKind, Verdict};
pub use unconfigured::Unconfigured;

use crate::network::{Network, join_all};
use node::NodeBoot;

impl Network {
    /// Boots the nodes of a plan, all at the same time, and starts them as it says.
    ///
    /// A drive that is armed to stop without this program stays so until its guard is released
    /// ([`release_guards`](Self::release_guards)), and its heartbeat is watched until
    /// [`Node::watch_heartbeat`](crate::Node::watch_heartbeat) changes that.
    pub async fn boot(&self, plan: &BootPlan) -> BootReport {
        let began = plan.nodes.iter().map(|(id, expectation)| NodeBoot::new(self, *id, plan, expectation).run());
        let mut report = BootReport { nodes: join_all(began).await, notes: Vec::new() };
        if self.seen().contains(plan.own) {
            report.notes.push(format!(
                "node {0} is on the bus, the node-ID of this master: another master, or a device that has it. Two heartbeats \
                 under one node-ID hide the loss of either: give one of them another node-ID",
                plan.own
            ));
        }
        if report.is_whole() {
            self.start_together(plan, &mut report).await;
        } else {
            self.give_up(plan.startup, &mut report);
        }
        report
    }

    /// Starts all nodes with one command, if the plan has that.
    async fn start_together(&self, plan: &BootPlan, report: &mut BootReport) {
        if !plan.startup.has(Startup::START_ALL) || plan.startup.has(Startup::STARTS_NONE) {
            return;
        }
        let before = self.now();
        self.nmt_all(NmtCommand::Start);
        let started = report.nodes.iter_mut().filter(|node| node.status.is_none()).map(|node| async move {
            let expectation = plan.nodes.get(&node.node)?;
            let mut booting = NodeBoot::resumed(self, node.node, plan, expectation);
            booting.await_start(before).await;
            booting.fill_in(node);
            Some(())
        });
        join_all(started.collect::<Vec<_>>()).await;
    }

    /// What a master does when a mandatory node has failed (1F80h).
    fn give_up(&self, startup: Startup, report: &mut BootReport) {
        let (command, done) = match startup {
            _ if startup.has(Startup::STOP_ALL) => (NmtCommand::Stop, "all nodes were stopped (1F80h, bit 6)"),
            _ if startup.has(Startup::RESET_ALL) => (NmtCommand::ResetNode, "all nodes were reset (1F80h, bit 4)"),
            _ => return,
        };
        self.nmt_all(command);
        report.notes.push(format!("a mandatory node has failed: {done}"));
    }
}
