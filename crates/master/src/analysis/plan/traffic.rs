//! What the nodes of a machine and their host send in a cycle, by how they are set up, as frames with bounds.

use std::fmt;
use std::time::Duration;

use can::{Bitrate, CanId};
use canopen::pdo::{Direction, EventTrigger, PdoId, PdoNumber};
use canopen::{CobId, NodeId, connection_set};
use devices::Timing;

use super::queued::{Queued, Trigger};
use super::response_time::{Bound, ErrorRate, load, response_times};
use crate::network::DEFAULT_TIMEOUT;
use crate::pdo::{PdoConfig, TransmissionType};

/// Data bytes of the frames of fixed length.
const SDO_BYTES: u8 = 8;
const EMCY_BYTES: u8 = 8;
const HEARTBEAT_BYTES: u8 = 1;
const NMT_BYTES: u8 = 2;

/// No motion waits for an SDO answer; the client does, for so long.
const SDO_PATIENCE: Duration = DEFAULT_TIMEOUT;

/// One node: what it sends on its own, and how fast it is.
#[derive(Clone, Debug)]
pub struct NodeTraffic {
    /// Its node-ID.
    pub node: NodeId,
    /// Its PDOs with their COB-IDs, those that are switched off too.
    pub pdos: Vec<(PdoConfig, CobId)>,
    /// The RPDO that the host sends in each cycle; `None`: every one that is switched on.
    pub in_cycle: Option<PdoNumber>,
    /// What makes it send event-driven TPDOs.
    pub event_trigger: EventTrigger,
    /// Its heartbeat producer time (1017h); `None`: it has none, or it is off.
    pub heartbeat: Option<Duration>,
    /// It sends EMCY.
    pub emcy: bool,
    /// How fast it answers.
    pub timing: Timing,
}

/// In which order the host's frames leave its controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HostQueue {
    /// In the order given: a computer with SocketCAN, an adapter, a gateway.
    #[default]
    Fifo,
    /// The most urgent first: a controller with a mailbox for each.
    Priority,
}

/// What the host does, and what is taken for what nothing bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Period of SYNC, in which each RPDO is sent once.
    pub cycle: Duration,
    /// SYNC is on the bus.
    pub has_sync: bool,
    /// How much later than its grid the host sends SYNC and the RPDOs, at most.
    pub jitter: Duration,
    /// The queue of its controller.
    pub queue: HostQueue,
    /// Shortest time between two SDO requests of the host, to whichever node; `None`: it sends none.
    pub sdo: Option<Duration>,
    /// Shortest time between two EMCY of a node; `None`: while no drive reports a fault.
    pub emcy: Option<Duration>,
    /// Shortest time between two NMT commands; `None`: while none is given.
    pub nmt: Option<Duration>,
    /// Heartbeat of the host with its node-ID.
    pub host_heartbeat: Option<(NodeId, Duration)>,
    /// How often a frame is destroyed.
    pub errors: Option<ErrorRate>,
}

impl Settings {
    /// A cycle of SYNC with SDO requests 10 ms apart and EMCY of each node 100 ms apart, without NMT commands; a host that is
    /// always in time.
    pub const fn new(cycle: Duration) -> Self {
        Self {
            cycle,
            has_sync: true,
            jitter: Duration::ZERO,
            queue: HostQueue::Fifo,
            sdo: Some(Duration::from_millis(10)),
            emcy: Some(Duration::from_millis(100)),
            nmt: None,
            host_heartbeat: None,
            errors: None,
        }
    }

    /// The same while nothing but the cycle and heartbeats is on the bus: no SDO, no EMCY, no NMT command.
    #[must_use]
    pub const fn cycle_alone(self) -> Self {
        Self { sdo: None, emcy: None, nmt: None, ..self }
    }
}

/// What a frame is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// NMT command of the host.
    Nmt,
    /// SYNC of the host.
    Sync,
    /// EMCY of a node.
    Emcy,
    /// A PDO of a node; an RPDO is sent by the host.
    Pdo(PdoId),
    /// SDO request of the host, to any node.
    SdoRequest,
    /// The answer to one, of any node.
    SdoAnswer,
    /// Heartbeat, of a node or of the host.
    Heartbeat,
}

impl fmt::Display for Purpose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nmt => f.write_str("NMT"),
            Self::Sync => f.write_str("SYNC"),
            Self::Emcy => f.write_str("EMCY"),
            Self::Pdo(pdo) => pdo.fmt(f),
            Self::SdoRequest => f.write_str("SDO request"),
            Self::SdoAnswer => f.write_str("SDO answer"),
            Self::Heartbeat => f.write_str("heartbeat"),
        }
    }
}

