//! What is present of the table of faults, for the drive and for each of its axes.

use canopen::EmcyErrorCode;
use devices::servo::faults::{FAULT_COUNT, FAULTS};

use super::hardware::MAX_AXES;
use crate::engine::faults::{FaultMonitor, FaultSet};

/// The faults of the drive, or of one of its axes: the same table for all of them.
pub(super) type Faults = FaultMonitor<FAULT_COUNT>;

/// How many supervision periods a cause lasts before it counts: disturbances are shorter.
static DEBOUNCE: [u16; FAULT_COUNT] = [3; FAULT_COUNT];

/// None present.
pub(super) const fn no_faults() -> Faults {
    FaultMonitor::new(&FAULTS, &DEBOUNCE)
}

/// What has just become a fault.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NewFaults {
    /// Of what all axes share: it stops all of them.
    pub(super) shared: FaultSet,
    /// Of each axis.
    pub(super) own: [FaultSet; MAX_AXES],
}

impl NewFaults {
    /// The codes of their EMCY messages.
    pub(super) fn codes(self) -> impl Iterator<Item = EmcyErrorCode> {
        core::iter::once(self.shared).chain(self.own).flat_map(FaultSet::rows).map(|row| FAULTS[row].emcy)
    }
}
