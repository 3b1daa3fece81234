//! Services of CiA 301 that a described device has by its objects, beside those of [`Device`]: the error history (1003h),
//! consumers of heartbeats (1016h), TIME (1012h) and EMCY (1028h), node and life guarding (100Ch, 100Dh), the store of parameters
//! (1010h, 1011h) with the date of its configuration (1020h), and the scanning of objects for a multiplexed PDO (1FA0h).

use can::{Frame, Instant};
use canopen::guarding::Guarding;
use canopen::heartbeat::{Consumer, ConsumerEvent, MAX_CONSUMERS};
use canopen::node::Via;
use canopen::object::{
    COB_ID_EMCY, COB_ID_SYNC_MESSAGE, COB_ID_TIME_STAMP_OBJECT, CONFIGURATION_DATE, CONFIGURATION_TIME,
    EMERGENCY_CONSUMER_OBJECT, GUARD_TIME, LIFE_TIME_FACTOR, PRODUCER_HEARTBEAT_TIME,
    SYNCHRONOUS_COUNTER_OVERFLOW_VALUE, SYNCHRONOUS_WINDOW_LENGTH,
};
use canopen::od::{Condition, Dictionary, Entry, Slot, Storage, Table, View};
use canopen::pdo::parameter::{SYNC_START_VALUE, TRANSMISSION_TYPE};
use canopen::pdo::{AddressMode, PdoNumber, RPDO_PARAMETER, TPDO_MAPPING, TPDO_PARAMETER, TransmissionType};
use canopen::{AbortCode, CobId, Mux, NmtState, NodeId};

use super::memory::Memory;
use super::overheard::Overheard;
use super::scanner::Scanner;
use crate::engine::device::Device;

/// Most nodes that are watched at a time, whichever entries of 1016h name them.
const CONSUMERS: usize = 8;

/// "save" and "load" (CiA 301, 7.5.2.13 and 7.5.2.14).
const SAVE: u32 = u32::from_le_bytes(*b"save");
const LOAD: u32 = u32::from_le_bytes(*b"load");

const HISTORY: u16 = 0x1003;
const STORE: u16 = 0x1010;
const RESTORE: u16 = 0x1011;
const WATCH: u16 = 0x1016;
const TIME_COB_ID: u16 = COB_ID_TIME_STAMP_OBJECT.index;
const EMCY_CONSUMER: u16 = EMERGENCY_CONSUMER_OBJECT.index;
const SYNC_WINDOW: u16 = SYNCHRONOUS_WINDOW_LENGTH.index;
const SYNC_OVERFLOW: u16 = SYNCHRONOUS_COUNTER_OVERFLOW_VALUE.index;
const LAST_RPDO_PARAMETER: u16 = RPDO_PARAMETER + PdoNumber::MAX - 1;
const LAST_TPDO_PARAMETER: u16 = TPDO_PARAMETER + PdoNumber::MAX - 1;
const LAST_TPDO_MAPPING: u16 = TPDO_MAPPING + PdoNumber::MAX - 1;

/// The services of one device.
#[derive(Clone, Debug)]
pub struct Services<S: Storage> {
    watches: [Option<HeartbeatConsumer>; CONSUMERS],
    /// None of a device without 100Ch and 100Dh, and while heartbeats are produced: a device does one of the two.
    guarding: Option<Guarding>,
    /// Whose remote frames guard.
    node_id: NodeId,
    answer: Option<Frame>,
    overheard: Overheard,
    scanner: Scanner<S>,
    memory: Memory<S>,
    generation: u32,
    /// A parameter was written after the date of the configuration.
    changed: bool,
}

/// A node whose heartbeat is watched.
#[derive(Clone, Copy, Debug)]
struct HeartbeatConsumer {
    /// Of the entry of 1016h.
    sub_index: u8,
    consumer: Consumer,
    /// The heartbeat has stayed away.
    is_lost: bool,
}

impl HeartbeatConsumer {
    fn of(sub_index: u8, raw: u32) -> Option<Self> {
        Some(Self { sub_index, consumer: Consumer::from_raw(raw)?, is_lost: false })
    }
}

/// What a peer's write was to these services.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    /// Nothing of theirs.
    Elsewhere,
    /// An object of theirs.
    Service,
    /// The watch over the last one that was missed (1016h): no node is missed any more, and a first heartbeat is waited for where one
    /// still is to come (CiA 301, 7.2.8.3.2).
    WatchEnded,
}

impl<S: Storage> Services<S> {
    /// With what is found in the memory at power-on.
    pub fn new(memory: Memory<S>) -> Self {
        Self {
            watches: [None; CONSUMERS],
            guarding: None,
            node_id: NodeId::MIN,
            answer: None,
            overheard: Overheard::NOTHING,
            scanner: Scanner::NONE,
            memory,
            generation: 0,
            changed: false,
        }
    }

