//! The host: its state, and its settings. Its behaviour is in the other files of this folder.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::NodeId;
use devices::Description;
use futures_util::stream::FuturesUnordered;
use machine::file::GroupPlan;
use master::plan::NodeTraffic;
use master::{Gear, Network};

use crate::capture::{CaptureRun, WaysBack};
use crate::console::Reader;
use crate::motion::group_run::GroupRun;
use crate::network::report;
use crate::nodes::heard_ids::HeardIds;
use crate::nodes::known_node::KnownNode;
use crate::nodes::meter::Meter;
use crate::parameters::journals::Journals;
use crate::parameters::transactions::Transactions;
use crate::session::DeadMan;
use crate::session::authority::{Authority, SessionId};
use crate::session::handle::{HostHandle, Inbox, channel};
use crate::trace::{Origin, Trace};
use crate::tune::Tuned;
use crate::wire::Wire;
use crate::work::{Listening, OpenLine, Running, Work};
use crate::world::changes::Changes;
use crate::world::door::WorldDoor;

/// How long a jog continues without being renewed. Checked every 10 ms: a drive is commanded to stop within 200 ms.
pub const JOG_SPAN: Duration = Duration::from_millis(190);

/// How long any other motion continues without a sign of the session that commands it. A browser runs the timers of a tab in
/// the background once a second.
pub const PRESENCE_SPAN: Duration = Duration::from_secs(3);

/// Period at which the clock is checked.
pub(crate) const TICK: Duration = Duration::from_millis(10);

/// Settings of a host.
#[derive(Clone, Debug)]
pub struct Setting {
    /// The bus, as it was given.
    pub bus: String,
    /// Its bit rate, if known.
    pub bitrate: Option<Bitrate>,
    /// Longest wait for each answer of a node.
    pub timeout: Duration,
    /// Models that need not be identified.
    pub models: BTreeMap<NodeId, &'static Description>,
    /// The gears behind the shafts of drives, if any.
    pub gears: BTreeMap<NodeId, Gear>,
    /// The groups of the machine file: what their axes may do.
    pub groups: Vec<GroupPlan>,
    /// Name of the bus in a log: that of its CAN interface, or `can0`.
    pub interface: String,
    /// Unix time of the bus's zero, for a log.
    pub unix_zero: Duration,
    /// Rollback journals of open transactions; none on a bus that ends with this program.
    pub journals: Option<Arc<dyn Journals>>,
    /// The world around the drives, where they are virtual ones of this program.
    pub world: Option<WorldDoor>,
    /// What is to be put back of captures, for whatever ends the program.
    pub ways_back: WaysBack,
    /// What understands the lines of a console, where there is one.
    pub console: Option<Arc<dyn Reader>>,
    /// Health and news of the bus.
    pub wire: Wire,
    /// Frames that a session sends as they are may set drives in motion.
    pub allow_motion: bool,
}

/// The one task that owns the network. See the [crate](crate).
pub struct Host {
    pub(crate) network: Network,
    pub(crate) setting: Setting,
    pub(crate) inbox: Inbox,
    pub(crate) authority: Authority,
    /// The sessions, and which of them has control.
    pub(crate) held_by: Option<SessionId>,
    /// The session that has control is there.
    pub(crate) presence: Option<DeadMan>,
    pub(crate) nodes: BTreeMap<NodeId, KnownNode>,
    pub(crate) scanning: bool,
    /// A node appeared during a scan, and may have been missed.
    pub(crate) scans_again: bool,
    pub(crate) running: BTreeMap<NodeId, Running>,
    pub(crate) jogs: BTreeMap<NodeId, DeadMan>,
    /// The speed limit of each session, in r/min.
    pub(crate) speed_limits: BTreeMap<SessionId, f64>,
    /// Drives that may be moved although nothing stops them when this program dies.
    pub(crate) accepted: BTreeSet<NodeId>,
    /// Drives whose stop was not seen, and in how many consecutive readings each has been at rest since.
    pub(crate) unseen_stops: BTreeMap<NodeId, u32>,
    /// The last reported stop of each node, and its time.
    pub(crate) stops_reported: BTreeMap<NodeId, (Instant, &'static str)>,
    /// Counts the stops of everything, and of everything that this program has moved.
    pub(crate) stops: u64,
    /// Several drives as one motion.
    pub(crate) group: Option<GroupRun>,
    pub(crate) listening: Vec<Listening>,
    /// Lines of consoles that are under way.
    pub(crate) lines: usize,
    /// Those of them that end before they are done with what they are of.
    pub(crate) open_lines: Vec<OpenLine>,
    pub(crate) parameters: Transactions,
    /// Captures under way.
    pub(crate) captures: BTreeMap<NodeId, CaptureRun>,
    /// What was captured of each node, newest first, for its report.
    pub(crate) captured: BTreeMap<NodeId, Vec<report::ReportedCapture>>,
    /// Gains that were proposed to the session that has control, and not tried yet.
    pub(crate) tuned: BTreeMap<NodeId, Box<Tuned>>,
    /// What the last tuning of each node came to, for its report.
    pub(crate) tunings: BTreeMap<NodeId, report::Tuning>,
    /// The changes of the world.
    pub(crate) changes: Changes,
    /// Numbers the work that runs, so that the end of replaced work is not taken for the end of its replacement.
    pub(crate) generation: u64,
    pub(crate) work: Work,
    pub(crate) lifelines: FuturesUnordered<Lifeline>,
    /// Nodes whose PDO mappings are being read, and whether they have to be read again afterwards.
    pub(crate) learning: BTreeMap<NodeId, bool>,
    /// The traffic of each node, as it was last read.
    pub(crate) traffic: BTreeMap<NodeId, NodeTraffic>,
    pub(crate) heard_ids: HeardIds,
    pub(crate) meter: Meter,
    pub(crate) states: u64,
    pub(crate) shown_at: Instant,
}

impl core::fmt::Debug for Host {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Host").field("setting", &self.setting).finish_non_exhaustive()
    }
}

/// Ends with its session.
pub(crate) type Lifeline = futures_util::future::BoxFuture<'static, SessionId>;

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
            stops_reported: BTreeMap::new(),
            stops: 0,
            group: None,
            listening: Vec::new(),
            lines: 0,
            open_lines: Vec::new(),
            parameters: Transactions::default(),
            captures: BTreeMap::new(),
            captured: BTreeMap::new(),
            tuned: BTreeMap::new(),
            tunings: BTreeMap::new(),
            changes: Changes::default(),
            learning: BTreeMap::new(),
            traffic: BTreeMap::new(),
            heard_ids: HeardIds::from(now),
            generation: 0,
            work: Work::new(),
            lifelines: FuturesUnordered::new(),
            states: 0,
            shown_at: now,
        };
        (host, handle)
    }
}
