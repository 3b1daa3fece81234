//! Frames to a node: what each of its services does with a frame.

use can::{Frame, Instant};

use super::pending::Source;
use super::{Node, NodeEvent, Ticket, Via};
use crate::AbortCode;
use crate::nmt;
use crate::od::{Refusal, Storage};
use crate::pdo::{PdoNumber, Reception, Tpdo};
use crate::sdo::server::Write;

/// The number of the server that every device has: 1200h.
const DEFAULT_SERVER: u8 = 0;

impl<S: Storage> Node<S> {
    /// A data frame with an identifier that a service here listens to. SDO, NMT and SYNC do not share theirs; two
    /// RPDOs may have the same.
    #[inline(never)]
    pub(super) fn receive(&mut self, frame: &Frame, id: u16) {
        if self.received.is_nmt(id) {
            self.receive_nmt(frame);
        } else if self.received.is_sync(id) {
            self.receive_sync(frame);
        } else if self.received.is_sdo(id) {
            self.receive_sdo(frame);
        } else {
            self.receive_rpdos(frame, id);
        }
    }

    /// Any other frame than a data frame with a base identifier: a remote frame may ask for a TPDO (CiA 301, 7.2.2.4.3).
    #[cold]
    pub(super) fn receive_remote(&mut self, frame: &Frame) {
        if !self.hears_remote(frame) || !self.state.allows_pdo() {
            return;
        }
        for position in 0..self.pdos.tpdos.as_ref().len() {
            let tpdo = &mut self.pdos.tpdos.as_mut()[position];
            if tpdo.can_id() == frame.id() && tpdo.handle_remote(&self.dictionary) {
                self.offer_tpdo(position);
            }
        }
    }

    /// The frame may ask for a TPDO.
    #[cold]
    pub(super) fn hears_remote(&self, frame: &Frame) -> bool {
        self.profile.remote_requests && frame.is_remote() && self.pdos.tpdo_ids.as_ref().contains(&frame.id().raw())
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
        if let Some(write) = self.sdo.handle_frame(frame, &mut self.dictionary, self.now) {
            match self.write(DEFAULT_SERVER, write.slot, write.facts, write.raw) {
                Ok(()) => self.sdo.finish(write, Ok(())),
                Err(refusal) => self.refuse(DEFAULT_SERVER, write, refusal),
            }
        }
        if self.sdo.has_reply() {
            self.pending.insert(Source::SdoReply);
        } else {
            self.offer_segment();
        }
        self.deadline = self.deadline.min(self.sdo.deadline());
    }

    /// A download is refused, or the owner is asked.
    #[cold]
    pub(super) fn refuse(&mut self, server: u8, write: Write, refusal: Refusal) {
        let now = self.now;
        match refusal {
            Refusal::Abort(code) => self.server_mut(server).finish(write, Err(code)),
            Refusal::Ask => {
                self.ticket = Ticket(self.ticket.0.wrapping_add(1));
                self.server_mut(server).defer(write, now);
                *self.asked_mut(server) = self.ticket;
                let row = self.table().row(write.slot);
                let is_long = write.facts.summary.is_long();
                let raw = if is_long { write.raw } else { write.raw & row.data_type.mask() };
                self.push(NodeEvent::Asked { slot: write.slot, raw, ticket: self.ticket });
            }
        }
    }

    /// The owner's decision on the download of [`NodeEvent::Asked`]: the value is stored, takes effect and is reported as
    /// [`NodeEvent::Written`], or the client gets this abort code. False if no client waits for it any more, and nothing is done:
    /// the client gave up or asked for something else, [`NodeProfile::sdo_timeout_ns`](super::NodeProfile::sdo_timeout_ns)
    /// is over, or communication was stopped.
    pub fn answer(&mut self, ticket: Ticket, verdict: Result<(), AbortCode>, now: Instant) -> bool {
        self.now = now;
        let Some(server) = self.questions().position(|(asked, _)| asked == ticket) else { return false };
        let server = server as u8;
        let Some(write) = self.server_mut(server).take_deferred() else { return false };
        if verdict.is_ok() {
            self.commit(server, write.slot, write.raw);
        }
        self.server_mut(server).finish(write, verdict);
        if self.sdo.has_reply() {
            self.pending.insert(Source::SdoReply);
        }
        self.offer_channels();
        self.reschedule();
        true
    }

