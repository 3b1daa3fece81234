//! Frames to a node: who listens to which identifier, and what each of them does with a frame.

use can::Frame;

use super::pending::Source;
use super::{Node, NodeEvent, Via};
use crate::cob::{self, PdoNumber};
use crate::pdo::Reception;
use crate::{NmtState, NodeId, nmt};

/// The identifiers that a node listens to. A frame is compared with all of them at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receivers([u16; 8]);

/// No frame has this identifier.
const UNUSED: u16 = u16::MAX;
const NMT: usize = 0;
const SYNC: usize = 1;
const SDO: usize = 2;
const FIRST_RPDO: usize = 3;

/// Which receivers a frame is for, one bit each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Matches(u8);

impl Matches {
    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    const fn contains(self, receiver: usize) -> bool {
        self.0 >> receiver & 1 != 0
    }
}

impl Receivers {
    /// Deaf.
    pub(super) const NONE: Self = Self([UNUSED; 8]);

    /// NMT and SDO requests to `node_id`.
    pub(super) fn new(node_id: NodeId) -> Self {
        let mut receivers = Self::NONE;
        receivers.0[NMT] = cob::NMT.raw() as u16;
        receivers.0[SDO] = cob::sdo_request(node_id).raw() as u16;
        receivers
    }

    pub(super) fn set_sync(&mut self, id: Option<u16>) {
        self.0[SYNC] = id.unwrap_or(UNUSED);
    }

    pub(super) fn set_rpdo(&mut self, position: usize, id: Option<u16>) {
        self.0[FIRST_RPDO + position] = id.unwrap_or(UNUSED);
    }

    #[inline]
    pub(super) fn of(&self, id: u16) -> Matches {
        let mut matches = 0;
        for (bit, receiver) in self.0.iter().enumerate() {
            matches |= u8::from(*receiver == id) << bit;
        }
        Matches(matches)
    }
}

impl<const N: usize> Node<N> {
    /// A data frame with an identifier that somebody here listens to.
    pub(super) fn receive(&mut self, frame: &Frame, receivers: Matches) {
        if receivers.contains(SDO) {
            return self.receive_sdo(frame);
        }
        if receivers.contains(NMT) {
            return self.receive_nmt(frame);
        }
        if receivers.contains(SYNC) && self.state.allows_sdo() {
            self.receive_sync();
        }
        for number in PdoNumber::ALL {
            if receivers.contains(FIRST_RPDO + number.position()) {
                self.receive_rpdo(frame, number);
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
        self.push(NodeEvent::Sync);
        if self.state != NmtState::Operational {
            return;
        }
        for position in 0..PdoNumber::COUNT {
            if self.tpdos[position].handle_sync(&self.dictionary.view()) {
                self.offer_tpdo(position);
            }
        }
        for number in PdoNumber::ALL {
            if let Some(data) = self.rpdos[number.position()].take_latched() {
                self.apply_rpdo(number, data);
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
