//! What happens in a world, as values: drives that boot, change state, fault, arrive; the bus that errs; hands from outside.
//!
//! A world that is [watched](crate::World::watch) notes an [`Event`] when it happens. Of what the wire carries that is its
//! own instant; what a firmware does by itself is seen when its communication task has run, at most 1 ms later, which is
//! when it could first report it on the bus. Watching changes nothing: the run has the same digest.
//!
//! Events are pulled with [`World::poll_event`](crate::World::poll_event), oldest first. At most [`MAX_WAITING`] wait; when
//! are not pulled, the oldest go, and [`EventKind::Missed`] says how many.

mod names;
mod words;

use core::time::Duration;
use std::sync::Arc;

use can::{Frame, Instant};
use canopen::NmtState;
use canopen::emcy::Emcy;
use cia402::{ModeOfOperation, PowerState};
use devices::faults::FaultRow;

pub use names::KINDS;

pub use crate::drive::PowerPhase;
use crate::stimulus::Place;
use crate::wire::{ErrorCause, ErrorState};

/// Events that wait to be pulled; further ones displace the oldest.
pub const MAX_WAITING: usize = 4096;

/// One thing that happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The time of the bus.
    pub at: Instant,
    /// At which drive, by the number under which it was added, and at which of its axes; of other stations on the bus the
    /// node-ID that their frame names. `None` for what is of no node.
    pub place: Option<Place>,
    /// What happened.
    pub kind: EventKind,
}

/// What happened in the world, or to one of its drives.
#[derive(Clone, Debug, PartialEq)]
pub enum EventKind {
    /// The drive's supply, and what its firmware makes of it, has changed.
    Power(PowerPhase),
    /// The boot-up message is on the bus (CiA 301, 7.2.8.3.3).
    Boot,
    /// The NMT state has changed; `from` is `None` when the firmware has just started.
    Nmt {
        /// The state before.
        from: Option<NmtState>,
        /// The state from here on.
        to: NmtState,
    },
    /// The state of the power drive system has changed (CiA 402-2, 8.2), or what comes closest to it in a drive without that
    /// machine.
    State {
        /// The state before.
        from: Option<PowerState>,
        /// The state from here on.
        to: PowerState,
    },
    /// The mode in effect has changed.
    Mode(ModeOfOperation),
    /// A fault.
    Fault {
        /// Its code in the drive's own numbering; of a drive that shows several faults as bits, the one bit.
        code: u32,
        /// What the drive's manual says of it.
        row: Option<&'static FaultRow>,
    },
    /// A fault is gone: reset, or over by itself.
    FaultReset {
        /// Its code.
        code: u32,
        /// What the drive's manual says of it.
        row: Option<&'static FaultRow>,
    },
    /// An EMCY message is on the bus (CiA 301, 7.2.7).
    Emcy {
        /// Its content.
        emcy: Emcy,
        /// The fault of that drive that it reports.
        row: Option<&'static FaultRow>,
    },
    /// Statusword bit 10, target reached, has come while the operation is enabled.
    TargetReached,
    /// Statusword bit 11, internal limit active, has come (true) or gone.
    InternalLimit(bool),
    /// A store into the non-volatile memory has begun.
    StoreBegun,
    /// The non-volatile memory has new contents.
    StoreDone {
        /// Which store of this drive it is.
        generation: u64,
    },
    /// Something at the machine is destroyed.
    Damage(&'static str),
    /// An attempt to send failed: an error frame. Of attempts in a row at one frame the first, second, fourth, eighth and so
    /// on are reported.
    BusError {
        /// What the controllers took for an error.
        cause: ErrorCause,
        /// What was to be sent.
        frame: Frame,
        /// Which attempt in a row it is, from 1.
        attempt: u64,
    },
    /// A controller's error state has changed (ISO 11898-1, fault confinement).
    BusState {
        /// The state before.
        from: ErrorState,
        /// The state from here on.
        to: ErrorState,
    },
    /// The node's bus cable was cut (true), or joined.
    Cable(bool),
    /// A stimulus from outside, in the words of a world command.
    Stimulus {
        /// The command, without the node.
        words: Arc<str>,
        /// Who; see [`World::act_as`](crate::World::act_as).
        by: Option<Arc<str>>,
    },
    /// The bus has fallen behind the clock that drives it.
    Behind(Duration),
    /// The bus has caught up with the clock.
    CaughtUp {
        /// The most that it was behind.
        worst: Duration,
    },
    /// So many older events were not pulled in time, and are lost.
    Missed(u64),
}