    /// Of a value longer than a cell, the bytes that [`NodeEvent::Asked`] asks about; none when that is not asked any more.
    pub fn asked_bytes(&self, ticket: Ticket) -> &[u8] {
        let mut questions = (0..).zip(self.questions()).filter(|(_, (asked, _))| *asked == ticket);
        let asked = questions.find_map(|(number, (_, server))| Some((number, server.deferred()?)));
        asked.map_or(&[], |(number, write)| self.dictionary.view().staged(number, write.raw as usize))
    }

    #[inline(never)]
    fn receive_rpdos(&mut self, frame: &Frame, id: u16) {
        for position in 0..self.received.rpdos().len() {
            if self.received.rpdos()[position] == id {
                self.receive_rpdo(frame, position);
                if !self.received.rpdos_share() {
                    return;
                }
            }
        }
        if !self.channels.as_ref().is_empty() {
            self.receive_channel(frame, id);
        }
    }

    #[inline]
    fn receive_rpdo(&mut self, frame: &Frame, position: usize) {
        self.last_addressed = Some(self.now);
        if !self.state.allows_pdo() {
            return;
        }
        let rpdo = &mut self.pdos.rpdos.as_mut()[position];
        let (reception, is_timed) = (rpdo.receive(frame), rpdo.is_timed());
        if is_timed && reception != Reception::TooShort {
            self.restart_rpdo_timer(position);
        }
        if !self.pdos.short.is_empty() && reception != Reception::TooShort {
            self.accept_after_short(position);
        }
        match reception {
            Reception::Apply(data) => self.apply_rpdo(position, data),
            Reception::Latch(data) => self.latch_rpdo(position, data),
            Reception::Multiplexed(data) => self.receive_multiplexed(position, data),
            Reception::TooShort => return self.refuse_short_rpdo(position),
            Reception::NothingMapped => return,
        }
        if self.pdos.tpdos.as_mut().get_mut(position).is_some_and(Tpdo::handle_rpdo) {
            self.offer_tpdo(position);
        }
    }

    #[inline(never)]
    fn restart_rpdo_timer(&mut self, position: usize) {
        let rpdo = &mut self.pdos.rpdos.as_mut()[position];
        let was_late = rpdo.restart_timer(self.now);
        self.deadline = self.deadline.min(rpdo.deadline());
        if was_late {
            self.push(NodeEvent::RpdoInTime(number_at(position)));
        }
    }

    /// An error is reported when it begins and when it ends (CiA 301, 7.2.7.1), not with each frame between.
    #[cold]
    fn refuse_short_rpdo(&mut self, position: usize) {
        if !self.pdos.short.contains(position) {
            self.pdos.short.set(position, true);
            self.push(NodeEvent::RpdoTooShort(number_at(position)));
        }
    }

    #[cold]
    fn accept_after_short(&mut self, position: usize) {
        if self.pdos.short.contains(position) {
            self.pdos.short.set(position, false);
            self.push(NodeEvent::RpdoFits(number_at(position)));
        }
    }

    /// Stores each mapped object whose value may be written; the others keep their value.
    #[inline(always)]
    pub(super) fn apply_rpdo(&mut self, position: usize, data: u64) {
        let via = Via::Rpdo(number_at(position));
        let Some(mapping) = self.pdos.rpdos.as_ref()[position].mapping() else { return };
        let Some(objects) = mapping.plain_objects() else { return self.apply_at_the_bit(position, data) };
        for object in objects {
            // A refused value is not reported to a client: RPDOs are not confirmed. Communication objects cannot be mapped.
            if let Ok(raw) = self.dictionary.write_resolved(&object.write, object.extract(data)) {
                self.events.push(NodeEvent::Written { slot: object.write.slot, raw, via });
            }
        }
    }

    /// The same where fields are not whole cells.
    #[inline(never)]
    fn apply_at_the_bit(&mut self, position: usize, data: u64) {
        let via = Via::Rpdo(number_at(position));
        let Some(mapping) = self.pdos.rpdos.as_ref()[position].mapping() else { return };
        for object in mapping.objects_at_the_bit() {
            let bytes = object.extract_bits(data).to_le_bytes();
            let size = self.dictionary.table().row(object.slot).data_type.size();
            if let Ok(raw) = self.dictionary.write_bytes(object.slot, &bytes[..size]) {
                self.events.push(NodeEvent::Written { slot: object.slot, raw, via });
            }
        }
    }
}

/// The PDO at a position that a node has.
pub(super) fn number_at(position: usize) -> PdoNumber {
    PdoNumber::at(position).unwrap_or(PdoNumber::FIRST)
}
