//! The commands: commands that share everything but a word share a file.

pub mod departures;
pub mod drive;
mod effect;
pub mod emcy;
pub mod estop;
pub mod explain;
pub mod home;
pub mod motion;
pub mod nmt;
pub mod object;
pub mod objects;
mod on_bus;
pub mod params;
pub mod pdo;
pub mod read;
pub mod scan;
pub mod several;
pub mod store;
pub mod write;

use clap::Subcommand;
use host::network::scan::ScanReport;
use master::drive::{self as master_drive, Motion};
use plot::Paint;
use serde::Serialize;
use words::node::Nodes;

use crate::context::Context;
use crate::failure::Failure;
use crate::guard::GuardArgs;
pub use effect::CommandEffect;
use motion::MotionOutcome;
use object::ObjectReport;
use several::StateOutcome;

/// Commands on a bus.
#[derive(Debug, Subcommand)]
pub enum Command {
    #[allow(missing_docs, reason = "it would be the help in place of that of the command")]
    Scan(scan::Scan),
    #[allow(missing_docs, reason = "as above")]
    Write(write::Write),
    #[allow(missing_docs, reason = "as above")]
    State(drive::State),
    #[allow(missing_docs, reason = "as above")]
    Explain(explain::Explain),
    #[allow(missing_docs, reason = "as above")]
    Enable(drive::Enable),
    #[allow(missing_docs, reason = "as above")]
    Disable(drive::Disable),
    #[allow(missing_docs, reason = "as above")]
    Estop(estop::Estop),
    #[allow(missing_docs, reason = "as above")]
    Stop(drive::Stop),
    #[allow(missing_docs, reason = "as above")]
    QuickStop(drive::QuickStop),
    #[allow(missing_docs, reason = "as above")]
    Reset(drive::Reset),
    #[allow(missing_docs, reason = "as above")]
    Velocity(motion::Velocity),
    #[allow(missing_docs, reason = "as above")]
    Move(motion::Move),
    #[allow(missing_docs, reason = "as above")]
    Torque(motion::Torque),
    #[allow(missing_docs, reason = "as above")]
    Home(home::Home),
    #[allow(missing_docs, reason = "as above")]
    Save(store::Save),
    #[allow(missing_docs, reason = "as above")]
    Nmt(nmt::Nmt),
}

/// What came of one of them.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum Outcome {
    /// Who is on the bus.
    Scanned(Box<ScanReport>),
    /// An object that was written.
    Written(Box<ObjectReport>),
    /// What drives say of themselves, or how they were stopped.
    State(StateOutcome),
    /// Why it does not move.
    Explained(Box<explain::Explanation>),
    /// Of a motion.
    Moved(Box<MotionOutcome>),
    /// Parameters that a drive has stored.
    Stored(Box<store::StoreReport>),
    /// An NMT command.
    Managed(Box<nmt::NmtReport>),
}

impl Command {
    /// Does it.
    ///
    /// # Errors
    /// Why it was not done.
    pub async fn run(&self, context: &Context) -> Result<Outcome, Failure> {
        Ok(match self {
            Self::Scan(command) => Outcome::Scanned(Box::new(command.run(context).await?)),
            Self::Write(command) => Outcome::Written(Box::new(command.run(context).await?)),
            Self::State(command) => Outcome::State(command.run(context).await?),
            Self::Explain(command) => Outcome::Explained(Box::new(command.run(context).await?)),
            Self::Enable(command) => Outcome::State(command.run(context).await?),
            Self::Disable(command) => Outcome::State(command.run(context).await?),
            Self::Estop(command) => Outcome::State(command.run(context).await?.into()),
            Self::Stop(command) => Outcome::State(command.run(context).await?),
            Self::QuickStop(command) => Outcome::State(command.run(context).await?),
            Self::Reset(command) => Outcome::State(command.run(context).await?),
            Self::Velocity(command) => Outcome::Moved(Box::new(command.run(context).await?)),
            Self::Move(command) => Outcome::Moved(Box::new(command.run(context).await?)),
            Self::Torque(command) => Outcome::Moved(Box::new(command.run(context).await?)),
            Self::Home(command) => Outcome::Moved(Box::new(command.run(context).await?)),
            Self::Save(command) => Outcome::Stored(Box::new(command.run(context).await?)),
            Self::Nmt(command) => Outcome::Managed(Box::new(command.run(context).await?)),
        })
    }

    /// How it guards what it moves.
    pub const fn guard(&self) -> Option<&GuardArgs> {
        match self {
            Self::Velocity(command) => Some(command.guard()),
            Self::Move(command) => Some(command.guard()),
            Self::Torque(command) => Some(command.guard()),
            Self::Home(command) => Some(command.guard()),
            _ => None,
        }
    }

    /// What it does to drives.
    pub fn effect(&self) -> CommandEffect {
        use master_drive::Command as Of;
        let moves = |(node, motion): (_, Motion)| CommandEffect::OnDrive(node, motion.into());
        match self {
            Self::Scan(_) | Self::State(_) | Self::Explain(_) => CommandEffect::None,
            Self::Write(command) => command.effect(),
            Self::Enable(command) => of_nodes(command.nodes, Of::Enable, CommandEffect::OnEveryDrive),
            Self::Disable(command) => of_nodes(command.nodes, Of::Disable, CommandEffect::OnEveryDrive),
            Self::Reset(command) => of_nodes(command.nodes, Of::ResetFault, CommandEffect::OnEveryDrive),
            Self::Estop(_) => CommandEffect::StopAll,
            Self::Stop(command) => of_nodes(command.nodes, Of::Stop, CommandEffect::StopAllByRamp),
            Self::QuickStop(command) => of_nodes(command.nodes, Of::QuickStop, CommandEffect::StopAll),
            Self::Velocity(command) => moves((command.node, command.motion())),
            Self::Move(command) => moves((command.node, command.motion())),
            Self::Torque(command) => moves((command.node, command.motion())),
            Self::Home(command) => moves((command.node, command.motion())),
            Self::Save(command) => CommandEffect::Stores(command.node),
            Self::Nmt(command) => {
                command.change().map_or(CommandEffect::ManagesMore, |(node, to)| CommandEffect::Manages(node, to))
            }
        }
    }
}

fn of_nodes(nodes: Nodes, one: master_drive::Command, all: CommandEffect) -> CommandEffect {
    match nodes {
        Nodes::One(node) => CommandEffect::OnDrive(node, one),
        Nodes::All => all,
    }
}

impl Outcome {
    /// Why the command fails although it has something to report.
    pub fn failure(&self) -> Option<Failure> {
        match self {
            Self::State(outcome) => outcome.failure(),
            Self::Explained(explanation) => explanation.failure(),
            Self::Scanned(_) | Self::Written(_) | Self::Moved(_) | Self::Stored(_) | Self::Managed(_) => None,
        }
    }
}

impl Outcome {
    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        match self {
            Self::Scanned(report) => scan::text(report, paint),
            Self::Written(report) => report.text(paint),
            Self::State(report) => report.text(paint),
            Self::Explained(report) => explain::text(report, paint),
            Self::Moved(report) => report.text(paint),
            Self::Stored(report) => report.text(paint),
            Self::Managed(report) => report.text(paint),
        }
    }
}
