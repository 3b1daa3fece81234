//! `state`, `enable`, `disable`, `stop`, `quick-stop` and `reset`, of one drive or of every drive on the bus.

use canopen::NodeId;
use master::join_all;
use serde::Serialize;

use super::drive::{Disable, Enable, QuickStop, Reset, State, StateReport, Stop};
use super::estop::{Estop, StopReport, stop_all};
use super::on_bus::drives_on_bus;
use crate::context::Context;
use crate::failure::Failure;
use plot::Paint;
use words::node::Nodes;

/// What came of something that is done with one drive or with every one.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum StateOutcome {
    /// Of one drive.
    One(Box<StateReport>),
    /// Of every drive on the bus.
    All(Box<SeveralReport>),
    /// Of every drive on the bus, which was to stop.
    Stopped(Box<StopReport>),
}

impl From<StopReport> for StateOutcome {
    fn from(report: StopReport) -> Self {
        Self::Stopped(Box::new(report))
    }
}

impl StateOutcome {
    async fn of(
        (context, nodes): (&Context, Nodes),
        undone: &str,
        act: impl AsyncFn(NodeId) -> Result<StateReport, Failure>,
    ) -> Result<Self, Failure> {
        match nodes {
            Nodes::One(node) => act(node).await.map(Box::new).map(Self::One),
            Nodes::All => each(context, undone, act).await.map(Box::new).map(Self::All),
        }
    }

    /// Why it was not done with every drive.
    pub fn failure(&self) -> Option<Failure> {
        match self {
            Self::One(_) => None,
            Self::All(report) => report.failure(),
            Self::Stopped(report) => report.failure(),
        }
    }

    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        match self {
            Self::One(report) => report.text(paint),
            Self::All(report) => report.text(paint),
            Self::Stopped(report) => report.text(paint),
        }
    }
}

impl State {
    /// Reads everything.
    pub async fn run(&self, context: &Context) -> Result<StateOutcome, Failure> {
        let read = async |node| StateReport::read(&context.drive(node).await?).await;
        StateOutcome::of((context, self.nodes), "the state was not read", read).await
    }
}

impl Enable {
    /// Enables and shows the state.
    pub async fn run(&self, context: &Context) -> Result<StateOutcome, Failure> {
        let enable = async |node| {
            let drive = context.drive(node).await?;
            drive.enable().await?;
            StateReport::read(&drive).await?.still_enabled()
        };
        StateOutcome::of((context, self.nodes), "not enabled", enable).await
    }
}

impl Disable {
    /// Disables and shows the state.
    pub async fn run(&self, context: &Context) -> Result<StateOutcome, Failure> {
        let disable = async |node| {
            let drive = context.drive_to_stop(node).await?;
            drive.disable().await?;
            StateReport::read(&drive).await
        };
        StateOutcome::of((context, self.nodes), "not seen to be disabled: it may still have power", disable).await
    }
}

impl Stop {
    /// Stops and shows the state.
    pub async fn run(&self, context: &Context) -> Result<StateOutcome, Failure> {
        let Nodes::One(node) = self.nodes else { return stop_all(context).await.map(StateOutcome::from) };
        let drive = context.drive_to_stop(node).await?;
        drive.stop().await?;
        Ok(StateOutcome::One(Box::new(StateReport::read(&drive).await?)))
    }
}

impl QuickStop {
    /// Stops at once and shows the state. The stop goes out before the model is asked for.
    pub async fn run(&self, context: &Context) -> Result<StateOutcome, Failure> {
        let Nodes::One(node) = self.nodes else { return Estop::default().run(context).await.map(StateOutcome::from) };
        context.quick_stop(node).await?;
        let drive = context.drive_to_stop(node).await?;
        drive.quick_stop().await?;
        Ok(StateOutcome::One(Box::new(StateReport::read(&drive).await?)))
    }
}

impl Reset {
    /// Resets and shows the state.
    pub async fn run(&self, context: &Context) -> Result<StateOutcome, Failure> {
        let reset = async |node| {
            let drive = context.drive(node).await?;
            drive.reset_fault().await?;
            StateReport::read(&drive).await
        };
        StateOutcome::of((context, self.nodes), "the fault was not reset", reset).await
    }
}

/// What became of each drive.
#[derive(Debug, Serialize)]
pub struct SeveralReport {
    ok: bool,
    nodes: Vec<NodeOutcome>,
    #[serde(skip)]
    failure: Option<Failure>,
}

#[derive(Debug, Serialize)]
struct NodeOutcome {
    node: u8,
    /// What it says of itself afterwards; null where it was not done.
    state: Option<StateReport>,
    /// Why it was not done.
    why: Option<String>,
}

/// Does the same with every drive at once; `undone` is what is said of those with which it was not done.
async fn each(
    context: &Context,
    undone: &str,
    act: impl AsyncFn(NodeId) -> Result<StateReport, Failure>,
) -> Result<SeveralReport, Failure> {
    let found = drives_on_bus(context).await;
    if found.is_empty() {
        return Err(Failure::new(format!("no drive answers on {}", context.bus_name))
            .of_kind("no_node")
            .because("no node has a statusword (6041h), and none was heard")
            .next("check supply, cable and bit rate, then: ferrodrive scan"));
    }
    let act = &act;
    let done = found.into_iter().map(|(id, silent)| async move {
        let done = match silent {
            None => act(id).await,
            Some(silent) => Err(silent.into()),
        };
        (id, done)
    });
    let done = join_all(done.collect::<Vec<_>>()).await;
    let failed: Vec<_> = done.iter().filter_map(|(id, done)| Some((*id, done.as_ref().err()?))).collect();
    let failure = failed.first().map(|(first, _)| {
        let names: Vec<_> = failed.iter().map(|(id, _)| id.to_string()).collect();
        let plural = if names.len() == 1 { "" } else { "s" };
        let failure = Failure::new(format!("node{plural} {}: {undone}", names.join(", "))).of_kind("not_all");
        let failure = failed.iter().fold(failure, |failure, (id, why)| failure.because(reason(*id, why)));
        failure.next(format!("ferrodrive explain {first}"))
    });
    let outcome = |(id, done): (NodeId, Result<StateReport, Failure>)| match done {
        Ok(state) => NodeOutcome { node: id.raw(), state: Some(state), why: None },
        Err(why) => NodeOutcome { node: id.raw(), state: None, why: Some(reason(id, &why)) },
    };
    Ok(SeveralReport { ok: failure.is_none(), nodes: done.into_iter().map(outcome).collect(), failure })
}

/// Why it was not done, with the node.
fn reason(id: NodeId, failure: &Failure) -> String {
    let said =
        std::iter::once(&failure.what).chain(&failure.because).map(String::as_str).collect::<Vec<_>>().join("; ");
    let name = format!("node {id}");
    if said.starts_with(&name) { said } else { format!("{name}: {said}") }
}

impl SeveralReport {
    /// Why it was not done with every drive.
    pub fn failure(&self) -> Option<Failure> {
        self.failure.clone()
    }

    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        let each = self.nodes.iter().map(|outcome| match &outcome.state {
            Some(state) => state.text(paint),
            None => paint.bad(outcome.why.as_deref().unwrap_or_default()),
        });
        each.collect::<Vec<_>>().join("\n")
    }
}