    /// The supply is back: the memory is as it was left.
    pub fn power_on(&mut self, memory: Memory<S>) {
        self.memory = memory;
        self.overheard = Overheard::NOTHING;
    }

    /// What it has heard of others.
    pub const fn overheard(&self) -> &Overheard {
        &self.overheard
    }

    /// Once each run of the communication task.
    pub fn run_task(&mut self, device: &mut Device<impl Storage>, now: Instant) {
        self.scanner.run(device, now);
    }

    /// Contents of the memory, and a number that changes with them.
    pub const fn memory(&self) -> (&Memory<S>, u32) {
        (&self.memory, self.generation)
    }

    /// What LSS keeps, beside the parameters.
    pub fn store_lss(&mut self, stored: [u8; 2]) {
        self.memory.store_lss(stored);
        self.generation = self.generation.wrapping_add(1);
    }

    /// A program that was downloaded, or cleared.
    pub fn store_program(&mut self, object: Mux, program: &[u8]) {
        self.memory.store_program(object, program);
        self.generation = self.generation.wrapping_add(1);
    }

    /// The memory can be read.
    pub fn is_sound(&self) -> bool {
        self.memory.is_sound()
    }

    /// After the device's restart, before it boots: the stored values of the rows that `wanted` names, and the watches.
    pub fn start(&mut self, device: &mut Device<impl Storage>, wanted: fn(&Entry) -> bool) {
        self.memory.load(device.values_mut(), wanted);
        let mut watches = entries(device.values().view());
        self.watches = core::array::from_fn(|_| watches.next());
        self.node_id = device.node().node_id();
        self.answer = None;
        self.changed = false;
        self.overheard.configure(device.values());
        self.scanner = Scanner::of(device.values().table());
        self.configure_guarding(device);
    }

    /// 100Ch, 100Dh or 1017h has changed, or communication begins.
    fn configure_guarding(&mut self, device: &Device<impl Storage>) {
        let view = device.values().view();
        let value = |mux| view.value(mux).ok();
        self.guarding = match (value(GUARD_TIME), value(LIFE_TIME_FACTOR)) {
            (Some(time_ms), Some(factor)) if value(PRODUCER_HEARTBEAT_TIME).unwrap_or(0) == 0 => {
                Some(Guarding::new(time_ms as u16, factor as u8))
            }
            _ => None,
        };
    }

    /// A peer wrote to `slot`.
    pub fn written(&mut self, device: &mut Device<impl Storage>, slot: Slot, raw: u32, via: Via) -> Written {
        let mux = device.values().table().row(slot).mux();
        if mux.index == CONFIGURATION_DATE.index {
            self.changed = false;
        } else if via == Via::Sdo && device.values().table().row(slot).is_kept() {
            self.changed = true;
        }
        match (mux.index, mux.sub_index) {
            (TIME_COB_ID | EMCY_CONSUMER, _) => self.overheard.configure(device.values()),
            (WATCH, sub_index @ 1..) => {
                if self.watch(sub_index, raw) && !self.misses_anybody() {
                    return Written::WatchEnded;
                }
            }
            (0x100C | 0x100D | 0x1017, 0) => self.configure_guarding(device),
            (HISTORY, 0) => forget_history(device.values_mut()),
            (STORE, sub_index) => {
                if raw == SAVE {
                    if core::mem::take(&mut self.changed) {
                        forget_configuration(device.values_mut());
                    }
                    self.memory.save(device.values(), |row| row.is_kept() && is_in_group(row.mux(), sub_index));
                    self.generation = self.generation.wrapping_add(1);
                }
                restore_default(device, slot);
            }
            (RESTORE, sub_index) => {
                if raw == LOAD {
                    self.memory.forget(|mux| is_in_group(mux, sub_index) || mux.index == CONFIGURATION_DATE.index);
                    self.generation = self.generation.wrapping_add(1);
                }
                restore_default(device, slot);
            }
            _ => return Written::Elsewhere,
        }
        Written::Service
    }

    /// An entry of 1016h has this value now; true if it was the watch over one that is missed.
    fn watch(&mut self, sub_index: u8, raw: u32) -> bool {
        let of_entry = |watch: &Option<HeartbeatConsumer>| watch.is_some_and(|watch| watch.sub_index == sub_index);
        let position = self.watches.iter().position(of_entry).or_else(|| self.watches.iter().position(Option::is_none));
        let Some(position) = position else { return false };
        let before = core::mem::replace(&mut self.watches[position], HeartbeatConsumer::of(sub_index, raw));
        before.is_some_and(|watch| watch.is_lost)
    }

