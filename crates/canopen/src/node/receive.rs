//! Frames to a node: who listens to which identifier, and what each of them does with a frame.

use can::Frame;

use super::pending::Source;
use super::{Node, NodeEvent, Via};
use crate::cob::{self, PdoNumber};
use crate::pdo::Reception;
use crate::{NodeId, nmt};

/// The identifiers that a node listens to, one in each 16-bit lane, so that a frame is compared with all of them at
/// once. Most frames on a bus are for others.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receivers(u128);

const LANE_BITS: u32 = 16;
/// The highest bit of every lane; no identifier reaches it.
const LANE_TOPS: u128 = 0x8000 * EACH_LANE;
const EACH_LANE: u128 = 0x0001_0001_0001_0001_0001_0001_0001_0001;

const NMT: u32 = 0;
const SYNC: u32 = 1;
const SDO: u32 = 2;
const FIRST_RPDO: u32 = 3;

/// Which receivers a frame is for: the top bit of their lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Matches(u128);

impl Matches {
    #[inline]
    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    #[inline]
    const fn contains(self, lane: u32) -> bool {
        self.0 >> (lane * LANE_BITS + LANE_BITS - 1) & 1 != 0
    }
}

impl Receivers {
    /// Deaf: no identifier is FFFFh.
    pub(super) const NONE: Self = Self(u128::MAX);

    /// NMT and SDO requests to `node_id`.
    pub(super) fn new(node_id: NodeId) -> Self {
        let mut receivers = Self::NONE;
        receivers.set(NMT, cob::NMT.as_standard());
        receivers.set(SDO, cob::sdo_request(node_id).as_standard());
        receivers
    }

    pub(super) fn set_sync(&mut self, id: Option<u16>) {
        self.set(SYNC, id);
    }

    pub(super) fn set_rpdo(&mut self, position: usize, id: Option<u16>) {
        self.set(FIRST_RPDO + position as u32, id);
    }

    fn set(&mut self, lane: u32, id: Option<u16>) {
        let shift = lane * LANE_BITS;
        self.0 = self.0 & !(0xFFFF << shift) | u128::from(id.unwrap_or(u16::MAX)) << shift;
    }

    /// A lane differs from `id` in its top bit, or in lower bits, which then carry into the top bit.
    #[inline]
    pub(super) const fn of(self, id: u16) -> Matches {
        let half = (id as u64 * EACH_LANE as u64) as u128;
        let difference = self.0 ^ (half << 64 | half);
        let carried = (difference & !LANE_TOPS) + (LANE_TOPS - EACH_LANE);
        Matches(!(carried | difference) & LANE_TOPS)
    }
}

impl<const N: usize> Node<N> {
    /// A data frame with an identifier that somebody here listens to. SDO, NMT and SYNC share theirs with nobody; two
    /// RPDOs may have the same.
    #[inline(never)]
    pub(super) fn receive(&mut self, frame: &Frame, receivers: Matches) {
        if receivers.contains(SDO) {
            return self.receive_sdo(frame);
        }
        if receivers.contains(NMT) {
            return self.receive_nmt(frame);
        }
        if receivers.contains(SYNC) {
            return self.receive_sync();
        }
        for (lane, number) in (FIRST_RPDO..).zip(&PdoNumber::ALL) {
            if receivers.contains(lane) {
                self.receive_rpdo(frame, *number);
            }
        }
    }

    fn receive_nmt(&mut self, frame: &Frame) {
        let Ok(request) = nmt::NmtRequest::parse(frame) else { return };
        if request.target.includes(self.node_id) {
            self.last_addressed = Some(self.now);
            self.handle_nmt(request.command);
        }
    }

    #[inline]
    fn receive_sdo(&mut self, frame: &Frame) {
        self.last_addressed = Some(self.now);
        if !self.state.allows_sdo() {
            return;
        }
        if let Some(write) = self.sdo.handle_frame(frame, &self.dictionary.view(), self.now) {
            let result = self.write(write.slot, write.raw, Via::Sdo);
            self.sdo.finish(write, result);
        }
        if self.sdo.has_reply() {
            self.pending.insert(Source::SdoReply);
        }
        self.deadline = self.deadline.min(self.sdo.deadline());
    }

    /// TPDOs first: their data is of the moment of SYNC, before what it lets take effect.
    fn receive_sync(&mut self) {
        if self.state.allows_sdo() {
            self.push(NodeEvent::Sync);
        }
        if !self.state.allows_pdo() {
            return;
        }
        for position in 0..PdoNumber::COUNT {
            if self.tpdos[position].handle_sync(&self.dictionary.view()) {
                self.offer_tpdo(position);
            }
        }
        for number in &PdoNumber::ALL {
            if let Some(data) = self.rpdos[number.position()].take_latched() {
                self.apply_rpdo(*number, data);
            }
        }
    }

    fn receive_rpdo(&mut self, frame: &Frame, number: PdoNumber) {
        self.last_addressed = Some(self.now);
        if !self.state.allows_pdo() {
            return;
        }
        match self.rpdos[number.position()].receive(frame) {
            Reception::Apply(data) => self.apply_rpdo(number, data),
            Reception::Latched => {}
            Reception::TooShort => return self.push(NodeEvent::RpdoTooShort(number)),
            Reception::NothingMapped => return,
        }
        if self.tpdos[number.position()].handle_rpdo() {
            self.offer_tpdo(number.position());
        }
    }

    /// Stores each mapped object whose value may be written; the others keep their value.
    fn apply_rpdo(&mut self, number: PdoNumber, data: u64) {
        let Some(mapping) = self.rpdos[number.position()].mapping().copied() else { return };
        for object in mapping.objects() {
            // A refused value has nobody to tell: RPDOs are not confirmed.
            let _ = self.write(object.slot, object.extract(data), Via::Rpdo(number));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_identifier_is_found_in_every_lane_that_has_it_and_in_no_other() {
        let mut receivers = Receivers::new(NodeId::MAX);
        receivers.set_sync(Some(0x080));
        for position in 0..4 {
            receivers.set_rpdo(position, [Some(0x001), Some(0x7FE), None, Some(0x001)][position]);
        }
        let listened: [Option<u16>; 8] =
            [Some(0), Some(0x080), Some(0x67F), Some(0x001), Some(0x7FE), None, Some(0x001), None];
        for id in 0..=0x7FF {
            let matches = receivers.of(id);
            for (lane, expected) in listened.iter().enumerate() {
                assert_eq!(matches.contains(lane as u32), *expected == Some(id), "{id:#X} in lane {lane}");
            }
            assert_eq!(matches.is_empty(), !listened.contains(&Some(id)));
            assert!(Receivers::NONE.of(id).is_empty());
        }
    }
}
