use super::faults::error_register::{COMMUNICATION, GENERIC};

/// Errors of communication that have not ended: they stand in the error register (CiA 301, 7.5.2.2) beside the drive's
/// faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CommunicationErrors {
    /// Events of the node were lost.
    pub(super) events_lost: bool,
    /// A heartbeat that is watched, or the guarding of this device, has stayed away.
    pub(super) heartbeat_lost: bool,
    /// How many RPDOs have missed their deadline.
    late_rpdos: u16,
    /// How many RPDOs had a last frame that was shorter than their mapping.
    short_rpdos: u16,
}

impl CommunicationErrors {
    /// No error.
    pub(super) const NONE: Self = Self { events_lost: false, heartbeat_lost: false, late_rpdos: 0, short_rpdos: 0 };

    /// The frames of an RPDO have become too short. Reported once, as is its end.
    pub(super) const fn begin_short_rpdo(&mut self) {
        self.short_rpdos = self.short_rpdos.saturating_add(1);
    }

    /// They fit again.
    pub(super) const fn end_short_rpdo(&mut self) {
        self.short_rpdos = self.short_rpdos.saturating_sub(1);
    }

    /// An RPDO has missed its deadline. Reported once, as is its end.
    pub(super) const fn begin_late_rpdo(&mut self) {
        self.late_rpdos = self.late_rpdos.saturating_add(1);
    }

    /// It has come again.
    pub(super) const fn end_late_rpdo(&mut self) {
        self.late_rpdos = self.late_rpdos.saturating_sub(1);
    }

    pub(super) const fn is_empty(self) -> bool {
        !self.events_lost && !self.heartbeat_lost && self.late_rpdos == 0 && self.short_rpdos == 0
    }

    /// What they set in the error register.
    pub(super) const fn register_bits(self) -> u8 {
        if self.is_empty() { 0 } else { COMMUNICATION | GENERIC }
    }
}
