//! The watch over a booted network: what happens to its nodes, and the boot-up of those that come back.
//!
//! In: the events of the network, and the frames of others ([`Supervisor::hear`]). Out: [`SupervisorEvent`]s. A node whose supply or cable
//! was away is stopped, identified, configured and watched anew; it is not started, and nothing moves, until the caller
//! resumes it ([`Supervisor::resume`]).
//!
//! A drive that stops for want of this master's heartbeat may go on with its old motion at the next one (M joint manual, 5.11.2),
//! before it could be stopped. So the heartbeat is held back as soon as such a drive is out of reach, which stops all that watch
//! it, and sent again when all of them are back and have been stopped. For that the loss of a drive has to be noticed
//! before the drive notices the loss of its master: by a shorter heartbeat of its own (1017h) than the watch that it has (1016h).

mod emcy_log;
mod event;
mod foreign;

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use can::{Frame, Instant};
use canopen::{NmtCommand, NmtState, NodeId};

use crate::Drive;
use crate::boot::{Assignment, BootPlan, Expectation, NodeReport, Startup};
use crate::core::{Event, NodeSet};
use crate::drive::{HostLoss, SwitchedOff};
use crate::error::Error;
use crate::network::Network;

pub use emcy_log::{EmcyLog, EmcyRecord};
pub use event::SupervisorEvent;
pub use foreign::Foreign;

/// How often events are looked for: quick to a person.
const POLL: Duration = Duration::from_millis(20);

/// Watches a network that was booted by a plan. Its runner has to go on running.
#[derive(Debug)]
pub struct Supervisor {
    network: Network,
    plan: BootPlan,
    emcys: EmcyLog,
    foreign: foreign::ForeignMasters,
    /// When each node's last boot-up by this master ended: what happened before belongs to it.
    settled: BTreeMap<NodeId, Instant>,
    /// Nodes that came back and are to be booted.
    returned: BTreeMap<NodeId, Return>,
    /// Nodes that this master's heartbeat keeps content, and that are out of reach or could not be stopped yet.
    away: NodeSet,
    /// The heartbeat is held back.
    held: bool,
    to_tell: VecDeque<(Instant, SupervisorEvent)>,
}

/// How a node came back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Return {
    /// Its heartbeat is there again: it was out of reach, and may never have stopped.
    HeartbeatBack,
    /// It has booted.
    Booted,
}

impl Supervisor {
    /// Watches the nodes of `plan`, which has just been booted.
    pub fn new(network: Network, plan: BootPlan) -> Self {
        let now = network.now();
        Self {
            settled: plan.nodes.keys().map(|node| (*node, now)).collect(),
            network,
            plan,
            emcys: EmcyLog::default(),
            foreign: foreign::ForeignMasters::default(),
            returned: BTreeMap::new(),
            away: NodeSet::EMPTY,
            held: false,
            to_tell: VecDeque::new(),
        }
    }

    /// The emergency messages so far.
    pub const fn emcys(&self) -> &EmcyLog {
        &self.emcys
    }

    /// A frame that another station sent, by which another master may be noticed.
    pub fn hear(&mut self, at: Instant, frame: &Frame) {
        let nodes = &self.plan.nodes;
        let foreign = self.foreign.note(frame, self.plan.own, |node| nodes.contains_key(&node));
        self.to_tell.extend(foreign.map(|foreign| (at, SupervisorEvent::Foreign(foreign))));
    }

    /// The next thing that happens, with its time; `None` if nothing does for 20 ms. To be awaited to its end, again and again: a node
    /// that comes back is stopped and booted by it.
    pub async fn next(&mut self) -> Option<(Instant, SupervisorEvent)> {
        if let Some(happening) = self.to_tell.pop_front() {
            return Some(happening);
        }
        while let Some((at, event)) = self.network.poll_event() {
            if let Some(happening) = self.take(at, event) {
                return Some((at, happening));
            }
        }
        if let Some((node, how)) = self.returned.pop_first() {
            let happening = self.recover(node, how).await;
            return Some((self.network.now(), happening));
        }
        self.network.sleep(POLL).await;
        None
    }

    /// Lets a node that came back take part again: NMT start. What it did before does not come back
    /// with it: its set-points were ended. Stops what could not be stopped before.
    ///
    /// # Errors
    /// Those of the SDO requests that stop it, and [`Error::NotReached`] where it turns on. It is not started then.
    pub async fn resume(&mut self, node: NodeId) -> Result<(), Error> {
        if self.away.contains(node) {
            self.stop(node).await?;
            self.away.remove(node);
            self.release_if_all_stand().await?;
        }
        self.network.node(node).nmt(NmtCommand::Start);
        Ok(())
    }