/// One frame of the plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedFrame {
    /// What it is for.
    pub purpose: Purpose,
    /// The node that it is of, or to; `None` for what goes to all, and for SDO, which has the least urgent identifier of any.
    pub node: Option<NodeId>,
    /// As it is queued.
    pub frame: Queued,
    /// Until when it has to be there, from the beginning of its period (of its SYNC's): the next one; for SDO, as long as one waits
    /// for an answer.
    pub deadline: Duration,
    /// When it is there.
    pub bound: Bound,
}

impl PlannedFrame {
    /// It is there in time, in every case that was planned for.
    pub fn is_in_time(&self) -> bool {
        self.bound.worst.is_some_and(|worst| worst <= self.deadline)
    }
}

/// Remarks on a PDO for the planner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remark {
    /// Event-driven, without inhibit time: nothing bounds how often it comes. It was taken once in a cycle, or as often as its event
    /// timer brings it where that is more.
    Unbounded(NodeId, PdoId),
    /// Sent only when a remote frame asks for it: left out.
    OnRequest(NodeId, PdoId),
    /// Its identifier is another frame's too.
    Shared(NodeId, PdoId, CanId),
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unbounded(node, pdo) => write!(
                f,
                "node {node} {pdo}: event-driven without inhibit time, so that nothing bounds how often it comes; taken once a \
                 cycle, or as often as its event timer brings it. Set {:04X}h:03, or a synchronous transmission type",
                pdo.parameter_index()
            ),
            Self::OnRequest(node, pdo) => write!(f, "node {node} {pdo}: sent on remote request only; left out"),
            Self::Shared(node, pdo, id) => write!(f, "node {node} {pdo}: {id}h is another frame's identifier too"),
        }
    }
}

/// Everything that is sent, with bounds.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The frames, most urgent first.
    pub frames: Vec<PlannedFrame>,
    /// Share of its time that the bus is taken at most.
    pub load: f64,
    /// What was taken or left out.
    pub remarks: Vec<Remark>,
}

impl Plan {
    /// Each frame is there in time.
    pub fn fits(&self) -> bool {
        self.frames.iter().all(PlannedFrame::is_in_time)
    }

    /// Whether a host that tolerates so many cycles in a row without a PDO runs on this bus, where `cycle_alone` is the plan of the same
    /// [without SDO and EMCY](Settings::cycle_alone): all is in time then, and what comes beside it delays no PDO for longer.
    pub fn is_tolerable(&self, cycle_alone: &Self, tolerance: u32) -> bool {
        let holds = |frame: &PlannedFrame| match frame.purpose {
            Purpose::Sync | Purpose::Pdo(_) => {
                frame.bound.worst.is_some_and(|worst| worst <= frame.deadline * (1 + tolerance))
            }
            _ => frame.is_in_time(),
        };
        cycle_alone.fits() && self.frames.iter().all(holds)
    }
}

/// A frame before its bound is known.
struct Draft {
    purpose: Purpose,
    node: Option<NodeId>,
    frame: Queued,
    deadline: Duration,
    by_host: bool,
}

/// Plans the bus of these nodes.
pub fn plan(nodes: &[NodeTraffic], settings: &Settings, bitrate: Bitrate) -> Plan {
    let mut remarks = Vec::new();
    let mut drafts = of_host(nodes, settings);
    let sync = drafts.iter().position(|draft| draft.purpose == Purpose::Sync);
    let request = drafts.iter().position(|draft| draft.purpose == Purpose::SdoRequest);
    drafts.extend(request.and_then(|by| sdo_answer(nodes, settings, by)));
    for node in nodes {
        let beside = drafts.len();
        of_node(node, settings, sync, &mut drafts, &mut remarks);
        for draft in &drafts[beside..] {
            let shares = drafts.iter().any(|other| other.frame.id == draft.frame.id && !std::ptr::eq(other, draft));
            if let (true, Purpose::Pdo(pdo)) = (shares, draft.purpose) {
                remarks.push(Remark::Shared(node.node, pdo, draft.frame.id));
            }
        }
    }
    if settings.queue == HostQueue::Fifo {
        stand_in_line(&mut drafts);
    }
    let frames: Vec<Queued> = drafts.iter().map(|draft| draft.frame.clone()).collect();
    let bounds = response_times(&frames, bitrate, settings.errors);
    let mut planned: Vec<PlannedFrame> = drafts
        .into_iter()
        .zip(bounds)
        .map(|(Draft { purpose, node, frame, deadline, .. }, bound)| PlannedFrame {
            purpose,
            node,
            frame,
            deadline,
            bound,
        })
        .collect();
    let load = load(&frames, bitrate);
    planned.sort_by_key(|planned| can::Frame::new(planned.frame.id, &[]).arbitration_key());
    Plan { frames: planned, load, remarks }
}

