//! `ferrodrive params`: a node's configuration as one thing: kept in a file, compared, written as a transaction, checked.

mod apply;
mod backup;
mod compare;
pub(in crate::command) mod journal;
mod plan;
mod source;

use std::path::{Path, PathBuf};
use std::time::Duration;

use canopen::NodeId;
use machine::parameters::Form;
use master::units::parse_duration;
use words::node::node;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::{Format, file_path};

pub(in crate::command) use plan::{PlanReport, plan_of};

/// Back up a node's parameters, compare them, write them all or not at all, roll back
///
/// Files: .dcf (CiA 306), .toml (objects by number or name, values with units), .bin (concise DCF, CiA 302-3). Commands
/// and set-points are never among the parameters, nothing here moves a drive, and a drive in operation enabled is
/// refused.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive params backup 4 -o wheel.toml\n  \
    ferrodrive --bus can0 params plan 4 wheel.toml\n  ferrodrive --bus can0 params apply 4 wheel.toml --save --prove\n  \
    ferrodrive --bus can0 params verify 4 wheel.toml\n  ferrodrive params diff 4 wheel.toml\n  \
    ferrodrive --bus can0 params rollback 4\n  ferrodrive --bus can0 --machine machine.toml params apply 4")]
pub(crate) struct Params {
    #[command(subcommand)]
    what: ParamsCommand,
}

#[derive(Debug, clap::Subcommand)]
enum ParamsCommand {
    Backup(Backup),
    Diff(Diff),
    Plan(PlanArguments),
    Apply(Apply),
    Verify(Verify),
    Rollback(Rollback),
}

/// Read all parameters of a node's model into a file
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive params backup 4 -o wheel.toml\n  \
    ferrodrive --bus can0 params backup 4 -o wheel.dcf --force")]
struct Backup {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Write to this file, .toml, .dcf or .bin (default, and -: TOML to standard output)
    #[arg(long, short, value_name = "FILE", value_parser = output_path)]
    output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, requires = "output")]
    force: bool,
}

/// Show the differences between a node and a file, between two nodes, or between two files
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 params diff 4 wheel.toml\n  \
    ferrodrive --bus can0 params diff 4 5\n  ferrodrive params diff before.toml after.dcf")]
struct Diff {
    /// Node-ID or file
    #[arg(value_name = "NODE|FILE", value_parser = node_or_file)]
    first: NodeOrFile,
    /// Node-ID (after a node) or file. Of two nodes, what depends on the node-ID is compared as the first one's, and node-ID and bit rate
    /// are left out
    #[arg(value_name = "NODE|FILE", value_parser = node_or_file)]
    second: NodeOrFile,
}

/// Whose parameters are compared.
#[derive(Clone, Debug)]
enum NodeOrFile {
    Node(NodeId),
    File(PathBuf),
}

fn node_or_file(text: &str) -> Result<NodeOrFile, String> {
    match node(text) {
        Ok(id) => Ok(NodeOrFile::Node(id)),
        // A number is not meant as a file.
        Err(error) if text.starts_with(|first: char| first.is_ascii_digit()) && !text.contains('.') => {
            Err(error.to_string())
        }
        Err(_) => parameters_path(text).map(NodeOrFile::File),
    }
}

/// Show what `apply` would write, in order; nothing is written
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 params plan 4 wheel.toml\n  \
    ferrodrive --bus can0 --machine machine.toml params plan 4")]
struct PlanArguments {
    #[command(flatten)]
    wanted: NodeAndFile,
    /// Include node-ID and bit rate, which are written last
    #[arg(long)]
    address: bool,
}

/// Write a file's parameters to a node, all or none
///
/// Everything that can be checked is checked before the first write; each value is read back; on the first refusal what
/// was written is put back in reverse order. A journal is kept meanwhile, with which `rollback` restores the node after
/// a kill or a power failure.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 params apply 4 wheel.toml\n  \
    ferrodrive --bus can0 params apply 4 wheel.toml --save --prove\n  \
    ferrodrive --bus can0 --machine machine.toml params apply 4")]
struct Apply {
    #[command(flatten)]
    wanted: NodeAndFile,
    /// Include node-ID and bit rate, which are written last
    #[arg(long, conflicts_with = "prove")]
    address: bool,
    #[command(flatten)]
    how: Transaction,
}

/// Check that a node has the values of a file (exit status 1 if not)
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 params verify 4 wheel.toml\n  \
    ferrodrive --bus can0 --machine machine.toml params verify 4")]
struct Verify {
    #[command(flatten)]
    wanted: NodeAndFile,
}

/// Restore a node to how it was before an interrupted `apply`
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 params rollback 4\n  \
    ferrodrive --bus can0 params rollback 4 ferrodrive-node4.journal")]
struct Rollback {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// The journal (default: that of this node in the current folder)
    #[arg(value_name = "JOURNAL")]
    journal: Option<PathBuf>,
}

/// What is done around the writes.
#[derive(Debug, clap::Args)]
pub(in crate::command) struct Transaction {
    /// Store the parameters in the drive's memory afterwards
    #[arg(long)]
    save: bool,
    /// Restart the drive afterwards, and read everything again
    ///
    /// `power-cycle` waits until the drive has been switched off and on by hand; `reset` sends NMT reset node, with
    /// which a device loads its stored values (CiA 301, 7.3.2.2.1). Without HOW: a reset on a virtual bus of this
    /// command, else a power cycle.
    #[arg(long, value_name = "HOW", num_args = 0..=1, require_equals = true, default_missing_value = "auto", requires = "save")]
    prove: Option<Prove>,
    /// Longest wait for the drive to come back
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "2min", requires = "prove")]
    within: Duration,
    /// File for the journal
    #[arg(long, value_name = "FILE", value_parser = file_path)]
    journal: Option<PathBuf>,
}

/// Which node shall have what.
#[derive(Debug, clap::Args)]
struct NodeAndFile {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// The parameters: .toml, .dcf or .bin (default: the values in the machine file)
    #[arg(value_name = "FILE", value_parser = parameters_path)]
    file: Option<PathBuf>,
}

/// A file of parameters: its ending gives its form.
fn parameters_path(text: &str) -> Result<PathBuf, String> {
    Form::of(Path::new(text)).map(|_| text.into())
}

fn output_path(text: &str) -> Result<PathBuf, String> {
    if text == "-" { Ok(text.into()) } else { parameters_path(text) }
}

/// How a drive is restarted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Prove {
    /// Whichever fits the bus.
    #[value(hide = true)]
    Auto,
    /// Its supply is switched off and on by hand.
    PowerCycle,
    /// NMT reset node.
    Reset,
}

impl Params {
    /// Does what was asked for, and prints it.
    pub(crate) async fn run(&self, context: &Context, format: Format) -> Result<(), Failure> {
        let printed = match &self.what {
            ParamsCommand::Backup(backup) => format.print(&backup.run(context).await?),
            ParamsCommand::Diff(diff) => format.print(&diff.run(context).await?),
            ParamsCommand::Plan(plan) => format.print(&plan.run(context).await?),
            ParamsCommand::Apply(apply) => format.print(&apply.run(context).await?),
            ParamsCommand::Rollback(rollback) => format.print(&rollback.run(context).await?),
            ParamsCommand::Verify(verify) => {
                let report = verify.run(context).await?;
                return format.print_judged(&report, report.failure().map(Failure::from));
            }
        };
        printed.map_err(Failure::of_stdout)
    }
}
