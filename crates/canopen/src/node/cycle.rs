//! SYNC at a node (CiA 301, 7.2.5): the cycle that it begins, the synchronous window (1007h), and its production.

use can::{CanId, Frame, Instant};

use super::pending::Source;
use super::{Node, NodeEvent};
use crate::object::{
    COB_ID_SYNC_MESSAGE, COMMUNICATION_CYCLE_PERIOD, SYNCHRONOUS_COUNTER_OVERFLOW_VALUE, SYNCHRONOUS_WINDOW_LENGTH,
};
use crate::od::Storage;
use crate::pdo::Tpdo;
use crate::sync::{Producer, Sync};
use crate::{AbortCode, CobId, connection_set};

const NANOS_PER_MICRO: u64 = 1_000;

impl<S: Storage> Node<S> {
    /// 1005h, 1006h or 1019h has changed, or communication begins. Without 1006h a node does not produce SYNC, whatever bit 30
    /// of 1005h says.
    pub(super) fn configure_sync(&mut self) {
        let cob_id = self.object(COB_ID_SYNC_MESSAGE).map(CobId);
        let id = cob_id.and_then(|cob_id| cob_id.can_id().as_standard());
        self.received.set_sync(id);
        let period_us = cob_id.filter(|cob_id| cob_id.generates()).and(self.object(COMMUNICATION_CYCLE_PERIOD));
        let overflow = self.object(SYNCHRONOUS_COUNTER_OVERFLOW_VALUE).unwrap_or(0) as u8;
        self.sync.id = id.map_or(connection_set::SYNC, CanId::standard);
        self.sync.producer = Producer::new(period_us.unwrap_or(0), overflow);
        self.pending.remove(Source::Sync);
        if self.state.allows_sdo() {
            self.sync.producer.start(self.now);
        }
    }

    /// 1007h or a TPDO has changed, or communication begins.
    pub(super) fn configure_window(&mut self) {
        self.sync.window_ns = u64::from(self.object(SYNCHRONOUS_WINDOW_LENGTH).unwrap_or(0)) * NANOS_PER_MICRO;
        if self.sync.window_ns == 0 {
            self.sync.close_window();
        }
        let waits = self.pdos.tpdos.as_ref().iter().any(Tpdo::has_start_value);
        self.sync.has_more = waits || self.sync.window_ns != 0;
    }

    /// What a client may write to 1005h: the identifier stays while SYNC is generated, and only a node with 1006h generates it
    /// (CiA 301, 7.5.2.5).
    pub(super) fn check_sync_cob_id(&self, new: CobId) -> Result<(), AbortCode> {
        CobId(new.0 & !CobId::INVALID).check_identifier()?;
        let present = CobId(self.object(COB_ID_SYNC_MESSAGE).unwrap_or(0));
        let moves = present.generates() && present.can_id() != new.can_id();
        let cannot = new.generates() && self.object(COMMUNICATION_CYCLE_PERIOD).is_none();
        if moves || cannot { Err(AbortCode::INVALID_VALUE) } else { Ok(()) }
    }

    /// A new NMT state was entered: SYNC is sent in pre-operational and operational, and no window outlasts operational.
    pub(super) fn follow_nmt_with_sync(&mut self) {
        if !self.state.allows_sdo() {
            self.sync.producer.stop();
            self.pending.remove(Source::Sync);
        } else if self.sync.producer.deadline() == Instant::FAR_FUTURE {
            self.sync.producer.start(self.now);
            self.deadline = self.deadline.min(self.sync.deadline());
        }
        if !self.state.allows_pdo() {
            self.sync.close_window();
        }
    }

    /// TPDOs first: their data is of the moment of SYNC, before what it lets take effect.
    #[inline(never)]
    pub(super) fn receive_sync(&mut self, frame: &Frame) {
        if self.state.allows_sdo() {
            self.push(NodeEvent::Sync);
        }
        if !self.state.allows_pdo() {
            return;
        }
        if self.sync.has_more {
            self.prepare_cycle(Sync::parse(frame));
        }
        let mut from = 0;
        while let Some(position) = self.pdos.synchronous.next(from) {
            if self.pdos.tpdos.as_mut()[position].handle_sync(&self.dictionary) {
                self.offer_tpdo(position);
            }
            from = position + 1;
        }
        while let Some(position) = self.pdos.latched.next(0) {
            self.pdos.latched.set(position, false);
            if let Some(data) = self.pdos.rpdos.as_mut()[position].take_latched() {
                self.apply_rpdo(position, data);
            }
        }
    }

    /// The window opens, and TPDOs that wait for a counter hear it.
    #[cold]
    fn prepare_cycle(&mut self, sync: Sync) {
        if self.sync.window_ns != 0 {
            self.sync.window_end = self.now.plus_nanos(self.sync.window_ns);
            self.sync.late = false;
            self.deadline = self.deadline.min(self.sync.window_end);
        }
        for tpdo in self.pdos.tpdos.as_mut().iter_mut().filter(|tpdo| tpdo.has_start_value()) {
            tpdo.hear_counter(sync.counter);
        }
    }

    /// Time has reached `now`.
    pub(super) fn serve_sync(&mut self) {
        if self.sync.producer.handle_timeout(self.now) {
            // This node's own cycle begins with it, as that of every other does.
            let frame = self.sync.producer.take().emit(self.sync.id);
            self.sync.frame = Some(frame);
            self.pending.insert(Source::Sync);
            self.receive_sync(&frame);
        }
        if self.now < self.sync.window_end {
            return;
        }
        // What a SYNC has sampled and the wire has not taken in time is discarded (CiA 301, 7.5.2.7).
        self.sync.window_end = Instant::FAR_FUTURE;
        self.sync.late = true;
        let mut from = 0;
        while let Some(position) = self.pdos.synchronous.next(from) {
            self.pdos.tpdos.as_mut()[position].discard_late();
            self.offer_tpdo(position);
            from = position + 1;
        }
    }

    /// The data of a synchronous RPDO waits for SYNC. Once the window is over it is discarded until the next SYNC
    /// (CiA 301, 7.5.2.7).
    pub(super) fn latch_rpdo(&mut self, position: usize, data: u64) {
        if !self.sync.late {
            self.pdos.rpdos.as_mut()[position].latch(data);
            self.pdos.latched.set(position, true);
        }
    }
}
