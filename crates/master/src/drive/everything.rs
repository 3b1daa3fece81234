//! Stopping every drive on the bus, whatever moves it.

use std::collections::BTreeMap;
use std::time::Duration;

use can::Instant;
use canopen::heartbeat::Consumer;
use canopen::object::CONSUMER_HEARTBEAT_TIME_1;
use canopen::{AbortCode, Mux, NmtCommand, NmtState, NodeId};
use cia402::PowerState;
use cia402::object::{CONTROLWORD, STATUSWORD};
use devices::{AxisId, Description, PowerStyle};

use super::handle::Drive;
use super::safety::{ANSWER, SILENCE, STOP};
use crate::core::NodeSet;
use crate::error::Error;
use crate::gear::Gear;
use crate::identify;
use crate::network::{Network, Node, join_all};

/// How many nodes are asked at once, and how long after them the next ones: 32 requests take 40 ms at 100 kbit/s.
pub(super) const WINDOW: usize = 32;
pub(super) const WINDOW_TIME: Duration = Duration::from_millis(40);

/// How long the heartbeat of a program is waited for: three quarters of the two seconds within which most drives expect it.
const HOST_HEARTBEAT: Duration = Duration::from_millis(1500);

/// How far apart the axes of a device have their objects, and how many there may be (CiA 402-1: eight blocks of 800h).
const AXIS_OFFSET: u16 = 0x800;
const MOST_AXES: u8 = 8;

/// What keeps an axis at rest once it was seen to stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopWay {
    /// The quick stop: its motor has power and holds.
    QuickStop,
    /// Its motor has no power, by its quick stop option (605Ah) or since before: a load may move it.
    NoPower,
    /// A fault, which has taken the power off its motor.
    Fault,
}

impl StopWay {
    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::QuickStop => "quick stop",
            Self::NoPower => "no power",
            Self::Fault => "fault",
        }
    }
}

/// What became of an axis when everything was to stop.
#[derive(Clone, Debug)]
pub struct StoppedAxis {
    /// Its node.
    pub node: NodeId,
    /// Which of the node's axes.
    pub axis: AxisId,
    /// The model, as far as that is known.
    pub model: Option<&'static Description>,
    /// How long after the beginning it was seen to stand, by its statusword and its speed (or its position, where it does not
    /// show a speed), and what holds it; or why that was not seen: then it may still be moving.
    pub outcome: Result<(Duration, StopWay), Error>,
}

impl Network {
    /// Stops every drive on the bus, all at the same time, whatever has set it in motion, and returns how each came to rest.
    ///
    /// First one NMT command takes all nodes to pre-operational: no PDO of another master sets a drive going again after
    /// its quick stop, and a node that was stopped by NMT answers SDO (CiA 301, 7.3.2.2). Stopped would not do, since nothing
    /// can then be asked or seen. The nodes are left so: who goes on starts them again. Outputs of other devices stay
    /// as they are in pre-operational.
    ///
    /// Then it goes on as [`quick_stop_everything`](Self::quick_stop_everything). A program whose heartbeat drives watch is left out,
    /// though it was heard and does not answer: it is known by that heartbeat, for which this waits a second and a half at most.
    pub async fn stop_everything(&self, models: &BTreeMap<NodeId, &'static Description>) -> Vec<StoppedAxis> {
        self.nmt_all(NmtCommand::EnterPreOperational);
        let began = self.now();
        let mut stopped = self.quick_stop_everything(models).await;
        let is_silent = |axis: &&StoppedAxis| axis.outcome.is_err() && self.facts(axis.node).answered_at.is_none();
        let silent = stopped.iter().filter(is_silent).map(|axis| axis.node);
        let silent: NodeSet = silent.filter(|node| !models.contains_key(node)).collect();
        let drives: NodeSet = stopped.iter().map(|axis| axis.node).filter(|node| !silent.contains(*node)).collect();
        let hosts = self.hosts_of(drives, silent, began).await;
        stopped.retain(|axis| !hosts.contains(axis.node));
        stopped
    }

    /// Which of these nodes that answer nothing are programs: their heartbeat is what drives watch (1016h), and it goes on to say
    /// "operational" behind the command of `began`, which a device obeys and a master does not.
    async fn hosts_of(&self, drives: NodeSet, silent: NodeSet, began: Instant) -> NodeSet {
        if silent.is_empty() {
            return NodeSet::EMPTY;
        }
        let watched = drives.iter().map(|id| async move {
            let consumers = self.node(id).with_timeout(ANSWER).by_server_in_use();
            consumers.read::<u32>(CONSUMER_HEARTBEAT_TIME_1).await.ok().and_then(Consumer::from_raw)
        });
        let watched = join_all(watched.collect::<Vec<_>>()).await.into_iter().flatten();
        let watched: NodeSet = watched.map(|consumer| consumer.node()).filter(|node| silent.contains(*node)).collect();
        let is_host = |node: NodeId| {
            let facts = self.facts(node);
            facts.heartbeat_at.is_some_and(|at| at > began) && facts.nmt_state == Some(NmtState::Operational)
        };
        while self.now() - began < HOST_HEARTBEAT && !watched.iter().all(is_host) {
            self.sleep(ANSWER / 4).await;
        }
        watched.iter().filter(|node| is_host(*node)).collect()
    }

