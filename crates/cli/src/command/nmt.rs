//! `ferrodrive nmt`: network management commands (CiA 301, clause 7.2.8).

use std::time::Duration;

use canopen::NmtCommand;
use clap::ValueEnum;
use serde::Serialize;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use crate::paint::Paint;
use testbench::words::node::{Nodes, nodes};

/// Send a network management command to one node or to all
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus socketcand://HOST:29536/can0 nmt 4 start\n  \
    ferrodrive --bus slcan:///dev/ttyACM0 nmt all pre-operational")]
pub(crate) struct Nmt {
    /// Node-ID, or all
    #[arg(value_name = "NODE|all", value_parser = nodes)]
    nodes: Nodes,
    /// What to do
    command: NmtWord,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum NmtWord {
    /// Go to operational: PDOs work
    Start,
    /// Go to stopped: nothing but NMT and heartbeat works
    Stop,
    /// Go to pre-operational: SDO works, PDOs do not
    PreOperational,
    /// Restart the device
    Reset,
    /// Restart its communication only
    ResetCommunication,
}

/// How long a reset device may take until it says that it has booted.
const BOOT_PATIENCE: Duration = Duration::from_secs(5);

/// What was done.
#[derive(Debug, Serialize)]
pub(crate) struct NmtReport {
    node: Option<u8>,
    command: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    booted: Option<bool>,
}

impl Nmt {
    /// Sends the command; after a reset of one node waits for its boot-up message.
    pub(crate) async fn run(&self, context: &Context) -> Result<NmtReport, Failure> {
        let (command, name) = self.command.meaning();
        let Nodes::One(node) = self.nodes else {
            context.network.nmt_all(command);
            context.settle().await;
            return Ok(NmtReport { node: None, command: name, booted: None });
        };
        let handle = context.node(node);
        let resets = matches!(command, NmtCommand::ResetNode | NmtCommand::ResetCommunication);
        let booted = handle.wait_boot_up(BOOT_PATIENCE);
        handle.nmt(command);
        if resets {
            booted.await?;
        } else {
            context.settle().await;
        }
        Ok(NmtReport { node: Some(node.raw()), command: name, booted: resets.then_some(true) })
    }
}

impl NmtWord {
    fn meaning(self) -> (NmtCommand, &'static str) {
        match self {
            Self::Start => (NmtCommand::Start, "start"),
            Self::Stop => (NmtCommand::Stop, "stop"),
            Self::PreOperational => (NmtCommand::EnterPreOperational, "pre-operational"),
            Self::Reset => (NmtCommand::ResetNode, "reset"),
            Self::ResetCommunication => (NmtCommand::ResetCommunication, "reset-communication"),
        }
    }
}

impl Report for NmtReport {
    fn text(&self, _: Paint) -> String {
        let whom = self.node.map_or_else(|| "all nodes".into(), |node| format!("node {node}"));
        let booted = if self.booted == Some(true) { "; it has booted" } else { "" };
        format!("{whom}: {} sent{booted}", self.command)
    }
}
