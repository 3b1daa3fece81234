use std::collections::VecDeque;
use std::ops::Range;

use can::{CanId, Frame, Instant, MAX_DATA_LENGTH};
use canopen::pdo::{Direction, PdoId, PdoNumber};
use canopen::{Mux, NodeId};

use super::field::{ImagePlace, bits_of, mask_of};
use super::pdo_map::PdoMap;

/// A value that came by PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// The object's bits, not sign-extended.
    pub raw: u64,
    /// When the PDO came.
    pub at: Instant,
}

/// When an RPDO is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RpdoTrigger {
    /// As soon as a value in it was written.
    Write,
    /// After the next SYNC that this master produces.
    Sync,
}

/// Process image: the newest data of every mapped PDO, with the time it came, and the data to send.
///
/// RPDO and TPDO are from the device's side. A frame that is shorter
/// than its mapping is not taken over (CiA 301, 7.2.2.5). An unsent RPDO is overwritten by its newer value.
#[derive(Clone, Debug)]
pub struct ProcessImage {
    tpdos: Vec<TpdoImage>,
    rpdos: Vec<Rpdo>,
    /// Position in `tpdos` by identifier; `NONE` for most.
    by_id: Vec<u16>,
    /// Positions in `rpdos` to send, each at most once.
    pending: VecDeque<u16>,
    /// Positions in `rpdos` that were written and wait for a SYNC, each at most once.
    waiting: Vec<u16>,
    /// The newest cycle, for the age of what comes.
    cycle: u64,
}

const NONE: u16 = u16::MAX;

/// A PDO keeps its position; one that is no longer used has no identifier.
#[derive(Clone, Debug)]
struct TpdoImage {
    node: NodeId,
    number: PdoNumber,
    /// Counts its mappings, so that a [`ImagePlace`] in an old one finds nothing.
    generation: u16,
    id: Option<u16>,
    map: PdoMap,
    /// Cached, for the receive path.
    bytes: usize,
    data: u64,
    at: Option<Instant>,
    cycle: u64,
    too_short: u32,
    /// Its mapping was written by something else than what set it here: its frames are something else.
    is_suspended: bool,
}

#[derive(Clone, Debug)]
struct Rpdo {
    node: NodeId,
    number: PdoNumber,
    generation: u16,
    id: Option<CanId>,
    map: PdoMap,
    bytes: usize,
    trigger: RpdoTrigger,
    data: u64,
    state: SendState,
    /// A value was written to it: the device may hold one of its frames back until the next SYNC.
    in_use: bool,
    /// As of a TPDO.
    is_suspended: bool,
}

impl TpdoImage {
    const fn is_received(&self) -> bool {
        self.id.is_some() && !self.is_suspended
    }

    /// Whether a place is one of it as it is now.
    const fn is_of(&self, place: ImagePlace) -> bool {
        self.generation == place.generation && !self.is_suspended
    }
}