/// The shortest cycle, in steps of 0.5 ms to 10 ms and then longer ones, in which everything is there in time, with these settings
/// but for their cycle; `None`: there is none up to 100 ms.
pub fn shortest_cycle(nodes: &[NodeTraffic], settings: &Settings, bitrate: Bitrate) -> Option<Duration> {
    let half_ms = (1..=20).chain([40, 100, 200]);
    let mut cycles = half_ms.map(|half_ms| Duration::from_micros(500) * half_ms);
    cycles.find(|cycle| plan(nodes, &Settings { cycle: *cycle, ..*settings }, bitrate).fits())
}

/// How many nodes like these, over and over in their order, fit the bus at this cycle; at most 127. The PDOs of those that are
/// added have the identifiers of the predefined connection set for their node-IDs.
pub fn most_nodes(nodes: &[NodeTraffic], settings: &Settings, bitrate: Bitrate) -> usize {
    if nodes.is_empty() {
        return 0;
    }
    let fits = |count: usize| {
        let many: Vec<NodeTraffic> =
            (1..=count).filter_map(|id| Some(nodes[(id - 1) % nodes.len()].moved_to(NodeId::new(id as u8)?))).collect();
        plan(&many, settings, bitrate).fits()
    };
    // More nodes never make it easier.
    let (mut fit, mut too_many) = (0, usize::from(NodeId::MAX.raw()) + 1);
    while too_many - fit > 1 {
        let middle = fit.midpoint(too_many);
        if fits(middle) {
            fit = middle;
        } else {
            too_many = middle;
        }
    }
    fit
}

impl NodeTraffic {
    /// The same node under another node-ID, the identifiers of its own PDOs with it.
    fn moved_to(&self, node: NodeId) -> Self {
        let pdos = self.pdos.iter().map(|(config, cob_id)| {
            let is_own = cob_id.0 & 0x7F == u32::from(self.node.raw());
            let moved = (cob_id.0 & !0x7F) | u32::from(node.raw());
            (config.clone(), if is_own { CobId(moved) } else { *cob_id })
        });
        Self { node, pdos: pdos.collect(), ..self.clone() }
    }
}

fn queued(id: CanId, length: u8, period: Duration) -> Queued {
    Queued { id, length, period, jitter: Duration::ZERO, ahead: Vec::new(), with: None, trigger: None }
}

/// The place of SYNC among the frames.
const SYNC: usize = 0;

/// SYNC and the RPDOs, in the order in which they are sent, and what comes between now and then.
fn of_host(nodes: &[NodeTraffic], settings: &Settings) -> Vec<Draft> {
    let draft = |purpose, node, frame: Queued| {
        let deadline = frame.period;
        Draft { purpose, node, frame, deadline, by_host: true }
    };
    let in_cycle = |id, length| Queued { jitter: settings.jitter, ..queued(id, length, settings.cycle) };
    let sync = settings.has_sync.then(|| draft(Purpose::Sync, None, in_cycle(connection_set::SYNC, 0)));
    let with = sync.as_ref().map(|_| SYNC);
    let mut drafts = Vec::from_iter(sync);
    for node in nodes {
        for (config, cob_id) in node.pdos.iter().filter(|(config, cob_id)| is_sent(config, *cob_id)) {
            let is_sent = node.in_cycle.is_none_or(|number| number == config.pdo.number);
            // What a multiplexed one is sent for is not known.
            if config.pdo.direction == Direction::Rpdo && config.multiplexed.is_none() && is_sent {
                let frame = Queued { with, ..in_cycle(cob_id.can_id(), config.map.bytes() as u8) };
                drafts.push(draft(Purpose::Pdo(config.pdo), Some(node.node), frame));
            }
        }
    }
    if let Some(period) = settings.nmt {
        drafts.push(draft(Purpose::Nmt, None, queued(connection_set::NMT, NMT_BYTES, period)));
    }
    if let Some(period) = settings.sdo
        && let Some(last) = nodes.iter().map(|node| node.node).max()
    {
        // To whichever node: the least urgent of their identifiers.
        let frame = queued(connection_set::sdo_request(last), SDO_BYTES, period);
        drafts.push(Draft { deadline: SDO_PATIENCE, ..draft(Purpose::SdoRequest, None, frame) });
    }
    if let Some((host, period)) = settings.host_heartbeat {
        let frame = queued(connection_set::heartbeat(host), HEARTBEAT_BYTES, period);
        drafts.push(draft(Purpose::Heartbeat, Some(host), frame));
    }
    drafts
}

