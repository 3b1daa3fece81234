//! What a master expects of the nodes of a network, and what it makes of them: of the descriptions of their models, or as a
//! CANopen manager's dictionary says (1F80h to 1F8Ah, 1F22h, 1F26h, 1F27h, 1F55h, 1016h). Source: CiA 302-2, 302-3.

use core::fmt;
use std::collections::BTreeMap;
use std::time::Duration;

use canopen::concise::{Concise, ConciseError};
use canopen::heartbeat::Consumer;
use canopen::object::{GUARD_TIME, LIFE_TIME_FACTOR};
use canopen::{Mux, NodeId};
use devices::Description;

use super::assignment::{Assignment, Startup};

/// Timeout of one SDO answer where the source of the plan gives none: a slow drive takes some milliseconds, 127 that
/// are asked at once half a second at 50 kbit/s.
const ANSWER: Duration = Duration::from_millis(200);

/// How often a request is sent until a node counts as silent.
const TRIES: u32 = 3;

/// How long a node may take from a reset to its boot-up message, and to its first answer. The slowest known here takes about one
/// second.
pub(super) const BOOT_TIME: Duration = Duration::from_secs(3);

/// What a node is given as heartbeat producer time that has none.
const HEARTBEAT: Duration = Duration::from_millis(500);

/// Everything that the boot-up of a network goes by.
#[derive(Clone, Debug)]
pub struct BootPlan {
    /// What the master does on its own.
    pub startup: Startup,
    /// The nodes, and what is expected of each.
    pub nodes: BTreeMap<NodeId, Expectation>,
    /// How long a node may take until it answers (1F89h, CiA 302-2). `None` waits for mandatory nodes without limit, as 1F89h = 0 has
    /// it, and for others as long as a plan without 1F89h does.
    pub boot_time: Option<Duration>,
    /// How long each SDO answer is waited for.
    pub timeout: Duration,
    /// How often a request is sent until a node counts as silent; 0 is as 1.
    pub tries: u32,
    /// The heartbeat producer time that a node gets whose 1017h is 0; `None` leaves it so.
    pub heartbeat: Option<Duration>,
    /// The node-ID under which this master sends its own heartbeat.
    pub own: NodeId,
    /// Each drive is made to stop when this program dies, with what its model has for that.
    pub guard: bool,
}

/// What is expected of one node. What is `None` is not looked at.
#[derive(Clone, Debug, Default)]
pub struct Expectation {
    /// What the master does with it (1F81h).
    pub assignment: Assignment,
    /// 1000h (1F84h).
    pub device_type: Option<u32>,
    /// 1018h:01 (1F85h).
    pub vendor_id: Option<u32>,
    /// 1018h:02 (1F86h).
    pub product_code: Option<u32>,
    /// 1018h:03 (1F87h).
    pub revision_number: Option<u32>,
    /// 1018h:04 (1F88h).
    pub serial_number: Option<u32>,
    /// 1F56h:01 (1F55h); looked at with [`Assignment::VERIFY_SOFTWARE`] only.
    pub software: Option<u32>,
    /// 1020h:01 and :02, date and time of its configuration (1F26h, 1F27h). If they are there already, nothing is written.
    pub configured: Option<(u32, u32)>,
    /// What is written to it, in this order (1F22h).
    pub configuration: Vec<(Mux, Vec<u8>)>,
    /// Which sub-index of 1011h restores it (1F8Ah); with [`Assignment::RESTORE`] only.
    pub restore: u8,
    /// The longest time between its heartbeats (1016h of the master); `None`: by its own 1017h.
    pub heartbeat: Option<Duration>,
    /// Its model, where that is known.
    pub description: Option<&'static Description>,
}

impl Expectation {
    /// The identity of a model, as a mandatory node that is not disturbed while it is operational.
    pub fn of(description: &'static Description) -> Self {
        let identity = description.identity;
        // A description without a number (0: 1018h is mandatory, the number may be unknown) expects none.
        let given = |number: u32| (number != 0).then_some(number);
        Self {
            assignment: Assignment::CAREFUL,
            device_type: Some(identity.device_type),
            vendor_id: given(identity.vendor_id),
            product_code: given(identity.product_code),
            revision_number: given(identity.revision_number),
            restore: 1,
            description: Some(description),
            ..Self::default()
        }
    }

    /// Nothing is written to the node, restored or loaded: one that is operational already has all that it is to have.
    pub(super) fn asks_for_nothing(&self) -> bool {
        let steps = Assignment::RESTORE | Assignment::VERIFY_SOFTWARE;
        self.configuration.is_empty() && self.assignment.0 & steps == 0
    }

    /// Guard time and life time factor of the node guarding that it is to be watched by, if it is: of 1F81h, or of the 100Ch and 100Dh
    /// that it is given.
    pub fn guarding(&self) -> Option<(Duration, u8)> {
        let written =
            |object| self.configuration.iter().rev().find(|(to, _)| *to == object).map(|(_, data)| number(data));
        let given = || match written(GUARD_TIME)? {
            0 => None,
            ms => Some((Duration::from_millis(ms.into()), written(LIFE_TIME_FACTOR).unwrap_or(0) as u8)),
        };
        self.assignment.guarding().or_else(given)
    }

