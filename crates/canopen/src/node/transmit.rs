//! Frames from a node: which service has something to send, which of them is the most urgent, and when to look again.

use can::{CanId, Frame, Instant};

use super::pending::Source;
use super::receive::number_at;
use super::{Node, NodeEvent};
use crate::connection_set;
use crate::heartbeat::Heartbeat;
use crate::od::Storage;
use crate::pdo::Rpdo;

impl<S: Storage> Node<S> {
    #[inline(never)]
    pub(super) fn serve_deadlines(&mut self) {
        self.offer_heartbeat();
        self.serve_sync();
        self.sdo.handle_timeout(self.now);
        if self.sdo.has_reply() {
            self.pending.insert(Source::SdoReply);
        }
        self.serve_channel_deadlines();
        for tpdo in self.pdos.tpdos.as_mut() {
            tpdo.handle_timeout(self.now);
        }
        for position in 0..self.pdos.rpdos.as_ref().len() {
            if self.pdos.rpdos.as_mut()[position].handle_timeout(self.now) {
                self.events.push(NodeEvent::RpdoTimedOut(number_at(position)));
            }
        }
        self.reschedule();
    }

    /// Finds the earliest deadline of all services, and offers what has become ready.
    pub(super) fn reschedule(&mut self) {
        let rpdos = self.pdos.rpdos.as_ref().iter().map(Rpdo::deadline);
        let services = self.heartbeat.deadline().min(self.sdo.deadline()).min(self.sync.deadline());
        self.deadline = rpdos.fold(services.min(self.channel_deadline()), Instant::min);
        self.offer_emcy();
        for position in 0..self.pdos.tpdos.as_ref().len() {
            self.offer_tpdo(position);
        }
    }

    #[inline(never)]
    pub(super) fn take_most_urgent(&mut self) -> Option<Frame> {
        match self.pending.take_only() {
            Some(Source::SdoReply) => self.take_sdo_reply(),
            Some(Source::Tpdo(position)) => self.take_tpdo(position),
            _ => self.take_of_many(),
        }
    }

    #[inline(never)]
    fn take_of_many(&mut self) -> Option<Frame> {
        let source = self.pending.iter().min_by_key(|source| self.pending_id(*source))?;
        self.pending.remove(source);
        self.take(source)
    }

    fn pending_id(&self, source: Source) -> u32 {
        match source {
            Source::BootUp => 0,
            Source::Sync => self.sync.id.raw(),
            Source::Emcy => self.emcy_id.map_or(u32::MAX, CanId::raw),
            Source::Tpdo(position) => self.pdos.tpdos.as_ref()[position].can_id().raw(),
            Source::SdoReply => connection_set::sdo_reply(self.node_id).raw(),
            Source::Channel => self.channel_id(),
            Source::Heartbeat => connection_set::heartbeat(self.node_id).raw(),
        }
    }

    fn take(&mut self, source: Source) -> Option<Frame> {
        match source {
            Source::BootUp => Some(Heartbeat::boot_up(self.node_id).emit()),
            Source::Sync => self.sync.frame.take(),
            Source::Heartbeat => {
                let state = self.heartbeat_state.unwrap_or(self.state.heartbeat_byte());
                Some(Heartbeat { node: self.node_id, state }.emit())
            }
            Source::SdoReply => self.take_sdo_reply(),
            Source::Channel => self.take_of_channel(),
            Source::Tpdo(position) => self.take_tpdo(position),
            Source::Emcy => {
                let emcy = self.emcy.take(self.now)?;
                self.offer_emcy();
                self.emcy_id.map(|id| emcy.emit(id))
            }
        }
    }

    #[inline(always)]
    fn take_sdo_reply(&mut self) -> Option<Frame> {
        match self.sdo.take_reply() {
            Some(bytes) => Some(Frame::full(connection_set::sdo_reply(self.node_id), bytes)),
            None => self.take_segment(),
        }
    }

    // Apart, so that an SDO's reply saves no registers for it.
    #[inline(never)]
    fn take_tpdo(&mut self, position: usize) -> Option<Frame> {
        let tpdo = &mut self.pdos.tpdos.as_mut()[position];
        let frame = tpdo.take(&self.dictionary, self.now);
        self.deadline = self.deadline.min(tpdo.deadline(self.now));
        frame
    }

    /// Of an SDO block upload; the next one is offered at once.
    #[inline(never)]
    fn take_segment(&mut self) -> Option<Frame> {
        let segment = self.sdo.take_segment(&self.dictionary.view());
        self.offer_segment();
        segment.map(|bytes| Frame::full(connection_set::sdo_reply(self.node_id), bytes))
    }

    #[inline(never)]
    pub(super) fn offer_segment(&mut self) {
        self.pending.set(Source::SdoReply, self.sdo.has_segment());
    }

    pub(super) fn offer_heartbeat(&mut self) {
        if self.heartbeat.handle_timeout(self.now) {
            self.pending.insert(Source::Heartbeat);
        }
    }

    /// Offers a TPDO if it is due and not inhibited, and sees that it is looked at when it will be.
    #[inline]
    pub(super) fn offer_tpdo(&mut self, position: usize) {
        let tpdo = &self.pdos.tpdos.as_ref()[position];
        self.pending.set(Source::Tpdo(position), tpdo.is_ready(self.now));
        self.deadline = self.deadline.min(tpdo.deadline(self.now));
    }

    pub(super) fn offer_emcy(&mut self) {
        let may_send = self.state.allows_sdo() && self.emcy_id.is_some();
        self.pending.set(Source::Emcy, may_send && self.emcy.is_ready(self.now));
        if may_send {
            self.deadline = self.deadline.min(self.emcy.deadline(self.now));
        }
    }
}