fn of_node(
    node: &NodeTraffic,
    settings: &Settings,
    sync: Option<usize>,
    drafts: &mut Vec<Draft>,
    remarks: &mut Vec<Remark>,
) {
    let id = node.node;
    // Those that are sent to it, with what it acts upon: the frame itself, or the next SYNC.
    let rpdos: Vec<(PdoNumber, usize)> = drafts
        .iter()
        .enumerate()
        .filter_map(|(number, draft)| match draft.purpose {
            Purpose::Pdo(pdo) if draft.node == Some(id) && pdo.direction == Direction::Rpdo => {
                let synchronous = node.pdos.iter().any(|(own, _)| own.pdo == pdo && own.transmission.is_synchronous());
                Some((pdo.number, sync.filter(|_| synchronous).unwrap_or(number)))
            }
            _ => None,
        })
        .collect();
    let mut add = |purpose, frame: Queued, deadline| {
        drafts.push(Draft { purpose, node: Some(id), frame, deadline, by_host: false });
    };
    if let Some(period) = settings.emcy.filter(|_| node.emcy) {
        add(Purpose::Emcy, queued(connection_set::emcy(id), EMCY_BYTES, period), period);
    }
    for (config, cob_id) in &node.pdos {
        if config.pdo.direction == Direction::Rpdo || !is_sent(config, *cob_id) {
            continue;
        }
        let mut frame = queued(cob_id.can_id(), config.bytes() as u8, settings.cycle);
        match config.transmission {
            TransmissionType::SYNC_RTR | TransmissionType::EVENT_RTR => {
                remarks.push(Remark::OnRequest(id, config.pdo));
                continue;
            }
            // Without SYNC it does not come.
            transmission if transmission.is_synchronous() && !settings.has_sync => continue,
            transmission if transmission.is_synchronous() => {
                frame.period = settings.cycle * u32::from(transmission.0.max(1));
                frame.trigger = sync.map(|by| answer(by, node.timing.pdo_reaction));
            }
            _ if node.event_trigger == EventTrigger::AnswersRpdo => {
                let Some(by) = rpdos.iter().find(|(number, _)| *number == config.pdo.number) else { continue };
                frame.trigger = Some(answer(by.1, node.timing.pdo_reaction));
            }
            transmission => {
                let inhibit = config.inhibit_time.filter(|time| !time.is_zero());
                let timer = config.event_time.filter(|time| !time.is_zero());
                let by_timer_alone = transmission == TransmissionType::EVENT_PROFILE
                    && node.event_trigger == EventTrigger::ChangeOr255ByTimer;
                frame.period = match (inhibit, timer) {
                    (inhibit, Some(timer)) if by_timer_alone => timer.max(inhibit.unwrap_or_default()),
                    (Some(inhibit), _) => inhibit,
                    // Changes may bring it at any time; the timer brings it at the latest.
                    (None, timer) => {
                        remarks.push(Remark::Unbounded(id, config.pdo));
                        timer.map_or(settings.cycle, |timer| timer.min(settings.cycle))
                    }
                };
            }
        }
        // A synchronous one is of its cycle, however seldom it comes.
        let deadline = if frame.trigger.is_some() { settings.cycle } else { frame.period };
        add(Purpose::Pdo(config.pdo), frame, deadline);
    }
    if let Some(period) = node.heartbeat {
        add(Purpose::Heartbeat, queued(connection_set::heartbeat(id), HEARTBEAT_BYTES, period), period);
    }
}

/// One request is under way at a time, so that one answer is: of the node whose identifier is the least urgent, and as early and
/// as late as that of any.
fn sdo_answer(nodes: &[NodeTraffic], settings: &Settings, by: usize) -> Option<Draft> {
    let (last, period) = (nodes.iter().map(|node| node.node).max()?, settings.sdo?);
    let spans = || nodes.iter().map(|node| node.timing.sdo_answer);
    let least_us = spans().map(|span| span.least_us).min()?;
    let most_us = spans().map(|span| span.most_us).max()?;
    let trigger = Some(answer(by, devices::Span::new(least_us, most_us, "")));
    let frame = Queued { trigger, ..queued(connection_set::sdo_reply(last), SDO_BYTES, period) };
    Some(Draft { purpose: Purpose::SdoAnswer, node: None, frame, deadline: SDO_PATIENCE, by_host: false })
}

