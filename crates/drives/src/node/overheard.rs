//! What a described device hears that is not for it alone: the time of day (TIME, 1012h bit 31) and the errors of others (EMCY, 1028h).

use core::time::Duration;

use can::{Frame, Instant};
use canopen::emcy::Emcy;
use canopen::object::{COB_ID_TIME_STAMP_OBJECT, EMERGENCY_CONSUMER_OBJECT};
use canopen::od::{Dictionary, Storage};
use canopen::time_stamp::TimeOfDay;
use canopen::{CobId, Mux, NodeId};

/// The standard identifiers, a bit each.
const WORDS: usize = 2048 / 32;

/// The time of day and the last error message of another device.
#[derive(Clone, Debug)]
pub struct Overheard {
    heard: [u32; WORDS],
    time_id: Option<u16>,
    /// The last TIME, and when it came.
    time: Option<(TimeOfDay, Instant)>,
    /// The last EMCY message, and whose it is.
    emcy: Option<(NodeId, Emcy)>,
}

impl Overheard {
    pub(super) const NOTHING: Self = Self { heard: [0; WORDS], time_id: None, time: None, emcy: None };

    /// 1012h or 1028h has changed, or communication begins. A clock that was set goes on.
    pub(super) fn configure(&mut self, values: &Dictionary<impl Storage>) {
        self.heard = [0; WORDS];
        let cob_id = |object| values.table().find(object).ok().map(|slot| CobId(values.raw(slot)));
        let time = cob_id(COB_ID_TIME_STAMP_OBJECT).filter(|cob_id| cob_id.consumes());
        self.time_id = time.and_then(|cob_id| cob_id.can_id().as_standard());
        let emcys = entries().filter_map(|(_, entry)| cob_id(entry).filter(|cob_id| cob_id.is_valid()));
        let emcys = emcys.filter_map(|cob_id| cob_id.can_id().as_standard()).filter(|id| *id != 0);
        for id in emcys.chain(self.time_id) {
            self.heard[usize::from(id) / 32] |= 1 << (id % 32);
        }
    }

    #[inline]
    pub(super) fn wants(&self, frame: &Frame) -> bool {
        frame.standard_data_id().is_some_and(|id| self.heard[usize::from(id) / 32] >> (id % 32) & 1 == 1)
    }

    /// A wanted frame arrived.
    pub(super) fn handle_frame(&mut self, frame: &Frame, values: &Dictionary<impl Storage>, now: Instant) {
        if frame.standard_data_id() == self.time_id
            && let Some(time) = TimeOfDay::parse(frame)
        {
            self.time = Some((time, now));
        }
        let Some(emcy) = Emcy::parse(frame) else { return };
        let is_its = |entry| {
            let cob_id = values.table().find(entry).ok().map(|slot| CobId(values.raw(slot)));
            cob_id.is_some_and(|cob_id| cob_id.is_valid() && cob_id.can_id() == frame.id())
        };
        if let Some((node, _)) = entries().find(|(_, entry)| is_its(*entry)) {
            self.emcy = Some((node, emcy));
        }
    }

    /// The time of day; `None` before the first TIME since power-on.
    pub fn time_of_day(&self, now: Instant) -> Option<TimeOfDay> {
        let (time, at) = self.time?;
        Some(time.after(Duration::from_nanos(now.nanos_since(at))))
    }

    /// The last EMCY message of another device that it listens to, and whose it is by its place in 1028h.
    pub const fn last_emcy(&self) -> Option<(NodeId, Emcy)> {
        self.emcy
    }
}

/// The entries of 1028h: one for each node, at its node-ID (CiA 301, 7.5.2.31).
fn entries() -> impl Iterator<Item = (NodeId, Mux)> {
    NodeId::all().map(|node| (node, Mux::new(EMERGENCY_CONSUMER_OBJECT.index, node.raw())))
}
