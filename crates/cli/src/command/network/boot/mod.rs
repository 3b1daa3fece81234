//! `ferrodrive boot`: the boot-up of a network (CiA 302-2), with what each step expected and found.

mod planned;
mod report;

use std::path::PathBuf;

use canopen::NodeId;
use words::node::node;

use crate::context::Context;
use crate::failure::Failure;
use crate::global::Global;
use crate::output::Format;
use crate::session;
use host::network::boot::{BootOptions, BootReport};
pub(crate) use planned::{Planned, announce, global_of, plan_of, planned_by};

/// Boot the nodes of a network: check their identities, configure and start them
///
/// Each node is reset, asked for its identity, configured, watched by its heartbeat and started, in the order of CiA
/// 302-2. Each step reports what was expected and what was found; a node that fails is reported with the standard's
/// letter. The expectations come from the file: a machine file, or the DCF of a CANopen manager (1F80h to 1F8Ah,
/// 1F22h). Without a file, each node found on the bus is booted with the identity that it reports. A node that is
/// already operational is left as it is, unless --reset is given. No motor is moved. A machine file whose group or base
/// has a cycle that the bus cannot carry is refused first. Ends with status 1 if a mandatory node has failed, or if a
/// node that was left as it is does not have the values of the file.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive boot examples/machine.toml\n  \
    ferrodrive --bus can0 boot machine.toml --node 4   # only this node of it\n  \
    ferrodrive --bus can0 boot master.dcf --no-start   # up to NMT start")]
pub(crate) struct Boot {
    /// Machine file, or DCF of a CANopen manager (default: --machine, --model, or the nodes on the bus)
    #[arg(value_name = "FILE.toml|MASTER.dcf")]
    file: Option<PathBuf>,
    /// Boot only this node; may be repeated
    #[arg(long = "node", value_name = "NODE", value_parser = node)]
    nodes: Vec<NodeId>,
    /// Also reset nodes that are operational: a turning motor may stop at once, or keep turning
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
        format.print_judged(&report, report.failure().map(Failure::from))
    }

    async fn boot(&self, context: &Context, planned: &Planned) -> Result<BootReport, Failure> {
        let mut plan = plan_of(planned, context, &self.nodes).await?;
        announce(context, &plan);
        let options = BootOptions { nodes: self.nodes.clone(), reset: self.reset, no_start: self.no_start };
        Ok(options.boot(&context.network, &mut plan).await)
    }
}
