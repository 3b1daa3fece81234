//! `ferrodrive boot`: the boot-up of a network (CiA 302-2), with what each step expected and found.

mod planned;
mod report;

use std::path::PathBuf;

use canopen::NodeId;
use master::boot::BootPlan;
use testbench::words::node::node;

use crate::context::Context;
use crate::failure::Failure;
use crate::global::Global;
use crate::output::Format;
use crate::session;
pub(crate) use planned::{Planned, announce, global_of, plan_of, planned_by};
use testbench::network::boot::BootReport;

/// Boot the nodes of a network: check who they are, configure and start them
///
/// Each node is reset, asked for its identity, configured, watched by its heartbeat and started, in the order of CiA 302-2; each step
/// says what it expected and found, and a node that fails has the standard's letter. What is expected is said by the file: a
/// machine file, or the DCF of a CANopen manager (1F80h to 1F8Ah, 1F22h). Without one, whoever is on the bus is booted as what it says that
/// it is. A node that is operational is left as it is, unless --reset is given. No motor is moved. A machine file
/// whose group or base has a cycle that the bus cannot carry is refused before. Ends with status 1 if a mandatory node has failed, or if one that was left as it is does not have what the file says.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive boot examples/machine.toml\n  \
    ferrodrive --bus can0 boot machine.toml --node 4     # that node of it alone\n  \
    ferrodrive --bus can0 boot master.dcf --no-start     # up to, and without, NMT start")]
pub(crate) struct Boot {
    /// Machine file, or DCF of a CANopen manager (default: --machine, --model, or who is on the bus)
    #[arg(value_name = "FILE.toml|MASTER.dcf")]
    file: Option<PathBuf>,
    /// Only this node; may be repeated
    #[arg(long = "node", value_name = "NODE", value_parser = node)]
    nodes: Vec<NodeId>,
    /// Reset nodes that are operational too: a motor that turns may stop at once, or go on
    #[arg(long)]
    reset: bool,
    /// Leave the nodes pre-operational
    #[arg(long)]
    no_start: bool,
}

impl Boot {
    /// Boots, prints, and fails if a mandatory node has.
    pub(crate) fn run(&self, global: &Global, format: Format) -> Result<(), Failure> {
        let planned = planned_by(self.file.as_deref(), global)?;
        let global = global_of(&planned, global)?;
        let report = session::run(&global, async |context| self.boot(context, &planned).await)?;
        format.print(&report).map_err(Failure::of_stdout)?;
        report.failure().map_or(Ok(()), |failure| Err(Failure { told: true, ..failure.into() }))
    }

    async fn boot(&self, context: &Context, planned: &Planned) -> Result<BootReport, Failure> {
        let mut plan = plan_of(planned, context, &self.nodes).await?;
        // The heartbeat that a drive would watch ends with this command.
        plan.guard = false;
        self.apply(&mut plan);
        announce(context, &plan);
        let report = context.network.boot(&plan).await;
        context.settle().await;
        let unconfigured = context.network.unconfigured(&plan, &report).await;
        Ok(BootReport::new(&plan, &report, &unconfigured))
    }

    fn apply(&self, plan: &mut BootPlan) {
        use master::boot::{Assignment, Startup};
        if self.reset {
            for expectation in plan.nodes.values_mut() {
                expectation.assignment = expectation.assignment.without(Assignment::KEEP_ALIVE);
            }
        }
        if self.no_start {
            plan.startup.0 |= Startup::STARTS_NONE;
        }
    }
}
