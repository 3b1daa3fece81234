use canopen::pdo::PdoNumber;

use super::faults::error_register::{COMMUNICATION, GENERIC};

/// Errors of communication that have not ended: they stand in the error register (CiA 301, 7.5.2.2) beside the drive's
/// faults. A bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CommunicationErrors(u8);

impl CommunicationErrors {
    /// No error.
    pub(super) const NONE: Self = Self(0);
    /// Events of the node were lost.
    pub(super) const EVENTS_LOST: Self = Self(1 << PdoNumber::PREDEFINED);
    /// A heartbeat that is watched has stayed away.
    pub(super) const HEARTBEAT: Self = Self(Self::EVENTS_LOST.0 << 1);

    /// The last frame of an RPDO was shorter than its mapping.
    pub(super) const fn short_rpdo(number: PdoNumber) -> Self {
        Self(1 << number.position())
    }

    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    pub(super) const fn contains(self, errors: Self) -> bool {
        self.0 & errors.0 == errors.0
    }

    pub(super) const fn insert(&mut self, errors: Self) {
        self.0 |= errors.0;
    }

    pub(super) const fn remove(&mut self, errors: Self) {
        self.0 &= !errors.0;
    }

    /// What they set in the error register.
    pub(super) const fn register_bits(self) -> u8 {
        if self.is_empty() { 0 } else { COMMUNICATION | GENERIC }
    }
}
