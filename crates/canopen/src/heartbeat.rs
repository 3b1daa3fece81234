//! Boot-up and heartbeat (CiA 301, 7.2.8.3.2 and 7.2.8.3.3): the frame, the producer (1017h), a consumer (1016h).

use can::{CanId, Frame, Instant};

use crate::od::View;
use crate::period::Period;
use crate::{AbortCode, Mux, NmtState, NodeId, connection_set};

const NANOS_PER_MILLI: u64 = 1_000_000;
/// The highest sub-index of 1016h (CiA 301, 7.5.2.19).
pub const MAX_CONSUMERS: u8 = 127;

/// A boot-up or heartbeat frame of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heartbeat {
    /// Who sent it.
    pub node: NodeId,
    /// The state byte as sent: 00h is boot-up.
    pub state: u8,
}

impl Heartbeat {
    /// Boot-up of `node`.
    pub const fn boot_up(node: NodeId) -> Self {
        Self { node, state: 0 }
    }

    /// True for boot-up.
    pub const fn is_boot_up(self) -> bool {
        self.state == 0
    }

    /// The sender's NMT state, if the byte is one that the standard defines.
    pub const fn nmt_state(self) -> Option<NmtState> {
        NmtState::from_heartbeat_byte(self.state)
    }

    /// Reads a frame with identifier 700h + node-ID and at least one byte; `None` for any other.
    pub fn parse(frame: &Frame) -> Option<Self> {
        let connection_set::Service::Heartbeat(node) = connection_set::Service::of(frame.id())? else { return None };
        frame.data().first().map(|state| Self { node, state: *state })
    }

    /// The frame on 700h + node-ID, with one byte (CiA 301, 7.2.8.3.2.2).
    pub fn emit(self) -> Frame {
        Frame::new(connection_set::heartbeat(self.node), &[self.state])
    }
}

/// When the next heartbeat is due. A producer that is served late skips what it missed.
#[derive(Clone, Copy, Debug)]
pub struct Producer(Period);

impl Producer {
    /// A producer that never sends.
    pub const OFF: Self = Self(Period::OFF);

    /// Starts with the boot-up message at `now`, which counts as the first heartbeat. 0 ms is off.
    pub const fn from_boot_up(period_ms: u16, now: Instant) -> Self {
        Self(Period::new(period_ms as u64 * NANOS_PER_MILLI).after(now))
    }

    /// Starts at once, with a heartbeat due at `now`: 1017h was written. 0 ms is off.
    pub const fn from_write(period_ms: u16, now: Instant) -> Self {
        Self(Period::new(period_ms as u64 * NANOS_PER_MILLI).due(now))
    }

    /// When a heartbeat is next due; [`Instant::FAR_FUTURE`] for never.
    pub const fn deadline(&self) -> Instant {
        self.0.deadline()
    }

    /// True if a heartbeat is due at `now`; the next one is then set on the grid of the period.
    pub fn handle_timeout(&mut self, now: Instant) -> bool {
        self.0.handle_timeout(now)
    }
}

/// What a consumer reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConsumerEvent {
    /// The first heartbeat, or the first after a loss; the state byte is given.
    Heard(u8),
    /// The node booted: its state was lost.
    BootUp,
    /// No heartbeat within the consumer time.
    Lost,
}

/// Watches one node's heartbeat, as an entry of 1016h asks. Armed by the first heartbeat.
#[derive(Clone, Copy, Debug)]
pub struct Consumer {
    node: NodeId,
    time_ns: u64,
    watch: Watch,
}

#[derive(Clone, Copy, Debug)]
enum Watch {
    /// Nothing heard yet, or lost.
    Waiting,
    Alive {
        until: Instant,
    },
}

impl Consumer {
    /// Watches `node` with a consumer time in ms.
    pub const fn new(node: NodeId, time_ms: u16) -> Self {
        Self { node, time_ns: time_ms as u64 * NANOS_PER_MILLI, watch: Watch::Waiting }
    }

    /// From the value of 1016h: bits 16 to 23 node-ID, bits 0 to 15 time in ms. `None` if it asks for nothing.
    pub const fn from_raw(raw: u32) -> Option<Self> {
        let time_ms = raw as u16;
        match NodeId::new((raw >> 16) as u8) {
            Some(node) if time_ms != 0 => Some(Self::new(node, time_ms)),
            _ => None,
        }
    }

    /// Whom it watches.
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// The identifier of the frames that it wants.
    pub const fn can_id(&self) -> CanId {
        connection_set::heartbeat(self.node)
    }

    /// True between a heartbeat and its loss.
    pub const fn is_alive(&self) -> bool {
        matches!(self.watch, Watch::Alive { .. })
    }

