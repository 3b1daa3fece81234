use crate::NmtState;
use crate::cob::PdoNumber;
use crate::od::Slot;

/// How many events may wait for the owner. When full, the oldest is lost. One RPDO makes at most eight, and an owner
/// polls after every frame.
pub const EVENT_QUEUE_LENGTH: usize = 32;

/// What a node tells its owner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeEvent {
    /// A peer wrote an entry; the value is in the dictionary. `raw` is what this write stored, should a later one
    /// have replaced it meanwhile.
    Written {
        /// The entry.
        slot: Slot,
        /// Its cell after this write.
        raw: u32,
        /// The way it came.
        via: Via,
    },
    /// A new NMT state was entered.
    Nmt(NmtState),
    /// SYNC; synchronous RPDOs that waited for it follow as `Written`.
    Sync,
    /// NMT reset node: the node is down. Restart the application, put the dictionary to power-on values and call
    /// [`Node::boot`](super::Node::boot).
    ResetNode,
    /// NMT reset communication: the node is down. Put 1000h to 1FFFh to power-on values and call
    /// [`Node::boot`](super::Node::boot).
    ResetCommunication,
    /// An RPDO was shorter than its mapping and discarded.
    RpdoTooShort(PdoNumber),
}

/// How a value came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Via {
    /// SDO download.
    Sdo,
    /// RPDO of this number.
    Rpdo(PdoNumber),
}