    fn take(&mut self, at: Instant, event: Event) -> Option<SupervisorEvent> {
        // What a boot-up by this master brings about is in its report.
        let is_known = |node: NodeId| self.settled.get(&node).is_some_and(|settled| at <= *settled);
        match event {
            Event::Emcy(node, emcy) => {
                let model = self.plan.nodes.get(&node).and_then(|expectation| expectation.description);
                return Some(SupervisorEvent::Emcy(self.emcys.push(at, node, emcy, model)));
            }
            Event::BootUp(node) | Event::HeartbeatBack(node) | Event::NmtState(node, _) if is_known(node) => {
                return None;
            }
            Event::HeartbeatLost(node, _) => self.lose(at, node),
            Event::BootUp(node) => {
                // Its supply may have come back so soon that no heartbeat was missed.
                self.lose(at, node);
                self.emcys.end(node, at);
                self.note_return(node, Return::Booted);
            }
            Event::HeartbeatBack(node) => self.note_return(node, Return::HeartbeatBack),
            Event::NmtState(node, state) if self.tells_alarm(node, state) => return Some(SupervisorEvent::Alarm(node)),
            // Those are about this program's own questions.
            Event::NoAnswer(..) | Event::Aborted(..) => return None,
            _ => {}
        }
        Some(SupervisorEvent::Event(event))
    }

    /// A drive that this master's heartbeat keeps content is out of reach.
    fn lose(&mut self, at: Instant, node: NodeId) {
        if !self.watches_heartbeat(node) {
            return;
        }
        self.away.insert(node);
        if !self.held {
            self.held = true;
            self.network.hold_heartbeats(true);
            let mut nodes = NodeSet::EMPTY;
            self.plan.nodes.keys().filter(|node| self.watches_heartbeat(**node)).for_each(|node| nodes.insert(*node));
            self.to_tell.push_back((at, SupervisorEvent::Held(nodes)));
        }
    }

    fn tells_alarm(&self, node: NodeId, said: NmtState) -> bool {
        let model = self.plan.nodes.get(&node).and_then(|expectation| expectation.description);
        model.is_some_and(|model| model.tells_alarm(said))
    }

    fn watches_heartbeat(&self, node: NodeId) -> bool {
        matches!(self.network.guarded(node), Some(HostLoss::StopsWithoutHeartbeat { .. }))
    }

    fn note_return(&mut self, node: NodeId, how: Return) {
        let boots = |expectation: &Expectation| expectation.assignment.has(Assignment::SLAVE | Assignment::BOOT);
        if self.plan.nodes.get(&node).is_some_and(boots) {
            // A boot-up says more than a heartbeat.
            let known = self.returned.entry(node).or_insert(how);
            *known = (*known).max(how);
        }
    }

    /// Stops a node that has come back, boots it alone, and lets the heartbeat go out again if no node is missing.
    async fn recover(&mut self, node: NodeId, how: Return) -> SupervisorEvent {
        let stopped = match how {
            Return::HeartbeatBack => self.stop(node).await,
            Return::Booted => {
                // It does nothing yet, and what was armed on it is gone with its supply.
                self.network.forget_guard(node);
                Ok(())
            }
        };
        let report = self.boot(node).await;
        // A node that is not what it was cannot be stopped as it was either: then the boot-up says more.
        if let Err(error) = stopped
            && !report.has_failed()
        {
            return SupervisorEvent::NotStopped(node, error.to_string());
        }
        self.away.remove(node);
        if let Err(error) = self.release_if_all_stand().await {
            return SupervisorEvent::NotStopped(node, error.to_string());
        }
        SupervisorEvent::Recovered(report)
    }

    /// Up to, and without, NMT start. While the heartbeat is held back nothing is armed by it.
    async fn boot(&mut self, node: NodeId) -> NodeReport {
        let expectation = self.plan.nodes.get(&node).cloned().unwrap_or_default();
        let startup = Startup(self.plan.startup.0 | Startup::STARTS_NONE);
        let nodes = BTreeMap::from([(node, expectation)]);
        let plan = BootPlan { startup, nodes, guard: self.plan.guard && !self.held, ..self.plan.clone() };
        let report = self.network.boot(&plan).await;
        self.settled.insert(node, self.network.now());
        report.nodes.into_iter().next().unwrap_or_else(|| NodeReport::of_nothing(node))
    }

    /// Ends the motion of a drive: it must not go on when it hears its master again.
    async fn stop(&self, node: NodeId) -> Result<(), Error> {
        match self.drive(node) {
            Some(drive) => drive.stop().await,
            None => Ok(()),
        }
    }

    fn drive(&self, node: NodeId) -> Option<Drive> {
        let description = self.plan.nodes.get(&node)?.description.filter(|model| model.first_axis().is_some())?;
        Some(Drive::new(self.network.node(node).with_timeout(self.plan.timeout), description))
    }

    /// If no node is missing: every drive that stopped for want of the heartbeat is stopped by command, then it goes
    /// out again.
    async fn release_if_all_stand(&mut self) -> Result<(), Error> {
        if !self.held || !self.away.is_empty() {
            return Ok(());
        }
        let nodes: Vec<NodeId> = self.plan.nodes.keys().copied().collect();
        for node in nodes.iter().copied().filter(|node| self.watches_heartbeat(*node)) {
            if let Err(error) = self.stop(node).await {
                self.away.insert(node);
                return Err(error);
            }
        }
        self.held = false;
        self.network.hold_heartbeats(false);
        self.to_tell.push_back((self.network.now(), SupervisorEvent::Released));
        if self.plan.guard {
            // Those that booted meanwhile.
            for drive in nodes
                .into_iter()
                .filter(|node| self.network.guarded(*node).is_none())
                .filter_map(|node| self.drive(node))
            {
                drive.guard(SwitchedOff::SwitchOn).await?;
            }
        }
        Ok(())
    }
}
