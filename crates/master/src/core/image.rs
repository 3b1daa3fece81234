use std::collections::VecDeque;
use std::ops::Range;

use can::{CanId, Frame, Instant, MAX_DATA_LENGTH};
use canopen::{Mux, NodeId};

/// One object in a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MappedObject {
    /// Which object of the device.
    pub mux: Mux,
    /// Its length in bits, 1 to 64.
    pub bits: u8,
}

impl MappedObject {
    /// From a mapping record (1600h.., 1A00h..): index, sub-index, length. Source: CiA 301, 7.5.2.36.
    pub const fn from_record(record: u32) -> Self {
        Self { mux: Mux::from_key(record >> 8), bits: record as u8 }
    }

    /// As a mapping record.
    pub const fn to_record(self) -> u32 {
        self.mux.key() << 8 | self.bits as u32
    }
}

/// What a PDO carries, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PdoMap(pub Vec<MappedObject>);

impl PdoMap {
    /// Total length in bits.
    pub fn bits(&self) -> u32 {
        self.0.iter().map(|object| u32::from(object.bits)).sum()
    }

    /// Total length in bytes, begun ones counted.
    pub fn bytes(&self) -> usize {
        self.bits().div_ceil(8) as usize
    }

    /// Every object with the bits it takes, bit 0 being the lowest bit of byte 0.
    pub fn fields(&self) -> impl Iterator<Item = (MappedObject, Range<u32>)> {
        let mut at = 0;
        self.0.iter().map(move |object| {
            let from = at;
            at += u32::from(object.bits);
            (*object, from..at)
        })
    }

    /// The bits of `mux`; `None` if it is not mapped or lies beyond the 64 bits of a frame.
    pub fn find(&self, mux: Mux) -> Option<Range<u32>> {
        let (_, bits) = self.fields().find(|(object, _)| object.mux == mux)?;
        (bits.end <= u64::BITS).then_some(bits)
    }
}

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

/// Process image: the newest data of every mapped PDO, with the time it came, and what is to be sent.
///
/// RPDO and TPDO are from the device's side; PDOs are numbered from 0 (1400h, 1800h). A frame that is shorter
/// than its mapping is not taken over (CiA 301, 7.2.2.5). An unsent RPDO is overwritten by its newer value.
#[derive(Clone, Debug)]
pub struct Image {
    tpdos: Vec<Tpdo>,
    rpdos: Vec<Rpdo>,
    /// Position in `tpdos` by identifier; `NONE` for most.
    by_id: Vec<u16>,
    /// Positions in `rpdos` to send, each at most once.
    pending: VecDeque<u16>,
}

const NONE: u16 = u16::MAX;

#[derive(Clone, Debug)]
struct Tpdo {
    node: NodeId,
    number: u8,
    id: u16,
    map: PdoMap,
    /// Cached, for the receive path.
    bytes: usize,
    data: [u8; MAX_DATA_LENGTH],
    at: Option<Instant>,
    too_short: u32,
}

#[derive(Clone, Debug)]
struct Rpdo {
    node: NodeId,
    number: u8,
    id: CanId,
    map: PdoMap,
    trigger: RpdoTrigger,
    data: u64,
    written: bool,
    pending: bool,
}

impl Default for Image {
    fn default() -> Self {
        let by_id = vec![NONE; usize::from(CanId::MAX_STANDARD) + 1];
        Self { tpdos: Vec::new(), rpdos: Vec::new(), by_id, pending: VecDeque::new() }
    }
}

impl Image {
    /// Receives a node's TPDO under `id` from now on, in place of what that TPDO was before.
    pub fn set_tpdo(&mut self, node: NodeId, number: u8, id: u16, map: PdoMap) {
        self.remove_tpdo(node, number);
        let bytes = map.bytes();
        self.tpdos.push(Tpdo { node, number, id, map, bytes, data: [0; 8], at: None, too_short: 0 });
        self.index();
    }

    /// Receives a node's TPDO no longer.
    pub fn remove_tpdo(&mut self, node: NodeId, number: u8) {
        self.tpdos.retain(|pdo| (pdo.node, pdo.number) != (node, number));
        self.index();
    }

