use crate::NmtState;
use crate::od::{Slot, Storage, Table};
use crate::pdo::{Direction, MAX_OBJECTS, PdoId, PdoNumber};

/// What a node reports to its owner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeEvent {
    /// A peer wrote an entry; the value is in the dictionary. `raw` is what this write stored, should a later one
    /// have replaced it meanwhile.
    Written {
        /// The entry.
        slot: Slot,
        /// Its cell after this write; of a value longer than a cell how many bytes it has.
        raw: u32,
        /// The way it came.
        via: Via,
    },
    /// A peer wants to write an entry with [`Condition::Ask`](crate::od::Condition::Ask), and its SDO waits for
    /// [`Node::answer`](super::Node::answer). The dictionary has the old value; access, length and limits are in order.
    Asked {
        /// The entry.
        slot: Slot,
        /// What would be stored, in as many low bytes as the entry has; of a value longer than a cell how many bytes wait:
        /// [`Node::asked_bytes`](super::Node::asked_bytes).
        raw: u32,
        /// Which question this is.
        ticket: Ticket,
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
    /// An RPDO was shorter than its mapping and discarded. Reported once, until [`RpdoFits`](Self::RpdoFits).
    RpdoTooShort(PdoNumber),
    /// An RPDO has the length of its mapping again.
    RpdoFits(PdoNumber),
    /// A multiplexed RPDO in destination address mode named an object that is not there, or cannot be mapped or written. Its value is
    /// not used.
    DestinationMissing(PdoNumber),
    /// An RPDO has stayed away for the time of its event timer (CiA 301, 7.5.2.35). Reported once, until
    /// [`RpdoInTime`](Self::RpdoInTime).
    RpdoTimedOut(PdoNumber),
    /// It has come again, or is not awaited any more.
    RpdoInTime(PdoNumber),
    /// The owner did not poll in time: older events than the following ones are lost. The dictionary has the values.
    EventsLost,
}

/// Which question to the owner: an answer to an older one is not taken for this one's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticket(pub(super) u16);

/// How many events one frame can make: an owner that polls after every `handle_*` and has room for them never loses one;
/// another is reported as [`NodeEvent::EventsLost`].
pub(super) fn most_of_a_frame(table: &Table) -> usize {
    // SYNC and the objects of every RPDO that waited for it; or a frame that all RPDOs listen to, each of which was too short
    // before: `RpdoFits` and its objects. The entries of a mapping record are as many as its rows, without sub-index 00h.
    let rpdos = table.rows().iter().filter_map(|row| match PdoId::of_object(row.index) {
        Some((PdoId { direction: Direction::Rpdo, .. }, true)) => Some(usize::from(row.sub_index) <= MAX_OBJECTS),
        _ => None,
    });
    // And the state that a boot entered, if the owner has not polled since.
    2 + rpdos.filter(|counts| *counts).count()
}

/// What waits for the owner, in the order of arrival. When full, the oldest are lost, and that is reported in their place.
#[derive(Clone)]
pub(super) struct EventQueue<S: Storage> {
    events: S::Events<NodeEvent>,
    /// How many were ever taken and put, modulo 2^32: two counters, so that neither waits for the other.
    taken: u32,
    put: u32,
}

impl<S: Storage> EventQueue<S> {
    /// Room for at least `count`.
    pub(super) fn empty(count: usize) -> Self {
        Self { events: S::events(count.next_power_of_two(), NodeEvent::Sync), taken: 0, put: 0 }
    }

    pub(super) const fn clear(&mut self) {
        self.taken = self.put;
    }

    pub(super) const fn is_empty(&self) -> bool {
        self.taken == self.put
    }

    pub(super) fn capacity(&self) -> usize {
        self.events.as_ref().len()
    }

    #[inline]
    fn place(&self, number: u32) -> usize {
        number as usize & (self.events.as_ref().len() - 1)
    }

    #[inline]
    pub(super) fn push(&mut self, event: NodeEvent) {
        let place = self.place(self.put);
        self.events.as_mut()[place] = event;
        self.put = self.put.wrapping_add(1);
        if self.put.wrapping_sub(self.taken) as usize > self.capacity() {
            self.lose_oldest();
        }
    }

    #[cold]
    fn lose_oldest(&mut self) {
        self.taken = self.taken.wrapping_add(1);
        let place = self.place(self.taken);
        self.events.as_mut()[place] = NodeEvent::EventsLost;
    }

    #[inline]
    pub(super) fn pop(&mut self) -> Option<NodeEvent> {
        if self.taken == self.put {
            return None;
        }
        let event = self.events.as_ref()[self.place(self.taken)];
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
