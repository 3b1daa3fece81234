use can::{CanId, Frame, Instant};

use crate::connection_set;
use crate::sync::Producer;

/// What a node knows of SYNC beside its identifier.
#[derive(Clone, Debug)]
pub(super) struct NodeSync {
    pub(super) id: CanId,
    pub(super) producer: Producer,
    /// The SYNC that is to be sent.
    pub(super) frame: Option<Frame>,
    /// 0: there is no window.
    pub(super) window_ns: u64,
    /// When the window that a SYNC has opened ends; [`Instant::FAR_FUTURE`] while none is open.
    pub(super) window_end: Instant,
    /// The window is over, and no SYNC has come since.
    pub(super) late: bool,
    /// More is to be done at a SYNC than to count it: there is a window, or a TPDO with a start value.
    pub(super) has_more: bool,
}

impl NodeSync {
    pub(super) const NONE: Self = Self {
        id: connection_set::SYNC,
        producer: Producer::OFF,
        frame: None,
        window_ns: 0,
        window_end: Instant::FAR_FUTURE,
        late: false,
        has_more: false,
    };

    /// When it next needs attention.
    pub(super) fn deadline(&self) -> Instant {
        self.producer.deadline().min(self.window_end)
    }

    pub(super) fn close_window(&mut self) {
        self.window_end = Instant::FAR_FUTURE;
        self.late = false;
    }
}
