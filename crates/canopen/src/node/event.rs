use crate::NmtState;
use crate::od::Slot;
use crate::pdo::MAX_OBJECTS;
use crate::pdo::PdoNumber;

/// SYNC, and the objects of every RPDO that waited for it.
const MOST_OF_SYNC: usize = 1 + PdoNumber::PREDEFINED * MAX_OBJECTS;
/// A frame that all RPDOs listen to, each of which was too short before: [`NodeEvent::RpdoFits`] and its objects.
const MOST_OF_AN_RPDO: usize = PdoNumber::PREDEFINED * (1 + MAX_OBJECTS);

/// How many events may wait for the owner: at least what one frame makes. An owner that polls after every `handle_*`
/// never loses one; another is told [`NodeEvent::EventsLost`].
pub const EVENT_QUEUE_LENGTH: usize =
    if MOST_OF_SYNC > MOST_OF_AN_RPDO { MOST_OF_SYNC } else { MOST_OF_AN_RPDO }.next_power_of_two();

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
    /// An RPDO was shorter than its mapping and discarded. Told once, until [`RpdoFits`](Self::RpdoFits).
    RpdoTooShort(PdoNumber),
    /// An RPDO has the length of its mapping again.
    RpdoFits(PdoNumber),
    /// The owner did not poll in time: older events than the following ones are lost. The dictionary has the values.
    EventsLost,
}

/// What waits for the owner, in the order of arrival. When full, the oldest are lost, and that is told in their place.
#[derive(Clone, Debug)]
pub(super) struct EventQueue {
    events: [NodeEvent; EVENT_QUEUE_LENGTH],
    /// How many were ever taken and put, modulo 256: two counters, so that neither waits for the other.
    taken: u8,
    put: u8,
}

const _: () = assert!(EVENT_QUEUE_LENGTH < 256, "the counters are told apart by their difference");

impl EventQueue {
    pub(super) const EMPTY: Self = Self { events: [NodeEvent::Sync; EVENT_QUEUE_LENGTH], taken: 0, put: 0 };

    #[inline]
    pub(super) fn push(&mut self, event: NodeEvent) {
        self.events[usize::from(self.put) % EVENT_QUEUE_LENGTH] = event;
        self.put = self.put.wrapping_add(1);
        if usize::from(self.put.wrapping_sub(self.taken)) > EVENT_QUEUE_LENGTH {
            self.lose_oldest();
        }
    }

    #[cold]
    fn lose_oldest(&mut self) {
        self.taken = self.taken.wrapping_add(1);
        self.events[usize::from(self.taken) % EVENT_QUEUE_LENGTH] = NodeEvent::EventsLost;
    }

    #[inline]
    pub(super) fn pop(&mut self) -> Option<NodeEvent> {
        if self.taken == self.put {
            return None;
        }
        let event = self.events[usize::from(self.taken) % EVENT_QUEUE_LENGTH];
        self.taken = self.taken.wrapping_add(1);
        Some(event)
    }
}

/// How a value came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Via {
    /// SDO download.
    Sdo,
    /// RPDO of this number.
    Rpdo(PdoNumber),
}
