//! `ferrodrive nmt`: network management commands (CiA 301, clause 7.2.8).

use std::time::Duration;

use can::Instant;
use canopen::object::PRODUCER_HEARTBEAT_TIME;
use canopen::{NmtCommand, NmtState, NodeId};
use clap::ValueEnum;
use host::command::NmtChange;
use master::units::parse_duration;
use master::{Elapsed, Node, NodeView};
use plot::Paint;
use serde::Serialize;
use words::node::{Nodes, nodes};

use crate::context::Context;
use crate::failure::Failure;

/// Send a network management command to one node or to all
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus socketcand://HOST:29536/can0 nmt 4 start\n  \
    ferrodrive --bus slcan:///dev/ttyACM0 nmt all pre-operational\n  ferrodrive nmt 1 start --wait\n  \
    ferrodrive --bus slcan:///dev/ttyACM0 nmt all reset --wait 3s")]
pub struct Nmt {
    /// Node-ID, or all
    #[arg(value_name = "NODE|all", value_parser = nodes)]
    pub(super) nodes: Nodes,
    /// Command to send
    command: NmtWord,
    /// Wait until the node confirms it: by its heartbeat, after a reset by its boot-up message
    ///
    /// With all, this lists what each node reports within the time.
    #[arg(long, value_name = "TIME", value_parser = parse_duration, num_args = 0..=1, default_missing_value = "5s")]
    wait: Option<Duration>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum NmtWord {
    /// Go to operational: PDOs work
    #[value(alias = "operational")]
    Start,
    /// Go to stopped: nothing but NMT and heartbeat works
    #[value(alias = "stopped")]
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
pub struct NmtReport {
    node: Option<u8>,
    command: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    booted: Option<bool>,
    /// The state that it has said, where that was waited for.
    #[serde(skip_serializing_if = "Option::is_none")]
    state: Option<String>,
    /// What each node has reported, where all were commanded and waited for.
    #[serde(skip_serializing_if = "Option::is_none")]
    nodes: Option<Vec<NmtAnswer>>,
}

/// What a node has said.
#[derive(Debug, Serialize)]
struct NmtAnswer {
    node: u8,
    state: String,
    /// Its boot-up message has come.
    booted: bool,
}

impl Nmt {
    /// What a host does of it, for a page: to one node, and not what resets it.
    pub(super) fn change(&self) -> Option<(NodeId, NmtChange)> {
        match (self.nodes, self.command) {
            (Nodes::One(node), NmtWord::Start) => Some((node, NmtChange::Start)),
            (Nodes::One(node), NmtWord::PreOperational) => Some((node, NmtChange::PreOperational)),
            _ => None,
        }
    }

    /// Sends the command, which the host of a page has done before; after a reset of one node waits for its boot-up message.
    ///
    /// # Errors
    /// What was waited for has not come.
    pub async fn run(&self, context: &Context) -> Result<NmtReport, Failure> {
        let command = self.command.command();
        let done = NmtReport { node: None, command: command.word(), booted: None, state: None, nodes: None };
        let Nodes::One(node) = self.nodes else {
            context.network.nmt_all(command);
            let nodes = match self.wait {
                Some(patience) => Some(said_by_all(context, patience).await),
                None => {
                    context.settle().await;
                    None
                }
            };
            return Ok(NmtReport { nodes, ..done });
        };
        let handle = context.node(node);
        let resets = matches!(command, NmtCommand::ResetNode | NmtCommand::ResetCommunication);
        let booted = handle.wait_boot_up(self.wait.unwrap_or(BOOT_PATIENCE));
        let before = context.network.now();
        if context.in_control().is_none() {
            handle.nmt(command);
        }
        let mut state = None;
        if resets {
            booted.await?;
        } else if let Some(patience) = self.wait {
            state = Some(self.reached(context, &handle, before, patience).await?.to_string());
        } else {
            context.settle().await;
        }
        Ok(NmtReport { node: Some(node.raw()), booted: resets.then_some(true), state, ..done })
    }

    /// Waits until a node's heartbeat has the state that the command leads to.
    async fn reached(
        &self,
        context: &Context,
        handle: &Node,
        before: Instant,
        patience: Duration,
    ) -> Result<NmtState, Failure> {
        let wanted = match self.command {
            NmtWord::Start => NmtState::Operational,
            NmtWord::Stop => NmtState::Stopped,
            _ => NmtState::PreOperational,
        };
        let id = handle.id();
        let model = context.stated_model(id);
        // A heartbeat that was on its way when the command went out has the state before it.
        let said = |node: &NodeView<'_>| {
            let heard = node.facts.heartbeat_at.filter(|at| *at > before)?;
            let reported = node.facts.nmt_state?;
            let state = model.map_or(reported, |model| model.nmt_state(reported));
            Some((heard, state)).filter(|(_, state)| *state == wanted)
        };
        context.show(format!("node {id}: waiting until it reports that it is {wanted}"));
        match handle.wait(said, patience).await {
            Ok((_, state)) => Ok(state),
            Err(Elapsed) => Err(self.not_reached(context, handle, wanted, before, patience).await),
        }
    }

    async fn not_reached(
        &self,
        context: &Context,
        handle: &Node,
        wanted: NmtState,
        before: Instant,
        patience: Duration,
    ) -> Failure {
        let id = handle.id();
        let failure =
            Failure::new(format!("node {id} has not reported within {} s that it is {wanted}", patience.as_secs_f64()))
                .of_kind("not_reached")
                .at_node(id);
        let facts = handle.facts();
        let said = facts.nmt_state.filter(|_| facts.heartbeat_at.is_some_and(|at| at > before));
        if said == Some(wanted) {
            return failure
                .because(format!(
                    "its heartbeat says {wanted}, as that of this model does with an alarm too: which of them it is does not show"
                ))
                .next(format!("a node that is stopped answers no SDO: ferrodrive read {id} 1000"));
        }
        if let Some(state) = said {
            return failure
                .because(format!("its heartbeat reports that it is {state}"))
                .next(format!("ferrodrive state {id}"));
        }
        // Who is stopped answers no SDO.
        let period = handle.upload(PRODUCER_HEARTBEAT_TIME).await.map(|value| value.raw() & 0xFFFF);
        match period {
            Ok(0) => failure
                .because("it sends no heartbeat (1017h is 0), so that its state cannot be seen")
                .next(format!("ferrodrive write {id} 1017 100, then once more; or omit --wait")),
            Ok(ms) => failure
                .because(format!("no heartbeat came, though 1017h is {ms} ms"))
                .next(format!("ferrodrive --bus {} dump --node {id}, or a longer --wait", context.bus_name)),
            Err(error) => failure
                .because(format!("no heartbeat came, and {error}"))
                .next("ferrodrive scan shows the nodes on the bus"),
        }
    }
}

/// What every node says within a time.
async fn said_by_all(context: &Context, patience: Duration) -> Vec<NmtAnswer> {
    let before = context.network.now();
    context.show("listening to the nodes");
    context.network.sleep(patience).await;
    let said = context.network.seen().iter().filter_map(|node| {
        let facts = context.network.facts(node);
        facts.heartbeat_at.filter(|at| *at >= before)?;
        // The state of an alarm heartbeat is its model's to read.
        let state = facts.probable_state(context.stated_model(node))?;
        let booted = facts.boot_up.is_some_and(|(at, _)| at >= before);
        Some(NmtAnswer { node: node.raw(), state: state.to_string(), booted })
    });
    said.collect()
}

impl NmtWord {
    const fn command(self) -> NmtCommand {
        match self {
            Self::Start => NmtCommand::Start,
            Self::Stop => NmtCommand::Stop,
            Self::PreOperational => NmtCommand::EnterPreOperational,
            Self::Reset => NmtCommand::ResetNode,
            Self::ResetCommunication => NmtCommand::ResetCommunication,
        }
    }
}

impl NmtReport {
    /// As lines for people.
    pub fn text(&self, _: Paint) -> String {
        let whom = self.node.map_or_else(|| "all nodes".into(), |node| format!("node {node}"));
        let booted = if self.booted == Some(true) { "; it has booted" } else { "" };
        let state = self.state.as_ref().map(|state| format!("; it is {state}")).unwrap_or_default();
        let mut text = format!("{whom}: {} sent{booted}{state}", self.command);
        for NmtAnswer { node, state, booted } in self.nodes.iter().flatten() {
            let booted = if *booted { "has booted, " } else { "" };
            text.push_str(&format!("\n  node {node}: {booted}{state}"));
        }
        if self.nodes.as_ref().is_some_and(Vec::is_empty) {
            text.push_str("\n  no node has sent anything since");
        }
        text
    }
}
