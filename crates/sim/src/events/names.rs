//! The kinds of events by name: what programs and people filter by.

use super::EventKind;

/// Each kind's name and what it means, as [`EventKind::name`] has them.
pub const KINDS: [(&str, &str); 20] = [
    ("power", "a drive's supply has come, or its bus has drained"),
    ("boot", "a boot-up message"),
    ("nmt", "the NMT state has changed"),
    ("state", "the CiA 402 state has changed"),
    ("mode", "the mode of operation has changed"),
    ("fault", "a fault, with cause and remedy"),
    ("fault_reset", "a fault is gone"),
    ("emcy", "an EMCY message"),
    ("target_reached", "statusword bit 10 has come"),
    ("internal_limit", "statusword bit 11 has come or gone"),
    ("store_begun", "a store into the non-volatile memory begins"),
    ("store_done", "the non-volatile memory has new contents"),
    ("damage", "something is destroyed"),
    ("bus_error", "an attempt to send failed"),
    ("bus_state", "error-active, error-passive, bus-off"),
    ("cable", "a bus cable was cut or joined"),
    ("stimulus", "a world command was done"),
    ("behind", "the bus has fallen behind the clock"),
    ("caught_up", "the bus has caught up with the clock"),
    ("missed", "events are lost, as they were not read in time"),
];

impl EventKind {
    /// Its name, one of [`KINDS`].
    pub const fn name(&self) -> &'static str {
        KINDS[self.number()].0
    }

    /// Its place in [`KINDS`].
    const fn number(&self) -> usize {
        match self {
            Self::Power(_) => 0,
            Self::Boot => 1,
            Self::Nmt { .. } => 2,
            Self::State { .. } => 3,
            Self::Mode(_) => 4,
            Self::Fault { .. } => 5,
            Self::FaultReset { .. } => 6,
            Self::Emcy { .. } => 7,
            Self::TargetReached => 8,
            Self::InternalLimit(_) => 9,
            Self::StoreBegun => 10,
            Self::StoreDone { .. } => 11,
            Self::Damage(_) => 12,
            Self::BusError { .. } => 13,
            Self::BusState { .. } => 14,
            Self::Cable(_) => 15,
            Self::Stimulus { .. } => 16,
            Self::Behind(_) => 17,
            Self::CaughtUp { .. } => 18,
            Self::Missed(_) => 19,
        }
    }
}