    /// A monitored heartbeat producer is silent.
    fn misses_anybody(&self) -> bool {
        self.watches.iter().flatten().any(|watch| watch.is_lost)
            || self.guarding.is_some_and(|guarding| guarding.is_lost())
    }

    /// The frame is a heartbeat that is watched, or the master's guarding.
    #[inline]
    pub fn wants(&self, frame: &Frame) -> bool {
        self.watches.iter().flatten().any(|watch| watch.consumer.can_id() == frame.id())
            || self.overheard.wants(frame)
            || (self.guarding.is_some() && Guarding::is_request(frame, self.node_id))
    }

    /// A frame arrived at a node in this state; true if what is watched has come again, and nothing else is missing. A boot-up
    /// message is not a heartbeat yet: the node has lost its state.
    pub fn handle_frame(
        &mut self,
        frame: &Frame,
        values: &Dictionary<impl Storage>,
        state: NmtState,
        now: Instant,
    ) -> bool {
        let mut heard = false;
        if self.overheard.wants(frame) && state.allows_sdo() {
            self.overheard.handle_frame(frame, values, now);
        }
        if let Some(guarding) = self.guarding.as_mut().filter(|_| Guarding::is_request(frame, self.node_id)) {
            self.answer = Some(guarding.answer(self.node_id, state, now));
            heard = guarding.take_return();
        }
        for watch in self.watches.iter_mut().flatten() {
            if matches!(watch.consumer.handle_frame(frame, now), Some(ConsumerEvent::Heard(_))) {
                watch.is_lost = false;
                heard = true;
            }
        }
        heard && !self.misses_anybody()
    }

    /// What the master's guarding is answered with.
    pub const fn take_answer(&mut self) -> Option<Frame> {
        self.answer.take()
    }

    /// Time has reached `now`; true if something that is watched has stayed away.
    pub fn handle_timeout(&mut self, now: Instant) -> bool {
        let mut any = self.guarding.as_mut().is_some_and(|guarding| guarding.handle_timeout(now));
        for watch in self.watches.iter_mut().flatten() {
            if watch.consumer.handle_timeout(now) == Some(ConsumerEvent::Lost) {
                watch.is_lost = true;
                any = true;
            }
        }
        any
    }

    /// When [`handle_timeout`](Self::handle_timeout) should next be called.
    pub fn poll_timeout(&self) -> Option<Instant> {
        let guarding = self.guarding.as_ref().and_then(Guarding::poll_timeout);
        self.watches.iter().flatten().filter_map(|watch| watch.consumer.poll_timeout()).chain(guarding).min()
    }

    /// A frame was handed to the bus: an EMCY message goes into the error history.
    pub fn sent(&self, values: &mut Dictionary<impl Storage>, frame: &Frame) {
        let Ok(slot) = values.table().find(COB_ID_EMCY) else { return };
        let is_emcy = frame.id().raw() == values.raw(slot) & 0x7FF;
        let &[low, high, _, manufacturer_low, manufacturer_high, ..] = frame.data() else { return };
        if is_emcy && (low, high) != (0, 0) {
            remember(values, u32::from_le_bytes([low, high, manufacturer_low, manufacturer_high]));
        }
    }
}

/// What a device with these objects refuses beyond its rows: for [`Conditions`](canopen::od::Conditions).
pub(super) fn conditions(table: &'static Table) -> impl Iterator<Item = (Slot, Condition)> {
    let may_name_more = table.find(Mux::new(WATCH, CONSUMERS as u8 + 1)).is_ok();
    let hears_sync = table.find(COB_ID_SYNC_MESSAGE).is_ok();
    table.iter().filter_map(move |(slot, row)| {
        let condition = match (row.index, row.sub_index) {
            (HISTORY, 0) => Condition::Check(only_zero),
            (STORE, 1..) => Condition::Check(only_save),
            (RESTORE, 1..) => Condition::Check(only_load),
            (WATCH, 1..) if may_name_more => Condition::Change(no_more_than_are_watched),
            (TIME_COB_ID, 0) => Condition::Change(no_time_producer),
            (RPDO_PARAMETER..=LAST_RPDO_PARAMETER | TPDO_PARAMETER..=LAST_TPDO_PARAMETER, TRANSMISSION_TYPE)
                if !hears_sync =>
            {
                Condition::Change(no_sync)
            }
            (TPDO_PARAMETER..=LAST_TPDO_PARAMETER, SYNC_START_VALUE) | (SYNC_WINDOW | SYNC_OVERFLOW, 0)
                if !hears_sync =>
            {
                Condition::Change(no_effect)
            }
            _ => return None,
        };
        Some((slot, condition))
    })
}