    /// A node of which nothing is known: that it answers is all that is expected.
    pub fn of_unknown() -> Self {
        Self { assignment: Assignment::CAREFUL, restore: 1, ..Self::default() }
    }
}

impl BootPlan {
    /// How long this node may take until it answers; `None` without limit.
    pub(super) fn boot_time_of(&self, expectation: &Expectation) -> Option<Duration> {
        let mandatory = expectation.assignment.has(Assignment::MANDATORY);
        self.boot_time.or((!mandatory).then_some(BOOT_TIME))
    }

    /// A plan for these nodes.
    pub fn new(nodes: impl IntoIterator<Item = (NodeId, Expectation)>) -> Self {
        Self {
            startup: Startup::default(),
            nodes: nodes.into_iter().collect(),
            boot_time: Some(BOOT_TIME),
            timeout: ANSWER,
            tries: TRIES,
            heartbeat: Some(HEARTBEAT),
            own: NodeId::MAX,
            guard: true,
        }
    }

    /// The plan of a CANopen manager, from the values of its dictionary as SDO carries them. An object that is not there is
    /// `None`; a number that is shorter than its type is filled up with zeros.
    ///
    /// # Errors
    /// The concise DCF of a node that is not whole, and the dictionary of a device that is not the NMT master.
    pub fn from_objects(object: impl Fn(Mux) -> Option<Vec<u8>>) -> Result<Self, BadPlan> {
        let number = |index, sub_index| object(Mux::new(index, sub_index)).as_deref().map_or(0, number);
        let consumers: BTreeMap<NodeId, Duration> = (1..=127)
            .filter_map(|sub_index| Consumer::from_raw(number(0x1016, sub_index)).map(|consumer| (sub_index, consumer)))
            .map(|(sub_index, consumer)| {
                (consumer.node(), Duration::from_millis((number(0x1016, sub_index) & 0xFFFF).into()))
            })
            .collect();
        let mut plan = Self::new([]);
        plan.startup = Startup(number(0x1F80, 0));
        // CiA 302-2, 1F80h: bit 0 makes the device the NMT master.
        if object(Mux::new(0x1F80, 0)).is_some() && !plan.startup.has(Startup::MASTER) {
            return Err(BadPlan::NoMaster(plan.startup));
        }
        if object(Mux::new(0x1F89, 0)).is_some() {
            let ms = number(0x1F89, 0);
            plan.boot_time = (ms != 0).then(|| Duration::from_millis(ms.into()));
        }
        for node in NodeId::all() {
            let of_node = |index| number(index, node.raw());
            let some = |index| Some(of_node(index)).filter(|value| *value != 0);
            let assignment = Assignment(of_node(0x1F81));
            if !assignment.has(Assignment::SLAVE) {
                continue;
            }
            let concise = object(Mux::new(0x1F22, node.raw())).filter(|stream| !stream.is_empty());
            let configuration = match &concise {
                Some(stream) => entries(stream).map_err(|why| BadPlan::Concise { node, why })?,
                None => Vec::new(),
            };
            let expectation = Expectation {
                assignment,
                device_type: some(0x1F84),
                vendor_id: some(0x1F85),
                product_code: some(0x1F86),
                revision_number: some(0x1F87),
                serial_number: some(0x1F88),
                software: some(0x1F55),
                configured: some(0x1F26).zip(some(0x1F27)),
                configuration,
                restore: some(0x1F8A).map_or(1, |sub_index| sub_index as u8),
                heartbeat: consumers.get(&node).copied(),
                description: None,
            };
            plan.nodes.insert(node, expectation);
        }
        Ok(plan)
    }
}

fn number(bytes: &[u8]) -> u32 {
    bytes.iter().take(4).rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
}

fn entries(stream: &[u8]) -> Result<Vec<(Mux, Vec<u8>)>, ConciseError> {
    Ok(Concise::parse(stream)?.entries().map(|entry| (entry.mux, entry.data.to_vec())).collect())
}

/// A dictionary that no plan can be made of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BadPlan {
    /// A concise DCF that is not whole (1F22h).
    Concise {
        /// Whose configuration it is.
        node: NodeId,
        /// What is wrong with it.
        why: ConciseError,
    },
    /// The dictionary of a device that does not boot a network: bit 0 of its 1F80h is 0.
    NoMaster(Startup),
}

impl BadPlan {
    /// The node that it is about.
    pub const fn node(&self) -> Option<NodeId> {
        match self {
            Self::Concise { node, .. } => Some(*node),
            Self::NoMaster(_) => None,
        }
    }
}

impl fmt::Display for BadPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Concise { node, why } => {
                write!(f, "1F22h:{:02X}, the concise DCF of node {node}, is not whole: {why}", node.raw())
            }
            Self::NoMaster(Startup(bits)) => write!(
                f,
                "1F80h is {bits:X}h: without its bit 0 the device is not the NMT master and boots no node. Set bit 0, or give \
                 the file of the master"
            ),
        }
    }
}

impl core::error::Error for BadPlan {}
