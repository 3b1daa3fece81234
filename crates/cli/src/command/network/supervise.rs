//! `ferrodrive supervise`: boots a network, then watches it, and boots again what comes back.

use std::io::{self, BufRead, IsTerminal};
use std::path::PathBuf;
use std::time::Duration;

use can::BusFrame;
use canopen::NodeId;
use host::network::boot::BootReport;
use host::network::supervise::WatchedEvent;
use master::core::{Event, NodeSet};
use master::supervise::{EmcyRecord, Supervisor, SupervisorEvent};
use tokio::sync::mpsc::{Receiver, channel};
use words::node::node;

use super::boot::{Planned, announce, global_of, plan_of, planned_by};
use crate::context::Context;
use crate::failure::Failure;
use crate::global::Global;
use crate::output::{Format, Report};
use crate::session;
use plot::Paint;
use words::time::some_time;

/// Boot the nodes of a network, then watch heartbeats, errors and nodes that come back
///
/// Boots as `ferrodrive boot` does, and has each drive stop by itself when this command dies, where its model can do
/// that; where it cannot, this is reported. Then it reports what happens: lost heartbeats, states, emergency messages
/// with fault and remedy, another master. A node whose supply or cable was away is stopped, identified and configured
/// again; the line `resume NODE` on standard input starts it (NMT). While a drive that monitors this command's
/// heartbeat is out of reach, the heartbeat is held back, so that nothing resumes by itself: that stops every drive
/// that monitors it. A node that was operational is left as it is; if it does not have the values of the file, the
/// command ends with status 1. It never moves a motor. Ctrl-C ends it, and the drives then no longer monitor it.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive supervise examples/machine.toml --for 2s\n  \
    ferrodrive --bus can0 supervise machine.toml\n  \
    ferrodrive --bus can0 supervise master.dcf --own-node 1")]
pub(crate) struct Supervise {
    /// Machine file, or DCF of a CANopen manager (default: --machine, --model, or the nodes on the bus)
    #[arg(value_name = "FILE.toml|MASTER.dcf")]
    file: Option<PathBuf>,
    /// Boot and watch only this node; may be repeated
    #[arg(long = "node", value_name = "NODE", value_parser = node)]
    nodes: Vec<NodeId>,
    /// Node-ID of this master, for drives that do not monitor a heartbeat yet (1016h)
    #[arg(long, value_name = "NODE", value_parser = node, default_value = "127")]
    own_node: NodeId,
    /// End after this time (default on an embedded virtual bus: 1s)
    #[arg(long = "for", value_name = "TIME", value_parser = some_time)]
    duration: Option<Duration>,
}

/// Nothing happens on an embedded bus by itself.
const EMBEDDED_DURATION: Duration = Duration::from_secs(1);

/// Words that wait until a node is booted.
const WORDS: usize = 16;

impl Supervise {
    /// Boots and watches, until it is asked to end.
    pub(crate) fn run(&self, global: &Global, format: Format) -> Result<(), Failure> {
        let planned = planned_by(self.file.as_deref(), global)?;
        let global = global_of(&planned, global)?;
        session::run(&global, async |context| self.supervise(context, &planned, format).await)
    }

    async fn supervise(&self, context: &Context, planned: &Planned, format: Format) -> Result<(), Failure> {
        let mut plan = plan_of(planned, context, &self.nodes).await?;
        plan.own = self.own_node;
        announce(context, &plan);
        let mut others = context.traffic.of_others();
        let report = context.network.boot(&plan).await;
        let unconfigured = context.network.unconfigured(&plan, &report).await;
        let booted = BootReport::new(&plan, &report, &unconfigured);
        let failure = booted.failure().map(Failure::from);
        format.print_failed(&booted, failure.as_ref())?;
        if let Some(failure) = failure.filter(|_| !unconfigured.is_empty()) {
            // What is watched had better be what was planned.
            return Err(Failure { reported: true, ..failure });
        }
        while let Some((at, event)) = context.network.poll_event() {
            // What the report of the boot-up does not have.
            if let Event::TwoDevices(..) = event {
                format.print(&WatchedEvent::new(at, &SupervisorEvent::Event(event))).map_err(Failure::of_stdout)?;
            }
        }
        let mut supervisor = Supervisor::new(context.network.clone(), plan);
        context.progress.show("watching; Ctrl-C ends it");
        let mut words = words();
        let end = self.duration.or(context.is_embedded().then_some(EMBEDDED_DURATION));
        let end = end.map(|duration| context.network.now() + duration);
        while end.is_none_or(|end| context.network.now() < end) {
            while let Ok(BusFrame { at, frame, .. }) = others.try_recv() {
                supervisor.hear(at, &frame);
            }
            while let Ok(word) = words.try_recv() {
                obey(&mut supervisor, context, &word).await;
            }
            // To its end, whatever else happens: it may be stopping a motor.
            if let Some((at, happening)) = supervisor.next().await {
                format.print(&WatchedEvent::new(at, &happening)).map_err(Failure::of_stdout)?;
            }
        }
        let open = supervisor.emcys().records().filter(|record| record.gone.is_none());
        open.for_each(|record: &EmcyRecord| context.note(&format!("still present: {record}")));
        Ok(context.network.release_guards(NodeSet::ALL).await?)
    }
}

/// The lines of standard input; none once it ends. The thread ends with the program.
fn words() -> Receiver<String> {
    let (send, words) = channel(WORDS);
    std::thread::spawn(move || {
        for line in io::stdin().lock().lines() {
            let Ok(line) = line else { break };
            if !line.trim().is_empty() && send.blocking_send(line).is_err() {
                break;
            }
        }
    });
    words
}

/// `resume 4`. An invalid line is reported, and nothing is done.
async fn obey(supervisor: &mut Supervisor, context: &Context, line: &str) {
    let wanted = line.trim().strip_prefix("resume ").map(|rest| node(rest.trim()));
    match wanted {
        Some(Ok(node)) => match supervisor.resume(node).await {
            Ok(()) => context.note(&format!("node {node}: started again (NMT start)")),
            Err(error) => context.note(&format!("node {node} is not resumed: {error}")),
        },
        Some(Err(reason)) => context.note(&reason),
        None => {
            let how = if io::stdin().is_terminal() { "; Ctrl-C ends it" } else { "" };
            context.note(&format!("expected resume NODE{how}, got '{}'", line.trim()));
        }
    }
}

impl Report for WatchedEvent {
    fn text(&self, paint: Paint) -> String {
        format!("{} {}", paint.dim(&format!("({:.3})", self.t)), self.text)
    }
}
