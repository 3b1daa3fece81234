//! Frames to a node: what each of its services does with a frame.

use can::Frame;

use super::identifiers::Lane;
use super::pending::Source;
use super::{Node, NodeEvent, Via};
use crate::nmt;
use crate::pdo::PdoNumber;
use crate::pdo::Reception;

impl<const N: usize> Node<N> {
    /// A data frame with an identifier that somebody here listens to. SDO, NMT and SYNC share theirs with nobody; two
    /// RPDOs may have the same.
    #[inline(never)]
    pub(super) fn receive(&mut self, frame: &Frame, id: u16) {
        if self.received.has(Lane::NMT, id) {
            self.receive_nmt(frame);
        } else if self.received.has(Lane::SYNC, id) {
            self.receive_sync();
        } else if self.received.has(Lane::SDO, id) {
            self.receive_sdo(frame);
        } else {
            self.receive_rpdos(frame, id);
        }
    }

    #[inline(never)]
    fn receive_nmt(&mut self, frame: &Frame) {
        let Ok(request) = nmt::NmtRequest::parse(frame) else { return };
        if request.target.includes(self.node_id) {
            self.handle_nmt(request.command);
        }
    }

    // Apart, so that each service saves no more registers than it needs.
    #[inline(never)]
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
    #[inline(never)]
    fn receive_sync(&mut self) {
        if self.state.allows_sdo() {
            self.push(NodeEvent::Sync);
        }
        if !self.state.allows_pdo() {
            return;
        }
        for position in self.synchronous_tpdos.iter() {
            if self.tpdos[position].handle_sync(&self.dictionary.view()) {
                self.offer_tpdo(position);
            }
        }
        for position in self.latched_rpdos.take().iter() {
            if let Some(data) = self.rpdos[position].take_latched() {
                self.apply_rpdo(position, data);
            }
        }
    }

    #[inline(never)]
    fn receive_rpdos(&mut self, frame: &Frame, id: u16) {
        for position in 0..PdoNumber::PREDEFINED {
            if self.received.has(Lane::rpdo(position), id) {
                self.receive_rpdo(frame, position);
            }
        }
    }

    #[inline]
    fn receive_rpdo(&mut self, frame: &Frame, position: usize) {
        self.last_addressed = Some(self.now);
        if !self.state.allows_pdo() {
            return;
        }
        let reception = self.rpdos[position].receive(frame);
        if !self.short_rpdos.is_empty() && reception != Reception::TooShort {
            self.accept_after_short(position);
        }
        match reception {
            Reception::Apply(data) => self.apply_rpdo(position, data),
            Reception::Latched => self.latched_rpdos.set(position, true),
            Reception::TooShort => return self.refuse_short_rpdo(position),
            Reception::NothingMapped => return,
        }
        if self.tpdos[position].handle_rpdo() {
            self.offer_tpdo(position);
        }
    }

    /// An error is told when it begins and when it ends (CiA 301, 7.2.7.1), not with each frame between.
    #[cold]
    fn refuse_short_rpdo(&mut self, position: usize) {
        if !self.short_rpdos.contains(position) {
            self.short_rpdos.set(position, true);
            self.push(NodeEvent::RpdoTooShort(number_at(position)));
        }
    }

    #[cold]
    fn accept_after_short(&mut self, position: usize) {
        if self.short_rpdos.contains(position) {
            self.short_rpdos.set(position, false);
            self.push(NodeEvent::RpdoFits(number_at(position)));
        }
    }

    /// Stores each mapped object whose value may be written; the others keep their value.
    #[inline(always)]
    fn apply_rpdo(&mut self, position: usize, data: u64) {
        let via = Via::Rpdo(number_at(position));
        let Some(mapping) = self.rpdos[position].mapping() else { return };
        for object in mapping.objects() {
            // A refused value has nobody to tell: RPDOs are not confirmed. Communication objects cannot be mapped.
            if let Ok(raw) = self.dictionary.write(object.slot, object.extract(data)) {
                self.events.push(NodeEvent::Written { slot: object.slot, raw, via });
            }
        }
    }
}

fn number_at(position: usize) -> PdoNumber {
    PdoNumber::at(position).unwrap_or(PdoNumber::FIRST)
}