    /// Prepares a node's RPDO for sending under `id`, all bits zero.
    pub fn set_rpdo(&mut self, node: NodeId, number: u8, id: u16, map: PdoMap, trigger: RpdoTrigger) {
        self.remove_rpdo(node, number);
        let id = CanId::standard(id);
        self.rpdos.push(Rpdo { node, number, id, map, trigger, data: 0, written: false, pending: false });
    }

    /// Sends a node's RPDO no longer.
    pub fn remove_rpdo(&mut self, node: NodeId, number: u8) {
        self.pending.clear();
        self.rpdos.retain(|pdo| (pdo.node, pdo.number) != (node, number));
        let pending = self.rpdos.iter().enumerate().filter(|(_, pdo)| pdo.pending);
        self.pending.extend(pending.map(|(position, _)| position as u16));
    }

    /// The newest value of an object that a node sends by PDO; `None` if it is not mapped or none has come.
    pub fn value(&self, node: NodeId, mux: Mux) -> Option<Received> {
        self.tpdos.iter().filter(|pdo| pdo.node == node).find_map(|pdo| {
            let raw = bits_of(u64::from_le_bytes(pdo.data), pdo.map.find(mux)?);
            Some(Received { raw, at: pdo.at? })
        })
    }

    /// The mapping under which a node's TPDO is received.
    pub fn tpdo_map(&self, node: NodeId, number: u8) -> Option<&PdoMap> {
        self.tpdos.iter().find(|pdo| (pdo.node, pdo.number) == (node, number)).map(|pdo| &pdo.map)
    }

    /// When a node's TPDO last came.
    pub fn tpdo_at(&self, node: NodeId, number: u8) -> Option<Instant> {
        self.tpdos.iter().find(|pdo| (pdo.node, pdo.number) == (node, number))?.at
    }

    /// How many frames of a node's TPDO were shorter than its mapping and therefore ignored.
    pub fn too_short(&self, node: NodeId, number: u8) -> u32 {
        self.tpdos.iter().find(|pdo| (pdo.node, pdo.number) == (node, number)).map_or(0, |pdo| pdo.too_short)
    }

    /// Puts a value into every RPDO of the node that carries the object and queues them by their trigger.
    /// False if none carries it. Bits that do not fit are dropped.
    pub fn write(&mut self, node: NodeId, mux: Mux, raw: u64) -> bool {
        let mut found = false;
        for (position, pdo) in self.rpdos.iter_mut().enumerate().filter(|(_, pdo)| pdo.node == node) {
            let Some(bits) = pdo.map.find(mux) else { continue };
            let mask = mask_of(&bits);
            pdo.data = pdo.data & !(mask << bits.start) | (raw & mask) << bits.start;
            pdo.written = true;
            found = true;
            if pdo.trigger == RpdoTrigger::Write && !core::mem::replace(&mut pdo.pending, true) {
                self.pending.push_back(position as u16);
            }
        }
        found
    }

    /// Takes in a frame if it is a known TPDO; says whose.
    pub(super) fn handle_frame(&mut self, id: u16, frame: &Frame, now: Instant) -> Option<NodeId> {
        let position = *self.by_id.get(usize::from(id))?;
        let pdo = self.tpdos.get_mut(usize::from(position))?;
        if frame.data().len() < pdo.bytes {
            pdo.too_short = pdo.too_short.saturating_add(1);
        } else {
            pdo.data = *frame.padded();
            pdo.at = Some(now);
        }
        Some(pdo.node)
    }

    /// A SYNC is going out: what waited for it follows.
    pub(super) fn handle_sync(&mut self) {
        for (position, pdo) in self.rpdos.iter_mut().enumerate() {
            let due = pdo.trigger == RpdoTrigger::Sync && core::mem::take(&mut pdo.written);
            if due && !core::mem::replace(&mut pdo.pending, true) {
                self.pending.push_back(position as u16);
            }
        }
    }

    pub(super) fn poll_transmit(&mut self) -> Option<Frame> {
        let pdo = self.rpdos.get_mut(usize::from(self.pending.pop_front()?))?;
        pdo.pending = false;
        let data = pdo.data.to_le_bytes();
        Some(Frame::new(pdo.id, &data[..pdo.map.bytes().min(MAX_DATA_LENGTH)]))
    }

