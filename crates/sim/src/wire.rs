//! The CAN bus as physics, at the grain of a frame (ISO 11898-1; Bosch CAN Specification 2.0, part A).
//!
//! [`Bus`] holds one controller for each station and the wire between them. Frames go in with
//! [`Bus::offer`]; time comes in with [`Bus::arbitrate`] and [`Bus::advance`]; frames that passed,
//! errors and changes of error state come out. The lowest arbitration key wins an idle wire and holds
//! it for the exact bits of the frame; a frame that is not acknowledged, or that was disturbed, costs
//! an error frame and counts in the error counters of every node that saw it.
//!
//! Deliberately absent: overload frames, propagation delay, clock tolerance, and the superposition of
//! error flags bit by bit; each is far below what a drive or a master can notice.

mod alone;
mod bus;
mod collision;
mod confinement;
mod controller;
mod delivery;

pub use bus::{Bus, Delivered, Role};
pub use confinement::{ErrorCounters, ErrorState};
pub use controller::ControllerOptions;

use can::{Frame, Instant};

/// Recessive bits in a row that show a controller that the wire is idle.
pub(crate) const IDLE_BITS: u64 = 11;

/// Sequences of eleven recessive bits that a bus-off controller waits for (fault confinement, rule 12).
pub const BUS_OFF_SEQUENCES: u32 = 128;

/// Bits an error-passive transmitter waits after the intermission (suspend transmission).
pub const SUSPEND_BITS: u64 = 8;

/// Why a frame did not get through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorCause {
    /// Disturbed on the wire ([`Corruption`](crate::fault::Corruption)).
    Disturbed,
    /// No other node at this bit rate acknowledged.
    NotAcknowledged,
    /// Another node sent the same identifier with other contents.
    Collision,
    /// A node at another bit rate got in between.
    BitRate,
    /// Its sender lost power or its cable in the middle of the frame.
    Abandoned,
}

/// Something that happened on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WireEvent {
    /// A frame got through and is with all receivers.
    Frame {
        /// Start of frame.
        start: Instant,
        /// Last bit of end of frame: when receivers have it.
        end: Instant,
        /// Number of the sender's controller.
        source: usize,
        /// The frame.
        frame: Frame,
    },
    /// An attempt failed; the sender will try again.
    Error {
        /// When the error showed; the error frame follows.
        at: Instant,
        /// Number of the sender's controller.
        source: usize,
        /// What was to be sent.
        frame: Frame,
        /// Why it failed.
        cause: ErrorCause,
    },
    /// A controller changed its error state.
    State {
        /// The time of the bus.
        at: Instant,
        /// Number of the controller.
        controller: usize,
        /// The state from here on.
        state: ErrorState,
    },
}

impl WireEvent {
    /// When it happened; for a frame its end.
    pub fn at(&self) -> Instant {
        match *self {
            Self::Frame { end, .. } => end,
            Self::Error { at, .. } | Self::State { at, .. } => at,
        }
    }
}

/// Counts since the world began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// When these counts were taken.
    pub at: Instant,
    /// Frames that got through.
    pub frames: u64,
    /// Attempts that failed.
    pub errors: u64,
    /// Time for which the wire was taken, interframe space included.
    pub busy_ns: u64,
}

impl Statistics {
    /// Bus load between `earlier` and this, 0 to 1. A frame counts when it is complete, so that over
    /// a short span the figure may stand out by one frame.
    pub fn load_since(&self, earlier: &Self) -> f64 {
        let span = self.at.nanos_since(earlier.at);
        if span == 0 { 0.0 } else { (self.busy_ns - earlier.busy_ns) as f64 / span as f64 }
    }
}

/// State of the wire itself.
#[derive(Clone, Debug, Default)]
pub(crate) struct Segment {
    /// The frame on it.
    pub(crate) transmission: Option<Transmission>,
    /// The intermission is over: a new frame may start.
    pub(crate) free_at: Instant,
    /// Since when all bits were recessive, if no frame is on it.
    pub(crate) recessive_since: Instant,
}

/// A frame on its way, with what will become of it.
#[derive(Clone, Debug)]
pub(crate) struct Transmission {
    pub(crate) frame: Frame,
    pub(crate) source: usize,
    pub(crate) start: Instant,
    /// Last bit if it passes; the bit that shows the error if it fails.
    pub(crate) end: Instant,
    /// Duration of a bit of the slowest node that has a part in this.
    pub(crate) bit_ns: u64,
    pub(crate) failure: Option<ErrorCause>,
}