fn answer(by: usize, span: devices::Span) -> Trigger {
    let of_us = |us: u32| Duration::from_micros(us.into());
    Trigger { by, least: of_us(span.least_us), most: of_us(span.most_us) }
}

fn is_sent(config: &PdoConfig, cob_id: CobId) -> bool {
    cob_id.is_valid() && !config.is_empty()
}

/// In a queue SYNC and the RPDOs follow each other, and any of the others may stand before them, and before each other.
fn stand_in_line(drafts: &mut [Draft]) {
    let is_cyclic = |draft: &Draft| matches!(draft.purpose, Purpose::Sync | Purpose::Pdo(_));
    let host: Vec<usize> = (0..drafts.len()).filter(|number| drafts[*number].by_host).collect();
    let seldom: Vec<usize> = host.iter().copied().filter(|number| !is_cyclic(&drafts[*number])).collect();
    let cyclic: Vec<usize> = host.iter().copied().filter(|number| is_cyclic(&drafts[*number])).collect();
    for number in host {
        let own = &drafts[number];
        let before: Vec<usize> = if is_cyclic(own) {
            let earlier = cyclic.iter().copied().take_while(|other| *other != number);
            earlier.chain(seldom.iter().copied()).collect()
        } else {
            let others = seldom.iter().copied().filter(|other| *other != number);
            cyclic.iter().copied().chain(others).collect()
        };
        drafts[number].frame.ahead = before;
    }
}

#[cfg(test)]
mod tests {
    use canopen::Mux;
    use canopen::pdo::MappingRecord;

    use super::*;
    use crate::core::PdoMap;

    const MS: Duration = Duration::from_millis(1);
    const TPDO1: PdoId = PdoId { direction: Direction::Tpdo, number: PdoNumber::FIRST };

    /// Load of a bus at 500 kbit/s with SYNC each 10 ms and one TPDO of 8 bytes, and whether there was a remark.
    fn with_tpdo(event_trigger: EventTrigger, set: impl Fn(PdoConfig) -> PdoConfig) -> (f64, bool) {
        let map = [0x6064, 0x606C].map(|index| MappingRecord { mux: Mux::new(index, 0), bits: 32 });
        let config = set(PdoConfig::new(TPDO1, PdoMap(map.to_vec())));
        let timing = devices::model("zlac8030l").expect("a model").timing;
        let (node, pdos) = (NodeId::new(4).expect("a node"), vec![(config, CobId(0x184))]);
        let node = NodeTraffic { node, pdos, in_cycle: None, event_trigger, heartbeat: None, emcy: true, timing };
        let plan = plan(&[node], &Settings::new(10 * MS).cycle_alone(), Bitrate::K500);
        (plan.load, !plan.remarks.is_empty())
    }

    /// Longest frames have 55 + 10 s bits for s data bytes (Davis et al., equation 1): SYNC 55, this TPDO 135.
    fn load_of_one_each(period: Duration) -> f64 {
        (55.0 / 10e-3 + 135.0 / period.as_secs_f64()) / 500e3
    }

    #[test]
    fn an_event_timer_brings_a_tpdo_oftener_than_the_cycle() {
        use EventTrigger::{Change, ChangeOr255ByTimer};
        let by_timer = |config: PdoConfig| config.event_time(MS);
        let cases = [
            ("nothing bounds it", with_tpdo(Change, |config| config), 10 * MS, true),
            ("changes, and a timer", with_tpdo(Change, by_timer), MS, true),
            ("a slower timer", with_tpdo(Change, |config| config.event_time(50 * MS)), 10 * MS, true),
            ("the timer alone", with_tpdo(ChangeOr255ByTimer, by_timer), MS, false),
            (
                "the timer alone, slow",
                with_tpdo(ChangeOr255ByTimer, |config| config.event_time(50 * MS)),
                50 * MS,
                false,
            ),
            ("held back", with_tpdo(Change, |config| by_timer(config).inhibit_time(2 * MS)), 2 * MS, false),
            (
                "changes of type 254",
                with_tpdo(ChangeOr255ByTimer, |config| {
                    by_timer(config).transmission(TransmissionType::EVENT_MANUFACTURER)
                }),
                MS,
                true,
            ),
        ];
        for (what, (load, said), period, says) in cases {
            assert!((load - load_of_one_each(period)).abs() < 1e-9, "{what}: {load}");
            assert_eq!(said, says, "{what}");
        }
    }
}