    fn index(&mut self) {
        self.by_id.fill(NONE);
        for (position, pdo) in self.tpdos.iter().enumerate() {
            if let Some(entry) = self.by_id.get_mut(usize::from(pdo.id)) {
                *entry = position as u16;
            }
        }
    }
}

const fn mask_of(bits: &Range<u32>) -> u64 {
    let width = bits.end - bits.start;
    if width >= u64::BITS { u64::MAX } else { (1 << width) - 1 }
}

/// The bits `bits` of a frame's data.
pub(crate) const fn bits_of(data: u64, bits: Range<u32>) -> u64 {
    data >> bits.start & mask_of(&bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATUSWORD: MappedObject = MappedObject::from_record(0x6041_0010);
    const POSITION: MappedObject = MappedObject::from_record(0x6064_0020);
    const MODE: MappedObject = MappedObject::from_record(0x6060_0008);

    fn node(raw: u8) -> NodeId {
        NodeId::new(raw).unwrap()
    }

    #[test]
    fn splits_a_frame_by_its_mapping() {
        let mut image = Image::default();
        image.set_tpdo(node(4), 0, 0x184, PdoMap(vec![STATUSWORD, POSITION]));
        let now = Instant::from_millis(5);
        assert_eq!(image.value(node(4), POSITION.mux), None);
        assert_eq!(image.handle_frame(0x184, &"184#3702FFFFFFFF".parse().unwrap(), now), Some(node(4)));
        assert_eq!(image.value(node(4), STATUSWORD.mux), Some(Received { raw: 0x0237, at: now }));
        assert_eq!(image.value(node(4), POSITION.mux), Some(Received { raw: 0xFFFF_FFFF, at: now }));
        assert_eq!(image.value(node(5), POSITION.mux), None);
    }

    #[test]
    fn a_short_frame_is_not_half_applied() {
        let mut image = Image::default();
        image.set_tpdo(node(4), 0, 0x184, PdoMap(vec![STATUSWORD, POSITION]));
        image.handle_frame(0x184, &"184#370201".parse().unwrap(), Instant::ZERO);
        assert_eq!(image.value(node(4), STATUSWORD.mux), None);
        assert_eq!(image.too_short(node(4), 0), 1);
    }

    #[test]
    fn an_unsent_rpdo_is_overwritten_by_its_newer_value() {
        let mut image = Image::default();
        image.set_rpdo(node(4), 0, 0x204, PdoMap(vec![STATUSWORD, MODE]), RpdoTrigger::Write);
        assert!(image.write(node(4), STATUSWORD.mux, 6));
        assert!(image.write(node(4), MODE.mux, 3));
        assert!(image.write(node(4), STATUSWORD.mux, 0x1_000F));
        assert!(!image.write(node(4), POSITION.mux, 1));
        assert_eq!(image.poll_transmit().unwrap().to_string(), "204#0F0003");
        assert_eq!(image.poll_transmit(), None);
    }

    #[test]
    fn a_synchronous_rpdo_waits_for_the_sync() {
        let mut image = Image::default();
        image.set_rpdo(node(4), 1, 0x304, PdoMap(vec![POSITION]), RpdoTrigger::Sync);
        image.write(node(4), POSITION.mux, 7);
        assert_eq!(image.poll_transmit(), None);
        image.handle_sync();
        assert_eq!(image.poll_transmit().unwrap().to_string(), "304#07000000");
        image.handle_sync();
        assert_eq!(image.poll_transmit(), None);
    }

    #[test]
    fn a_mapping_beyond_eight_bytes_is_never_read_or_written_past_the_frame() {
        let mut image = Image::default();
        let long = PdoMap(vec![POSITION, POSITION, STATUSWORD]);
        image.set_tpdo(node(4), 0, 0x184, long.clone());
        image.set_rpdo(node(4), 0, 0x204, long, RpdoTrigger::Write);
        image.handle_frame(0x184, &"184#0102030405060708".parse().unwrap(), Instant::ZERO);
        assert_eq!(image.value(node(4), STATUSWORD.mux), None);
        assert!(!image.write(node(4), STATUSWORD.mux, 1));
    }
}