/// 1020h: another command than the tool's that has written it changes what the device starts with (CiA 301, 7.5.2.23: it is 0 then).
fn forget_configuration(values: &mut Dictionary<impl Storage>) {
    for object in [CONFIGURATION_DATE, CONFIGURATION_TIME] {
        if let Ok(slot) = values.table().find(object) {
            values.set_raw(slot, 0);
        }
    }
}

fn only_zero(_: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    if raw == 0 { Ok(()) } else { Err(AbortCode::INVALID_VALUE) }
}

/// 1012h: these devices have no clock of their own, to produce TIME (bit 30; CiA 301, 7.5.2.15). A file may deliver it set.
fn no_time_producer(_: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    if CobId(raw).generates() { Err(AbortCode::INVALID_VALUE) } else { Ok(()) }
}

/// What waits for SYNC, of a device without 1005h: it hears none (CiA 301, 7.5.2.5). A file may deliver it.
fn no_sync(_: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    match TransmissionType::from_raw(raw as u8)? {
        TransmissionType::RemoteEventDriven => Ok(()),
        wanted if wanted.is_event_driven() => Ok(()),
        _ => Err(AbortCode::INVALID_VALUE),
    }
}

pub(super) fn no_effect(_: &View<'_>, _: u32) -> Result<(), AbortCode> {
    Err(AbortCode::INVALID_VALUE)
}

/// Of a device whose firmware writes to no objects of others: a TPDO in destination address mode would never be sent.
pub(crate) fn no_destinations(table: &'static Table) -> impl Iterator<Item = (Slot, Condition)> {
    let mappings = table.iter().filter(|(_, row)| (TPDO_MAPPING..=LAST_TPDO_MAPPING).contains(&row.index));
    mappings.filter(|(_, row)| row.sub_index == 0).map(|(slot, _)| (slot, Condition::Change(is_not_destination)))
}

fn is_not_destination(_: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    match AddressMode::from_count(raw as u8) {
        Some(AddressMode::Destination) => Err(AbortCode::PDO_TOO_LONG),
        _ => Ok(()),
    }
}

/// Entries of 1016h that name a node.
fn entries(values: View<'_>) -> impl Iterator<Item = HeartbeatConsumer> {
    (1..=MAX_CONSUMERS).filter_map(move |sub_index| {
        let raw = values.value(Mux::new(WATCH, sub_index)).ok()?;
        HeartbeatConsumer::of(sub_index, raw as u32)
    })
}

/// One node more than can be watched is refused, as it would have no effect. A node that is watched may get another time.
fn no_more_than_are_watched(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    let Some(wanted) = Consumer::from_raw(raw) else { return Ok(()) };
    let is_watched = entries(*values).any(|watch| watch.consumer.node() == wanted.node());
    let has_room = entries(*values).count() < CONSUMERS;
    if is_watched || has_room { Ok(()) } else { Err(AbortCode::PARAMETER_INCOMPATIBLE) }
}

fn only_save(_: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    if raw == SAVE { Ok(()) } else { Err(AbortCode::CANNOT_TRANSFER) }
}

fn only_load(_: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    if raw == LOAD { Ok(()) } else { Err(AbortCode::CANNOT_TRANSFER) }
}

/// Sub-index 1 is everything, 2 communication (1000h to 1FFFh), 3 the profile (6000h to 9FFFh), and those from 4 on the
/// maker's.
const fn is_in_group(mux: Mux, group: u8) -> bool {
    match group {
        1 => true,
        2 => matches!(mux.index, 0x1000..=0x1FFF),
        3 => matches!(mux.index, 0x6000..=0x9FFF),
        _ => matches!(mux.index, 0x2000..=0x5FFF),
    }
}

/// The object shows again what it can do.
fn restore_default(device: &mut Device<impl Storage>, slot: Slot) {
    let node_id = device.node().node_id();
    device.values_mut().restore_default(slot, node_id);
}

/// The latest error goes to sub-index 1, the others move up.
fn remember(values: &mut Dictionary<impl Storage>, error: u32) {
    let table = values.table();
    let field = |sub_index| table.find(Mux::new(HISTORY, sub_index));
    let Ok(count_slot) = field(0) else { return };
    let mut moved = error;
    let mut count = 0;
    for sub_index in 1..=254 {
        let Ok(slot) = field(sub_index) else { break };
        let before = values.raw(slot);
        values.set_raw(slot, moved);
        count = sub_index;
        moved = before;
        if before == 0 {
            break;
        }
    }
    values.set_raw(count_slot, u32::from(count));
}

fn forget_history(values: &mut Dictionary<impl Storage>) {
    let table = values.table();
    for sub_index in 1..=254 {
        let Ok(slot) = table.find(Mux::new(HISTORY, sub_index)) else { break };
        values.set_raw(slot, 0);
    }
}