    /// A frame arrived. Other nodes' frames do nothing.
    pub fn handle_frame(&mut self, frame: &Frame, now: Instant) -> Option<ConsumerEvent> {
        let heartbeat = Heartbeat::parse(frame).filter(|heartbeat| heartbeat.node == self.node)?;
        let was_alive = self.is_alive();
        self.watch = Watch::Alive { until: now.plus_nanos(self.time_ns) };
        if heartbeat.is_boot_up() {
            // A node that has just booted may need its 1017h written first: wait for its first heartbeat anew.
            self.watch = Watch::Waiting;
            return Some(ConsumerEvent::BootUp);
        }
        (!was_alive).then_some(ConsumerEvent::Heard(heartbeat.state))
    }

    /// Time has reached `now`.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<ConsumerEvent> {
        match self.watch {
            Watch::Alive { until } if now >= until => {
                self.watch = Watch::Waiting;
                Some(ConsumerEvent::Lost)
            }
            _ => None,
        }
    }

    /// When [`handle_timeout`](Self::handle_timeout) should next be called.
    pub const fn poll_timeout(&self) -> Option<Instant> {
        match self.watch {
            Watch::Alive { until } => Some(until),
            Watch::Waiting => None,
        }
    }
}

/// Whether an entry of 1016h may take this value: a node that another entry watches is refused (CiA 301, 7.5.2.19).
///
/// # Errors
/// 0604 0043h.
pub fn check_watched_once(values: &View<'_>, entry: Mux, raw: u32) -> Result<(), AbortCode> {
    let Some(wanted) = Consumer::from_raw(raw) else { return Ok(()) };
    let of_entry = |sub_index| Consumer::from_raw(values.value(Mux::new(entry.index, sub_index)).ok()? as u32);
    let others = (1..=MAX_CONSUMERS).filter(|sub_index| *sub_index != entry.sub_index).filter_map(of_entry);
    let mut same = others.filter(|other| other.node() == wanted.node());
    if same.next().is_some() { Err(AbortCode::PARAMETER_INCOMPATIBLE) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(millis: u64) -> Instant {
        Instant::from_millis(millis)
    }

    fn heartbeat(state: u8) -> Frame {
        Heartbeat { node: NodeId::MAX, state }.emit()
    }

    #[test]
    fn parses_what_it_emits_and_refuses_the_rest() {
        for node in NodeId::all() {
            let heartbeat = Heartbeat { node, state: 5 };
            assert_eq!(Heartbeat::parse(&heartbeat.emit()), Some(heartbeat));
        }
        for text in ["700#05", "704#", "704#R1", "604#05", "00000704#05"] {
            assert_eq!(Heartbeat::parse(&text.parse().unwrap()), None, "{text}");
        }
    }

    #[test]
    fn a_producer_keeps_its_grid_and_skips_what_it_missed() {
        let mut producer = Producer::from_boot_up(100, ms(0));
        assert!(!producer.handle_timeout(ms(99)));
        assert!(producer.handle_timeout(ms(103)));
        assert_eq!(producer.deadline(), ms(200));
        assert!(producer.handle_timeout(ms(450)));
        assert!(!producer.handle_timeout(ms(450)));
        assert_eq!(producer.deadline(), ms(500));
    }

    #[test]
    fn a_consumer_is_armed_by_the_first_heartbeat() {
        let mut consumer = Consumer::from_raw(0x007F_07D0).unwrap();
        assert_eq!(consumer.can_id(), CanId::standard(0x77F));
        assert_eq!(consumer.poll_timeout(), None);
        assert_eq!(consumer.handle_timeout(ms(10_000)), None);
        assert_eq!(consumer.handle_frame(&heartbeat(5), ms(10_000)), Some(ConsumerEvent::Heard(5)));
        assert_eq!(consumer.handle_frame(&heartbeat(5), ms(11_000)), None);
        assert_eq!(consumer.handle_timeout(ms(12_999)), None);
        assert_eq!(consumer.handle_timeout(ms(13_000)), Some(ConsumerEvent::Lost));
        assert_eq!(consumer.handle_timeout(ms(20_000)), None);
        assert_eq!(consumer.handle_frame(&heartbeat(0), ms(20_000)), Some(ConsumerEvent::BootUp));
        assert_eq!(consumer.poll_timeout(), None);
    }

    #[test]
    fn an_entry_without_node_or_time_watches_nothing() {
        for raw in [0, 0x0000_07D0, 0x007F_0000, 0x0080_07D0] {
            assert!(Consumer::from_raw(raw).is_none(), "{raw:#X}");
        }
    }
}