    /// The same, and the NMT state of each node stays as it is: for callers that may only stop drives. A drive that
    /// another master keeps going by PDO is among the results as one that was not seen to stand, and a node in NMT state
    /// stopped as one that does not answer.
    ///
    /// Each node-ID has a quick stop by SDO, those first that were heard or are in `models`. A node without a controlword
    /// (6040h) is not a drive and is left out. One that was heard, or is in `models`, and does not answer is among the
    /// results with that error. A node-ID that neither answers nor sends anything meanwhile is not: nothing shows it. Of an
    /// unknown model the second and further axes are commanded to stop and cannot be seen to stand.
    ///
    /// Takes a third of a second, and the time of the drives' own ramps. What else this program asks of these drives has to have
    /// ended.
    pub async fn quick_stop_everything(&self, models: &BTreeMap<NodeId, &'static Description>) -> Vec<StoppedAxis> {
        let began = self.now();
        self.quick_stop_moved();
        let expected: NodeSet = self.seen().iter().chain(models.keys().copied()).collect();
        let (first, others): (Vec<_>, Vec<_>) = NodeId::all().partition(|node| expected.contains(*node));
        let turns = others.chunks(WINDOW).enumerate().flat_map(|(number, window)| {
            window.iter().map(move |node| (*node, WINDOW_TIME * (number as u32 + u32::from(!expected.is_empty()))))
        });
        let stops = first.into_iter().map(|node| (node, Duration::ZERO)).chain(turns).map(|(id, wait)| async move {
            if !wait.is_zero() {
                self.sleep(wait).await;
            }
            // A stop waits for no record of a server.
            let node = self.node(id).with_timeout(ANSWER).by_server_in_use();
            let stopped = stop_node(&node, models.get(&id).copied(), expected.contains(id)).await;
            let since = |axis: StoppedAxis| StoppedAxis {
                outcome: axis.outcome.map(|(_, way)| (self.now() - began, way)),
                ..axis
            };
            stopped.into_iter().map(since).collect::<Vec<_>>()
        });
        let mut stopped: Vec<_> = join_all(stops.collect::<Vec<_>>()).await.into_iter().flatten().collect();
        stopped.sort_by_key(|axis| (axis.node, axis.axis));
        stopped
    }
}

/// Stops what is at a node-ID. Nothing where there is no node, or one that is not a drive.
async fn stop_node(node: &Node, named: Option<&'static Description>, is_expected: bool) -> Vec<StoppedAxis> {
    if named.is_some_and(|model| model.axes.is_empty()) {
        return Vec::new();
    }
    let first = Drive { node: node.clone(), axis: AxisId::FIRST, description: named, guess: None, gear: Gear::DIRECT };
    // The model is asked for only once the stop is sent.
    let commanded = first.command_stop().await;
    match commanded {
        Err(Error::Aborted { code: AbortCode::NO_SUCH_OBJECT, .. }) => return Vec::new(),
        Err(Error::NoAnswer { .. }) if !is_expected && node.facts().seen_at.is_none() => return Vec::new(),
        _ => {}
    }
    let model = match named {
        Some(model) => Some(model),
        None => identify::knowledge(node).await.ok().and_then(|knowledge| knowledge.description()),
    };
    let Some(model) = model.filter(|model| !model.axes.is_empty()) else {
        let mut stopped = vec![first.brought_to_rest().await];
        if stopped.iter().all(|axis| axis.outcome.is_ok()) {
            stopped.extend(stop_unseen_axes(node).await);
        }
        return stopped;
    };
    let axes = (0..model.axes.len() as u8).map(|axis| {
        let drive = Drive { axis: AxisId(axis), description: Some(model), ..first.clone() };
        async move { drive.brought_to_rest().await }
    });
    join_all(axes.collect::<Vec<_>>()).await
}

/// Commands the further axes of a device of unknown model to stop, where it has them.
async fn stop_unseen_axes(node: &Node) -> Vec<StoppedAxis> {
    let mut axes = Vec::new();
    for axis in 1..MOST_AXES {
        let place = |mux: Mux| Mux::new(mux.index + u16::from(axis) * AXIS_OFFSET, mux.sub_index);
        if node.read::<u16>(place(STATUSWORD)).await.is_err() {
            break;
        }
        let sent = node.write(place(CONTROLWORD), STOP.0).await;
        let unseen = Error::UnknownModel { node: node.id(), intent: "see its further axes stand" };
        axes.push(StoppedAxis { node: node.id(), axis: AxisId(axis), model: None, outcome: sent.and(Err(unseen)) });
    }
    axes
}

impl Drive {
    /// The first word to a drive of which it is not known what it does.
    async fn command_stop(&self) -> Result<(), Error> {
        if self.may_hold_by_stopping() && self.is_without_power().await {
            return Ok(());
        }
        self.write_controlword(STOP).await
    }

    async fn brought_to_rest(&self) -> StoppedAxis {
        let outcome = match self.come_to_rest(SILENCE).await {
            Ok(after) => self.statusword().await.map(|statusword| (after, self.way_of(statusword))),
            Err(error) => Err(error),
        };
        StoppedAxis { node: self.node.id(), axis: self.axis, model: self.description, outcome }
    }

    /// What keeps an axis that stands from turning.
    fn way_of(&self, statusword: cia402::Statusword) -> StopWay {
        let has_power = match self.power_style() {
            PowerStyle::EchoesControlword { live, .. } => statusword.has(live),
            _ => self.power_state(statusword) == Some(PowerState::QuickStopActive),
        };
        if self.power_style().is_faulted(statusword) && !has_power {
            StopWay::Fault
        } else if has_power {
            StopWay::QuickStop
        } else {
            StopWay::NoPower
        }
    }
}
