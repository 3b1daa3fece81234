//! The host: what it holds, and what it is told at its start. What it does stands in the files beside this one.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::NodeId;
use devices::Description;
use futures_util::stream::FuturesUnordered;
use master::plan::NodeTraffic;
use master::{Gear, Network};

use super::changes::Changes;
use super::group_run::GroupRun;
use super::heard_ids::HeardIds;
use super::journals::Journals;
use super::known_node::KnownNode;
use super::meter::Meter;
use super::transactions::Transactions;
use super::work::{Listening, Running, Work};
use crate::authority::{Authority, SessionId};
use crate::dead_man::DeadMan;
use crate::handle::{HostHandle, Inbox, channel};
use crate::trace::{Origin, Trace};
use crate::wire::Wire;
use crate::world::WorldDoor;

/// How long a jog goes on without being renewed. Looked at every 10 ms: a drive is told to stop within 200 ms.
pub const JOG_SPAN: Duration = Duration::from_millis(190);

/// How long any other motion goes on without a sign of the session that commands it. A browser calls the timers of a tab in
/// the background once a second.
pub const PRESENCE_SPAN: Duration = Duration::from_secs(3);

/// How often the clock is looked at.
pub(super) const TICK: Duration = Duration::from_millis(10);

/// What a host is told at its start.
#[derive(Clone, Debug)]
pub struct Setting {
    /// The bus as it was named.
    pub bus: String,
    /// Its bit rate, where it is known.
    pub bitrate: Option<Bitrate>,
    /// Longest wait for each answer of a node.
    pub timeout: Duration,
    /// Models that need not be found out.
    pub models: BTreeMap<NodeId, &'static Description>,
    /// What stands behind the drives' shafts, where anything does.
    pub gears: BTreeMap<NodeId, Gear>,
    /// Name of the bus in a log: that of its CAN interface, or `can0`.
    pub interface: String,
    /// Unix time of the bus's zero, for a log.
    pub unix_zero: Duration,
    /// Where what leads back from a transaction is kept meanwhile; nowhere on a bus that ends with this program.
    pub journals: Option<Arc<dyn Journals>>,
    /// The world around the drives, where they are virtual ones of this program.
    pub world: Option<WorldDoor>,
    /// What the bus says beside frames.
    pub wire: Wire,
}

/// The one task that owns the network. See the [crate](crate).
pub struct Host {
    pub(super) network: Network,
    pub(super) setting: Setting,
    pub(super) inbox: Inbox,
    pub(super) authority: Authority,
    /// Whose motions these are.
    pub(super) held_by: Option<SessionId>,
    /// The session that has control is there.
    pub(super) presence: Option<DeadMan>,
    pub(super) nodes: BTreeMap<NodeId, KnownNode>,
    pub(super) scanning: bool,
    /// Somebody came while that was going on, and may have been missed.
    pub(super) scans_again: bool,
    pub(super) running: BTreeMap<NodeId, Running>,
    pub(super) jogs: BTreeMap<NodeId, DeadMan>,
    /// What each session has limited itself to, in r/min.
    pub(super) speed_limits: BTreeMap<SessionId, f64>,
    /// Drives that may be moved although nothing stops them when this program dies.
    pub(super) accepted: BTreeSet<NodeId>,
    /// Drives whose stop was not seen, and in how many looks in a row each has stood since.
    pub(super) unseen_stops: BTreeMap<NodeId, u32>,
    /// What was last told of a stop of each node, and when.
    pub(super) stops_told: BTreeMap<NodeId, (Instant, &'static str)>,
    /// Several drives as one motion.
    pub(super) group: Option<GroupRun>,
    pub(super) listening: Vec<Listening>,
    pub(super) parameters: Transactions,
    /// What was done to the world.
    pub(super) changes: Changes,
    /// Numbers what runs, so that the end of something that was replaced is told from the end of what replaced it.
    pub(super) generation: u64,
    pub(super) work: Work,
    pub(super) lifelines: FuturesUnordered<Lifeline>,
    /// Nodes whose PDO mappings are being read, and whether they have to be read again after that.
    pub(super) learning: BTreeMap<NodeId, bool>,
    /// What each node sends, as it was last read.
    pub(super) traffic: BTreeMap<NodeId, NodeTraffic>,
    pub(super) heard_ids: HeardIds,
    pub(super) meter: Meter,
    pub(super) pictures: u64,
    pub(super) shown_at: Instant,
}

impl core::fmt::Debug for Host {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Host").field("setting", &self.setting).finish_non_exhaustive()
    }
}

/// Ends with its session.
pub(super) type Lifeline = futures_util::future::BoxFuture<'static, SessionId>;

impl Host {
    /// A host on a network that the caller runs, and a handle to it.
    pub fn new(network: Network, setting: Setting) -> (Self, HostHandle) {
        let origin = Origin { interface: setting.interface.clone(), unix_zero: setting.unix_zero };
        let (handle, inbox) = channel(Trace::new(network.models(), origin));
        let now = network.now();
        let host = Self {
            meter: Meter::new(now, setting.bitrate),
            network,
            setting,
            inbox,
            authority: Authority::default(),
            held_by: None,
            presence: None,
            nodes: BTreeMap::new(),
            scanning: false,
            scans_again: false,
            running: BTreeMap::new(),
            jogs: BTreeMap::new(),
            speed_limits: BTreeMap::new(),
            accepted: BTreeSet::new(),
            unseen_stops: BTreeMap::new(),
            stops_told: BTreeMap::new(),
            group: None,
            listening: Vec::new(),
            parameters: Transactions::default(),
            changes: Changes::default(),
            learning: BTreeMap::new(),
            traffic: BTreeMap::new(),
            heard_ids: HeardIds::from(now),
            generation: 0,
            work: Work::new(),
            lifelines: FuturesUnordered::new(),
            pictures: 0,
            shown_at: now,
        };
        (host, handle)
    }
}