impl Rpdo {
    const fn is_sent(&self) -> bool {
        self.id.is_some() && !self.is_suspended
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SendState {
    Idle,
    /// Among those that wait for a SYNC.
    Waiting,
    /// Among those to send.
    Pending,
}

impl Default for ProcessImage {
    fn default() -> Self {
        let by_id = vec![NONE; usize::from(CanId::MAX_STANDARD) + 1];
        let (pending, waiting) = (VecDeque::new(), Vec::new());
        Self { tpdos: Vec::new(), rpdos: Vec::new(), by_id, pending, waiting, cycle: 0 }
    }
}

impl ProcessImage {
    /// Receives a node's TPDO under `id` from now on, in place of what that TPDO was before. Nothing changes where it is so
    /// already.
    pub fn set_tpdo(&mut self, node: NodeId, number: PdoNumber, id: u16, map: PdoMap) {
        let bytes = map.bytes();
        let unchanged = |pdo: &TpdoImage| (pdo.node, pdo.number, pdo.id, &pdo.map) == (node, number, Some(id), &map);
        if let Some(pdo) = self.tpdos.iter_mut().find(|pdo| unchanged(pdo)) {
            if std::mem::take(&mut pdo.is_suspended) {
                self.index();
            }
            return;
        }
        let before = self.tpdos.iter().position(|pdo| (pdo.node, pdo.number) == (node, number));
        let generation = before.map_or(0, |position| self.tpdos[position].generation.wrapping_add(1));
        let id = Some(id);
        let (data, at, cycle, too_short, is_suspended) = (0, None, 0, 0, false);
        let new = TpdoImage { node, number, generation, id, map, bytes, data, at, cycle, too_short, is_suspended };
        match before {
            Some(position) => self.tpdos[position] = new,
            None => self.tpdos.push(new),
        }
        self.index();
    }

    /// Receives a node's TPDO no longer.
    pub fn remove_tpdo(&mut self, node: NodeId, number: PdoNumber) {
        if let Some(pdo) = self.tpdos.iter_mut().find(|pdo| (pdo.node, pdo.number) == (node, number)) {
            pdo.generation = pdo.generation.wrapping_add(1);
            (pdo.id, pdo.map, pdo.at) = (None, PdoMap::default(), None);
        }
        self.index();
    }

    /// Of an object that was written: where it is the mapping of a PDO, frames of that PDO are something else now. It is neither received nor
    /// sent until it is set again, or [`resumed`](Self::resume).
    pub(super) fn note_written(&mut self, node: NodeId, index: u16) {
        if let Some((pdo, true)) = PdoId::of_object(index)
            && self.is_live(node, pdo)
        {
            self.suspend(node, pdo, true);
        }
    }

    /// Its mapping was put back as it was.
    pub(crate) fn resume(&mut self, node: NodeId, pdo: PdoId) {
        self.suspend(node, pdo, false);
    }

    /// Whether a PDO is received or sent as it was set.
    pub(crate) fn is_live(&self, node: NodeId, PdoId { direction, number }: PdoId) -> bool {
        match direction {
            Direction::Tpdo => self.tpdo(node, number).is_some(),
            Direction::Rpdo => self.rpdos.iter().any(|pdo| (pdo.node, pdo.number) == (node, number) && pdo.is_sent()),
        }
    }

    fn suspend(&mut self, node: NodeId, PdoId { direction, number }: PdoId, is_suspended: bool) {
        match direction {
            Direction::Tpdo => {
                let found = self.tpdos.iter_mut().filter(|pdo| (pdo.node, pdo.number) == (node, number));
                found.for_each(|pdo| pdo.is_suspended = is_suspended);
                self.index();
            }
            Direction::Rpdo => {
                let is_it = |pdo: &Rpdo| (pdo.node, pdo.number) == (node, number);
                let Some(position) = self.rpdos.iter().position(is_it) else { return };
                (self.rpdos[position].is_suspended, self.rpdos[position].state) = (is_suspended, SendState::Idle);
                self.unqueue(position);
            }
        }
    }

    /// Prepares a node's RPDO for sending under `id`, all bits zero. What it carries stays where that is so already.
    pub fn set_rpdo(&mut self, node: NodeId, number: PdoNumber, id: u16, map: PdoMap, trigger: RpdoTrigger) {
        let id = Some(CanId::standard(id));
        let same = |pdo: &&mut Rpdo| (pdo.node, pdo.number, pdo.id, &pdo.map) == (node, number, id, &map);
        if let Some(pdo) = self.rpdos.iter_mut().find(same) {
            (pdo.trigger, pdo.is_suspended) = (trigger, false);
            return;
        }
        self.remove_rpdo(node, number);
        let bytes = map.bytes().min(MAX_DATA_LENGTH);
        let before = self.rpdos.iter().position(|pdo| (pdo.node, pdo.number) == (node, number));
        let generation = before.map_or(0, |position| self.rpdos[position].generation);
        let (data, state, in_use, is_suspended) = (0, SendState::Idle, false, false);
        let new = Rpdo { node, number, generation, id, map, bytes, trigger, data, state, in_use, is_suspended };
        match before {
            Some(position) => self.rpdos[position] = new,
            None => {
                self.rpdos.push(new);
                // No cycle has to make room.
                self.pending.reserve(self.rpdos.len());
                self.waiting.reserve(self.rpdos.len());
            }
        }
    }

    /// Sends a node's RPDO no longer.
    pub fn remove_rpdo(&mut self, node: NodeId, number: PdoNumber) {
        let Some(position) = self.rpdos.iter().position(|pdo| (pdo.node, pdo.number) == (node, number)) else { return };
        let pdo = &mut self.rpdos[position];
        pdo.generation = pdo.generation.wrapping_add(1);
        (pdo.id, pdo.map, pdo.state) = (None, PdoMap::default(), SendState::Idle);
        self.unqueue(position);
    }

    fn unqueue(&mut self, position: usize) {
        self.pending.retain(|other| usize::from(*other) != position);
        self.waiting.retain(|other| usize::from(*other) != position);
    }

    /// The newest value of an object that a node sends by PDO; `None` if it is not mapped or none has come.
    pub fn value(&self, node: NodeId, mux: Mux) -> Option<Received> {
        let carriers = self.tpdos.iter().filter(|pdo| pdo.node == node && !pdo.is_suspended);
        let values = carriers.filter_map(|pdo| {
            let raw = bits_of(pdo.data, pdo.map.find(mux)?);
            Some(Received { raw, at: pdo.at? })
        });
        values.max_by_key(|received| received.at)
    }

    /// As [`value`](Self::value), of an object that is mapped with this length.
    pub fn value_of_length(&self, node: NodeId, mux: Mux, bits: u32) -> Option<Received> {
        let mapped = self.find_signals(node, mux).map(|(_, place)| place).filter(|place| place.bits() == bits);
        mapped.filter_map(|place| self.at(place)).max_by_key(|received| received.at)
    }

    /// The mapping under which a node's TPDO is received.
    pub fn tpdo_map(&self, node: NodeId, number: PdoNumber) -> Option<&PdoMap> {
        self.tpdo(node, number).map(|pdo| &pdo.map)
    }

    /// When a node's TPDO last came.
    pub fn tpdo_at(&self, node: NodeId, number: PdoNumber) -> Option<Instant> {
        self.tpdo(node, number)?.at
    }

    /// The identifier of a node's TPDO, and how many bytes it carries.
    pub fn tpdo_id(&self, node: NodeId, number: PdoNumber) -> Option<(u16, usize)> {
        let pdo = self.tpdo(node, number)?;
        Some((pdo.id?, pdo.bytes))
    }

    /// How many frames of a node's TPDO were shorter than its mapping and therefore ignored.
    pub fn too_short(&self, node: NodeId, number: PdoNumber) -> u32 {
        self.tpdo(node, number).map_or(0, |pdo| pdo.too_short)
    }

    fn tpdo(&self, node: NodeId, number: PdoNumber) -> Option<&TpdoImage> {
        self.tpdos.iter().find(|pdo| (pdo.node, pdo.number) == (node, number) && pdo.is_received())
    }

    /// Puts a value into every RPDO of the node that carries the object and queues them by their trigger.
    /// False if none carries it. Bits that do not fit are dropped.
    pub fn write(&mut self, node: NodeId, mux: Mux, raw: u64) -> bool {
        let mut found = false;
        for position in 0..self.rpdos.len() {
            let pdo = &self.rpdos[position];
            let Some(bits) = pdo.map.find(mux).filter(|_| pdo.node == node) else { continue };
            let place = Self::place(position, pdo.generation, &bits);
            found |= self.put(place, raw);
        }
        found
    }

    /// Puts a controlword into every RPDO of the node that carries it and has been written to, and sends these at once: a device
    /// that holds the one before back until the next SYNC (CiA 301, 7.2.2.2, synchronous) takes this one instead.
    pub(super) fn overrule(&mut self, node: NodeId, controlword: Mux, raw: u16) {
        for position in 0..self.rpdos.len() {
            let pdo = &self.rpdos[position];
            let Some(bits) = pdo.map.find(controlword).filter(|_| pdo.node == node && pdo.in_use) else { continue };
            let place = Self::place(position, pdo.generation, &bits);
            self.put(place, raw.into());
        }
        self.release_waiting();
    }

    /// Nothing is sent any more, whatever was written.
    pub(super) fn fall_silent(&mut self) {
        self.pending.clear();
        self.waiting.clear();
        self.rpdos.iter_mut().for_each(|pdo| (pdo.state, pdo.in_use) = (SendState::Idle, false));
    }

    /// Where a node's TPDOs have an object, in the order in which they were set up.
    pub(crate) fn find_signals(&self, node: NodeId, mux: Mux) -> impl Iterator<Item = (PdoNumber, ImagePlace)> {
        let tpdos = self.tpdos.iter().enumerate().filter(move |(_, pdo)| pdo.node == node && !pdo.is_suspended);
        tpdos.filter_map(move |(position, pdo)| {
            Some((pdo.number, Self::place(position, pdo.generation, &pdo.map.find(mux)?)))
        })
    }

    /// Where a node's RPDOs have an object.
    pub(crate) fn find_set_points(
        &self,
        node: NodeId,
        mux: Mux,
    ) -> impl Iterator<Item = (PdoNumber, RpdoTrigger, ImagePlace)> {
        let rpdos = self.rpdos.iter().enumerate().filter(move |(_, pdo)| pdo.node == node && !pdo.is_suspended);
        rpdos.filter_map(move |(position, pdo)| {
            let place = Self::place(position, pdo.generation, &pdo.map.find(mux)?);
            Some((pdo.number, pdo.trigger, place))
        })
    }

    /// What is carried by the PDOs of a node that are in use, by their numbers.
    pub(crate) fn carried(&self, node: NodeId, to_device: bool) -> Vec<(PdoNumber, Vec<Mux>)> {
        let tpdos = self.tpdos.iter().filter(|pdo| !to_device && pdo.is_received());
        let rpdos = self.rpdos.iter().filter(|pdo| to_device && pdo.is_sent());
        let all =
            tpdos.map(|pdo| (pdo.node, pdo.number, &pdo.map)).chain(rpdos.map(|pdo| (pdo.node, pdo.number, &pdo.map)));
        let objects = |map: &PdoMap| map.0.iter().map(|object| object.mux).collect();
        all.filter(|(of, ..)| *of == node).map(|(_, number, map)| (number, objects(map))).collect()
    }

    fn place(position: usize, generation: u16, bits: &Range<u32>) -> ImagePlace {
        ImagePlace { slot: position as u16, generation, shift: bits.start as u8, mask: mask_of(bits) }
    }

    /// The bits of a place in a TPDO, and when they came; `None` before the first, and after a new mapping.
    #[inline]
    pub(super) fn at(&self, place: ImagePlace) -> Option<Received> {
        let pdo = self.tpdos.get(usize::from(place.slot)).filter(|pdo| pdo.is_of(place))?;
        Some(Received { raw: place.of(pdo.data), at: pdo.at? })
    }

    /// Cycles that have begun since the TPDO of a place came; `None` before the first, and after a new mapping.
    #[inline]
    pub(super) fn cycles_since(&self, place: ImagePlace) -> Option<u64> {
        let pdo = self.tpdos.get(usize::from(place.slot)).filter(|pdo| pdo.generation == place.generation)?;
        pdo.at.map(|_| self.cycle.saturating_sub(pdo.cycle))
    }

    /// The bits of a place in a TPDO, and how many cycles have begun since they came; as [`at`](Self::at).
    #[inline]
    pub(super) fn aged(&self, place: ImagePlace) -> Option<(u64, u64)> {
        let pdo = self.tpdos.get(usize::from(place.slot)).filter(|pdo| pdo.is_of(place))?;
        pdo.at.map(|_| (place.of(pdo.data), self.cycle.saturating_sub(pdo.cycle)))
    }

    /// Puts bits into a place of an RPDO and queues it by its trigger. False after a new mapping.
    #[inline]
    pub(super) fn put(&mut self, place: ImagePlace, raw: u64) -> bool {
        let Some(pdo) = self.rpdos.get_mut(usize::from(place.slot)) else { return false };
        if pdo.generation != place.generation || pdo.is_suspended {
            return false;
        }
        pdo.data = place.put(pdo.data, raw);
        pdo.in_use = true;
        match (pdo.state, pdo.trigger) {
            (SendState::Idle, RpdoTrigger::Sync) => {
                pdo.state = SendState::Waiting;
                self.waiting.push(place.slot);
            }
            (SendState::Idle, RpdoTrigger::Write) => {
                pdo.state = SendState::Pending;
                self.pending.push_back(place.slot);
            }
            (SendState::Waiting | SendState::Pending, _) => {}
        }
        true
    }

    /// Puts bits into an RPDO without queueing it: what it is to carry when it is sent for another object.
    pub(crate) fn preset(&mut self, node: NodeId, number: PdoNumber, mux: Mux, raw: u64) {
        let mut rpdos = self.rpdos.iter_mut().enumerate();
        let Some((position, pdo)) = rpdos.find(|(_, pdo)| (pdo.node, pdo.number) == (node, number)) else { return };
        if let Some(bits) = pdo.map.find(mux) {
            pdo.data = Self::place(position, pdo.generation, &bits).put(pdo.data, raw);
        }
    }

    /// Takes in a frame if it is a known TPDO; says whose.
    pub(super) fn handle_frame(&mut self, id: u16, frame: &Frame, now: Instant) -> Option<NodeId> {
        let position = *self.by_id.get(usize::from(id))?;
        let pdo = self.tpdos.get_mut(usize::from(position))?;
        if frame.data().len() < pdo.bytes {
            pdo.too_short = pdo.too_short.saturating_add(1);
        } else {
            pdo.data = u64::from_le_bytes(*frame.padded());
            pdo.at = Some(now);
            pdo.cycle = self.cycle;
        }
        Some(pdo.node)
    }

    /// A cycle has begun.
    pub(super) const fn begin_cycle(&mut self, number: u64) {
        self.cycle = number;
    }

    /// Marks everything that was written and waited for sending.
    pub(super) fn release_waiting(&mut self) {
        for position in self.waiting.drain(..) {
            if let Some(pdo) = self.rpdos.get_mut(usize::from(position)) {
                pdo.state = SendState::Pending;
                self.pending.push_back(position);
            }
        }
    }

    /// The next RPDO to send, and whose it is.
    pub(super) fn poll_transmit(&mut self) -> Option<(NodeId, Frame)> {
        let pdo = self.rpdos.get_mut(usize::from(self.pending.pop_front()?))?;
        pdo.state = SendState::Idle;
        Some((pdo.node, Frame::new(pdo.id?, &pdo.data.to_le_bytes()[..pdo.bytes])))
    }

    fn index(&mut self) {
        self.by_id.fill(NONE);
        for (position, pdo) in self.tpdos.iter().enumerate() {
            let id = pdo.id.filter(|_| !pdo.is_suspended).map(usize::from);
            if let Some(entry) = id.and_then(|id| self.by_id.get_mut(id)) {
                *entry = position as u16;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use canopen::pdo::MappingRecord;

    use super::*;

    const STATUSWORD: MappingRecord = MappingRecord::from_raw(0x6041_0010);
    const POSITION: MappingRecord = MappingRecord::from_raw(0x6064_0020);
    const MODE: MappingRecord = MappingRecord::from_raw(0x6060_0008);

    fn node(raw: u8) -> NodeId {
        NodeId::new(raw).unwrap()
    }

    #[test]
    fn splits_a_frame_by_its_mapping() {
        let mut image = ProcessImage::default();
        image.set_tpdo(node(4), PdoNumber::FIRST, 0x184, PdoMap(vec![STATUSWORD, POSITION]));
        let now = Instant::from_millis(5);
        assert_eq!(image.value(node(4), POSITION.mux), None);
        assert_eq!(image.handle_frame(0x184, &"184#3702FFFFFFFF".parse().unwrap(), now), Some(node(4)));
        assert_eq!(image.value(node(4), STATUSWORD.mux), Some(Received { raw: 0x0237, at: now }));
        assert_eq!(image.value(node(4), POSITION.mux), Some(Received { raw: 0xFFFF_FFFF, at: now }));
        assert_eq!(image.value(node(5), POSITION.mux), None);
    }

    #[test]
    fn a_short_frame_is_not_half_applied() {
        let mut image = ProcessImage::default();
        image.set_tpdo(node(4), PdoNumber::FIRST, 0x184, PdoMap(vec![STATUSWORD, POSITION]));
        image.handle_frame(0x184, &"184#370201".parse().unwrap(), Instant::ZERO);
        assert_eq!(image.value(node(4), STATUSWORD.mux), None);
        assert_eq!(image.too_short(node(4), PdoNumber::FIRST), 1);
    }

    #[test]
    fn an_unsent_rpdo_is_overwritten_by_its_newer_value() {
        let mut image = ProcessImage::default();
        image.set_rpdo(node(4), PdoNumber::FIRST, 0x204, PdoMap(vec![STATUSWORD, MODE]), RpdoTrigger::Write);
        assert!(image.write(node(4), STATUSWORD.mux, 6));
        assert!(image.write(node(4), MODE.mux, 3));
        assert!(image.write(node(4), STATUSWORD.mux, 0x1_000F));
        assert!(!image.write(node(4), POSITION.mux, 1));
        assert_eq!(image.poll_transmit().unwrap().1.to_string(), "204#0F0003");
        assert_eq!(image.poll_transmit(), None);
    }

    #[test]
    fn a_synchronous_rpdo_waits_for_the_sync() {
        let mut image = ProcessImage::default();
        image.set_rpdo(node(4), PdoNumber::FIRST, 0x304, PdoMap(vec![POSITION]), RpdoTrigger::Sync);
        image.write(node(4), POSITION.mux, 7);
        assert_eq!(image.poll_transmit(), None);
        image.release_waiting();
        assert_eq!(image.poll_transmit().unwrap().1.to_string(), "304#07000000");
        image.release_waiting();
        assert_eq!(image.poll_transmit(), None);
    }

    #[test]
    fn a_mapping_beyond_eight_bytes_is_never_read_or_written_past_the_frame() {
        let mut image = ProcessImage::default();
        let long = PdoMap(vec![POSITION, POSITION, STATUSWORD]);
        image.set_tpdo(node(4), PdoNumber::FIRST, 0x184, long.clone());
        image.set_rpdo(node(4), PdoNumber::FIRST, 0x204, long, RpdoTrigger::Write);
        image.handle_frame(0x184, &"184#0102030405060708".parse().unwrap(), Instant::ZERO);
        assert_eq!(image.value(node(4), STATUSWORD.mux), None);
        assert!(!image.write(node(4), STATUSWORD.mux, 1));
    }
}
